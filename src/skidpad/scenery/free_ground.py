"""Where things may stand: off lanes, crossings, ways of pedestrians, sight triangles, each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from skidpad.core.geometry import footprint
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside
from skidpad.scenery.things import Thing

EYE = 4.4  # m before the junction; AASHTO Green Book 2018, section 9.5.3, case B: 14.5 ft
GAP = 7.5  # s, the same, table 9-5, passenger car that turns left
SPEED = 50.0 / 3.6  # m/s, where a lane names no limit
FARTHEST = 60.0  # m along the other road; towns are built closer than the full 104 m (assumption)
DRIVEN = (LaneKind.DRIVING, LaneKind.RAMP)
CLEAR = 1.05  # m between a thing and any lane or crossing; the rule says 1 m
CORNER = 5.05  # m beside the lanes of a junction: pedestrians walk around its corners there
OWN = 0.5  # m between a thing and what the file names
PIECE = 12  # samples of a lane in one polygon


class FreeGround:
    """Finds places for things on the ground of a map that nothing else covers."""

    def __init__(self, samples: LaneSamples, lanes: LaneTable, roadside: Roadside) -> None:
        is_corner = lanes.junction >= 0
        own, corners = (lane_polygons(samples, lanes, m) for m in (~is_corner, is_corner))
        zebras = [shapely.MultiPoint(p[:, :2]).convex_hull for p in roadside.crosswalks]
        self._lanes = shapely.STRtree([*own, *corners, *zebras])
        self._corners = shapely.STRtree(corners)
        self._objects = shapely.STRtree(find_named_objects(roadside))
        self._sight = shapely.STRtree(sight_triangles(samples, lanes))

    def place(self, things: Sequence[Thing]) -> list[Thing]:
        """Returns those things whose ground is free, in their order; of two that meet, the first one.

        Free is: CLEAR m from lanes and crossings, CORNER m from lanes in junctions, OWN m from what the map
        names, and for tall things outside every sight triangle.
        """
        outlines = outlines_of(things)
        free = np.ones(len(things), dtype=np.bool_)
        for tree, distance in ((self._lanes, CLEAR), (self._corners, CORNER), (self._objects, OWN)):
            if len(tree.geometries):
                rows, _ = tree.query(outlines, predicate="dwithin", distance=distance)
                free[rows] = False
        if len(self._sight.geometries):
            rows, _ = self._sight.query(outlines, predicate="intersects")
            tall = np.array([t.is_tall for t in things])
            free[rows[tall[rows]]] = False
        kept = np.flatnonzero(free)
        return [things[i] for i in kept[stand_apart(outlines[kept], 0.0)].tolist()]


def stand_apart(outlines: NDArray[np.object_], distance: float) -> NDArray[np.bool_]:
    """Returns (n,) which of n outlines stay when, of two within `distance` in m, the first one stays."""
    first, second = shapely.STRtree(outlines).query(
        outlines, predicate="dwithin", distance=distance
    )
    meets: dict[int, list[int]] = {}
    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        if b < a:
            meets.setdefault(a, []).append(b)
    stands = np.ones(len(outlines), dtype=np.bool_)
    for a in range(len(outlines)):
        stands[a] = not any(stands[b] for b in meets.get(a, ()))
    return stands


def outlines_of(things: Sequence[Thing]) -> NDArray[np.object_]:
    """Returns (n,) polygons, the rectangle that each of n >= 1 things covers seen from above."""
    corners = [footprint(*t.outline) for t in things]
    found: NDArray[np.object_] = shapely.polygons(np.array(corners).reshape(-1, 4, 2))
    return found


def lane_polygons(
    samples: LaneSamples, lanes: LaneTable, chosen: NDArray[np.bool_], piece: int = PIECE
) -> list[shapely.Polygon]:
    """Returns convex pieces of the chosen lanes, `piece` samples long; chosen: (l,) for all lanes."""
    left = np.stack([-np.sin(samples.heading), np.cos(samples.heading)], axis=1)
    middle = np.stack([samples.x, samples.y], axis=1)
    half = 0.5 * samples.width[:, None]
    a, b = middle + half * left, middle - half * left
    found: list[shapely.Polygon] = []
    for first, size in zip(lanes.first[chosen].tolist(), lanes.size[chosen].tolist(), strict=True):
        for k in range(first, first + size - 1, piece):
            end = min(k + piece + 1, first + size)
            ring = np.concatenate([a[k:end], b[k:end][::-1]])
            found.append(shapely.MultiPoint(ring).convex_hull)
    return found


def find_named_objects(roadside: Roadside) -> list[shapely.Geometry]:
    """Returns the plan shapes of what the map itself names: boxes, barriers, signal heads, parking."""
    boxes = [shapely.Polygon(footprint(b.x, b.y, b.yaw, b.length, b.width)) for b in roadside.boxes]
    lines = [shapely.LineString(b.points[:, :2]) for b in roadside.barriers]
    heads = [shapely.Point(h.x, h.y) for h in roadside.heads]
    spaces = [
        shapely.Polygon(footprint(p.x, p.y, p.yaw, p.length, p.width)) for p in roadside.parking
    ]
    return [*boxes, *lines, *heads, *spaces]


# What drivers must see at junctions: the sight triangles, which stay free of tall things.


def sight_triangles(samples: LaneSamples, lanes: LaneTable) -> list[shapely.Polygon]:
    """Returns the triangles that tall things must not meet: one per ordered pair of lanes into one junction.

    Pairs of lanes of the same road have none.
    """
    entries: dict[int, list[int]] = {}
    for lane in np.flatnonzero((lanes.junction < 0) & np.isin(lanes.kind, DRIVEN)).tolist():
        after = lanes.next_lane[lanes.next_start[lane] : lanes.next_start[lane + 1]]
        for junction in np.unique(lanes.junction[after]).tolist():
            if junction >= 0:
                entries.setdefault(junction, []).append(lane)
    return [
        shapely.Polygon(corners)
        for members in entries.values()
        for own in members
        for other in members
        if lanes.road[own] != lanes.road[other]
        for corners in [_triangle(samples, lanes, own, other)]
    ]


def _triangle(samples: LaneSamples, lanes: LaneTable, own: int, other: int) -> NDArray[np.float64]:
    """Returns corners (3, 2) in m: the eye on lane `own`, the end of lane `other`, a point up `other`.

    That point is as far back as one must see: GAP s at the limit (SPEED without one), at most FARTHEST m.
    """
    last = int(lanes.first[other] + lanes.size[other] - 1)
    limit = float(samples.limit[last])
    reach = min(GAP * (limit if np.isfinite(limit) else SPEED), FARTHEST)
    points = [
        _before_end(samples, lanes, lane, m)
        for lane, m in ((own, EYE), (other, 0.0), (other, reach))
    ]
    return np.array(points)


def _before_end(
    samples: LaneSamples, lanes: LaneTable, lane: int, distance: float
) -> tuple[float, float]:
    """Returns x and y in m of the point `distance` in m before the end of a lane, at most its begin."""
    part = slice(int(lanes.first[lane]), int(lanes.first[lane] + lanes.size[lane]))
    s = max(float(samples.s[part][-1]) - distance, 0.0)
    x, y = (float(np.interp(s, samples.s[part], v[part])) for v in (samples.x, samples.y))
    return x, y
