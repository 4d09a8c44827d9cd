"""What a search leaves in its folder: what was searched, every trial, and what was found."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from msgspec import Struct

from skidpad.core.errors import FileError
from skidpad.core.files.reading import decode_json, read_bytes
from skidpad.core.maths.space import Space, Value
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.recording.files import read_json

SEARCH, TRIALS = "search.json", "trials.jsonl"
FOUND, FAILURES, CHOICES = "found.json", "failures", "failures.xosc"
HAZARD = "hazard.json"
LARGEST = 1024**3  # bytes of a file
FRONT = "front"  # of the ego


class Search(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is searched, and how; `search.json` in the folder."""

    run: dict[str, Any]  # the template, as config.yaml holds runs
    space: Space  # what varies, and how
    method: str  # how points are chosen
    objective: str  # what is looked for
    budget: int  # number of runs
    seed: int  # of all draws

    @property
    def template(self) -> RunSpec:
        """Returns the run whose values vary."""
        return run_from_plain(self.run, SEARCH)


class Trial(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a point of the space came to.

    Attributes:
        number: in the order of the search, from 0.
        unit: the point in the unit cube.
        values: what it stands for, by name of variable.
        margin: 0 or below for a failure (`search.margin`).
        simulated_s: how long the run was; 0 where it could not be driven.
        min_gap_m, min_ttc_s, max_drac_mps2: over all others; None where they never applied.
        contact_kmh: graded speed of the hardest contact (decision T-4): delta-v, else closing speed.
        contact_s: when it happened.
        other: what was touched.
        side: of the ego, on which it was touched.
        departed_s: when all wheels had left every lane.
        motion: hash of what moved (decision T-3): equal drives are one.
        fault: why it could not be driven, or how the stack failed; "" where neither.
        reference: of a failure, the same values with the reference driver at the wheel.
        bound: of a failure, what avoids it from the state in which it began: "braking", "steering left"
            or "steering right" (`search.bound`); "" where neither does.
    """

    number: int
    unit: tuple[float, ...]
    values: dict[str, Value]
    margin: float
    simulated_s: float = 0.0
    min_gap_m: float | None = None
    min_ttc_s: float | None = None
    max_drac_mps2: float | None = None
    contact_kmh: float | None = None
    contact_s: float | None = None
    other: str = ""
    side: str = ""
    departed_s: float | None = None
    motion: str = ""
    fault: str = ""
    reference: Trial | None = None
    bound: str = ""

    @property
    def is_avoidable(self) -> bool:
        """Returns whether it is a failure that the reference driver, braking or steering in time avoids."""
        return self.is_failure and (self.is_avoided_by_reference or self.bound != "")

    @property
    def is_avoided_by_reference(self) -> bool:
        """Returns whether the reference driver touches nothing and stays on the road with the same values.

        False where it was not driven.
        """
        r = self.reference
        if r is None:
            return False
        return r.contact_kmh is None and r.departed_s is None and not r.fault

    @property
    def is_failure(self) -> bool:
        """Returns whether it is a contact above 5 km/h or a departure."""
        return self.margin <= 0.0 and not self.fault

    @property
    def is_harmless(self) -> bool:
        """Returns whether it was driven and is no failure."""
        return not self.is_failure and not self.fault

    @property
    def kind(self) -> str:
        """Returns what failed in a few words, such as "front into lead"; failures of one kind are a group.

        "no failure" where nothing did.
        """
        if not self.is_failure:
            return "no failure"
        if not self.other:
            return "departure"
        if self.side == FRONT:
            return f"front into {self.other}"
        return f"{self.other} into the {self.side}"


class Change(Struct, frozen=True, forbid_unknown_fields=True):
    """One value that parts a failure from a harmless run."""

    name: str
    harmless: Value
    failing: Value


class Group(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Failures of one kind: the same side of the ego against the same other, or a departure.

    Attributes:
        kind: in words.
        failures: of this kind, the likeliest first.
        changes: the fewest values that part the first of them from a harmless run, each as near as
            bisection brought it; () where no harmless run was found.
        failing, harmless: the two runs on both sides of that border.
    """

    kind: str
    failures: tuple[Trial, ...]
    changes: tuple[Change, ...] = ()
    failing: Trial | None = None
    harmless: Trial | None = None


class Findings(Struct, frozen=True, forbid_unknown_fields=True):
    """The avoidable failures of a search by kind: `found.json` in its folder."""

    groups: tuple[Group, ...]


class Hazard(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The hazard that a search began from: `hazard.json` in its folder.

    Attributes:
        title: its id and type, or the name of its file.
        recorded: the scene as recorded, the ego, too.
        driven: the same with the searched driver in the ego's place.
        changes: what would have made it a crash: the values that part `driven` from `failing`.
        failing: the nearest failure on the way from `driven`; None where none was found.
        likelihood: of its values beside the likeliest ones; None without an exposure.
    """

    title: str
    recorded: Trial
    driven: Trial
    changes: tuple[Change, ...] = ()
    failing: Trial | None = None
    likelihood: float | None = None


def distinct_failures(trials: Iterable[Trial]) -> list[Trial]:
    """Return the failures, each drive once (decision T-3)."""
    found: dict[str, Trial] = {}
    for trial in trials:
        if trial.is_failure:
            found.setdefault(trial.motion, trial)
    return list(found.values())


S = TypeVar("S", bound=Struct)


def read_stored(out: Path, name: str, kind: type[S]) -> S:
    """Return the value of a JSON file in a folder; FileError where it is missing or damaged."""
    found = read_json(out / name, kind, LARGEST)
    if found is None:
        raise FileError(f"{out} has no {name}: it is no such folder, or was not driven to its end")
    return found


def read_search(out: Path) -> Search:
    """Return what was searched in a folder; FileError where it holds no search."""
    return read_stored(out, SEARCH, Search)


def read_lines(path: Path, kind: type[S]) -> list[S]:
    """Returns what the lines of a file hold, each a JSON object; nothing where there is no file.

    A last line that was cut off is left out.
    """
    if not path.is_file():
        return []
    lines = read_bytes(path, path.name, LARGEST).split(b"\n")[:-1]
    return [decode_json(line, f"{path} line {k + 1}", kind) for k, line in enumerate(lines)]


def read_trials(out: Path, name: str = TRIALS) -> list[Trial]:
    """Return the trials of a folder in order; a last line that was cut off is left out."""
    return read_lines(out / name, Trial)


def failure_folder(out: Path, number: int) -> Path:
    """Return the folder of a failure that is kept as a run."""
    return out / FAILURES / f"{number:05d}"


def read_hazard(out: Path) -> Hazard | None:
    """Return the hazard that a search began from; None where it began from a scenario."""
    return read_json(out / HAZARD, Hazard, LARGEST)


def read_findings(out: Path) -> Findings:
    """Return what was found in a folder; FileError where the search has not come to its end."""
    return read_stored(out, FOUND, Findings)
