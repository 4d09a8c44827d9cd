"""A map seen from above, for people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.geometry import footprint
from skidpad.roads.lanes import LaneKind, SignalKind
from skidpad.roads.queries import RoadMap

COLOURS = {
    LaneKind.DRIVING: "#5b6168",
    LaneKind.RAMP: "#6b7178",
    LaneKind.SHOULDER: "#8d9298",
    LaneKind.SIDEWALK: "#d9c9a8",
    LaneKind.PARKING: "#a9b7c6",
    LaneKind.MEDIAN: "#a8c090",
}
SIGNALS = {SignalKind.LIGHT: "#d62728", SignalKind.STOP: "#9467bd", SignalKind.YIELD: "#ff7f0e"}


def draw(map: RoadMap, path: Path, kind: str) -> None:
    """Writes a picture of lanes, roadside objects, signals and the ego's start to a file.

    kind: format, as matplotlib names it: "png", "svg".
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14, 10), layout="constrained")
    axes = figure.add_subplot()
    # Low roads first, so that a bridge lies on top.
    z_lane = map.samples.z[map.lanes.first]
    for lane in np.argsort(z_lane, kind="stable").tolist():
        _lane(axes, map, lane)
    for barrier in map.roadside.barriers:
        axes.plot(barrier.points[:, 0], barrier.points[:, 1], color="#444444", lw=0.4)
    for box in map.roadside.boxes:
        corners = footprint(box.x, box.y, box.yaw, box.length, box.width)
        axes.fill(corners[:, 0], corners[:, 1], color=tuple(c / 255 for c in box.rgb))
    for walk in map.roadside.crosswalks:
        axes.fill(walk[:, 0], walk[:, 1], color="white", alpha=0.8)
    for space in map.roadside.parking:
        corners = footprint(space.x, space.y, space.yaw, space.length, space.width)
        axes.fill(corners[:, 0], corners[:, 1], fill=False, ec="white", lw=0.5)
    _signals(axes, map)
    if map.ego_start is not None:
        ego = map.place(map.ego_start)
        axes.plot(ego.x, ego.y, marker=(3, 0, np.degrees(ego.heading) - 90), color="#1f77b4", ms=9)
    axes.set_aspect("equal")
    axes.set_xlabel("x in m")
    axes.set_ylabel("y in m")
    axes.set_title(map.name)
    figure.savefig(path, dpi=110, format=kind)


def _lane(axes: Any, map: RoadMap, lane: int) -> None:
    """Draws a lane's area, and its centreline where it is drivable."""
    first = int(map.lanes.first[lane])
    rows = slice(first, first + int(map.lanes.size[lane]))
    x, y, heading = map.samples.x[rows], map.samples.y[rows], map.samples.heading[rows]
    half = 0.5 * map.samples.width[rows]
    dx, dy = -np.sin(heading) * half, np.cos(heading) * half
    colour = COLOURS.get(LaneKind(int(map.lanes.kind[lane])), "#c8ccc4")
    axes.fill(np.r_[x + dx, (x - dx)[::-1]], np.r_[y + dy, (y - dy)[::-1]], color=colour, lw=0)
    if map.arrays.drivable[lane]:
        axes.plot(x, y, color="#e8e8e8", lw=0.25)


def _signals(axes: Any, map: RoadMap) -> None:
    """Draws a line across its lane for every signal of a drawn kind."""
    for kind, colour in SIGNALS.items():
        for row in np.flatnonzero(map.signals.kind == kind).tolist():
            line = map.at(int(map.signals.lane[row]), float(map.signals.s[row]))
            dx, dy = -np.sin(line.heading) * line.width / 2, np.cos(line.heading) * line.width / 2
            axes.plot([line.x - dx, line.x + dx], [line.y - dy, line.y + dy], color=colour, lw=1.5)
