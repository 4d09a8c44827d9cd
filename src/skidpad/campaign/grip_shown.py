"""The runs that a report shows, a median and a worst one per cell, driven again with their logs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from skidpad.campaign.grip import TARGET, Runner, Task
from skidpad.campaign.grip_cells import GripCell
from skidpad.campaign.matrix import RUNS
from skidpad.campaign.pool import Job
from skidpad.recording.logfiles import TICKS
from skidpad.recording.results import read_results

CELL = ("scenario", "cutin", "weather", "friction")


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
        (row["scenario"], row["cutin"], row["weather"], row["friction"], row["seed"])
        for row in shown(read_results(out)).to_dicts()
    }
    jobs = [
        Job(c.name, TARGET, Task(c, out, keep=True), c.deadline_s)
        for c in cells
        if (c.scenario, c.cutin.value, c.weather.name, c.friction.value, c.seed) in wanted
        and not (out / RUNS / c.name / TICKS).exists()
    ]
    for _ in runner(jobs):
        pass
