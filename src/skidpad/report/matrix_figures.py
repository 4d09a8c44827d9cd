"""Figures of the matrix report (A-259)."""

from __future__ import annotations

from collections.abc import Sequence

from skidpad.evidence.statistics import Rate
from skidpad.report.figures import Series, grouped_bars, panel, scatter
from skidpad.report.matrix_data import WEATHERS, Matrix, published_preliminary, published_value
from skidpad.report.page import Block, Figure

PANEL = (
    ("fatal_collisions", "collisions"),
    ("dropout_pct", "dropout, %"),
    ("mean_error_m", "mean error, m"),
    ("headway_variance_m2", "variance, m²"),
    ("radar_fpr_pct", "radar FPR, %"),
)


def collisions(matrix: Matrix) -> list[Block]:
    """By weather and configuration, and by configuration."""
    column, label = "fatal_collisions", "fatal collisions per run"
    by_weather = [
        _rates(c, [matrix.rate(column, c, w) for w in matrix.weathers], _said(matrix, c, column))
        for c in matrix.configs
    ]
    total = _rates(
        "all weathers",
        [matrix.rate(column, c) for c in matrix.configs],
        [_mean([published_value(column, c, w) for w in WEATHERS]) for c in matrix.configs],
    )
    return [
        Figure(
            grouped_bars(_groups(matrix), by_weather, label),
            "Fatal collisions per run by weather and configuration; lines are 95 % intervals, "
            "diamonds the published counts.",
        ),
        Figure(
            grouped_bars(matrix.configs, [total], label),
            "The same over all weathers, every drive once.",
        ),
    ]


def others(matrix: Matrix) -> list[Block]:
    """Dropout, dropout against collisions, variance, the panel, preliminary against final."""
    dropout = [_means(matrix, c, "dropout_pct", c) for c in matrix.configs]
    figures = [
        (
            grouped_bars(_groups(matrix), dropout, "dropout, %"),
            "Dropout by configuration and weather; diamonds published.",
        ),
        (
            _dropout_against_collisions(matrix),
            "Dropout against fatal collisions, one point per run.",
        ),
    ]
    if "4" in matrix.configs:
        variance = _means(matrix, "4", "headway_variance_m2", "configuration 4")
        caption = (
            "Variance of the distance error by weather, configuration 4 (published as headway "
            "variance)."
        )
        figures.append((grouped_bars(_groups(matrix), [variance], "variance, m²"), caption))
    if "3" in matrix.configs:
        charts = [(label, _means(matrix, "3", column, "3")) for column, label in PANEL]
        caption = "Configuration 3 in every weather, several metrics; diamonds published."
        figures.append((panel(matrix.weathers, charts), caption))
    caption = (
        "Published: preliminary against final script, means over the eleven clear runs that both "
        "have. Run `skidpad adas --profile preliminary` for ours."
    )
    figures.append((_preliminary(), caption))
    return [Figure(svg, caption) for svg, caption in figures]


def _groups(matrix: Matrix) -> list[str]:
    """Short labels for axes."""
    return [w.replace("-", "\n", 1) for w in matrix.weathers]


def _rates(name: str, rates: Sequence[Rate | None], published: Sequence[float | None]) -> Series:
    return Series(
        name,
        [r.rate if r else None for r in rates],
        [r.interval.low if r and r.interval else None for r in rates],
        [r.interval.high if r and r.interval else None for r in rates],
        published,
    )


def _means(matrix: Matrix, config: str, column: str, name: str) -> Series:
    means = [matrix.mean(column, config, w) for w in matrix.weathers]
    return Series(name, means, published=_said(matrix, config, column))


def _said(matrix: Matrix, config: str, column: str) -> list[float | None]:
    return [published_value(column, config, w) for w in matrix.weathers]


def _mean(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return sum(known) / len(known) if known else None


def _dropout_against_collisions(matrix: Matrix) -> str:
    points = []
    for c in matrix.configs:
        runs = matrix.cell(c).drop_nulls(["dropout_pct", "fatal_collisions"])
        points.append((c, runs["dropout_pct"].to_list(), runs["fatal_collisions"].to_list()))
    return scatter(points, "dropout, %", "fatal collisions per run")


def _preliminary() -> str:
    charts = [
        (label, Series(label, [before, after])) for label, before, after in published_preliminary()
    ]
    return panel(["preliminary", "final"], charts)
