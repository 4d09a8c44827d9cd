"""What a report shows besides results: a median and a worst run per cell, and full stops."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.stopping import SPEEDS_KMH, grip_rows
from skidpad.recording.campaign.grip import STOPPING
from skidpad.recording.files import write_parquet

CELL = ("scenario", "cutin", "overlay", "weather", "friction")


def select_shown_runs(results: pl.DataFrame) -> pl.DataFrame:
    """Of each cell the run with the median and with the least distance; columns CELL, seed, role."""
    finished = results.drop_nulls("min_cvip_m")
    order = finished.sort("completion", "min_cvip_m", "seed").group_by(CELL, maintain_order=True)
    middle = order.agg(pl.col("seed").get(pl.len() // 2)).with_columns(role=pl.lit("median"))
    worst = order.agg(pl.col("seed").first()).with_columns(role=pl.lit("worst"))
    return pl.concat([middle, worst]).sort(*CELL, "role")


def write_stopping(out: Path, weathers: Sequence[Weather], mu_ref: float) -> None:
    """Ratio, friction and stopping distances of each weather under both models (decision G-5)."""
    models = [GripModel.STATISTICAL, GripModel.PHYSICAL]
    rows = []
    for row in grip_rows(weathers, models, mu_ref):
        stops = {f"stop_{v:g}_m": s.distance for v, s in zip(SPEEDS_KMH, row.stops, strict=True)}
        numbers = {"ratio": row.ratio, "mu_80": row.mu_80, **stops}
        rows.append({"weather": row.weather, "model": row.model.value, **numbers})
    write_parquet(out / STOPPING, pl.DataFrame(rows))
