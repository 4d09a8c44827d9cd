"""What the matrix counts first: crashes with vehicles, departures, time to the first fatal event (R-6)."""

from __future__ import annotations

from functools import partial

import numpy as np

from skidpad.evidence.statistics import median_time
from skidpad.report.matrix_data import Matrix, config_title, rate_by_seed
from skidpad.report.matrix_tables import TOO_FEW
from skidpad.report.page import Cell, Table
from skidpad.report.tables import Column, Format, Quantity, table

RATE = Format(".2f", absent="no run")
COUNTS = (
    ("crashes_vehicle", "crashes with vehicles", "recoveries after hitting or being hit"),
    ("road_departures", "departures", "into a barrier, off the road, or facing the wrong way"),
    ("fatal_collisions", "all fatal", "both; one between two relocations, its first cause"),
    ("fatal_first", "first of a chain", "more than 8 s or 100 m after a relocation"),
)


def headline_table(matrix: Matrix) -> Table:
    """One row per configuration, every drive once."""
    counts = [
        Column[str](f"{title} per run", partial(_count, matrix, name), meaning, format=RATE)
        for name, title, meaning in COUNTS
    ]
    first = Column[str](
        "time to the first, median",
        partial(_first, matrix),
        "of runs; a run without one counts as longer than every run",
        "s",
    )
    columns = [Column[str]("configuration", config_title), *counts[:2], first, *counts[2:]]
    note = (
        "Every drive once. Small: 95 % interval; per 100 km it is that of the count, the way taken "
        "as given; of the median exact by order statistics, from six runs on."
    )
    return table(columns, matrix.configs, "What happened, by configuration", note)


def _count(matrix: Matrix, column: str, config: str) -> Quantity:
    runs = matrix.cell(config).drop_nulls([column, "distance_km"])
    km = float(runs["distance_km"].sum())
    if not len(runs) or not km:
        return Quantity(value=None)
    rate = rate_by_seed(runs, column)
    assert rate is not None
    scale = 100.0 * len(runs) / km
    told = f"per 100 km {scale * rate.rate:.1f}"
    if rate.interval is not None:
        low, high = (scale * end for end in rate.interval)
        told += f": {low:.1f} to {high:.1f}"
    return Quantity(
        value=rate.rate,
        interval=rate.interval,
        remark=TOO_FEW if rate.interval is None else "",
        lines=(told,),
        hint=f"{rate.events} events, {rate.runs} seeds, {km:,.0f} km, {rate.method.value}",
    )


def _first(matrix: Matrix, config: str) -> Cell:
    """Median time to the first fatal event; beyond the end of runs it cannot be told."""
    runs = matrix.cell(config).drop_nulls("duration_s")
    if not len(runs):
        return Cell("no run", kind="muted")
    end = float(runs["duration_s"].min())  # type: ignore[arg-type]
    times = runs["first_fatal_s"].cast(float).fill_null(np.inf).to_numpy()
    median, (low, high) = median_time(times, end)
    told = f"{_time(low, end)} to {_time(high, end)}" if low > 0.0 else "unbounded"
    return Cell(_time(median, end), note=told, sort=min(median, end), hint=f"{len(runs)} runs")


def _time(t: float, end: float) -> str:
    return f"{t:.0f}" if np.isfinite(t) else f"> {end:.0f}"
