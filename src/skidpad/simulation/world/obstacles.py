"""The static obstacles of a map as segments for contacts, with their names."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from skidpad.core.geometry import footprint
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.segments import Segments, static_segments
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import Barrier, BarrierKind, Box

FOOT = 0.3  # m below the foot line that a barrier still stops: roads are not flat


BARRIERS = {  # kerbs can be driven over
    BarrierKind.GUARDRAIL: SemanticClass.GUARD_RAIL,
    BarrierKind.WALL: SemanticClass.WALL,
    BarrierKind.FENCE: SemanticClass.FENCE,
}


class Obstacles(NamedTuple):
    """Segments, and for each what it belongs to: "guardrail", "building", ... and its class."""

    segments: Segments
    names: tuple[str, ...]
    labels: tuple[SemanticClass, ...]


class _Segment(NamedTuple):
    line: tuple[float, float, float, float]
    low: float
    high: float
    name: str
    label: SemanticClass


@lru_cache(maxsize=8)
def obstacles(map: RoadMap) -> Obstacles:
    """Returns everything solid beside the roads of a map."""
    found = [s for b in map.roadside.barriers if b.kind in BARRIERS for s in _of_barrier(b)]
    found += [s for b in map.roadside.boxes if b.solid for s in _of_box(b)]
    lines = np.array([s.line for s in found], dtype=np.float64).reshape(-1, 4)
    low, high = np.array([s.low for s in found]), np.array([s.high for s in found])
    return Obstacles(
        static_segments(lines, low, high),
        tuple(s.name for s in found),
        tuple(s.label for s in found),
    )


def _of_barrier(barrier: Barrier) -> Iterator[_Segment]:
    """Yields a wall segment for each piece of a barrier, with its heights in m."""
    for a, b in pairwise(barrier.points):
        yield _Segment(
            (float(a[0]), float(a[1]), float(b[0]), float(b[1])),
            float(min(a[2], b[2])) - FOOT,
            float(max(a[2], b[2])) + barrier.height,
            barrier.kind.name.lower(),
            BARRIERS[barrier.kind],
        )


def _of_box(box: Box) -> Iterator[_Segment]:
    """Yields the four wall segments around the footprint of a box."""
    label = SemanticClass(box.label)
    corners = footprint(box.x, box.y, box.yaw, box.length, box.width).tolist()
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True):
        line = (x0, y0, x1, y1)
        yield _Segment(line, box.z, box.z + box.height, label.name.lower(), label)
