"""The road under each actor: lane, height, slope; and the tiny noise of a real surface."""

from __future__ import annotations

from math import atan, cos, sin, tan

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import kernel
from skidpad.core.states import ActorStates
from skidpad.roads.kernels import (
    WIDTH,
    LaneArrays,
    S,
    X,
    Y,
    Z,
    closest_on_segment,
    project_kernel,
    sample_kernel,
    segment_kernel,
)
from skidpad.simulation.world.traffic.occupancy import PLACE, Places
from skidpad.simulation.world.traffic.path import uniform

Floats = NDArray[np.float64]

ROAD_NOISE = 1.0e-4  # rad of cross slope, uniform: breaks perfect symmetry (decision M-11)
NOISE_SALT = 7
STEPS = 6  # samples, more than a vehicle passes in one tick
EDGE = 0.05  # m from the lane's edge within which the nearest lane is searched
LEVEL = 1.0  # m of height that still is the same road


def places_for(length: Floats, width: Floats) -> Places:
    """Places of n actors, on no lane yet."""
    placed = np.zeros(len(length), dtype=PLACE)
    placed["lane"] = -1
    placed["half_length"], placed["half_width"] = length / 2.0, width / 2.0
    return placed


@kernel
def still_on_lane(
    lanes: LaneArrays, lane: int, sample: int, x: float, y: float, z: float
) -> tuple[int, float, float]:
    """(lane, s, offset) if the point is still inside the lane on which it was, else lane -1.

    Lanes do not overlap outside of junctions, so there this is the nearest lane, at a third of the
    cost of a search; within junctions an actor keeps its lane while it is inside.
    """
    if lane < 0:
        return -1, 0.0, 0.0
    last = lanes.first[lane] + lanes.size[lane] - 2
    for i in range(sample, min(sample + STEPS, last) + 1):
        p, q = lanes.sample[i], lanes.sample[i + 1]
        cx, cy = q[X] - p[X], q[Y] - p[Y]
        along = (x - p[X]) * cx + (y - p[Y]) * cy
        if along < 0.0:
            break
        if along <= cx * cx + cy * cy:
            share, offset, _, _ = closest_on_segment(lanes, i, x, y)
            z_lane = p[Z] + share * (q[Z] - p[Z])
            if abs(offset) > 0.5 * p[WIDTH] - EDGE or abs(z - z_lane) > LEVEL:
                break
            return lane, p[S] + share * (q[S] - p[S]), offset
    return -1, 0.0, 0.0


@kernel
def settle(
    lanes: LaneArrays,
    states: ActorStates,
    placed: Places,
    grade: Floats,
    bank: Floats,
    keys: NDArray[np.uint64],
    tick: int,
) -> None:
    """Find the lane under every present actor and put it on the road's surface.

    Writes states.z, `placed`, and the slopes along and across each body, rad. Beyond 20 m of any
    driving lane an actor keeps its height on level ground.
    """
    for i in range(len(grade)):
        grade[i] = bank[i] = 0.0
        place = placed[i]
        place.present = states.present[i]
        if not place.present:
            place.lane = -1
            continue
        x, y, yaw = states.x[i], states.y[i], states.yaw[i]
        place.x, place.y, place.yaw = x, y, yaw
        place.vx, place.vy, place.ax = states.vx[i], states.vy[i], states.ax[i]
        place.speed = states.vx[i] * cos(yaw) + states.vy[i] * sin(yaw)
        lane, s, offset = still_on_lane(lanes, place.lane, place.sample, x, y, states.z[i])
        if lane < 0:
            lane, s, offset = project_kernel(lanes, x, y, states.z[i], place.lane, True)
        place.lane = lane
        if lane < 0:
            continue
        place.sample, _ = segment_kernel(lanes, lane, s)
        _, _, z, heading, _, _, slope, cross, _ = sample_kernel(lanes, lane, s)
        tilt = tan(cross)
        states.z[i] = z + offset * tilt
        place.s, place.offset, place.heading = s, offset, heading
        place.v = states.vx[i] * cos(heading) + states.vy[i] * sin(heading)
        c, sn = cos(yaw - heading), sin(yaw - heading)
        grade[i] = atan(slope * c + tilt * sn)
        bank[i] = atan(tilt * c - slope * sn)
        bank[i] += ROAD_NOISE * (2.0 * uniform(keys[i], tick, NOISE_SALT) - 1.0)
