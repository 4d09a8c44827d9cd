"""The recipe of the friction campaign: short scenarios in thousands of paired runs.

Every run leaves its series; whole logs are kept of those that the report shows (decision G-7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

from skidpad import __version__
from skidpad.campaign.cells.grip import Cross, cross, scenario_of, template
from skidpad.campaign.recipes.recipe import Driven, Recipe, find_reason
from skidpad.campaign.runs.folder import Stopwatch, fresh_folder, last_line, write_drive
from skidpad.campaign.user_files import keep_road
from skidpad.campaign.workers.worker import Job, Runner
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.folder import RUNS
from skidpad.recording.campaign.grip import (
    GRIP,
    GripEntry,
    GripKey,
    GripMetrics,
    series_path,
    write_series,
)
from skidpad.recording.campaign.results import Timing, read_results
from skidpad.recording.run.log_files import TICKS, log_hash
from skidpad.scenarios.variation import CutIn

if TYPE_CHECKING:
    from skidpad.campaign.runs.run import Run
import polars as pl

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.stopping import SPEEDS_KMH, grip_rows
from skidpad.recording.campaign.grip import STOPPING
from skidpad.recording.files import write_parquet


def warm_up() -> None:
    """Compiles every kernel that a run may need, by driving a few whole runs."""
    from skidpad.campaign.runs.run import run
    from skidpad.physics.presets import preset

    varied = Cross(scenarios=("front_accident", "ghost_cut_in"), weather=(preset("icy_30"),))
    for cell in cross(template(), varied, range(1)):
        run(cell)


@dataclass(frozen=True, slots=True)
class GripDrive:
    """A drive, and what its log says."""

    driven: Run
    metrics: GripMetrics
    log_hash: str
    timing: Timing


def drive_and_judge(
    out: Path, cell: RunSpec, keep: bool = False, checkpoints_s: float | None = None
) -> GripDrive:
    """Drives a run of the catalogue and measures it; with `keep`, or when it failed, writes its folder.

    Of an earlier attempt it removes the folder first. checkpoints_s: s between checkpoints in a folder that
    is kept; None: none.
    """
    from skidpad.campaign.driving.backends import WATCHDOG, keep_server, make_backend
    from skidpad.campaign.runs.run import run
    from skidpad.evidence.grip.scores import grip_metrics
    from skidpad.physics.grip import friction_ratio

    folder, watch = fresh_folder(out, cell.name), Stopwatch()
    keep_server(cell.backend)
    backend = make_backend(cell.backend, WATCHDOG)
    kept = folder if keep else None
    driven = run(cell, backend=backend, folder=kept, checkpoints_s=checkpoints_s)
    metrics = grip_metrics(
        driven.log,
        driven.outcome,
        triggered=driven.triggered,
        route_length=driven.route_length,
        ratio=friction_ratio(cell.weather, cell.grip),
        off_road=driven.off_road,
    )
    if keep or driven.error:
        write_drive(folder, cell, driven)
        keep_road(out, driven.road)
    return GripDrive(driven, metrics, log_hash(driven.log), watch.timing_of(driven))


def drive_one(
    out: Path, cell: RunSpec, *, keep: bool = False, checkpoints_s: float | None = None
) -> Driven[GripKey, GripMetrics]:
    """Drives a run and writes its series, with `keep` its log and checkpoints too; returns its row."""
    from skidpad.evidence.grip.scores import grip_series

    found = drive_and_judge(out, cell, keep, checkpoints_s)
    write_series(series_path(out, cell.cell, cell.seed), grip_series(found.driven.log))
    return Driven(
        key=grip_key(cell, found.driven.outcome, found.log_hash),
        metrics=found.metrics,
        timing=found.timing,
        error=last_line(found.driven.error),
    )


def grip_key(cell: RunSpec, outcome: Outcome, log_hash: str | None = None) -> GripKey:
    """Returns the identifying columns of a cell's row; log_hash None: it left no log."""
    return GripKey(
        scenario=scenario_of(cell).title,
        weather=cell.weather.name,
        friction=cell.friction.value,
        seed=cell.seed,
        cutin=scenario_of(cell).variant or CutIn.FIXED.value,
        controller=cell.driver.label,
        sensors=cell.sensors.value,
        model=cell.settings.world.grip.value,
        overlay=cell.overlay,
        outcome=outcome.value,
        version=__version__,
        log_hash=log_hash,
    )


def finish(
    cells: Sequence[RunSpec], out: Path, runner: Runner, checkpoints_s: float | None = None
) -> None:
    """Drives the runs that the report shows again with their logs, and writes the stopping distances.

    A drive is the same whenever it is driven. checkpoints_s: s between checkpoints of these; None: none.
    """
    wanted = set(select_shown_runs(read_results(out)).select(*CELL, "seed").iter_rows())
    work = partial(drive_one, out, keep=True, checkpoints_s=checkpoints_s)
    jobs = [
        Job(c.name, work, c, c.deadline_s)
        for c in cells
        if attrgetter(*CELL, "seed")(grip_key(c, Outcome.COMPLETED)) in wanted
        and not (out / RUNS / c.name / TICKS).exists()
    ]
    for _ in runner(jobs):
        pass
    write_stopping(
        out,
        list({c.weather.name: c.weather for c in cells}.values()),
        cells[0].settings.world.mu_ref,
    )


def recipe(
    keep_all: bool = False, checkpoints_s: float | None = None
) -> Recipe[RunSpec, GripKey, GripMetrics]:
    """Returns what a grip campaign is made of; keep_all: every run leaves its whole log.

    checkpoints_s: s between checkpoints of runs whose logs are kept; None: none.
    """
    return Recipe(
        command="grip",
        columns=GRIP,
        entry=GripEntry,
        key=grip_key,
        drive=partial(drive_one, keep=keep_all, checkpoints_s=checkpoints_s),
        warm_up=warm_up,
        success=lambda metrics: metrics.completion,
        success_means="completed",
        why_not_quick=find_reason,
        finish=partial(finish, checkpoints_s=checkpoints_s),
    )


# --- what a report shows besides results: a median and a worst run per cell, and full stops
CELL = ("scenario", "cutin", "overlay", "weather", "friction")


def select_shown_runs(results: pl.DataFrame) -> pl.DataFrame:
    """Returns of each cell the run with the median and the least distance; columns CELL, seed, role."""
    finished = results.drop_nulls("min_cvip_m")
    order = finished.sort("completion", "min_cvip_m", "seed").group_by(CELL, maintain_order=True)
    middle = order.agg(pl.col("seed").get(pl.len() // 2)).with_columns(role=pl.lit("median"))
    worst = order.agg(pl.col("seed").first()).with_columns(role=pl.lit("worst"))
    return pl.concat([middle, worst]).sort(*CELL, "role")


def write_stopping(out: Path, weathers: Sequence[Weather], mu_ref: float) -> None:
    """Writes ratio, friction and stopping distances of each weather under both models (G-5)."""
    models = [GripModel.STATISTICAL, GripModel.PHYSICAL]
    rows = []
    for row in grip_rows(weathers, models, mu_ref):
        stops = {f"stop_{v:g}_m": s.distance for v, s in zip(SPEEDS_KMH, row.stops, strict=True)}
        numbers = {"ratio": row.ratio, "mu_80": row.mu_80, **stops}
        rows.append({"weather": row.weather, "model": row.model.value, **numbers})
    write_parquet(out / STOPPING, pl.DataFrame(rows))
