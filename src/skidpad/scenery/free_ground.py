"""Where things may stand: off lanes, crossings, ways of pedestrians, sight triangles, each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from skidpad.core.geometry import footprint
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside
from skidpad.scenery.sight import sight_triangles
from skidpad.scenery.things import Thing

CLEAR = 1.05  # m between a thing and any lane or crossing; the rule says 1 m
CORNER = 5.05  # m beside the lanes of a junction: pedestrians walk around its corners there
OWN = 0.5  # m between a thing and what the file names
PIECE = 12  # samples of a lane in one polygon


class FreeGround:
    """Finds places for things on the ground of a map that nothing else covers."""

    def __init__(self, samples: LaneSamples, lanes: LaneTable, roadside: Roadside) -> None:
        own, corners = _lane_polygons(samples, lanes)
        zebras = [shapely.MultiPoint(p[:, :2]).convex_hull for p in roadside.crosswalks]
        self._lanes = shapely.STRtree([*own, *zebras])
        self._corners = shapely.STRtree(corners)
        self._objects = shapely.STRtree(_find_named_objects(roadside))
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
        first, second = shapely.STRtree(outlines[kept]).query(
            outlines[kept], predicate="intersects"
        )
        meets: dict[int, list[int]] = {}
        for a, b in zip(first.tolist(), second.tolist(), strict=True):
            if b < a:
                meets.setdefault(a, []).append(b)
        stands = np.ones(len(kept), dtype=np.bool_)
        for a in range(len(kept)):
            stands[a] = not any(stands[b] for b in meets.get(a, ()))
        return [things[i] for i in kept[stands].tolist()]


def outlines_of(things: Sequence[Thing]) -> NDArray[np.object_]:
    """Returns (n,) polygons, the rectangle that each of n >= 1 things covers seen from above."""
    corners = [footprint(*t.outline) for t in things]
    found: NDArray[np.object_] = shapely.polygons(np.array(corners).reshape(-1, 4, 2))
    return found


def _lane_polygons(
    samples: LaneSamples, lanes: LaneTable
) -> tuple[list[shapely.Polygon], list[shapely.Polygon]]:
    """Returns convex pieces of all lanes, PIECE samples long, and those of them that lie in a junction."""
    left = np.stack([-np.sin(samples.heading), np.cos(samples.heading)], axis=1)
    middle = np.stack([samples.x, samples.y], axis=1)
    half = 0.5 * samples.width[:, None]
    a, b = middle + half * left, middle - half * left
    found: list[shapely.Polygon] = []
    corners: list[shapely.Polygon] = []
    for lane, (first, size) in enumerate(
        zip(lanes.first.tolist(), lanes.size.tolist(), strict=True)
    ):
        for k in range(first, first + size - 1, PIECE):
            end = min(k + PIECE + 1, first + size)
            ring = np.concatenate([a[k:end], b[k:end][::-1]])
            piece = shapely.MultiPoint(ring).convex_hull
            (found if lanes.junction[lane] < 0 else corners).append(piece)
    return [*found, *corners], corners


def _find_named_objects(roadside: Roadside) -> list[shapely.Geometry]:
    """Returns the plan shapes of what the map itself names: boxes, barriers, signal heads, parking."""
    boxes = [shapely.Polygon(footprint(b.x, b.y, b.yaw, b.length, b.width)) for b in roadside.boxes]
    lines = [shapely.LineString(b.points[:, :2]) for b in roadside.barriers]
    heads = [shapely.Point(h.x, h.y) for h in roadside.heads]
    spaces = [
        shapely.Polygon(footprint(p.x, p.y, p.yaw, p.length, p.width)) for p in roadside.parking
    ]
    return [*boxes, *lines, *heads, *spaces]
