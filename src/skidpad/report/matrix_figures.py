"""Figures of the matrix report (A-259)."""

from __future__ import annotations

from collections.abc import Sequence

from skidpad.report.figures import Series, grouped_bars, panel, scatter
from skidpad.report.matrix_data import Matrix, groups_of, published_cells, published_preliminary
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
    said = published_cells()
    by_weather = [
        _rates(
            matrix,
            c,
            [
                said[c, w].get("fatal_collisions") if (c, w) in said else None
                for w in matrix.weathers
            ],
        )
        for c in matrix.configs
    ]
    totals = [matrix.rate("fatal_collisions", c) for c in matrix.configs]
    published = [
        _mean([p.get("fatal_collisions") for (c, _), p in said.items() if c == config])
        for config in matrix.configs
    ]
    total = Series(
        "all weathers",
        [r.rate if r else None for r in totals],
        [r.interval.low if r else None for r in totals],
        [r.interval.high if r else None for r in totals],
        published,
    )
    return [
        Figure(
            grouped_bars(groups_of(matrix.weathers), by_weather, "fatal collisions per run"),
            "Fatal collisions per run by weather and configuration; lines are 95 % intervals, "
            "diamonds the published counts.",
        ),
        Figure(
            grouped_bars(matrix.configs, [total], "fatal collisions per run"),
            "The same over all weathers, every drive once.",
        ),
    ]


def others(matrix: Matrix) -> list[Block]:
    """Dropout, dropout against collisions, variance, the panel, preliminary against final."""
    dropout = [
        Series(
            c,
            [matrix.mean("dropout_pct", c, w) for w in matrix.weathers],
            published=_said(matrix, c, "dropout_pct"),
        )
        for c in matrix.configs
    ]
    blocks: list[Block] = [
        Figure(
            grouped_bars(groups_of(matrix.weathers), dropout, "dropout, %"),
            "Dropout by configuration and weather; diamonds published.",
        ),
        Figure(
            _dropout_against_collisions(matrix),
            "Dropout against fatal collisions, one point per run.",
        ),
    ]
    if "4" in matrix.configs:
        variance = Series(
            "configuration 4",
            [matrix.mean("headway_variance_m2", "4", w) for w in matrix.weathers],
            published=_said(matrix, "4", "headway_variance_m2"),
        )
        blocks.append(
            Figure(
                grouped_bars(groups_of(matrix.weathers), [variance], "variance, m²"),
                "Variance of the distance error by weather, configuration 4 (published as headway variance).",
            )
        )
    if "3" in matrix.configs:
        charts = [
            (
                label,
                Series(
                    "3",
                    [matrix.mean(column, "3", w) for w in matrix.weathers],
                    published=_said(matrix, "3", column),
                ),
            )
            for column, label in PANEL
        ]
        blocks.append(
            Figure(
                panel(list(matrix.weathers), charts),
                "Configuration 3 in every weather, several metrics; diamonds published.",
            )
        )
    blocks.append(
        Figure(
            _preliminary(),
            "Published: preliminary against final script, means over the eleven clear runs that both "
            "have. Run `skidpad adas --profile preliminary` for ours.",
        )
    )
    return blocks


def _rates(matrix: Matrix, config: str, published: Sequence[float | None]) -> Series:
    rates = [matrix.rate("fatal_collisions", config, w) for w in matrix.weathers]
    return Series(
        config,
        [r.rate if r else None for r in rates],
        [r.interval.low if r else None for r in rates],
        [r.interval.high if r else None for r in rates],
        published,
    )


def _said(matrix: Matrix, config: str, column: str) -> list[float | None]:
    said = published_cells()
    return [said[config, w].get(column) if (config, w) in said else None for w in matrix.weathers]


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
