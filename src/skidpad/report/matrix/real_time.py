"""How fast the runs were against real time, by weather (A-246): what the source printed as RTF."""

from __future__ import annotations

from functools import partial

import polars as pl

from skidpad.report.elements.page import Block, Text
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.data import Matrix, WeatherGroup
from skidpad.report.published import Source, read_published

BEHIND = 0.9  # times real time, below which a tick counts as slow
SLOW = "ticks_below_0_9_pct"
KINDS = {"value": "", "upper_bound": "less than ", "target": "aim "}


def real_time_blocks(matrix: Matrix) -> list[Block]:
    """Returns tables of real-time factors by weather, ours and published; empty without our clocks."""
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
            "share of ticks slower than 0.9 times real time, those of a block by its mean; mean over runs",
            "%",
            Format(".2f", absent="not measured"),
        ),
    ]
    words = Text(
        "Speed of the simulation on the machine that drove these runs, other work included. The "
        "published numbers are of another experiment: a simulator that renders twelve sensors, held "
        "back to real time, on another machine. Ours runs as fast as it can."
    )
    return [words, table(columns, groups, "Real time by weather"), _published_table()]


def _published_table() -> Block:
    """Returns the table of published factors and shares of slow ticks, by stage and group of runs."""
    rows = read_published(Source.REAL_TIME).filter(
        pl.col("quantity").is_in(["mean_rtf", SLOW])
        & pl.col("stage").is_in(["preliminary", "final"])
    )
    scopes = rows.select("stage", "scope", "source").unique(["stage", "scope"], maintain_order=True)

    def of(quantity: str, place: tuple[str, str, str]) -> str:
        stage, scope, _ = place
        here = rows.filter(stage=stage, scope=scope, quantity=quantity)
        kinds = dict(here.select("kind", "value").rows())
        if "range_low" in kinds:
            return f"{kinds['range_low']:g} to {kinds['range_high']:g}"
        return "; ".join(f"{KINDS[kind]}{value:g}" for kind, value in kinds.items())

    columns = [
        Column[tuple[str, str, str]]("published runs", lambda place: f"{place[0]}, {place[1]}"),
        Column[tuple[str, str, str]]("times real time, mean", partial(of, "mean_rtf")),
        Column[tuple[str, str, str]](f"ticks below {BEHIND:g}, %", partial(of, SLOW)),
        Column[tuple[str, str, str]]("from", lambda place: place[2]),
    ]
    note = "The share for clear weather and that for Clear Sky - Night contradict each other in the source."
    return table(columns, scopes.rows(), "Published: real time", note)


def _rows(times: pl.DataFrame, group: WeatherGroup) -> pl.DataFrame:
    """Returns the rows of a group's weathers."""
    return times.filter(pl.col("weather").is_in(group.weathers))


def _of(times: pl.DataFrame, column: str, how: str, group: WeatherGroup) -> Quantity:
    """Returns the statistic `how` ("mean", "min", ...) of a column in a group; no value if empty."""
    values = _rows(times, group)[column].drop_nulls().drop_nans()
    return Quantity(value=float(getattr(values, how)()) if len(values) else None)
