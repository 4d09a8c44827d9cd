"""What was varied beside the published configurations: functions and cruise target, as factors."""

from __future__ import annotations

from functools import partial

import polars as pl

from skidpad.evidence.statistics import event_rate
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import Block, Figure
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.data import CONFIGS, EVENTS, Matrix
from skidpad.report.matrix.tables import RATE, mean_quantity, rate_quantity

Level = tuple[str, float]  # functions, cruise target in km/h
COUNTS = (
    ("crashes_vehicle", "crashes with vehicles per run"),
    ("road_departures", "departures per run"),
    (EVENTS, f"{EVENTS} per run"),
)


def factors(matrix: Matrix) -> list[Block]:
    """Returns tables of functions and targets, none when only published configurations were driven."""
    if all(config in CONFIGS for config in matrix.configs):
        return []
    levels = sorted(set(_known_runs(matrix).select("functions", "cruise_kmh").rows()))
    if not levels:
        return []
    return [_table(matrix, levels), *_figure(matrix, levels)]


def _known_runs(matrix: Matrix) -> pl.DataFrame:
    """Runs of our own stack, each drive once."""
    return matrix.counted.filter(pl.col("cruise_kmh").is_not_null())


def _runs(matrix: Matrix, level: Level) -> pl.DataFrame:
    """Returns the known runs with this level's functions and cruise target in km/h."""
    return _known_runs(matrix).filter(
        (pl.col("functions") == level[0]) & (pl.col("cruise_kmh") == level[1])
    )


def _table(matrix: Matrix, levels: list[Level]) -> Block:
    """Returns the table of counts per run and of mean speed by functions and cruise target."""
    columns = [
        Column[Level]("functions", lambda level: level[0] or "none"),
        Column[Level]("cruise target, km/h", lambda level: f"{level[1]:g}"),
        *(
            Column[Level](title, partial(_count, matrix, name), format=RATE)
            for name, title in COUNTS
        ),
        Column[Level]("mean speed, km/h", partial(_mean, matrix), format=Format()),
    ]
    note = "Over all weathers, every drive once; small: 95 % interval."
    return table(columns, levels, "By functions and cruise target", note)


def _count(matrix: Matrix, column: str, level: Level) -> Quantity:
    """Returns the rate of events per run in `column` at a level; no value without runs."""
    counts = _runs(matrix, level)[column].drop_nulls()
    return rate_quantity(event_rate(counts.to_list()) if len(counts) else None)


def _mean(matrix: Matrix, level: Level) -> Quantity:
    """Returns the mean speed in km/h over the runs at a level."""
    return mean_quantity(_runs(matrix, level), "mean_speed_kmh")


def _figure(matrix: Matrix, levels: list[Level]) -> list[Block]:
    """Returns a figure of crashes per run over cruise target, a curve per set of functions; or nothing."""
    found = []
    for functions in sorted({functions for functions, _ in levels}):
        targets = [cruise for f, cruise in levels if f == functions]
        if len(targets) > 1:
            rates = [_count(matrix, EVENTS, (functions, v)).value for v in targets]
            there = [(v, r) for v, r in zip(targets, rates, strict=True) if r is not None]
            if there:
                x, y = zip(*there, strict=True)
                found.append(Curve(functions or "none", x, y))
    if not found:
        return []
    chart = Chart(found, "cruise target, km/h", f"{EVENTS} per run")
    return [
        Figure(curves([chart], height=3.6), f"{EVENTS.capitalize()} against the cruise target.")
    ]
