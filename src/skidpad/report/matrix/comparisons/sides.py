"""Two configurations side by side: one table of both and their difference, one figure by weather."""

from __future__ import annotations

from functools import partial

import polars as pl

from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import UNITS_FROM, compare_pairs
from skidpad.evidence.statistics_text import no_limits_text
from skidpad.report.elements.campaign import Metric
from skidpad.report.elements.figures import Series, grouped_bars
from skidpad.report.elements.page import Block, Cell, Figure
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.comparisons.contrasts import BY_RUN
from skidpad.report.matrix.data import EVENTS, INTERVENTIONS, Matrix, config_title, rate_by_seed
from skidpad.report.matrix.tables import METRICS, metric_quantity

SIDES = (("1", "2"), ("2", "4"))  # as the source sets them side by side
ROWS = (
    "serious_contacts",
    "road_departures",
    INTERVENTIONS,
    "lane_invasions",
    "mean_speed_kmh",
    "bend_speed_kmh",
    "dropout_pct",
    "mean_error_m",
    "headway_variance_m2",
    "radar_fpr_pct",
    "radar_fnr_pct",
    "ttc_below_1_5_s",
)


def side_blocks(matrix: Matrix) -> list[Block]:
    """Returns a table and a figure for each pair of SIDES of which both were driven."""
    there = [pair for pair in SIDES if {*pair} <= {*matrix.configs}]
    return [block for pair in there for block in (_table(matrix, *pair), _figure(matrix, *pair))]


def _table(matrix: Matrix, first: str, second: str) -> Block:
    """Returns the table of means over seeds of both configurations, and their paired difference."""
    columns = [
        Column[Metric]("metric", lambda m: Cell(m.heading, note=m.meaning)),
        *(
            Column[Metric](config_title(c), partial(_mean, matrix, c), format=Format())
            for c in (first, second)
        ),
        Column[Metric](
            f"{second} minus {first}",
            partial(_difference, matrix, first, second),
            "paired by weather and seed",
            format=Format("+.2f", absent="no pairs"),
        ),
    ]
    rows = [METRICS[name] for name in ROWS]
    note = "Means over seeds, every drive once; small: 95 % interval of each number alone."
    return table(columns, rows, f"Configuration {first} and configuration {second}", note, False)


def _mean(matrix: Matrix, config: str, metric: Metric) -> Quantity:
    """Returns the metric's mean in all runs of a configuration, with its interval."""
    return metric_quantity(matrix.cell(config), metric.name)


def _difference(matrix: Matrix, first: str, second: str, metric: Metric) -> Quantity:
    """Returns the metric's paired mean difference, second less first; no value without pairs."""
    less, more = (pl.col("config") == config for config in (first, second))
    pairs, _ = paired_runs(matrix.finished, more, less, BY_RUN, metric.name)
    if not len(pairs):
        return Quantity(value=None)
    c = compare_pairs(per_seed(pairs, pl.col("difference")))
    few = "" if c.interval or matrix.seeds < UNITS_FROM else no_limits_text(c.n, "seed")
    return Quantity(value=c.mean, interval=c.interval, remark=few)


def _figure(matrix: Matrix, first: str, second: str) -> Figure:
    """Returns the figure of crashes per run of both configurations by weather."""
    series = [
        Series(
            config_title(config),
            [
                None if rate is None else rate.rate
                for group in matrix.weather_groups
                for rate in [rate_by_seed(matrix.within(config, group), EVENTS)]
            ],
        )
        for config in (first, second)
    ]
    groups = [g.short for g in matrix.weather_groups]
    caption = f"{EVENTS.capitalize()} of configurations {first} and {second} by weather."
    return Figure(grouped_bars(groups, series, f"{EVENTS} per run"), caption)
