"""Radar: which returns may be the lead, and which of them is in the ego's lane (A-066 to A-084)."""

from __future__ import annotations

from math import cos, nan, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.settings.stack import RadarCandidates, RadarCorridor, StackSettings
from skidpad.roads.kernels import LaneArrays, neighbour_s, project_kernel
from skidpad.stack.memory import Record
from skidpad.stack.perception.lane_view import MAX_SHIFTS, Place

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


@kernel
def velocity_limit(v_ego: float) -> float:
    """Returns the slowest range rate in m/s that is not a standing object, negative closing (A-071)."""
    return max(VELOCITY_FLOOR, -v_ego + VELOCITY_MARGIN)


@kernel
def forget_radar(m: Record) -> None:
    """Resets what radar points are compared with to that before any measurement."""
    m.velocity_limit = FIRST_VELOCITY_LIMIT


@kernel
def retain(
    points: RadarPoints,
    half_width: float,
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
        if not (RANGES[0] < r < RANGES[1]) or not (ALTITUDES[0] < altitude < ALTITUDES[1]):
            continue
        lateral = r * sin(float(points.azimuth[i]) + yaw_error) - kappa * r * r
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
    """What the radar says in one tick; NaN: no such point."""

    pre: float  # m, nearest point after the pre-filter
    lane: float  # m, nearest point in the ego's lane
    velocity: float  # m/s of the point in the lane, else of the nearest; negative closing
    points: int  # points after the pre-filter


NO_RADAR = RadarReading(nan, nan, nan, 0)


@kernel
def first_in_lane(
    a: LaneArrays,
    on_highway: NDArray[np.bool_],
    points: RadarPoints,
    kept: NDArray[np.int64],
    chosen: int,
    place: Place,
    ways: Floats,
) -> int:
    """Returns the first row of `points` in the ego's lane or where it leads (A-076 to A-078).

    Of the rows that the first `chosen` of `kept` name; -1: none is, or the ego is on no lane (A-083).
    on_highway: by lane; ways (n, 4): room for branches, beyond which none is followed. The look
    ahead reads one place per branch, the point's range + 10 m on, as A-078 is written: a target whose
    road ends before that place is missed.
    """
    if place.lane < 0:
        return -1
    lane, s = _onto_highway(a, on_highway, place.lane, place.s)
    x, y = place.x + MOUNT * cos(place.yaw), place.y + MOUNT * sin(place.yaw)
    for k in range(chosen):
        i = kept[k]
        r, bearing = float(points.range[i]), place.yaw + float(points.azimuth[i])
        target, at, _ = project_kernel(a, x + r * cos(bearing), y + r * sin(bearing), place.z, True)
        if target < 0:
            continue
        target, _ = _onto_highway(a, on_highway, target, at)
        if _is_same(a, target, lane) or _leads_to(a, lane, s + (r + LOOK_BEYOND), target, ways):
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
def _leads_to(a: LaneArrays, lane: int, s: float, target: int, ways: Floats) -> bool:
    """Returns whether s, counted from the start of a lane, lies on the target's lane on some branch."""
    ways[0, 0], ways[0, 1] = lane, s
    k, n = 0, 1
    while k < n:
        lane, s = int(ways[k, 0]), ways[k, 1]
        k += 1
        if s <= a.length[lane]:
            if _is_same(a, lane, target):
                return True
            continue
        s -= a.length[lane]
        for j in range(a.next_start[lane], a.next_start[lane + 1]):
            following = int(a.next_lane[j])
            known = False  # branches that meet again are followed once
            for m in range(n):
                known = known or (ways[m, 0] == following and ways[m, 1] == s)
            drives_on = a.drivable[following] or not a.drivable[lane]
            if not known and drives_on and n < len(ways):
                ways[n, 0], ways[n, 1] = following, s
                n += 1
    return False


class RadarRules(NamedTuple):
    """How a stack reads its radar."""

    takes_part: bool
    half_width: float  # m about the lane's path
    by_map: bool  # the map tells the ego's lane, not the corridor alone
    nearest_only: bool  # one point is matched with the map (D-029)


def radar_rules(settings: StackSettings) -> RadarRules:
    """Returns how the radar is read by these settings."""
    by_map = settings.radar_corridor is not RadarCorridor.PARABOLA
    return RadarRules(
        takes_part=settings.radar,
        half_width=HALF_WIDTH if by_map else PARABOLA_HALF_WIDTH,
        by_map=by_map,
        nearest_only=settings.radar_candidates is RadarCandidates.NEAREST,
    )


@kernel
def read_radar(
    m: Record, rules: RadarRules, points: RadarPoints, kept: NDArray[np.int64], tracking: bool, place: Place,
    a: LaneArrays, on_highway: NDArray[np.bool_], ways: Floats,
) -> RadarReading:  # fmt: skip
    """Returns the readings of one measurement, NO_RADAR without a point that passes the pre-filter (A-066).

    kept: room for every point; ways: as in `first_in_lane`; tracking: vision has confirmed a lead (A-073).
    """
    if not rules.takes_part:
        return NO_RADAR
    m.velocity_limit = velocity_limit(place.v)
    n = retain(
        points, rules.half_width, m.velocity_limit,
        TRACKING_BELOW if tracking else ALWAYS_BELOW, place.yaw_error, place.kappa, kept,
    )  # fmt: skip
    if n == 0:
        return NO_RADAR
    nearest = kept[0]
    found = nearest
    if rules.by_map:
        chosen = 1 if rules.nearest_only else n
        found = first_in_lane(a, on_highway, points, kept, chosen, place, ways)
    lane = nan if found < 0 else np.float64(points.range[found])
    told = nearest if found < 0 else found
    pre, velocity = np.float64(points.range[nearest]), np.float64(points.velocity[told])
    return RadarReading(pre, lane, velocity, n)
