"""The runs of a folder that `skidpad play` wrote, each with its verdict and its counterparts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import polars as pl
import yaml

from skidpad.core.courses import Scenario
from skidpad.core.errors import FileError
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.run import run_from_plain
from skidpad.evidence.drive.file_criteria import judge_criteria
from skidpad.evidence.drive.prepared import prepare
from skidpad.evidence.expectations import Expectation, parse_expectation, run_values
from skidpad.evidence.pairs import pairs
from skidpad.evidence.play_verdicts import (
    Counterpart,
    PlayJudgement,
    PlayVerdict,
    counterparts,
    judge_run,
)
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.grip import GripEntry, GripKey
from skidpad.recording.campaign.ledger import LEDGER, latest, read_ledger
from skidpad.recording.files import write_csv
from skidpad.recording.run.log import LogHeader, RunLog
from skidpad.recording.run.log_files import TICKS, read_log
from skidpad.recording.run.staging import Judging, Staging, read_judging, read_staging
from skidpad.roads.bundled import KEPT, kept_map
from skidpad.roads.queries import RoadMap

ERROR, CONFIG = "error.txt", "config.yaml"  # of a run's folder
CSV = "results.csv"
COLUMNS = {
    "run": "name of the run",
    "scenario": "name of the scenario",
    "weather": "name of the weather",
    "friction": "original or reduced",
    "seed": "seed of the run",
    "verdict": "passed, failed, void, not judged or error",
    "criterion": "what was judged by",
    "reasons": "why the verdict is what it is",
    "duration_s": "s, simulated time",
    "contacts_with": "what the ego touched first; null: nothing",
    "counterpart": "name of the other actor of this row",
    "staged": "an event of the file moves it",
    "met": "both came near an interaction",
    "min_distance_m": "m, least distance to the ego",
    "crossed_after_s": "s, ego behind (+) or before (-) the other at the same place; null: no such place",
    "min_gap_m": "m, least gap, bumper to bumper",
    "min_ttc_s": "s, least time to collision",
    "min_thw_s": "s, least time headway",
    "max_drac_mps2": "m/s^2, largest deceleration to avoid a crash at constant speeds",
    "max_required_mps2": "m/s^2, largest required deceleration",
    "min_pet_s": "s, least post-encroachment time",
    "contact_t_s": "s, when both touched",
    "contact_kmh": "km/h, closing speed at the contact",
    "ego_at_contact_kmh": "km/h, speed of the ego at the contact",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayRun:
    """One run. folder: None where there is none, as of a file that cannot be played."""

    name: str
    scenario: str
    weather: str
    friction: str
    seed: int | None
    judged: PlayJudgement
    folder: Path | None = None
    duration: float | None = None  # s
    others: tuple[Counterpart, ...] = ()
    contact: tuple[float, str, float] | None = None  # first of the ego: s, with what, closing m/s
    metrics: dict[str, Any] = field(default_factory=dict)  # of the campaign, by column

    @property
    def verdict(self) -> PlayVerdict:
        """Returns the verdict of the run."""
        return self.judged.verdict

    def least(self, name: str) -> float | None:
        """Returns the least of a column of pairs over all counterparts; None where none has a value."""
        known = [v for c in self.others if (v := getattr(c.pair, name)) is not None]
        return min(known, default=None)

    def most(self, name: str) -> float | None:
        """Returns the largest of a column of pairs over all counterparts; None where none has a value."""
        known = [v for c in self.others if (v := getattr(c.pair, name)) is not None]
        return max(known, default=None)


@dataclass(frozen=True, slots=True)
class Played:
    """All runs of a folder, and the rules by which they were judged."""

    out: Path
    runs: tuple[PlayRun, ...]
    judging: Judging

    @property
    def bad(self) -> list[PlayRun]:
        """Returns the runs that are failed, void or in error."""
        return [run for run in self.runs if not run.verdict.is_good]


def load_played(out: Path) -> Played:
    """Returns the judged runs of a folder, of one run or many; files that cannot be played are errors.

    Nothing is written.
    """
    judging = read_judging(out)
    rules = [parse_expectation(text) for text in judging.expect]
    runs = [*_runs(out, rules)]
    runs += [
        PlayRun(
            name=left.file, scenario=left.file, weather="", friction="", seed=None,
            judged=PlayJudgement(PlayVerdict.ERROR, "", (f"cannot be played: {left.why}",)),
        )
        for left in judging.left_out
    ]  # fmt: skip
    return Played(out, tuple(runs), judging)


def _runs(out: Path, rules: Sequence[Expectation]) -> Iterator[PlayRun]:
    """Yields the runs in a folder by its ledger; the folder itself as one run where it has none."""
    if not (out / LEDGER).is_file():
        yield _run(out, out, rules, None)
        return
    for entry in latest(read_ledger(out, GripEntry)):
        yield _run(out, out / RUNS / entry.run, rules, entry)


def _run(out: Path, folder: Path, rules: Sequence[Expectation], entry: GripEntry | None) -> PlayRun:
    """Returns the judged run in `folder`; entry: what the ledger says of it, None without a ledger."""
    name = folder.resolve().name
    words = _words(folder, None if entry is None else entry.key)
    metrics = {} if entry is None or entry.metrics is None else asdict(entry.metrics)
    staging = read_staging(folder)
    if staging is None or not (folder / TICKS).is_file():
        what = (entry.error if entry else "").strip().rpartition("\n")[2]
        judged = PlayJudgement(
            PlayVerdict.ERROR, "", (what or "the run was not driven to its end",)
        )
        return PlayRun(name=name, judged=judged, metrics=metrics, **words)
    log = read_log(folder)
    found = pairs(log)
    others = tuple(counterparts(log, found, staging))
    if (folder / ERROR).is_file():
        judged = PlayJudgement(
            PlayVerdict.ERROR, "", ("the stack failed", *_last_line(folder / ERROR))
        )
    else:
        judged = judge_run(
            staging, others, rules, _of_file(out, log, staging), run_values(log, found)
        )
    return PlayRun(
        name=name, judged=judged, folder=folder, others=others, metrics=metrics,
        duration=float(log.t[-1]) if len(log) else 0.0, contact=_contact(log), **words,
    )  # fmt: skip


def _of_file(out: Path, log: RunLog, staging: Staging) -> list[Any]:
    """Returns the judged criteria of the scenario file; empty where it has none."""
    if not staging.criteria:
        return []
    return judge_criteria(prepare(log, find_road(out, log.header)), staging.criteria)


def find_road(out: Path, header: LogHeader) -> RoadMap:
    """Returns the map of a run, which `out` keeps, or the campaign of which `out` is a run."""
    above = out.resolve().parents[1:2]
    folder = next((f for f in (out, *above) if (f / KEPT).is_dir()), out)
    return kept_map(folder, header.map, header.map_hash)


def _contact(log: RunLog) -> tuple[float, str, float] | None:
    """Returns time in s, what was hit and closing speed in m/s of the first contact; None without."""
    first = next(iter(log.contacts), None)
    if first is None:
        return None
    what = first.static or log.table.names[first.actor]
    return first.tick * log.header.dt, what, first.v_closing


def _last_line(path: Path) -> list[str]:
    """Returns the last line of a text file, alone in a list; empty for an empty file."""
    text = path.read_text(encoding="utf-8", errors="replace").strip()
    return [text.rpartition("\n")[2]] if text else []


def _words(folder: Path, key: GripKey | None) -> dict[str, Any]:
    """Returns scenario, weather, friction and seed of a run, by its set-up, else by its ledger's key."""
    path = folder / CONFIG
    if not path.is_file():
        if key is None:
            return {"scenario": folder.name, "weather": "", "friction": "", "seed": None}
        return {name: getattr(key, name) for name in ("scenario", "weather", "friction", "seed")}
    try:
        plain = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise FileError(f"{path} cannot be read: {error}") from None
    spec = run_from_plain(plain, str(path))
    course = spec.course
    return {
        "scenario": course.variant or course.title if isinstance(course, Scenario) else spec.cell,
        "weather": spec.weather.name,
        "friction": spec.friction.value,
        "seed": spec.seed,
    }


def results_table(played: Played) -> pl.DataFrame:
    """Returns one row per run and counterpart; a run without any has one row."""
    rows = [_row(run, other) for run in played.runs for other in run.others or (None,)]
    return pl.DataFrame(rows, infer_schema_length=None)


def write_results_csv(played: Played) -> Path:
    """Writes results.csv into the folder and returns its path."""
    path = played.out / CSV
    write_csv(path, results_table(played))
    return path


def _row(run: PlayRun, other: Counterpart | None) -> dict[str, Any]:
    """Returns a row of the results table; None for `other` leaves the counterpart's fields empty."""
    row = dict.fromkeys(COLUMNS) | {
        "run": run.name, "scenario": run.scenario, "weather": run.weather,
        "friction": run.friction, "seed": run.seed, "verdict": run.verdict.value,
        "criterion": run.judged.criterion, "reasons": "; ".join(run.judged.reasons),
        "duration_s": run.duration, "contacts_with": None if run.contact is None else run.contact[1],
    }  # fmt: skip
    if other is not None:
        row |= other.pair._asdict()
        del row["one"], row["other"]
        row |= {
            "counterpart": other.name,
            "staged": other.staged,
            "met": other.encounter.met,
            "min_distance_m": other.encounter.distance,
            "crossed_after_s": other.encounter.crossed_after,
            "contact_t_s": other.contact_t,
            "contact_kmh": kmh_of(other.contact_v),
            "ego_at_contact_kmh": kmh_of(other.contact_v_ego),
        }
    return row | {k: v for k, v in run.metrics.items() if k not in row}


def kmh_of(v: float | None) -> float | None:
    """Returns m/s in km/h; None stays None."""
    return None if v is None else kmh_from_mps(v)
