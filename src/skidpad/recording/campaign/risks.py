"""What `skidpad risk` leaves in its folder: what was asked, every run, and what came of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec import Struct

from skidpad.core.maths.space import Space
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.traffic.disturbance import actor_of_draw
from skidpad.recording.campaign.searches import read_lines, read_stored

RISK, RISK_RUNS, RISK_FOUND = "risk.json", "runs.jsonl", "probability.json"
SPLITTING = "splitting.jsonl"
SCALES = (0.5, 0.9, 1.1, 2.0)  # of the values of an input, to see what hangs on it


class Rate(Struct, frozen=True, forbid_unknown_fields=True):
    """How often the encounter happens. source: where it was read; "" for an assumption."""

    value: float
    source: str = ""


class Risk(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What is asked; `risk.json` in the folder.

    Attributes:
        run: the template, as config.yaml holds runs.
        space: the exposure: what varies in an encounter, and how.
        per_hour, per_100km: how often the encounter happens; None: not given.
        repetitions, per_level: of subset simulation.
        samples: of importance sampling.
        seed: of all draws.
    """

    run: dict[str, Any]
    space: Space
    per_hour: Rate | None
    per_100km: Rate | None
    repetitions: int
    per_level: int
    samples: int
    seed: int

    @property
    def template(self) -> RunSpec:
        """Returns the run whose values vary."""
        return run_from_plain(self.run, RISK)

    @property
    def disturbed_actors(self) -> tuple[str, ...]:
        """Returns the names of the vehicles whose acceleration is disturbed."""
        actors = (actor_of_draw(v.name) for v in self.space.variables)
        return tuple(dict.fromkeys(actor for actor in actors if actor))

    @property
    def assumptions(self) -> list[str]:
        """Returns the names of the inputs for which no source is given."""
        unread = [v.name for v in self.space.variables if not v.source]
        names = list(dict.fromkeys(name_input(name) for name in unread))
        rates = {"encounters per hour": self.per_hour, "encounters per 100 km": self.per_100km}
        return names + [
            name for name, rate in rates.items() if rate is not None and not rate.source
        ]


def name_input(variable: str) -> str:
    """Returns what pages call an input: all draws of a disturbance are one."""
    actor = actor_of_draw(variable)
    return f"disturbance of {actor}" if actor else variable


class Probability(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A probability by one method, with its 95 % interval; null where there is no upper end."""

    method: str
    p: float
    low: float
    high: float | None
    runs: int
    simulated_s: float


class Influence(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What other values of one input do to the probability.

    factors: times the probability as asked, with all values times SCALES; None where the runs cannot
        tell.
    why_not: the last reason for a None.
    """

    name: str
    factors: tuple[float | None, ...]
    why_not: str = ""


class Repetition(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One repetition of splitting; a line of `splitting.jsonl`.

    Attributes:
        number: from 0.
        p: its estimate of the probability.
        levels: margins under which its rounds went on.
        ancestors: different first drives from which its failures stem.
        failing: drives of its end that fail.
        runs: drives in all.
        simulated_s: driven for them, ways back to where they branch included.
        kinds: failing drives by kind of failure.
        apart: by second since a branch: branches that were still driven then, and the mean distance in m
            of the disturbed vehicles from where they were in the drive that was left.
        faults: drives in which the stack failed.
    """

    number: int
    p: float
    levels: tuple[float, ...]
    ancestors: int
    failing: int
    runs: int
    simulated_s: float
    kinds: dict[str, int]
    apart: tuple[tuple[int, float], ...]
    faults: int = 0


class RiskFound(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What came of it: `probability.json`.

    Attributes:
        probabilities: by method.
        p, low, high: the answer, with the interval that holds those of both methods.
        why_not: why nothing is determined; "" where it is.
        levels: of the first repetition, margins that bound its events.
        ancestors: different first samples from which each repetition's failures stem.
        effective: failures of equal weight that tell as much as those of importance sampling.
        kinds: share of the probability by kind of failure.
        influences: of each numeric input.
        faults: runs that could not be driven.
        splitting: its repetitions, where disturbances were asked for.
    """

    probabilities: tuple[Probability, ...]
    p: float
    low: float
    high: float | None
    why_not: str
    levels: tuple[float, ...]
    ancestors: tuple[int, ...]
    effective: float
    kinds: dict[str, float]
    influences: tuple[Influence, ...]
    faults: int
    splitting: tuple[Repetition, ...] = ()


def read_risk(out: Path) -> Risk:
    """Return what was asked in a folder; FileError where it holds no such question."""
    return read_stored(out, RISK, Risk)


def read_repetitions(out: Path) -> list[Repetition]:
    """Returns the repetitions of splitting in a folder; a last line that was cut off is left out."""
    return read_lines(out / SPLITTING, Repetition)


def read_risk_found(out: Path) -> RiskFound:
    """Return what came of it; FileError where it has not come to its end."""
    return read_stored(out, RISK_FOUND, RiskFound)
