"""The preliminary against the final system: both arms of study A-278 beside what was published of them."""

from __future__ import annotations

import polars as pl

from skidpad.report.elements.figures import Series, panel
from skidpad.report.matrix.data import published_preliminary
from skidpad.report.matrix.tables import METRICS, metric_quantity

ARMS = ("preliminary", "final")


def preliminary_svg(rows: pl.DataFrame) -> str:
    """Returns a chart per quantity: means of both arms with 95 % intervals, published ones as diamonds.

    rows: the runs of study A-278, with their arm in `variant`. Quantities that they lack are left out.
    """
    charts = []
    for column, *published in published_preliminary():
        if column not in rows.columns:
            continue
        found = [metric_quantity(rows.filter(variant=arm), column) for arm in ARMS]
        series = Series(
            "ours",
            [q.value for q in found],
            low=[q.interval.low if q.interval else None for q in found],
            high=[q.interval.high if q.interval else None for q in found],
            published=published,
        )
        charts.append((METRICS[column].heading, series))
    return panel(ARMS, charts)
