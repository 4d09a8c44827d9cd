"""What a search found: which failures could have been avoided, of what kinds they are, and how near each
lies to a harmless run.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec
import numpy as np
from msgspec import structs

from skidpad.campaign.play import run_to
from skidpad.campaign.worker import Runner
from skidpad.core.space import Space
from skidpad.recording.files import write_bytes
from skidpad.recording.searches import (
    CHOICES,
    FOUND,
    Change,
    Findings,
    Group,
    Judged,
    Search,
    Trial,
    failure_folder,
)
from skidpad.search.files import write_choices
from skidpad.search.loop import drive_all
from skidpad.search.space import apply_values
from skidpad.search.trial import Point, unit_tuple

KEPT = 3  # failures of each group that are kept as runs
HALVINGS = 7  # of the way from a harmless value to a failing one: to less than 1 % of it


def distinct_failures(trials: Iterable[Trial]) -> list[Trial]:
    """Return the failures, each drive once (decision T-3)."""
    found: dict[str, Trial] = {}
    for trial in trials:
        if trial.is_failure:
            found.setdefault(trial.motion, trial)
    return list(found.values())


def judge_failures(found: Search, failures: Sequence[Trial]) -> list[Judged]:
    """Return the failures with the likelihood of their values."""
    return [Judged(trial=t, likelihood=found.space.likelihood(t.values)) for t in failures]


def group_failures(judged: Sequence[Judged]) -> list[Group]:
    """Return avoidable failures by kind, the largest group first."""
    kinds: dict[str, list[Judged]] = {}
    for one in judged:
        if one.trial.is_avoidable:
            kinds.setdefault(one.trial.kind, []).append(one)
    groups = [
        Group(kind=kind, failures=tuple(sorted(ones, key=_least_likely)))
        for kind, ones in kinds.items()
    ]
    return sorted(groups, key=lambda g: (-len(g.failures), g.kind))


def _least_likely(one: Judged) -> tuple[float, int]:
    return -one.likelihood, one.trial.number


def find_border(found: Search, group: Group, trials: Sequence[Trial], runner: Runner) -> Group:
    """Return the group with the smallest change that makes its first failure harmless.

    Begins at the nearest harmless trial. Value by value the harmless one's is put back to the
    failing one's as long as the run stays harmless, so that few differ; then the way between both
    is halved until it is shorter than 1 %.
    """
    failure = group.failures[0].trial
    harmless = nearest_harmless(failure, trials)
    if harmless is None:
        return group
    low = np.array(harmless.unit)
    high = np.array(failure.unit)
    best, k = harmless, 0
    for axis in np.argsort(-np.abs(high - low)):
        tried = low.copy()
        tried[axis] = high[axis]
        (trial,) = drive_all([_point(found, tried, k)], runner)
        k += 1
        if not trial.is_failure and not trial.fault:
            low, best = tried, trial
    worst = failure
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        (trial,) = drive_all([_point(found, middle, k)], runner)
        k += 1
        if trial.is_failure:
            high, worst = middle, trial
        else:
            low, best = middle, trial
    return structs.replace(
        group, changes=list_changes(found.space, best, worst), failing=worst, harmless=best
    )


def nearest_harmless(failure: Trial, trials: Iterable[Trial]) -> Trial | None:
    """Return the nearest trial of the unit cube that is no failure and was really driven."""
    at = np.array(failure.unit)
    good = [t for t in trials if not t.is_failure and not t.fault]
    return min(good, key=lambda t: float(np.linalg.norm(np.array(t.unit) - at)), default=None)


def list_changes(space: Space, harmless: Trial, failing: Trial) -> tuple[Change, ...]:
    """Return the values in which both differ, in the order of the space."""
    return tuple(
        Change(name, harmless.values[name], failing.values[name])
        for name in space.names
        if harmless.values[name] != failing.values[name]
    )


def _point(found: Search, unit: Iterable[float], number: int) -> Point:
    return Point(found.template, found.space, number, unit_tuple(unit), found.objective)


def look_at_failures(found: Search, trials: Sequence[Trial], runner: Runner) -> Findings:
    """Judge all failures of a search, group them, and find the border of each group."""
    judged = judge_failures(found, distinct_failures(trials))
    groups = [find_border(found, g, trials, runner) for g in group_failures(judged)]
    return Findings(tuple(judged), tuple(groups))


def kept_trials(groups: Sequence[Group]) -> list[Trial]:
    """Return the failures that are kept as runs: the first ones of each group."""
    return [one.trial for group in groups for one in group.failures[:KEPT]]


def write_findings(out: Path, found: Search, findings: Findings) -> None:
    """Write what was found, the avoidable failures as a file to play, and some of them as runs."""
    write_bytes(out / FOUND, msgspec.json.encode(findings))
    course = found.template.course
    avoidable = [one.trial for group in findings.groups for one in group.failures]
    write_choices(out / CHOICES, course.file, avoidable)  # type: ignore[union-attr]
    for trial in kept_trials(findings.groups):
        folder = failure_folder(out, trial.number)
        if not folder.exists():
            run_to(apply_values(found.template, trial.values), folder)
