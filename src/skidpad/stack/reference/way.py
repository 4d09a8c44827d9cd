"""The way ahead: a line of points along the straightest lanes, and who is in it."""

from __future__ import annotations

from bisect import bisect_right
from math import cos, sin
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.traffic.sight import SeenActors
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.channels.route import STEP, PathPoints, RoutePath, locate, route_path

LENGTH = 700.0  # m of way that is known
AT_LEAST = 350.0  # m, then it is drawn anew
ASTRAY = 4.0  # m beside the way, then it is drawn anew
NEAR = 40  # points around the last place among which the own one is looked for
LOOK = 320  # points ahead on which others are looked for
LEVEL = 2.5  # m above or below the way, beyond which somebody is on another road
HARDEST = 8.0  # m/s^2, nobody is taken to brake harder
MARGIN = 0.3  # m kept beside the own body
SOON = 1.0  # s ahead for which sideways motion is believed: a cut-in is seen as it begins
CROSSING = 0.5  # m/s sideways, more is crossing
HORIZON, HORIZON_STEP = 4.0, 0.5  # s for which crossing motion is believed
CROSSING_MARGIN = 1.5  # s between the own car and who crosses


class Place(NamedTuple):
    """Where the own car is on its way."""

    at: int  # point
    s: float  # m along it
    offset: float  # m left of it


class Way:
    """Follows the map from where the car is; at forks straight on."""

    path: RoutePath

    def __init__(self, map: RoadMap) -> None:
        self.map = map
        self.reset()

    def reset(self) -> None:
        """Resets the place on the path, as after a relocation of the car."""
        self.at: int | None = None

    def update(self, pose: Pose) -> Place | None:
        """Returns the place of a car at `pose`, None off every lane; draws the way anew where need be."""
        if self.at is not None:
            place = self._place(pose, self.at)
            if abs(place.offset) < ASTRAY and self.path.length - place.s > AT_LEAST:
                return place
            if abs(place.offset) < ASTRAY and not self.map.successors(self.path.lanes[-1]):
                return place
        start = self._start(pose)
        if start is None:
            self.at = None
            return None
        self.path = route_path(self.map, self._lanes(start), max(start.s - 10.0, 0.0))
        return self._place(pose, round(min(start.s, 10.0)))

    def _start(self, pose: Pose) -> LanePoint | None:
        """Returns the point to go on from, on the way itself where the car still is; None off every lane."""
        if self.at is not None:
            place = self._place(pose, self.at)
            if abs(place.offset) < ASTRAY:
                k = max(bisect_right(self.path.starts, place.s) - 1, 0)
                s = place.s - self.path.starts[k]
                lane = self.path.lanes[k]
                return self.map.at(lane, min(max(s, 0.0), float(self.map.lanes.length[lane])))
        return self.map.project(pose.x, pose.y, pose.z)

    def _lanes(self, start: LanePoint) -> list[int]:
        """Returns the lanes ahead from a start, straight on, until LENGTH in m is known."""
        lanes, known = [start.lane], float(self.map.lanes.length[start.lane]) - start.s
        while known < LENGTH:
            length = float(self.map.lanes.length[lanes[-1]])
            onward = self.map.ahead(self.map.at(lanes[-1], length), 0.01)
            if onward is None or onward.lane not in self.map.successors(lanes[-1]):
                break
            lanes.append(onward.lane)
            known += float(self.map.lanes.length[onward.lane])
        return lanes

    def _place(self, pose: Pose, near: int) -> Place:
        """Returns the ego's place on the path: row, distance along it in m and offset in m; keeps `at`.

        near: row around which it is looked for.
        """
        p = self.path.points
        at, offset = locate(p, pose.x, pose.y, near, NEAR)
        self.at, h = int(at), float(p.heading[at])
        ahead = cos(h) * (pose.x - float(p.x[at])) + sin(h) * (pose.y - float(p.y[at]))
        return Place(self.at, self.at * STEP + ahead, float(offset))


class Body(NamedTuple):
    """The own car's outline and motion on its way."""

    s: float  # m
    v: float  # m/s
    half_length: float
    half_width: float


def anticipate_actors(seen: SeenActors, before: SeenActors, span: float, age: float) -> SeenActors:
    """Returns the same actors where they are taken to be `age` s later.

    Those with brake lamps on are taken to go on slowing down as between the view `before`, `span` s
    earlier, and this one; all others go on as seen.
    """
    slowing_x, slowing_y = np.zeros(len(seen.x)), np.zeros(len(seen.x))
    _, now, then = np.intersect1d(seen.actor, before.actor, assume_unique=True, return_indices=True)
    if span > 0.0:
        lamps = seen.braking[now]
        slowing_x[now] = np.where(lamps, seen.vx[now] - before.vx[then], 0.0) / span
        slowing_y[now] = np.where(lamps, seen.vy[now] - before.vy[then], 0.0) / span
    slowing = np.hypot(slowing_x, slowing_y)
    share = np.minimum(HARDEST / np.maximum(slowing, 1e-9), 1.0)
    slowing_x, slowing_y, slowing = share * slowing_x, share * slowing_y, share * slowing
    speed = np.hypot(seen.vx, seen.vy)
    halts = slowing * age > speed  # then it stands where it came to rest
    t = np.where(halts, speed / np.maximum(slowing, 1e-9), age)
    return seen._replace(
        x=seen.x + seen.vx * t + 0.5 * slowing_x * t * t,
        y=seen.y + seen.vy * t + 0.5 * slowing_y * t * t,
        vx=np.where(halts, 0.0, seen.vx + slowing_x * t),
        vy=np.where(halts, 0.0, seen.vy + slowing_y * t),
    )


@kernel
def gaps_ahead(path: PathPoints, at: int, seen: SeenActors, body: Body) -> tuple[Floats, Floats]:
    """Returns (n,) m from the bumper to actors in the way or about to be, inf for others; (n,) m/s along it.

    at: point of the path at the car. An actor that crosses blocks the way, with 0 m/s, while the own car
    would arrive within CROSSING_MARGIN.
    """
    n = seen.x.size
    gap, speed = np.full(n, np.inf), np.zeros(n)
    for i in range(n):
        for k in range(int(HORIZON / HORIZON_STEP) + 1):
            t = k * HORIZON_STEP
            x = seen.x[i] + seen.vx[i] * t
            y = seen.y[i] + seen.vy[i] * t
            j, best = -1, np.inf
            for p in range(max(at - 5, 0), min(at + LOOK, path.x.size)):
                d = (path.x[p] - x) ** 2 + (path.y[p] - y) ** 2
                if d < best and abs(path.z[p] - seen.z[i]) < LEVEL:
                    j, best = p, d
            if j < 0 or best > 900.0:
                break
            c, s = np.cos(path.heading[j]), np.sin(path.heading[j])
            along = c * (x - path.x[j]) + s * (y - path.y[j])
            if abs(along) > 2.0:
                continue  # before or beyond the stretch
            offset = -s * (x - path.x[j]) + c * (y - path.y[j])
            v_along = c * seen.vx[i] + s * seen.vy[i]
            v_side = -s * seen.vx[i] + c * seen.vy[i]
            turn = seen.yaw[i] - path.heading[j]
            half_l = 0.5 * (abs(np.cos(turn)) * seen.length[i] + abs(np.sin(turn)) * seen.width[i])
            half_w = 0.5 * (abs(np.sin(turn)) * seen.length[i] + abs(np.cos(turn)) * seen.width[i])
            crosses = abs(v_side) > max(CROSSING, abs(v_along))
            if t > SOON and not crosses:
                break
            if abs(offset) > half_w + body.half_width + MARGIN:
                continue
            s_other = j * 1.0 + along - (v_along * t if not crosses else 0.0)
            free = s_other - half_l - body.s - body.half_length
            if s_other < body.s:
                break
            if crosses and t > 0.0:
                arrival = max(free, 0.0) / max(body.v, 0.5)
                if abs(arrival - t) > CROSSING_MARGIN:
                    continue
            if free < gap[i]:
                gap[i] = free
                speed[i] = 0.0 if crosses else v_along
            if not crosses:
                break
    return gap, speed
