"""The static obstacles of a map as segments for contacts, with their names."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from skidpad.core.geometry import footprint
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.segments import Segments, static_segments
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import Barrier, BarrierKind, Box

FOOT = 0.3  # m below the foot line that a barrier still stops: roads are not flat


class Obstacles(NamedTuple):
    """Segments, and for each what it belongs to: "guardrail", "building", ..."""

    segments: Segments
    names: tuple[str, ...]


@lru_cache(maxsize=8)
def obstacles(map: RoadMap) -> Obstacles:
    """Everything solid beside the road; kerbs can be driven over."""
    lines: list[tuple[float, float, float, float]] = []
    low: list[float] = []
    high: list[float] = []
    names: list[str] = []
    for barrier in map.roadside.barriers:
        if barrier.kind is not BarrierKind.KERB:
            _add_barrier(barrier, lines, low, high, names)
    for box in map.roadside.boxes:
        if box.solid:
            _add_box(box, lines, low, high, names)
    array = np.array(lines, dtype=np.float64).reshape(-1, 4)
    return Obstacles(static_segments(array, np.array(low), np.array(high)), tuple(names))


def _add_barrier(
    barrier: Barrier,
    lines: list[tuple[float, float, float, float]],
    low: list[float],
    high: list[float],
    names: list[str],
) -> None:
    for a, b in zip(barrier.points[:-1], barrier.points[1:], strict=True):
        lines.append((float(a[0]), float(a[1]), float(b[0]), float(b[1])))
        low.append(float(min(a[2], b[2])) - FOOT)
        high.append(float(max(a[2], b[2])) + barrier.height)
        names.append(barrier.kind.name.lower())


def _add_box(
    box: Box,
    lines: list[tuple[float, float, float, float]],
    low: list[float],
    high: list[float],
    names: list[str],
) -> None:
    corners = footprint(box.x, box.y, box.yaw, box.length, box.width)
    for k in range(4):
        (x0, y0), (x1, y1) = corners[k].tolist(), corners[(k + 1) % 4].tolist()
        lines.append((x0, y0, x1, y1))
        low.append(box.z)
        high.append(box.z + box.height)
        names.append(SemanticClass(box.label).name.lower())
