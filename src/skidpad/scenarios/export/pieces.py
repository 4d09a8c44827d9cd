"""Recorded motion in pieces that every player follows alike.

esmini merges vertices of a trajectory that lie nearer than 0.1 m (`--traj_filter`, its default; never
the first and the last one, so none of two). So a piece has near vertices at its end only, and who
moves slower than that is led from piece to piece.
Source: PolyLineShape::FinalizeVertices of esmini 3.6, RoadManager.cpp.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import hypot
from typing import NamedTuple

import numpy as np

NEAR = 0.105  # m, 5 mm more than the radius of esmini's filter
SHIFT_MAX = 0.001  # m, that leaving a vertex out may cost
TURN_MAX = 0.002  # rad
HELD_MAX = 1.0  # s between vertices of what moves


class Vertex(NamedTuple):
    """A place and when it is reached: s, m, rad."""

    t: float
    x: float
    y: float
    z: float
    h: float


def pieces(vertices: Sequence[Vertex], sparse: bool = False) -> list[list[Vertex]]:
    """Returns the motion as trajectories that follow each other; where one ends the next begins.

    Vertices that say no more than their neighbours are left out where they are near; sparse:
    everywhere. Times must rise.
    """
    kept = thin_vertices(vertices, sparse)
    found = [kept[:1]]
    closed = False  # a near vertex ends a piece
    for before, vertex in pairwise(kept):
        if closed:
            found.append([before])
        found[-1].append(vertex)
        closed = _distance(before, vertex) < NEAR
    return found


def thin_vertices(vertices: Sequence[Vertex], sparse: bool = False) -> list[Vertex]:
    """Returns the vertices without those that the motion is as even without.

    Only near ones are left out; sparse: any.
    """
    table = np.array(vertices)
    kept, i, last = [0], 0, len(vertices) - 1
    while i < last:
        j = i + 1
        if sparse or _distance(vertices[i], vertices[j]) < NEAR:
            while j < last and _even(table[i : j + 2]):
                j += 1
        kept.append(j)
        i = j
    return [vertices[k] for k in kept]


def _even(rows: np.ndarray) -> bool:
    """Returns whether those between the first and the last one lie on the straight way in time.

    rows: (n, 5) of t, x, y, z, h; within SHIFT_MAX and TURN_MAX.
    """
    first, last = rows[0], rows[-1]
    way = float(np.hypot(last[1] - first[1], last[2] - first[2]))
    if way >= NEAR and last[0] - first[0] > HELD_MAX:
        return False
    share = ((rows[1:-1, 0] - first[0]) / (last[0] - first[0]))[:, None]
    off = np.abs(rows[1:-1, 1:] - first[1:] - share * (last[1:] - first[1:])).max(axis=0)
    return bool((off[:3] <= SHIFT_MAX).all() and off[3] <= TURN_MAX)


def _distance(a: Vertex, b: Vertex) -> float:
    """Returns the horizontal distance in m between two vertices."""
    return hypot(b.x - a.x, b.y - a.y)
