"""What a search found: which failures could have been avoided, of what kinds they are, and how near each
lies to a harmless run.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec
import numpy as np
from msgspec import structs

from skidpad.campaign.runs.play import run_to
from skidpad.campaign.workers.worker import Runner
from skidpad.core.maths.space import Space
from skidpad.recording.campaign.searches import (
    CHOICES,
    FOUND,
    HAZARD,
    Change,
    Findings,
    Group,
    Hazard,
    Search,
    Trial,
    distinct_failures,
    failure_folder,
)
from skidpad.recording.files import write_bytes, write_json
from skidpad.search.files import write_choices
from skidpad.search.loop import drive_all
from skidpad.search.space import apply_values, is_parameter
from skidpad.search.trial import Point, unit_tuple

KEPT = 3  # failures of each group that are kept as runs
HALVINGS = 7  # of the way from a harmless value to a failing one: to less than 1 % of it


def group_failures(found: Search, failures: Iterable[Trial]) -> list[Group]:
    """Returns the avoidable failures by kind, the largest group first, in each the likeliest first."""
    kinds: dict[str, list[Trial]] = {}
    for trial in failures:
        if trial.is_avoidable:
            kinds.setdefault(trial.kind, []).append(trial)

    def rank(trial: Trial) -> tuple[float, int]:
        return -found.space.likelihood(trial.values), trial.number

    groups = [Group(kind=k, failures=tuple(sorted(ts, key=rank))) for k, ts in kinds.items()]
    return sorted(groups, key=lambda g: (-len(g.failures), g.kind))


def find_border(found: Search, group: Group, trials: Sequence[Trial], runner: Runner) -> Group:
    """Returns the group with the smallest change that makes its first failure harmless.

    Begins at the nearest harmless trial; without one the group stays as it is. Value by value the
    harmless one's is put back to the failing one's as long as the run stays harmless, so that few
    differ; then the way between both is halved until it is shorter than 1 %.
    """
    failure = group.failures[0]
    harmless = nearest_harmless(failure, trials)
    if harmless is None:
        return group
    low = np.array(harmless.unit)
    high = np.array(failure.unit)
    best, worst = harmless, failure
    for axis in np.argsort(-np.abs(high - low)):
        tried = low.copy()
        tried[axis] = high[axis]
        trial = _drive(found, tried, runner)
        if trial.is_harmless:
            low, best = tried, trial
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        trial = _drive(found, middle, runner)
        if trial.is_failure:
            high, worst = middle, trial
        elif trial.is_harmless:
            low, best = middle, trial
        else:  # what cannot be driven lies between both
            break
    return structs.replace(
        group, changes=list_changes(found.space, best, worst), failing=worst, harmless=best
    )


def nearest_harmless(failure: Trial, trials: Iterable[Trial]) -> Trial | None:
    """Returns the nearest trial of the unit cube that was driven and is no failure; None without one."""
    at = np.array(failure.unit)
    good = [t for t in trials if t.is_harmless]
    return min(good, key=lambda t: float(np.linalg.norm(np.array(t.unit) - at)), default=None)


def list_changes(space: Space, harmless: Trial, failing: Trial) -> tuple[Change, ...]:
    """Return the values in which both differ, in the order of the space."""
    return tuple(
        Change(name, harmless.values[name], failing.values[name])
        for name in space.names
        if harmless.values[name] != failing.values[name]
    )


def _drive(found: Search, unit: Iterable[float], runner: Runner) -> Trial:
    """Drives one point that is no trial of the search, and returns what it came to."""
    point = Point(found.template, found.space, 0, unit_tuple(unit), found.objective)
    return drive_all([point], runner)[0]


def look_at_failures(found: Search, trials: Sequence[Trial], runner: Runner) -> Findings:
    """Group the avoidable failures of a search, and find the border of each group."""
    groups = group_failures(found, distinct_failures(trials))
    return Findings(tuple(find_border(found, g, trials, runner) for g in groups))


def kept_trials(groups: Sequence[Group]) -> list[Trial]:
    """Return the failures that are kept as runs: the first ones of each group."""
    return [trial for group in groups for trial in group.failures[:KEPT]]


def write_hazard(out: Path, hazard: Hazard) -> None:
    """Writes what a search found about the hazard that it began from into its folder."""
    write_json(out / HAZARD, hazard)


def write_findings(out: Path, found: Search, findings: Findings) -> None:
    """Writes what was found, the avoidable failures as a file to play, and some of them as runs.

    There is no file where no parameter varies. Those runs, of `kept_trials`, are driven again unless
    their folders exist.
    """
    write_bytes(out / FOUND, msgspec.json.encode(findings))
    course = found.template.course
    avoidable = [trial for group in findings.groups for trial in group.failures]
    if any(map(is_parameter, found.space.names)):
        write_choices(out / CHOICES, course.file, avoidable)  # type: ignore[union-attr]
    for trial in kept_trials(findings.groups):
        folder = failure_folder(out, trial.number)
        if not folder.exists():
            run_to(apply_values(found.template, trial.values), folder)
