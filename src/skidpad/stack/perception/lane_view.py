"""Where the ego is on the map, and how the lane ahead bends (A-043, A-147, A-148)."""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core import geometry
from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel
from skidpad.roads.along import advance_kernel
from skidpad.roads.kernels import LaneArrays, neighbour_s, project_kernel, sample_kernel

REFERENCE_DISTANCE = 30.0  # m, the one point at which curvature is read
PARABOLA = 0.5  # of the curvature (D-063)
MAX_SHIFTS = 8  # lanes to look sideways for the highway
WAYS = 256  # branches of the lane ahead
wrap_angle = kernel(geometry.wrap_angle)


class LaneView(NamedTuple):
    """The ego against its lane; left positive throughout."""

    lane: int  # index of the lane where it is; -1: off every lane
    s: float  # m along it
    offset: float  # m left of its centre
    bend: float  # 1/m, curvature of the lane where it is; 0 off every lane
    reference: int  # index of the lane that it is to follow; -1: none
    reference_s: float  # m along that
    yaw_error: float  # rad, heading minus lane heading; 0 off every lane
    curvature: float  # 1/m at the reference point ahead; 0 off every lane
    kappa: float  # 1/m, of the parabola kappa Z^2 (D-063)


class Place(NamedTuple):
    """The ego on its lane, as it sees what is ahead."""

    x: float  # world frame
    y: float
    z: float
    yaw: float
    v: float  # m/s
    lane: int  # as in LaneView
    s: float
    yaw_error: float
    kappa: float


NOWHERE = LaneView(-1, 0.0, 0.0, 0.0, -1, 0.0, 0.0, 0.0, 0.0)


@kernel
def view_lane(
    a: LaneArrays, on_highway: NDArray[np.bool_], first_branch: bool, ways: Floats,
    x: float, y: float, z: float, yaw: float,
) -> LaneView:  # fmt: skip
    """Returns the view from a place in the world frame; others: as for `follow_lane`, `find_reference`."""
    lane, s, offset = project_kernel(a, x, y, z, True)
    if lane < 0:
        return NOWHERE
    here = sample_kernel(a, lane, s)
    reference, at = lane, s
    if not first_branch:
        reference, at = find_reference(a, on_highway, lane, s)
    ahead, there = follow_lane(a, first_branch, ways, reference, at, REFERENCE_DISTANCE, yaw)
    curvature = 0.0
    if ahead >= 0:
        curvature = sample_kernel(a, ahead, there)[4]
    turn, kappa = wrap_angle(yaw - here[3]), PARABOLA * curvature
    return LaneView(lane, s, offset, here[4], reference, at, turn, curvature, kappa)


@kernel
def find_reference(
    a: LaneArrays, on_highway: NDArray[np.bool_], lane: int, s: float
) -> tuple[int, float]:
    """Returns the nearest lane sideways that is on the highway (A-147), and s on it; the same if none is.

    on_highway: by lane.
    """
    left, left_s, right, right_s = lane, s, lane, s
    for _ in range(MAX_SHIFTS):
        if left >= 0 and on_highway[left]:
            return left, left_s
        if right >= 0 and on_highway[right]:
            return right, right_s
        left, left_s = _shift(a, left, left_s, a.left)
        right, right_s = _shift(a, right, right_s, a.right)
    return lane, s


@kernel
def _shift(a: LaneArrays, lane: int, s: float, beside: NDArray[np.int32]) -> tuple[int, float]:
    """Returns the lane beside a lane, -1 without one, and the place abreast of s on it."""
    other = -1
    if lane >= 0:
        other = int(beside[lane])
    return (other, neighbour_s(a, lane, other, s)) if other >= 0 else (-1, 0.0)


@kernel
def follow_lane(
    a: LaneArrays, first_branch: bool, ways: Floats, lane: int, s: float, distance: float,
    heading: float,
) -> tuple[int, float]:  # fmt: skip
    """Returns lane and s `distance` m further; -1, NaN where the road ends.

    On the branch that turns least from `heading` (A-148), or on the first one of the map (D-058).
    """
    if first_branch:
        return find_first_branch(a, ways, lane, s + distance)
    return advance_kernel(a, lane, s, distance, heading)


@kernel
def find_first_branch(a: LaneArrays, ways: Floats, lane: int, s: float) -> tuple[int, float]:
    """Returns the lane of the lowest index that s, counted from the start of a lane, lies on; -1, NaN: none.

    ways (n, 4): room for branches, beyond which none is followed.
    """
    first, at = -1, nan
    waiting, seen = 1, 0
    ways[0, 0], ways[0, 1] = lane, s
    while waiting > 0:
        waiting -= 1
        lane, s = int(ways[waiting, 0]), ways[waiting, 1]
        if s <= a.length[lane]:
            if first < 0 or lane < first:
                first, at = lane, s
            continue
        s -= a.length[lane]
        for k in range(a.next_start[lane], a.next_start[lane + 1]):
            following = int(a.next_lane[k])
            known = seen == len(ways)
            for m in range(seen):
                known = known or (ways[m, 2] == following and ways[m, 3] == s)
            if not known and (a.drivable[following] or not a.drivable[lane]):
                ways[seen, 2], ways[seen, 3] = following, s
                ways[waiting, 0], ways[waiting, 1] = following, s
                seen, waiting = seen + 1, waiting + 1
    return first, at
