"""Radar: which returns may be the lead, and which of them is in the ego's lane (A-066 to A-084)."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.roads.kernels import LaneArrays, neighbour_s, project_kernel
from skidpad.roads.queries import RoadMap
from skidpad.stack.perception.lane_view import MAX_SHIFTS, LaneView

HALF_WIDTH = 4.0  # m, pre-filter
PARABOLA_HALF_WIDTH = 1.6  # m
RANGES = (0.1, 80.0)  # m
ALTITUDES = (-0.05, 0.08)  # rad
VELOCITY_FLOOR = -35.0  # m/s
VELOCITY_MARGIN = 0.5  # m/s
ALWAYS_BELOW = 20.0  # m
TRACKING_BELOW = 40.0  # m
FIRST_VELOCITY_LIMIT = -15.6  # m/s, shown before the first measurement
MOUNT = 2.0  # m ahead of the ego's origin
LOOK_BEYOND = 10.0  # m


def velocity_limit(v_ego: float) -> float:
    """Returns the slowest range rate in m/s that is not a standing object, negative closing (A-071)."""
    return max(VELOCITY_FLOOR, -v_ego + VELOCITY_MARGIN)


@kernel
def retain(
    points: RadarPoints,
    half_width: float,
    ranges: tuple[float, float],
    altitudes: tuple[float, float],
    v_limit: float,
    keep_below: float,
    yaw_error: float,
    kappa: float,
    out: NDArray[np.int64],
) -> int:
    """Writes indices of the points that may be the lead into `out`, nearest first; returns how many.

    half_width in m about the lane's path; v_limit: m/s, slower ones count as standing; keep_below: m,
    nearer points stay whatever their velocity; yaw_error, kappa as for the cameras, left positive.
    """
    n = 0
    for i in range(len(points.range)):
        r = float(points.range[i])
        altitude = float(points.altitude[i])
        if not (ranges[0] < r < ranges[1]) or not (altitudes[0] < altitude < altitudes[1]):
            continue
        lateral = r * np.sin(float(points.azimuth[i]) + yaw_error) - kappa * r * r
        if abs(lateral) >= half_width:
            continue
        if r < keep_below or float(points.velocity[i]) > v_limit:
            k = n  # insertion keeps the list sorted by range
            while k > 0 and points.range[out[k - 1]] > r:
                out[k] = out[k - 1]
                k -= 1
            out[k] = i
            n += 1
    return n


class RadarReading(NamedTuple):
    """What the radar says in one tick; None: no such point."""

    pre: float | None  # m, nearest point after the pre-filter
    lane: float | None  # m, nearest point in the ego's lane
    velocity: float | None  # m/s of the point in the lane, else of the nearest; negative closing
    points: int  # points after the pre-filter


NO_RADAR = RadarReading(None, None, None, 0)


class InLane(Protocol):
    """Finds the nearest radar point in the ego's lane."""

    def __call__(
        self, points: RadarPoints, chosen: NDArray[np.int64], pose: Pose, view: LaneView, /
    ) -> int:
        """Returns the first of the chosen rows of `points` that lies in the ego's lane, or -1.

        pose: of the ego.
        """
        ...


class LaneMatch:
    """Compares the lanes of target and ego on the map (A-076 to A-078, A-083)."""

    def __init__(self, map: RoadMap) -> None:
        self.map = map
        self._traced: frozenset[int] | None = None

    def __call__(
        self, points: RadarPoints, chosen: NDArray[np.int64], pose: Pose, view: LaneView
    ) -> int:
        """Returns the first chosen row in the ego's lane or where it leads, or -1.

        -1 also where the ego is on no lane.
        """
        if view.ego is None:
            return -1
        if view.highway is not self._traced:
            self._traced = view.highway
            self._on_highway = np.isin(self.map.lanes.road, list(view.highway))
        return first_in_lane(
            self.map.held, self._on_highway, points, chosen,
            (pose.x, pose.y, pose.z, pose.yaw), view.ego.lane, view.ego.s, MOUNT, LOOK_BEYOND,
        )  # fmt: skip


@kernel
def first_in_lane(
    map: Held[LaneArrays],
    on_highway: NDArray[np.bool_],
    points: RadarPoints,
    chosen: NDArray[np.int64],
    ego: tuple[float, float, float, float],
    ego_lane: int,
    ego_s: float,
    mount: float,
    look_beyond: float,
) -> int:
    """Returns the first of the chosen rows of `points` in the ego's lane or where it leads, or -1.

    on_highway: by lane; ego: x, y, z and yaw; mount, look_beyond: m, `MOUNT` and `LOOK_BEYOND`. The
    look ahead reads one place per branch, the point's range + 10 m on, as A-078 is written: a target
    whose road ends before that place is missed.
    """
    a = map.value
    lane, s = _onto_highway(a, on_highway, ego_lane, ego_s)
    x, y = ego[0] + mount * cos(ego[3]), ego[1] + mount * sin(ego[3])
    for i in chosen:
        r, bearing = float(points.range[i]), ego[3] + float(points.azimuth[i])
        target, at, _ = project_kernel(a, x + r * cos(bearing), y + r * sin(bearing), ego[2], True)
        if target < 0:
            continue
        target, _ = _onto_highway(a, on_highway, target, at)
        if _is_same(a, target, lane) or _leads_to(a, lane, s + (r + look_beyond), target):
            return int(i)
    return -1


@inner_kernel
def _onto_highway(
    a: LaneArrays, on_highway: NDArray[np.bool_], lane: int, s: float
) -> tuple[int, float]:
    """Returns lane and s moved left until the road is on the highway or there is no further lane (A-077)."""
    for _ in range(MAX_SHIFTS):
        left = a.left[lane]
        if on_highway[lane] or left < 0:
            break
        s = neighbour_s(a, lane, left, s)
        lane = left
    return lane, s


@inner_kernel
def _is_same(a: LaneArrays, one: int, other: int) -> bool:
    """Returns whether two lane indices have the same road and lane id."""
    return bool(a.road[one] == a.road[other] and a.lane_id[one] == a.lane_id[other])


@inner_kernel
def _leads_to(a: LaneArrays, lane: int, s: float, target: int) -> bool:
    """Returns whether s, counted from the start of a lane, lies on the target's lane on some branch."""
    lanes, places = [lane], [s]
    k = 0
    while k < len(lanes):
        lane, s = lanes[k], places[k]
        k += 1
        if s <= a.length[lane]:
            if _is_same(a, lane, target):
                return True
            continue
        s -= a.length[lane]
        for j in range(a.next_start[lane], a.next_start[lane + 1]):
            following = int(a.next_lane[j])
            known = False  # branches that meet again are followed once
            for m in range(len(lanes)):
                known = known or (lanes[m] == following and places[m] == s)
            if not known and (a.drivable[following] or not a.drivable[lane]):
                lanes.append(following)
                places.append(s)
    return False


class AnyPoint:
    """The compatibility mode trusts its parabolic corridor alone (A-084)."""

    def __call__(self, points: RadarPoints, chosen: NDArray[np.int64], *_where: object) -> int:
        """Returns the first point that passed the corridor."""
        del points
        return int(chosen[0])


class Radar:
    """Pre-filter and lane check; replaces its list at each measurement (A-066)."""

    def __init__(self, in_lane: InLane, half_width: float, nearest_only: bool) -> None:
        self.in_lane, self.half_width, self.nearest_only = in_lane, half_width, nearest_only
        self.kept = np.empty(256, dtype=np.int64)
        self.reset()

    def reset(self) -> None:
        """Resets the limit of range rates to its value before any measurement."""
        self.velocity_limit = FIRST_VELOCITY_LIMIT

    def update(
        self, points: RadarPoints, pose: Pose, v_ego: float, view: LaneView, tracking: bool
    ) -> RadarReading:
        """Returns the readings of one measurement, NO_RADAR without a point that passes the pre-filter.

        v_ego: m/s; tracking: vision has confirmed a lead (A-073).
        """
        if len(points.range) > len(self.kept):
            self.kept = np.empty(len(points.range), dtype=np.int64)
        self.velocity_limit = velocity_limit(v_ego)
        n = retain(
            points, self.half_width, RANGES, ALTITUDES, self.velocity_limit,
            TRACKING_BELOW if tracking else ALWAYS_BELOW, view.yaw_error, view.kappa, self.kept,
        )  # fmt: skip
        if n == 0:
            return NO_RADAR
        chosen, nearest = self.kept[: 1 if self.nearest_only else n], self.kept[0]
        found = self.in_lane(points, chosen, pose, view)
        lane = None if found < 0 else float(points.range[found])
        told = nearest if found < 0 else found
        return RadarReading(float(points.range[nearest]), lane, float(points.velocity[told]), n)
