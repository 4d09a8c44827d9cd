"""Figures of the matrix report (A-259)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

from skidpad.evidence.statistics import Rate
from skidpad.report.elements.figures import (
    POINTS,
    Chart,
    Curve,
    Series,
    curves,
    cut_note,
    grouped_bars,
    panel,
)
from skidpad.report.elements.page import Block, Figure
from skidpad.report.matrix.answers import MARKERS, ends
from skidpad.report.matrix.data import (
    EVENTS,
    IN_SENTENCES,
    Matrix,
    WeatherGroup,
    config_title,
    mean_of,
    rate_by_seed,
)
from skidpad.report.matrix.tables import METRICS

PANEL = (
    (EVENTS, EVENTS),
    *(
        (name, METRICS[name].heading)
        for name in ("dropout_pct", "mean_error_m", "headway_variance_m2", "radar_fpr_pct")
    ),
)
GREY = 5  # of the palette


def collisions(matrix: Matrix) -> list[Block]:
    """Returns figures of crashes by weather and configuration, and by configuration."""
    label = f"{EVENTS} per run"
    by_weather = [
        _rates(
            short_title(c),
            [rate_by_seed(matrix.within(c, g), EVENTS) for g in matrix.weather_groups],
        )
        for c in matrix.comparison_configs
    ]
    total = _rates("all weathers", [matrix.rate(EVENTS, c) for c in matrix.comparison_configs])
    groups = [g.short for g in matrix.weather_groups]
    return [
        Figure(
            grouped_bars(groups, by_weather, label),
            f"{EVENTS.capitalize()} per run by weather and configuration; lines are 95 % intervals."
            + cut_note(by_weather),
        ),
        Figure(
            grouped_bars([short_title(c) for c in matrix.comparison_configs], [total], label),
            "The same over all weathers, every drive once." + cut_note([total]),
        ),
    ]


def others(matrix: Matrix) -> list[Block]:
    """Returns figures of dropout, dropout against crashes, variance, and configuration 3's metrics."""
    groups = [g.short for g in matrix.weather_groups]
    dropout = [_means(matrix, c, "dropout_pct", short_title(c)) for c in matrix.comparison_configs]
    dropout = [one for one in dropout if any(v is not None for v in one.values)]
    by_weather = "Dropout by weather and configuration."
    figures = [
        *([(grouped_bars(groups, dropout, "dropout, %"), by_weather)] if dropout else []),
        (
            run_figure(matrix, "dropout_pct", "dropout, %"),
            f"Dropout against {EVENTS}, one point per drive; the mark is the weather.",
        ),
    ]
    if "4" in matrix.configs:
        variance = _means(matrix, "4", "headway_variance_m2", "configuration 4")
        caption = "Variance of the distance error by weather, configuration 4."
        figures.append((grouped_bars(groups, [variance], "variance, m²"), caption))
    if "3" in matrix.configs:
        charts = [(label, _means(matrix, "3", column, "3")) for column, label in PANEL]
        figures.append(
            (panel(groups, charts), "Configuration 3 in every weather, several metrics.")
        )
    return [Figure(svg, caption) for svg, caption in figures]


def speed_figure(matrix: Matrix) -> Figure:
    """Returns the figure of crashes per run against mean speed, a point per configuration and weather."""
    points = {}
    for config in matrix.comparison_configs:
        for group in matrix.weather_groups:
            runs = matrix.within(config, group)
            rate = rate_by_seed(runs, EVENTS)
            mean = mean_of(runs, "mean_speed_kmh")
            if rate is not None and mean is not None:
                points[config, group] = ([mean], [rate.rate])
    caption = (
        f"{EVENTS.capitalize()} against mean speed: the colour is the configuration, the mark the "
        "weather. A configuration that crashes less only because it drives slower lies lower and "
        "further left."
    )
    return Figure(_draw_marks(matrix, points, "mean speed, km/h"), caption)


def run_figure(matrix: Matrix, column: str, label: str) -> str:
    """Returns an SVG of crashes against a column, one point per drive, marked by weather."""
    points = {}
    for config in matrix.comparison_configs:
        for group in matrix.weather_groups:
            runs = matrix.within(config, group).drop_nulls([column, EVENTS])
            if len(runs):
                points[config, group] = (runs[column].to_list(), runs[EVENTS].to_list())
    return _draw_marks(matrix, points, label)


Points = dict[tuple[str, WeatherGroup], tuple[list[float], list[float]]]


def _draw_marks(matrix: Matrix, points: Points, x_label: str) -> str:
    """Returns an SVG of clouds of points: the colour is the configuration, the mark the weather."""
    marks = {g: MARKERS[k % len(MARKERS)] for k, g in enumerate(matrix.weather_groups)}
    clouds = [
        Curve(
            config_title(config),
            x,
            y,
            colour=matrix.comparison_configs.index(config),
            style=POINTS | {"marker": marks[group]},
        )
        for (config, group), (x, y) in points.items()
    ]
    return curves(
        [Chart([*clouds, *weather_marks(matrix)], x_label, f"{EVENTS} per run")], height=3.8
    )


def weather_marks(matrix: Matrix) -> list[Curve]:
    """Returns empty curves by which a legend says which mark each weather has."""
    return [
        Curve(group.title, [], [], colour=GREY, style=POINTS | {"marker": mark})
        for group, mark in zip(matrix.weather_groups, cycle(MARKERS), strict=False)
    ]


def short_title(config: str) -> str:
    """Returns "configuration 2" for a number; another driver by its name."""
    return (
        f"configuration {config}"
        if config.isdigit()
        else IN_SENTENCES.get(config, config).removeprefix("the ")
    )


def _rates(name: str, rates: Sequence[Rate | None]) -> Series:
    """Returns a series of rates with their limits; None where a rate is unknown."""
    limits = [ends(r.interval if r else None) for r in rates]
    low, high = zip(*limits, strict=True) if limits else ((), ())
    return Series(name, [r.rate if r else None for r in rates], low, high)


def _means(matrix: Matrix, config: str, column: str, name: str) -> Series:
    """Returns a series of means of `column`, one per group of weathers; None without values."""
    groups = matrix.weather_groups
    return Series(name, [mean_of(matrix.within(config, group), column) for group in groups])
