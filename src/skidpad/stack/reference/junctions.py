"""Giving way at stop and yield lines: whether somebody in sight arrives before the own car is through."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np

from skidpad.core.geometry import wrap_angle
from skidpad.core.traffic.sight import SeenActors
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.channels.route import STEP, PathPoints

LOOK_FROM = 30.0  # m before a line from which others are looked at
THROUGH = 30.0  # m beyond the line within which ways are looked at for crossing
WAY_STEP, HORIZON = 4.0, 150.0  # m between two places of others' ways, and how far these go
BESIDE = 2.0  # m; a way that comes nearer crosses or joins
MARGIN = 1.0  # s kept when crossing, as the drivers of the background (right_of_way.py)
JOIN_MARGIN = 2.5  # s kept when joining: who comes must not catch up at once
V_THROUGH = 8.0  # m/s through a junction at most
MOVING = 1.0  # m/s, slower ones wait themselves
ALONG = 0.7  # cosine between two ways that run together


def travel_time(v: float, way: float, a: float, v_max: float = V_THROUGH) -> float:
    """Returns the s for `way` m from v at a > 0 m/s² up to v_max; faster ones count as v_max."""
    if v >= v_max:
        return way / v_max
    until = (v_max * v_max - v * v) / (2.0 * a)
    if way <= until:
        return (sqrt(v * v + 2.0 * a * way) - v) / a
    return (v_max - v) / a + (way - until) / v_max


class GivingWay:
    """What one driver makes of others near a line."""

    def __init__(self, map: RoadMap) -> None:
        self.map = map

    def must_wait(
        self, path: PathPoints, at: int, to_line: float, v: float, length: float, a: float,
        seen: SeenActors,
    ) -> bool:  # fmt: skip
        """Returns whether a moving actor off the own path gets there before the own car is through.

        MARGIN s are kept when crossing, JOIN_MARGIN s where its way joins; right of way is not asked.
        at: point of the own path at the car's centre; to_line: m from the front to the line; v: m/s;
        a: m/s^2 of the start.
        """
        first = at + round((to_line + 0.5 * length) / STEP)
        stretch = slice(first, min(first + round(THROUGH / STEP), len(path.x)))
        for i in range(len(seen.x)):
            speed = float(np.hypot(seen.vx[i], seen.vy[i]))
            if speed < MOVING or _leads(path, at, seen, i):
                continue
            met = self._meeting(path, stretch, seen, i)
            if met is None:
                continue
            beyond, distance, joins = met
            own = to_line + beyond + length
            clear = travel_time(v, max(own, 1.0), a) + (JOIN_MARGIN if joins else MARGIN)
            if distance / speed < clear:
                return True
        return False

    def _meeting(
        self, path: PathPoints, stretch: slice, seen: SeenActors, i: int
    ) -> tuple[float, float, bool] | None:
        """Returns where actor i's way first meets the own: m beyond the line, m ahead of its front, joins.

        None where they do not meet. stretch: points of the own path looked at.
        """
        xs, ys, headings = path.x[stretch], path.y[stretch], path.heading[stretch]
        for x, y, heading, gone in self._way(seen, i):
            d = np.hypot(xs - x, ys - y)
            k = int(np.argmin(d)) if len(d) else -1
            if k < 0 or d[k] > BESIDE:
                continue
            joins = bool(cos(heading - float(headings[k])) > ALONG)
            return k * STEP, max(gone - 0.5 * float(seen.length[i]), 0.0), joins
        return None

    def _way(self, seen: SeenActors, i: int) -> list[tuple[float, float, float, float]]:
        """Returns (x, y, heading, m gone) along the lane of actor i, straight on where it is on none."""
        x, y, yaw = float(seen.x[i]), float(seen.y[i]), float(seen.yaw[i])
        lane: LanePoint | None = self.map.project(x, y, float(seen.z[i]))
        if lane is not None and (
            abs(lane.offset) > 0.5 * lane.width or cos(wrap_angle(yaw - lane.heading)) < ALONG
        ):
            lane = None
        steps = [k * WAY_STEP for k in range(int(HORIZON / WAY_STEP))]
        if lane is None:
            return [(x + cos(yaw) * s, y + sin(yaw) * s, yaw, s) for s in steps]
        way = []
        for s in steps:
            place = self.map.ahead(lane, s)
            if place is None:
                break
            way.append((place.x, place.y, place.heading, s))
        return way


def _leads(path: PathPoints, at: int, seen: SeenActors, i: int) -> bool:
    """Returns whether actor i is on the own path, ahead or behind, and heads along it.

    It is within BESIDE m of one of the points from 40 before to 79 after `at`, the own car's. Its
    speed does not matter.
    """
    near = slice(max(at - 40, 0), at + 80)
    d = np.hypot(path.x[near] - seen.x[i], path.y[near] - seen.y[i])
    k = int(np.argmin(d))
    return bool(d[k] < BESIDE and cos(float(path.heading[near][k]) - float(seen.yaw[i])) > ALONG)
