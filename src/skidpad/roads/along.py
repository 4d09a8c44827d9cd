"""Kernels along lanes: how a way goes on at forks, a place further on, and the next signal."""

from __future__ import annotations

from math import atan2, inf, nan

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.roads.kernels import HEADING, LaneArrays, X, Y, sample_kernel, wrapped

RETRY = 64  # junction-free steps that one walk may take per 64 m, against cycles of tiny lanes


@inner_kernel
def turn_of(a: LaneArrays, lane: int, heading: float, distance: float) -> float:
    """Returns the angle in rad between `heading` and a lane's direction `distance` m into it, inf: its end.

    A thousandth of the turn to that place is added, so that lanes of one end direction differ.
    """
    s = min(distance, a.length[lane])
    x0, y0 = a.sample[a.first[lane], X], a.sample[a.first[lane], Y]
    x, y, _, h, _, _, _, _, _ = sample_kernel(a, lane, s)
    return abs(wrapped(h - heading)) + 1e-3 * abs(wrapped(atan2(y - y0, x - x0) - heading))


@inner_kernel
def straightest_next(a: LaneArrays, lane: int, heading: float) -> int:
    """Returns the drivable successor whose end points closest to `heading` (A-148), or -1.

    After a lane that is not drivable, any successor.
    """
    best, chosen = inf, -1
    for k in range(a.next_start[lane], a.next_start[lane + 1]):
        candidate = a.next_lane[k]
        if a.drivable[candidate] == 0 and a.drivable[lane] == 1:
            continue
        turn = turn_of(a, candidate, heading, inf)
        if turn < best:
            best, chosen = turn, candidate
    return chosen


@inner_kernel
def straightest_previous(a: LaneArrays, lane: int, heading: float) -> int:
    """Returns the drivable predecessor whose start points closest to `heading`, or -1.

    Before a lane that is not drivable, any predecessor.
    """
    best, chosen = inf, -1
    for k in range(a.prev_start[lane], a.prev_start[lane + 1]):
        candidate = a.prev_lane[k]
        if a.drivable[candidate] == 0 and a.drivable[lane] == 1:
            continue
        turn = abs(wrapped(a.sample[a.first[candidate], HEADING] - heading))
        if turn < best:
            best, chosen = turn, candidate
    return chosen


@kernel
def advance_kernel(
    a: LaneArrays, lane: int, s: float, distance: float, heading: float = nan
) -> tuple[int, float]:
    """Returns (lane, s) `distance` m further, at forks along the straightest successor; -1, NaN at dead ends.

    heading: what "straight" is measured against at every fork; NaN: the lane's own at its end.
    A negative distance goes back along straightest predecessors.
    """
    s += distance
    for _ in range(RETRY + int(abs(distance))):
        if s > a.length[lane]:
            ahead = heading
            if not abs(ahead) < inf:
                ahead = a.sample[a.first[lane] + a.size[lane] - 1, HEADING]
            following = straightest_next(a, lane, ahead)
            if following < 0:
                return -1, nan
            s -= a.length[lane]
            lane = following
        elif s < 0.0:
            previous = straightest_previous(a, lane, a.sample[a.first[lane], HEADING])
            if previous < 0:
                return -1, nan
            s += a.length[previous]
            lane = previous
        else:
            return lane, s
    return -1, nan


@inner_kernel
def advance_point(
    a: LaneArrays, lane: int, s: float, distance: float, heading: float
) -> tuple[int, float, float, float, float, float, float, float, float]:
    """Returns the point `distance` m further along the lanes, offset 0; lane -1 and NaN at a dead end.

    Columns as of `project_point`; forks as in `advance_kernel`.
    """
    lane, s = advance_kernel(a, lane, s, distance, heading)
    if lane < 0:
        return -1, nan, nan, nan, nan, nan, nan, nan, nan
    px, py, pz, heading, curvature, width, _, _, _ = sample_kernel(a, lane, s)
    return lane, s, 0.0, px, py, pz, heading, curvature, width


@inner_kernel
def signal_ahead(
    a: LaneArrays, lane: int, s: float, distance: float, kind: int, heading: float = nan
) -> tuple[int, float]:
    """Returns the first signal of `kind` on the straightest path from s on: (row of SignalTable, m to it).

    (-1, inf) when there is none within `distance`. The distance runs along the lanes to the stop line
    (A-158, A-163); no junction is needed (decision M-5). heading: as in `advance_kernel`.
    """
    walked = -s
    for _ in range(RETRY + int(distance)):
        for k in range(a.signal_start[lane], a.signal_start[lane + 1]):
            gap = walked + a.signal_s[k]
            if a.signal_kind[k] == kind and 0.0 <= gap <= distance:
                return a.signal_row[k], gap
        walked += a.length[lane]
        if walked > distance:
            return -1, inf
        ahead = heading
        if not abs(ahead) < inf:
            ahead = a.sample[a.first[lane] + a.size[lane] - 1, HEADING]
        lane = straightest_next(a, lane, ahead)
        if lane < 0:
            return -1, inf
    return -1, inf
