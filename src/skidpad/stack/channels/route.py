"""The way that navigation gives to every channel: one line of points over many lanes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.kernels.jit import kernel
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap

STEP = 1.0  # m between two points
UNSIGNED_LIMIT = mps_from_kmh(50.0)  # urban default where the map gives none (Vienna Convention)
SEARCH = 40  # points around the last place in which the next one is looked for


class PathPoints(NamedTuple):
    """Columns of a path for kernels; arrays (n,), STEP apart."""

    x: Floats
    y: Floats
    z: Floats
    heading: Floats  # rad, continuous
    curvature: Floats  # 1/m
    limit: Floats  # m/s


@dataclass(frozen=True, slots=True)
class Line:
    """A light, stop or yield line on the path."""

    s: float  # m along the path
    kind: SignalKind
    signal: int  # id in the map


@dataclass(frozen=True, slots=True)
class RoutePath:
    """A route as a line of points and the lines that cross it."""

    points: PathPoints
    lines: tuple[Line, ...]  # by s
    lanes: tuple[int, ...]
    starts: tuple[float, ...]  # m along the path where each lane begins

    @property
    def length(self) -> float:
        """Returns the length of the path in m."""
        return (len(self.points.x) - 1) * STEP


def route_path(map: RoadMap, lanes: Sequence[int], s_start: float = 0.0) -> RoutePath:
    """Returns the centre line of lanes that follow each other, from `s_start` m along the first.

    ConfigError where a lane does not follow the one before. UNSIGNED_LIMIT where the map gives none.
    """
    rows, starts, lines, s = [], [], [], -s_start
    for i, lane in enumerate(lanes):
        if i and lane not in map.successors(lanes[i - 1]):
            raise ConfigError(f"route: lane {lane} does not follow lane {lanes[i - 1]}")
        starts.append(s)
        lines += _lines(map, lane, s)
        first, size = int(map.lanes.first[lane]), int(map.lanes.size[lane])
        p = map.samples
        at = slice(first, first + size - 1)  # the last point is the next lane's first
        heading = p.heading[at]
        rows.append(
            np.column_stack(
                [s + p.s[at], p.x[at], p.y[at], p.z[at], heading, p.curvature[at], p.limit[at]]
            )
        )
        s += float(map.lanes.length[lane])
    raw = np.concatenate(rows)
    raw[:, 4] = np.unwrap(raw[:, 4])
    raw[np.isnan(raw[:, 6]), 6] = UNSIGNED_LIMIT
    at_s = np.arange(0.0, raw[-1, 0], STEP)
    columns = [np.interp(at_s, raw[:, 0], raw[:, k]) for k in range(1, 7)]
    kept = tuple(sorted((x for x in lines if x.s > 0.0), key=lambda line: line.s))
    return RoutePath(PathPoints(*columns), kept, tuple(lanes), tuple(starts))


def _lines(map: RoadMap, lane: int, start: float) -> list[Line]:
    """Returns the lines of lights, stop and yield signs on a lane that begins at `start` m of the path."""
    table = map.signals
    kinds = (SignalKind.LIGHT, SignalKind.STOP, SignalKind.YIELD)
    return [
        Line(start + float(table.s[row]), SignalKind(int(table.kind[row])), int(table.id[row]))
        for row in np.flatnonzero((table.lane == lane) & np.isin(table.kind, kinds))
    ]


@kernel
def locate(path: PathPoints, x: float, y: float, near: int, search: int) -> tuple[int, float]:
    """Returns the path point nearest to (x, y), and the m by which that lies left of the path there.

    Only points within `search` of point `near` are looked at.
    """
    best, best_d = near, np.inf
    for k in range(max(near - search, 0), min(near + search + 1, path.x.size)):
        d = (path.x[k] - x) ** 2 + (path.y[k] - y) ** 2
        if d < best_d:
            best, best_d = k, d
    h = path.heading[best]
    return best, -np.sin(h) * (x - path.x[best]) + np.cos(h) * (y - path.y[best])


def draw_route(
    map: RoadMap, start: int, length: float, rng: np.random.Generator
) -> tuple[int, ...]:
    """Returns lanes from `start` on for at least `length` m, turns drawn by `rng`; shorter at a dead end."""
    lanes, total = [start], float(map.lanes.length[start])
    while total < length:
        ways = [n for n in map.successors(lanes[-1]) if map.arrays.drivable[n]]
        if not ways:
            break
        lane = ways[int(rng.integers(len(ways)))]
        lanes.append(lane)
        total += float(map.lanes.length[lane])
    return tuple(lanes)
