"""The recipe of the threshold map: at which friction does following end in an accident?"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path

import polars as pl

from skidpad import __version__
from skidpad.campaign.cells.grip import template
from skidpad.campaign.cells.threshold import (
    DRIVERS,
    Levels,
    Task,
    preset_of,
    start_of_text,
    tasks,
    title_of,
)
from skidpad.campaign.recipes.grip import drive_and_judge
from skidpad.campaign.recipes.recipe import Driven, Recipe, find_reason
from skidpad.campaign.runs.folder import last_line
from skidpad.campaign.workers.worker import Job, Runner
from skidpad.core.courses import ActorMode
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.grip import GripMetrics
from skidpad.recording.campaign.results import read_results
from skidpad.recording.campaign.threshold import THRESHOLD, ThresholdEntry, ThresholdKey
from skidpad.recording.run.log_files import TICKS

COMMAND = "grip-threshold"
SITUATION = ("driver", "actors", "start", "deceleration")


def warm_up() -> None:
    """Compiles every kernel that a run may need, by driving one run per mode of actors."""
    from skidpad.campaign.runs.run import run

    levels = Levels(
        drivers=[DRIVERS["acc"]],
        modes=list(ActorMode),
        starts=[start_of_text("0.6")],
        decelerations=[8.0],
        shares=[0.11],
    )
    for task in tasks(template(), levels, range(1)):
        run(task.run)


def drive_one(out: Path, task: Task, *, keep: bool = False) -> Driven[ThresholdKey, GripMetrics]:
    """Drives a run and returns its row; with `keep` it leaves its folder."""
    found = drive_and_judge(out, task.run, keep)
    return Driven(
        key=threshold_key(task, found.driven.outcome, found.log_hash),
        metrics=found.metrics,
        timing=found.timing,
        error=last_line(found.driven.error),
    )


def threshold_key(task: Task, outcome: Outcome, log_hash: str | None = None) -> ThresholdKey:
    """Returns the identifying columns of a run's row; log_hash None: it left no log."""
    return ThresholdKey(
        driver=task.run.driver.label,
        actors=task.mode.value,
        start=title_of(task.start),
        speed_kmh=kmh_from_mps(task.start.v),
        gap_m=task.start.gap,
        deceleration=task.deceleration,
        road_mu=task.run.settings.world.mu_ref,
        preset=preset_of(task.share),
        seed=task.run.seed,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def finish(driven: Sequence[Task], out: Path, runner: Runner) -> None:
    """Drives the first accident of each situation, coming from dry road, again and keeps its log."""
    crashed = read_results(out).filter(~pl.col("completion"))
    first = crashed.sort("road_mu", "seed", descending=[True, False]).unique(
        SITUATION, keep="first", maintain_order=True
    )
    wanted = set(first.select(THRESHOLD.sort).iter_rows())
    jobs = [
        Job(task.name, partial(drive_one, out, keep=True), task, task.deadline_s)
        for task in driven
        if attrgetter(*THRESHOLD.sort)(threshold_key(task, Outcome.COLLISION)) in wanted
        and not (out / RUNS / task.name / TICKS).exists()
    ]
    for _ in runner(jobs):
        pass


def recipe(keep_all: bool = False) -> Recipe[Task, ThresholdKey, GripMetrics]:
    """Returns what a threshold campaign is made of; keep_all: every run leaves its whole log."""
    return Recipe(
        command=COMMAND,
        columns=THRESHOLD,
        entry=ThresholdEntry,
        key=threshold_key,
        drive=partial(drive_one, keep=keep_all),
        warm_up=warm_up,
        success=lambda metrics: metrics.completion,
        success_means="completed",
        why_not_quick=lambda out, task: find_reason(out, task.run),
        finish=finish,
    )
