"""Where the runs went and where they crashed: the ways of one seed on the map, and all crashes found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.report.crashes.cards import Found
from skidpad.report.elements.figures import FRAME, Chart, Curve, curves
from skidpad.report.elements.page import Block, Figure
from skidpad.report.matrix.answers import MARKERS
from skidpad.report.matrix.crashes import Cell
from skidpad.report.matrix.data import Matrix, config_title
from skidpad.report.matrix.figures import weather_marks
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap

JUMP = 20.0  # m between two points that are drawn, beyond which the car was put back
THINNED = 10  # ticks between the points of a way
GREY = 5  # of the palette


def way_blocks(matrix: Matrix, crashes: Mapping[Cell, Sequence[Found]]) -> list[Block]:
    """Returns a figure of first ways and places of crashes on the map; empty where no log was kept."""
    ways = {config: way for config in matrix.comparison_configs for way in _ways(matrix, config)}
    if not ways:
        return []
    road_map = next(iter(ways.values()))[1]
    lines = [
        Curve(
            "lanes", *_centre_lines(road_map), colour=GREY, style={"linewidth": 0.6, "color": FRAME}
        )
    ]
    for config, (way, _) in ways.items():
        colour = matrix.comparison_configs.index(config)
        style = {"linewidth": 1.0, "alpha": 0.8}
        lines.append(Curve(config_title(config), way[:, 0], way[:, 1], colour=colour, style=style))
    lines += [*_marks(matrix, crashes), *weather_marks(matrix)]
    chart = Chart(lines, "m east", "m north", equal=True)
    first = matrix.weather_groups[0]
    caption = (
        f"Ways of the first seed in {first.name}, a line for each configuration, and the places of "
        "the crashes whose logs were read; the colour is the configuration, the mark the weather."
    )
    return [Figure(curves([chart], width=8.4, height=6.4), caption)]


def _ways(matrix: Matrix, config: str) -> list[tuple[Floats, RoadMap]]:
    """Returns the way of a configuration's first seed in the first weathers, with its map; or nothing."""
    runs = matrix.within(config, matrix.weather_groups[0]).sort("seed").head(1)
    for name in matrix.names(runs):
        folder = matrix.folder.log(name)
        if folder is not None:
            log, road_map = matrix.log(folder)
            return [(broken_way(log.actors.x[:, 0], log.actors.y[:, 0]), road_map)]
    return []


def broken_way(x: NDArray[np.floating], y: NDArray[np.floating]) -> Floats:
    """Returns (n, 2) points of a way in m, every THINNED-th, with nan wherever the car was put elsewhere."""
    points = np.column_stack([x[::THINNED], y[::THINNED]]).astype(np.float64)
    far = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > JUMP) + 1
    return np.insert(points, far, np.nan, axis=0)


def _centre_lines(road_map: RoadMap) -> tuple[Floats, Floats]:
    """Returns x and y in m of the middle of all driving lanes, parted by nan."""
    samples, lanes = road_map.samples, road_map.lanes
    driven = np.isin(lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP))
    spans = zip(lanes.first[driven], lanes.size[driven], strict=True)
    parts = [np.append(np.arange(first, first + size), -1) for first, size in spans]
    rows = np.concatenate(parts)
    x, y = (np.where(rows < 0, np.nan, values[rows]) for values in (samples.x, samples.y))
    return x, y


def _marks(matrix: Matrix, crashes: Mapping[Cell, Sequence[Found]]) -> list[Curve]:
    """Returns a cloud of places of crashes per configuration and weather."""
    found = []
    for (config, weather), items in crashes.items():
        if config not in matrix.comparison_configs or not items:
            continue
        group = next(k for k, g in enumerate(matrix.weather_groups) if weather in g.weathers)
        rows = [(drive.log.actors, drive.row(crash.tick)) for crash, drive, _, _ in items]
        x, y = ([float(getattr(a, axis)[row, 0]) for a, row in rows] for axis in "xy")
        found.append(
            Curve(
                config_title(config),
                x,
                y,
                colour=matrix.comparison_configs.index(config),
                style={
                    "marker": MARKERS[group % len(MARKERS)],
                    "linestyle": "none",
                    "markersize": 7,
                    "markeredgecolor": "black",
                },
            )
        )
    return found
