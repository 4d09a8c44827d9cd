"""The road under every vehicle: height, slope, limit, and the traffic light that governs it."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import kernel
from skidpad.core.states import ActorStates
from skidpad.roads.kernels import LaneArrays, project_kernel, sample_kernel, signal_ahead
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap

Floats = NDArray[np.float64]
LIGHT = int(SignalKind.LIGHT)
A_COMFORT = 4.0  # m/s^2 with which a driver stops at a red light
ZONE_MIN = 6.0  # m before the stop line within which a standing vehicle is held
PASSED = 1.0  # m behind the stop line up to which the light still governs


class Ground(NamedTuple):
    """What the road tells about n vehicles; arrays (n,)."""

    lane: NDArray[np.int64]  # index into the lane table, -1 beside all roads
    s: Floats  # m along it
    z: Floats
    grade: Floats  # along the vehicle's heading, rad, uphill positive
    bank: Floats  # rad, left side up positive
    limit: Floats  # m/s, NaN where the map gives none
    signal: NDArray[np.int64]  # row of the governing light's signal, -1: none

    @classmethod
    def of(cls, n: int) -> Ground:
        """Nothing known yet."""
        lane, signal = np.full((2, n), -1, dtype=np.int64)
        s, z, grade, bank, limit = np.zeros((5, n))
        return cls(lane, s, z, grade, bank, limit, signal)


@kernel
def _feel(arrays: LaneArrays, states: ActorStates, half_lengths: Floats, ground: Ground) -> None:
    for i in range(states.x.shape[0]):
        lane, s, offset = project_kernel(
            arrays, states.x[i], states.y[i], states.z[i], ground.lane[i], False
        )
        ground.lane[i], ground.s[i], ground.signal[i] = lane, s, -1
        ground.grade[i] = ground.bank[i] = 0.0
        ground.limit[i] = np.nan
        if lane < 0:
            ground.z[i] = states.z[i]
            continue
        _, _, z, heading, _, _, grade, bank, limit = sample_kernel(arrays, lane, s)
        turn = states.yaw[i] - heading
        ground.z[i] = z + offset * np.tan(bank)
        slope = np.arctan(grade)
        ground.grade[i] = slope * cos(turn) + bank * sin(turn)
        ground.bank[i] = bank * cos(turn) - slope * sin(turn)
        ground.limit[i] = limit
        v = states.vx[i] * cos(heading) + states.vy[i] * sin(heading)
        if arrays.drivable[lane] == 0 or cos(turn) < 0.5 or v < -0.5:
            continue
        front = s + half_lengths[i] - PASSED
        reach = ZONE_MIN + PASSED + v * v / (2.0 * A_COMFORT)
        start = min(front, arrays.length[lane])
        row, gap = signal_ahead(arrays, lane, start, reach + front - start, LIGHT)
        if row >= 0 and gap - (front - start) >= 0.0:
            ground.signal[i] = row


def feel(roads: RoadMap, states: ActorStates, half_lengths: Floats, ground: Ground) -> None:
    """Fill `ground` for these vehicles; its lanes serve as hints."""
    _feel(roads.arrays, states, half_lengths, ground)
