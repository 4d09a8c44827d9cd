"""Radar: which returns may be the lead, and which of them is in the ego's lane (A-066 to A-084)."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.jit import kernel
from skidpad.roads.queries import LanePoint, RoadMap
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
    """Slowest range rate that is not a standing object, m/s, negative closing (A-071)."""
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
    """Indices of the points that may be the lead into `out`, nearest first; returns how many.

    half_width in m about the lane's path; keep_below: nearer points stay whatever their velocity;
    yaw_error, kappa as for the cameras, left positive.
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
    """Tells whether a radar point lies in the ego's lane."""

    def __call__(self, pose: Pose, view: LaneView, range: float, azimuth: float, /) -> bool:
        """range in m and azimuth in rad (left positive) from the ego at `pose`."""
        ...


class LaneMatch:
    """Compares the lanes of target and ego on the map (A-076 to A-078, A-083)."""

    def __init__(self, map: RoadMap) -> None:
        self.map = map

    def __call__(self, pose: Pose, view: LaneView, range: float, azimuth: float) -> bool:
        """False where target or ego is on no lane.

        The look ahead reads one place per branch, `range` + 10 m on, as A-078 is written: a target
        whose road ends before that place is missed.
        """
        if view.ego is None:
            return False
        c, s = cos(pose.yaw), sin(pose.yaw)
        bearing = pose.yaw + azimuth
        x = pose.x + MOUNT * c + range * cos(bearing)
        y = pose.y + MOUNT * s + range * sin(bearing)
        target = self.map.project(x, y, pose.z)
        if target is None:
            return False
        target = self._onto_highway(target, view.highway)
        ego = self._onto_highway(view.ego, view.highway)
        place = (target.road, target.lane_id)
        if place == (ego.road, ego.lane_id):
            return True
        reached = self.map.all_ahead(ego, range + LOOK_BEYOND)
        return any((point.road, point.lane_id) == place for point in reached)

    def _onto_highway(self, point: LanePoint, highway: frozenset[int]) -> LanePoint:
        """Leftwards until the road is on the highway or there is no further lane (A-077)."""
        for _ in range(MAX_SHIFTS):
            if point.road in highway:
                break
            left = self.map.left(point)
            if left is None:
                break
            point = left
        return point


class AnyPoint:
    """The compatibility mode trusts its parabolic corridor alone (A-084)."""

    def __call__(self, *_where: object) -> bool:
        """Every point that passed the corridor."""
        return True


class Radar:
    """Pre-filter and lane check; replaces its list at each measurement (A-066)."""

    def __init__(self, in_lane: InLane, half_width: float, nearest_only: bool) -> None:
        self.in_lane, self.half_width, self.nearest_only = in_lane, half_width, nearest_only
        self.kept = np.empty(256, dtype=np.int64)
        self.reset()

    def reset(self) -> None:
        """No measurement yet."""
        self.velocity_limit = FIRST_VELOCITY_LIMIT

    def update(
        self, points: RadarPoints, pose: Pose, v_ego: float, view: LaneView, tracking: bool
    ) -> RadarReading:
        """The readings of one measurement; tracking: vision has confirmed a lead (A-073)."""
        if len(points.range) > len(self.kept):
            self.kept = np.empty(len(points.range), dtype=np.int64)
        self.velocity_limit = velocity_limit(v_ego)
        n = retain(
            points, self.half_width, RANGES, ALTITUDES, self.velocity_limit,
            TRACKING_BELOW if tracking else ALWAYS_BELOW, view.yaw_error, view.kappa, self.kept,
        )  # fmt: skip
        if n == 0:
            return NO_RADAR
        nearest = self.kept[0]
        for i in self.kept[: 1 if self.nearest_only else n].tolist():
            r = float(points.range[i])
            if self.in_lane(pose, view, r, float(points.azimuth[i])):
                return RadarReading(float(points.range[nearest]), r, float(points.velocity[i]), n)
        return RadarReading(float(points.range[nearest]), None, float(points.velocity[nearest]), n)
