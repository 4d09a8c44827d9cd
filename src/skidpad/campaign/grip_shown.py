"""What a report shows besides results: logs of a median and a worst run per cell, and full stops."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from skidpad.campaign.grip import TARGET, Runner, Task
from skidpad.campaign.grip_cells import GripCell
from skidpad.campaign.pool import Job
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.stopping import SPEEDS_KMH, grip_rows
from skidpad.recording.campaigns import RUNS
from skidpad.recording.files import write_parquet
from skidpad.recording.logfiles import TICKS
from skidpad.recording.results import read_results

STOPPING = "stopping.parquet"
CELL = ("scenario", "cutin", "overlay", "weather", "friction")


def shown(results: pl.DataFrame) -> pl.DataFrame:
    """Of each cell the run with the median and with the least distance; columns CELL, seed, role."""
    finished = results.drop_nulls("min_cvip_m")
    order = finished.sort("completion", "min_cvip_m", "seed").group_by(CELL, maintain_order=True)
    middle = order.agg(pl.col("seed").get(pl.len() // 2)).with_columns(role=pl.lit("median"))
    worst = order.agg(pl.col("seed").first()).with_columns(role=pl.lit("worst"))
    return pl.concat([middle, worst]).sort(*CELL, "role")


def keep_shown(out: Path, cells: Sequence[GripCell], runner: Runner) -> None:
    """Write the logs of these runs; a drive is the same whenever it is driven."""
    wanted = {
        tuple(row[name] for name in (*CELL, "seed")) for row in shown(read_results(out)).to_dicts()
    }
    jobs = [
        Job(c.name, TARGET, Task(c, out, keep=True), c.deadline_s)
        for c in cells
        if (c.scenario, c.cutin.value, c.overlay, c.weather.name, c.friction.value, c.seed)
        in wanted
        and not (out / RUNS / c.name / TICKS).exists()
    ]
    for _ in runner(jobs):
        pass


def write_stopping(out: Path, weathers: Sequence[Weather], mu_ref: float) -> None:
    """Ratio, friction and stopping distances of each weather under both models (decision G-5)."""
    models = [GripModel.STATISTICAL, GripModel.PHYSICAL]
    rows = []
    for row in grip_rows(weathers, models, mu_ref):
        stops = {f"stop_{v:g}_m": s.distance for v, s in zip(SPEEDS_KMH, row.stops, strict=True)}
        numbers = {"ratio": row.ratio, "mu_80": row.mu_80, **stops}
        rows.append({"weather": row.weather, "model": row.model.value, **numbers})
    write_parquet(out / STOPPING, pl.DataFrame(rows))
