"""How fast the runs were against real time, by weather (A-246): what the source printed as RTF."""

from __future__ import annotations

from functools import partial

import polars as pl

from skidpad.report.matrix_data import Matrix, WeatherGroup
from skidpad.report.page import Block, Text
from skidpad.report.tables import Column, Format, Quantity, table

BEHIND = 0.9  # times real time, below which a tick counts as slow


def real_time_blocks(matrix: Matrix) -> list[Block]:
    """A table by weather; nothing where the campaign kept no clocks."""
    times = matrix.folder.timing
    if not {"rtf", "rtf_below_0_9_pct", "weather"} <= set(times.columns):
        return []
    known = times.filter(pl.col("rtf").is_not_null() & (pl.col("rtf") > 0.0))
    if not len(known):
        return []
    groups = [g for g in matrix.weather_groups if len(_rows(known, g))]
    columns = [
        Column[WeatherGroup]("weather", lambda group: group.title),
        Column[WeatherGroup]("runs", lambda group: float(len(_rows(known, group)))),
        Column[WeatherGroup](
            "times real time, mean",
            partial(_of, known, "rtf", "mean"),
            "simulated over wall time",
            format=Format(".1f"),
        ),
        Column[WeatherGroup](
            "times real time, least", partial(_of, known, "rtf", "min"), format=Format(".1f")
        ),
        Column[WeatherGroup](
            f"ticks below {BEHIND:g}",
            partial(_of, known, "rtf_below_0_9_pct", "mean"),
            "share of ticks slower than 0.9 times real time, mean over runs",
            "%",
            Format(".2f", absent="not measured"),
        ),
    ]
    words = Text(
        "Speed of the simulation on the machine that drove these runs, other work included. The "
        "source ran at 0.30 to 1.02 times real time on its machine, with a simulator that renders."
    )
    return [words, table(columns, groups, "Real time by weather")]


def _rows(times: pl.DataFrame, group: WeatherGroup) -> pl.DataFrame:
    return times.filter(pl.col("weather").is_in(group.weathers))


def _of(times: pl.DataFrame, column: str, how: str, group: WeatherGroup) -> Quantity:
    values = _rows(times, group)[column].drop_nulls().drop_nans()
    return Quantity(value=float(getattr(values, how)()) if len(values) else None)
