"""What each step of automation changes: neighbouring configurations, paired and tested as one family."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import polars as pl

from skidpad.core.text.wording import count_text
from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import EVER_SIGNIFICANT, compare_pairs, holm
from skidpad.evidence.statistics_text import p_text
from skidpad.report.elements.page import Block, Cell, Text
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.comparisons.contrasts import ALPHA, BY_RUN
from skidpad.report.matrix.data import INTERVENTIONS, Matrix, config_title
from skidpad.report.matrix.tables import METRICS

STEPS = (("1", "2"), ("2", "3"), ("3", "4"), ("2", "4"))
WORSE_UP = (INTERVENTIONS, "lane_invasions", "dropout_pct", "ttc_below_1_5_s", "mean_error_m")
STEP_COLUMNS = (
    INTERVENTIONS,
    "lane_invasions",
    "mean_speed_kmh",
    "dropout_pct",
    "ttc_below_1_5_s",
    "mean_error_m",
    "headway_variance_m2",
)


def step_blocks(matrix: Matrix) -> list[Block]:
    """Returns the table of what each step of STEPS changes, paired by weather and seed; or nothing.

    A sentence instead where EVER_SIGNIFICANT seeds are missing.
    """
    if matrix.seeds < EVER_SIGNIFICANT:
        return [Text(few_seeds_text(matrix.seeds))]
    intro = Text(
        "The difference that each step makes, paired by weather and seed: second minus first "
        "configuration. The step from 2 to 4 adds traffic-light assist, resume protocol and limiter at once."
    )
    there = [step for step in STEPS if {*step} <= {*matrix.configs}]
    found = step_differences(matrix, there)
    columns = [
        Column[tuple[str, str]](
            "step", lambda step: Cell(" to ".join(step), note=config_title(step[1])[4:])
        ),
        *(
            Column[tuple[str, str]](
                metric.title,
                partial(_found_step, found, name),
                metric.meaning,
                metric.unit,
                format=Format("+.2f", absent="no pairs"),
            )
            for name, metric in ((name, METRICS[name]) for name in STEP_COLUMNS)
        ),
    ]
    note = (
        f"Small: 95 % interval of each difference alone, and its p corrected for all {len(found)} of "
        "this table (Holm); only what is below 0.05 is marked."
    )
    return [intro, table(columns, there, "Paired differences per run", note)] if there else []


def few_seeds_text(seeds: int) -> str:
    """Returns the sentence that stands in place of what so few seeds cannot fill."""
    return (
        f"{count_text(seeds, 'seed')} per cell cannot show what a step changes: fewer than "
        f"{EVER_SIGNIFICANT} pairs allow no test."
    )


Differences = dict[tuple[str, tuple[str, str]], Quantity]


def _found_step(found: Differences, column: str, step: tuple[str, str]) -> Quantity:
    """Returns the difference found for a column and a step; no value where there is none."""
    return found.get((column, step), Quantity(value=None))


def step_differences(matrix: Matrix, steps: Sequence[tuple[str, str]]) -> Differences:
    """Returns the second configuration less the first by column and step, p corrected over all (Holm).

    A sign that is sure is marked better or worse, where more is worse.
    """
    found = {}
    for column in STEP_COLUMNS:
        for step in steps:
            less, more = (pl.col("config") == config for config in step)
            pairs, _ = paired_runs(matrix.finished, more, less, BY_RUN, column)
            if len(pairs):
                found[column, step] = compare_pairs(per_seed(pairs, pl.col("difference")))
    adjusted = holm([1.0 if c.p is None else c.p for c in found.values()]) if found else []
    return {
        key: Quantity(
            value=c.mean,
            interval=c.interval,
            lines=(p_text(None if c.p is None else p),),
            kind=("bad" if c.mean > 0 else "good") if p < ALPHA and key[0] in WORSE_UP else "",
            hint=count_text(c.n, "seed"),
        )
        for (key, c), p in zip(found.items(), adjusted, strict=True)
    }
