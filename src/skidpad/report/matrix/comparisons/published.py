"""The published numbers beside ours, apart from everything else, with what differs said first."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from skidpad.core.text.wording import list_text
from skidpad.report.elements.figures import Series, grouped_bars, panel
from skidpad.report.elements.page import Block, Figure, Text
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.matrix.data import (
    INTERVENTIONS,
    WEATHERS,
    Matrix,
    config_title,
    mean_of,
    published_preliminary,
    published_value,
    weather_title,
)
from skidpad.report.matrix.tables import METRICS

QUANTITIES = (
    (INTERVENTIONS, "Interventions per run", "published as total collisions"),
    ("dropout_pct", "Dropout, %", "ticks without a target or persisting"),
    ("mean_error_m", "Mean distance error, m", ""),
    ("headway_variance_m2", "Variance of the distance error, m²", "published as headway variance"),
    ("radar_fpr_pct", "Radar false positives, %", "after the lane check"),
    ("radar_fnr_pct", "Radar false negatives, %", "after the lane check"),
    ("mean_speed_kmh", "Mean speed, km/h", ""),
)
PUBLISHED = {  # column of results: what the published experiment had, in words
    "profile": (("thesis_text", "thesis_listing"), "the thesis's settings"),
    "traffic": (("fixed",), "vehicles at fixed places"),
    "sensors": (("pixels",), "camera images"),
    "map": (("Town04",), "the map Town04"),
}


def differences(matrix: Matrix) -> list[str]:
    """Returns in what these runs differ from the published experiment, besides the simulator; or nothing."""
    found = []
    for column, (values, words) in PUBLISHED.items():
        here = {str(v) for v in matrix.results[column].unique()}
        if not here <= set(values):
            found.append(f"{words} (here: {', '.join(sorted(here))})")
    return found


def beside_published(matrix: Matrix) -> list[Block]:
    """Returns a table per published quantity, ours and theirs in each cell, and figures with both.

    Empty where nothing was published of these configurations and weathers.
    """
    configs = [c for c in matrix.configs if _has_published(matrix, c)]
    if not configs:
        return []
    return [
        _words(matrix),
        *(_table(matrix, configs, *quantity) for quantity in QUANTITIES),
        *_figures(matrix, configs),
    ]


def _has_published(matrix: Matrix, config: str) -> bool:
    """Returns True when some weather of the matrix has published interventions of the configuration."""
    return any(published_value(INTERVENTIONS, config, w) is not None for w in matrix.weathers)


def _words(matrix: Matrix) -> Text:
    """Returns what a reader must know before comparing; a warning where the experiment is another."""
    other = differences(matrix)
    text = (
        "The published numbers come from one run of 500 s per cell on CARLA; they have no interval. "
        "Nothing here was tuned to meet them."
    )
    if not other:
        return Text("This is the published experiment on another simulator. " + text)
    text = f"Not the published experiment: that had {list_text(other)}. {text}"
    return Text(text + " `make published` drives the published experiment.", tone="warning")


def _table(matrix: Matrix, configs: Sequence[str], column: str, caption: str, note: str) -> Block:
    """Returns the table of our means of `column` beside the published, by configuration and weather."""

    def of(weather: str, config: str) -> Quantity:
        runs = matrix.cell(config, weather).drop_nulls(column)
        return Quantity(
            value=mean_of(runs, column),
            published=published_value(column, config, weather),
        )

    columns = [
        Column[str]("configuration", config_title),
        *(
            Column[str](weather_title(w), partial(of, w), w, format=Format(".2f", absent="no run"))
            for w in matrix.weathers
            if w in WEATHERS
        ),
    ]
    return table(columns, configs, f"{caption}, ours and published", note)


def _figures(matrix: Matrix, configs: Sequence[str]) -> list[Block]:
    """Returns figures of interventions, dropout, and published preliminary against final means."""
    weathers = [w for w in matrix.weathers if w in WEATHERS]
    groups = [w.replace("-", "\n", 1) for w in weathers]
    figures: list[Block] = []
    for column, per, caption in (
        (INTERVENTIONS, " per run", "Interventions (bars) and published collisions (diamonds)."),
        ("dropout_pct", "", "Dropout (bars) and the published dropout (diamonds)."),
    ):  # fmt: skip
        series = [
            Series(
                f"configuration {c}",
                [mean_of(matrix.cell(c, w), column) for w in weathers],
                published=[published_value(column, c, w) for w in weathers],
            )
            for c in configs
        ]
        figures.append(Figure(grouped_bars(groups, series, METRICS[column].heading + per), caption))
    charts = [
        (METRICS[column].heading, Series(column, [before, after]))
        for column, before, after in published_preliminary()
    ]
    caption = (
        "Published alone: preliminary against final script, means over the eleven clear runs that "
        "both have. `skidpad study A-278 --figure FILE.svg` drives both here and draws ours beside these."
    )
    return [*figures, Figure(panel(["preliminary", "final"], charts), caption)]
