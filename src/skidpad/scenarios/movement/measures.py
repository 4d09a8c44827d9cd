"""Distances, gaps and overlaps between entities, straight, in their own axes, or along the road."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from math import cos, hypot, inf, sin
from typing import Any, TypeVar

from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.roads.routing import shortest_route
from skidpad.scenarios.movement.network import Network
from skidpad.scenarios.reading.entities import Box

Point = tuple[float, float]
Some = TypeVar("Some", float, NDArray[Any])


class Axes(Enum):
    """Coordinates in which a distance is measured."""

    ENTITY = "entity"
    LANE = "lane"
    ROAD = "road"
    TRAJECTORY = "trajectory"
    WORLD = "world"


class Direction(Enum):
    """Which component of a distance counts."""

    LONGITUDINAL = "longitudinal"
    LATERAL = "lateral"
    EUCLIDEAN = "euclidianDistance"
    CARTESIAN = "cartesianDistance"  # its name before 1.1


def corners(pose: Pose, box: Box) -> list[Point]:
    """Returns the four corners of an entity on the ground."""
    found = []
    for a, b in ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)):
        p = pose.moved(forward=box.forward + a * box.length, left=box.left + b * box.width)
        found.append((p.x, p.y))
    return found


def between(origin: Pose, x: Some, y: Some) -> tuple[Some, Some]:
    """Returns a point, or arrays of them, in the axes of a pose: m forward, m left."""
    dx, dy = x - origin.x, y - origin.y
    c, s = cos(origin.yaw), sin(origin.yaw)
    return dx * c + dy * s, dy * c - dx * s


def overlap(a: Sequence[Point], b: Sequence[Point]) -> float:
    """Returns the m between two convex outlines along the best separating axis; negative: they overlap."""
    best = -inf
    for shape in (a, b):
        for k, (x0, y0) in enumerate(shape):
            x1, y1 = shape[(k + 1) % len(shape)]
            nx, ny = y1 - y0, x0 - x1
            size = hypot(nx, ny)
            if size == 0.0:
                continue
            pa = [(x * nx + y * ny) / size for x, y in a]
            pb = [(x * nx + y * ny) / size for x, y in b]
            best = max(best, min(pb) - max(pa), min(pa) - max(pb))
    return best


def clearance(a: Sequence[Point], b: Sequence[Point]) -> float:
    """Returns the shortest distance of two convex outlines in m, 0 where they touch."""
    if overlap(a, b) <= 0.0:
        return 0.0
    return min(_to_edges(p, shape) for one, shape in ((a, b), (b, a)) for p in one)


def _to_edges(p: Point, shape: Sequence[Point]) -> float:
    """Returns the least distance in m from a point to the edges of a closed polygon."""
    best = inf
    for k, (x0, y0) in enumerate(shape):
        x1, y1 = shape[(k + 1) % len(shape)]
        ex, ey = x1 - x0, y1 - y0
        length_sq = ex * ex + ey * ey
        u = 0.0 if length_sq == 0.0 else ((p[0] - x0) * ex + (p[1] - y0) * ey) / length_sq
        u = min(max(u, 0.0), 1.0)
        best = min(best, hypot(p[0] - x0 - u * ex, p[1] - y0 - u * ey))
    return best


def extent_gap(a: Sequence[float], b: Sequence[float]) -> float:
    """Returns the m between two intervals on one axis, 0 where they meet."""
    return max(min(b) - max(a), min(a) - max(b), 0.0)


def along_road(network: Network, a: Pose, b: Pose) -> Point | None:
    """Returns the way from a to b along the road and across it: m, positive ahead of and left of a.

    None off the road, or where no way leads from either to the other.
    """
    here, there = network.coordinates(a), network.coordinates(b)
    if here is None or there is None:
        return None
    forward = 1.0 if cos(here.turn) >= 0.0 else -1.0
    left = forward * (there.t - here.t)
    if here.road == there.road:
        return forward * (there.s - here.s), left
    p, q = network.place_of(a).lane, network.place_of(b).lane
    if p is None or q is None:
        return None
    ahead, behind = shortest_route(network.map, p, q), shortest_route(network.map, q, p)
    ways = [r.length * sign for r, sign in ((ahead, 1.0), (behind, -1.0)) if r is not None]
    return (min(ways, key=abs), left) if ways else None


def extents_along_road(
    network: Network, outline: Sequence[Point], pose: Pose
) -> tuple[int, list[float], list[float]] | None:
    """Returns the road and the s and t in m of the corners of a body at a pose; None off one road."""
    found = [network.coordinates(Pose(x, y, pose.z, yaw=pose.yaw)) for x, y in outline]
    known = [at for at in found if at is not None]
    if len(known) < len(found) or len({at.road for at in known}) != 1:
        return None
    return known[0].road, [at.s for at in known], [at.t for at in known]
