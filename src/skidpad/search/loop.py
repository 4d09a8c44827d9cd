"""The search itself: ask a method for points, drive them, tell it, until the budget is spent.

Every trial is a line of `trials.jsonl`. A search that is resumed asks its method for the same points
again and reads what they came to, so it goes on as if it had never stopped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct, structs

from skidpad.campaign.workers.worker import Job, Runner
from skidpad.core.errors import FileError, OutputError
from skidpad.recording.campaign.risks import RISK, RISK_RUNS, Risk, read_risk
from skidpad.recording.campaign.searches import (
    SEARCH,
    TRIALS,
    Search,
    Trial,
    read_search,
    read_trials,
)
from skidpad.recording.files import write_bytes, write_json
from skidpad.search.margin import NO_CONFLICT
from skidpad.search.methods import batch_sizes, make_method
from skidpad.search.trial import Point, drive_point, unit_tuple, with_reference

DEADLINE_S = 600.0  # of one run
SCENE = "scene"  # folder of the scenarios that a hazard was made into


def write_search(out: Path, search: Search, *, resume: bool) -> list[Trial]:
    """Write what is searched into a folder; return the trials that it holds already.

    Raises:
        OutputError: the folder holds another search, or this one and `resume` is false.
    """
    return _begin(out, SEARCH, search, read_search, TRIALS, resume)


def begin_risk(out: Path, asked: Risk, *, resume: bool) -> list[Trial]:
    """Write what is asked into a folder; return the runs that it holds already; as `write_search`."""
    return _begin(out, RISK, asked, read_risk, RISK_RUNS, resume)


def _begin(
    out: Path, name: str, asked: Struct, read: Callable[[Path], Struct], runs: str, resume: bool
) -> list[Trial]:
    """Returns the trials done before; in a new folder it writes the options and returns an empty list."""
    check_folder(out, name, resume=resume)
    if (out / name).is_file():
        if msgspec.json.encode(read(out)) != msgspec.json.encode(asked):
            raise OutputError(f"{out} was begun with other options: give another --out")
        return read_trials(out, runs)
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / name, asked)
    return []


def check_folder(out: Path, name: str = SEARCH, *, resume: bool) -> None:
    """Raise OutputError where a folder holds anything but a scene, or results that are not resumed."""
    if (out / name).is_file():
        if not resume:
            raise OutputError(f"{out} holds results already: give --resume, or another --out")
    elif out.exists() and any(path.name != SCENE for path in out.iterdir()):
        raise OutputError(f"{out} is not empty and holds no {name}: give another --out")


def search(found: Search, out: Path, runner: Runner, known: Sequence[Trial]) -> Iterator[Trial]:
    """Drives the search to its end and yields one trial after the other in their order.

    It goes on only as far as it is iterated; each trial is also appended to the folder's file.

    Args:
        found: what is searched.
        out: its folder, written by `write_search`.
        runner: drives a batch, on this machine or a cluster.
        known: trials of an earlier stretch, as `write_search` returns them.
    """
    template, space = found.template, found.space
    method = make_method(found.method, len(space.variables), found.seed, found.budget)
    stored = StoredTrials(out / TRIALS, known, partial(_drive_with_reference, runner=runner))
    number = 0
    for size in batch_sizes(found.budget):
        points = method.ask(size)
        trials = stored.drive([
            Point(template, space, number + k, unit_tuple(p), found.objective)
            for k, p in enumerate(points)
        ])  # fmt: skip
        yield from trials
        method.tell(points, np.array([_told_margin(trial) for trial in trials]))
        number += size


class StoredTrials:
    """The trials of a folder: those of an earlier stretch are read, others driven and written down."""

    def __init__(
        self, path: Path, known: Sequence[Trial], drive: Callable[[Sequence[Point]], list[Trial]]
    ) -> None:
        """known: trials of `path` that can be read. drive: returns the trials of points in order."""
        self.path, self._drive = path, drive
        self._known = {trial.number: trial for trial in known}
        if known:  # so that a line that was cut off is gone
            write_bytes(path, msgspec.json.Encoder().encode_lines(known))

    def drive(self, points: Sequence[Point]) -> list[Trial]:
        """Returns the trials of points, in their order; drives those not stored and appends them to the file.

        Raises:
            FileError: the file holds another point under the number of one of these.
        """
        new = self._drive([point for point in points if not self._holds(point)])
        with self.path.open("ab") as file:
            file.write(msgspec.json.Encoder().encode_lines(new))
        self._known |= {trial.number: trial for trial in new}
        return [self._known[point.number] for point in points]

    def _holds(self, point: Point) -> bool:
        """Returns whether the point's trial is stored; raises FileError where the stored one differs."""
        trial = self._known.get(point.number)
        if trial is not None and trial.unit != point.unit:
            raise FileError(
                f"{self.path}: trial {point.number} is not what this version asks for; "
                "begin anew in another folder"
            )
        return trial is not None


def _drive_with_reference(points: Sequence[Point], runner: Runner) -> list[Trial]:
    """Returns the trials of points, every failure with that of the reference driver at the wheel."""
    trials = drive_all(points, runner)
    failing = {t.number for t in trials if t.is_failure}
    again = [replace(p, template=with_reference(p.template)) for p in points if p.number in failing]
    references = {t.number: t for t in drive_all(again, runner)}
    return [structs.replace(t, reference=references.get(t.number)) for t in trials]


def _told_margin(trial: Trial) -> float:
    """Returns what a method learns; a failure that is not avoidable is no place to look: NO_CONFLICT."""
    return NO_CONFLICT if trial.is_failure and not trial.is_avoidable else trial.margin


def drive_all(points: Sequence[Point], runner: Runner) -> list[Trial]:
    """Returns the trials of points in their order; a run that killed its worker or hung is a fault."""
    by_key = {str(p.number): p for p in points}
    jobs = [Job(key, drive_point, p, DEADLINE_S) for key, p in by_key.items()]
    found = {}
    for done in runner(jobs):
        point = by_key[done.job.key]
        found[point.number] = (
            done.value if done.failure is None else _blank_trial(point, done.detail)
        )
    return [found[p.number] for p in points]


def _blank_trial(point: Point, detail: str) -> Trial:
    """Returns the trial of a lost run: no conflict, and the last line of the detail as its fault."""
    values = point.space.values(point.unit)
    last = detail.strip().rpartition("\n")[2] or "the run was lost"
    return Trial(
        number=point.number, unit=point.unit, values=values, margin=NO_CONFLICT, fault=last
    )
