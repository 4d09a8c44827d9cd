"""The road under each actor: lane, height, slope; and the tiny noise of a real surface."""

from __future__ import annotations

from math import atan, cos, sin, tan
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.roads.along import signal_ahead
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
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.rows import Rows
from skidpad.simulation.world.traffic.path import uniform

ROAD_NOISE = 1.0e-4  # rad of cross slope, uniform: breaks perfect symmetry (decision M-11)
NOISE_SALT = 7
STEPS = 6  # samples, more than a vehicle passes in one tick
LIGHT = int(SignalKind.LIGHT)
A_COMFORT = 4.0  # m/s^2 with which a driver stops at a red light
ZONE_MIN = 6.0  # m before the stop line within which a standing vehicle is held
PASSED = 1.0  # m behind the stop line up to which the light still governs
EDGE = 0.05  # m from the lane's edge within which the nearest lane is searched
LEVEL = 1.0  # m of height that still is the same road


@inner_kernel
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


@inner_kernel
def settle(lanes: LaneArrays, rows: Rows, noise: float, driving: bool, tick: int) -> None:
    """Finds the lane under every present actor and puts those that are grounded on its surface.

    Writes states.z, `placed`, and the slopes along and across each body, rad. An actor keeps its lane
    while it is inside, else gets the nearest one (driving: of driving lanes only). Beyond 20 m of a
    lane it keeps its height on level ground. noise: rad, bound of an error of the cross slope that
    is drawn for each actor and tick.
    """
    states, placed, grade, bank = rows.states, rows.placed, rows.grade, rows.bank
    for i in range(len(grade)):
        grade[i] = bank[i] = 0.0
        place = placed[i]
        place.present = states.present[i]
        if not place.present:
            place.lane = -1
            continue
        x, y, yaw = states.x[i], states.y[i], states.yaw[i]
        place.x, place.y, place.yaw, place.yaw_rate = x, y, yaw, states.yaw_rate[i]
        place.vx, place.vy, place.ax = states.vx[i], states.vy[i], states.ax[i]
        place.speed = states.vx[i] * cos(yaw) + states.vy[i] * sin(yaw)
        lane, s, offset = still_on_lane(lanes, place.lane, place.sample, x, y, states.z[i])
        if lane < 0:
            lane, s, offset = project_kernel(lanes, x, y, states.z[i], driving)
        place.lane = lane
        if lane < 0:
            continue
        place.sample, _ = segment_kernel(lanes, lane, s)
        _, _, z, heading, _, _, slope, cross, _ = sample_kernel(lanes, lane, s)
        tilt = tan(cross)
        if rows.grounded[i]:
            states.z[i] = z + offset * tilt
        place.s, place.offset, place.heading = s, offset, heading
        place.v = states.vx[i] * cos(heading) + states.vy[i] * sin(heading)
        c, sn = cos(yaw - heading), sin(yaw - heading)
        grade[i] = atan(slope * c + tilt * sn)
        bank[i] = atan(tilt * c - slope * sn)
        bank[i] += noise * (2.0 * uniform(rows.keys[i], tick, NOISE_SALT) - 1.0)


class RoadSigns(NamedTuple):
    """What the road tells n drivers; arrays (n,)."""

    limit: Floats  # m/s, NaN where the map gives none
    signal: Ints  # row of the governing light's signal, -1: none


@kernel
def _read_signs(map: Held[LaneArrays], placed: Places, limit: Floats, signal: Ints) -> None:
    """Writes each actor's speed limit in m/s (or NaN) and the row of the light ahead (or -1)."""
    lanes = map.value
    for i in range(len(placed)):
        place = placed[i]
        lane = np.int64(place.lane)  # as others ask, else the road's kernels are compiled once more
        limit[i], signal[i] = np.nan, -1
        if lane < 0:
            continue
        _, _, _, _, _, _, _, _, limit[i] = sample_kernel(lanes, lane, place.s)
        turned = cos(place.yaw - place.heading) < 0.5
        if lanes.drivable[lane] == 0 or turned or place.v < -0.5:
            continue
        front = place.s + place.half_length - PASSED
        reach = ZONE_MIN + PASSED + place.v * place.v / (2.0 * A_COMFORT)
        start = min(front, lanes.length[lane])
        row, gap = signal_ahead(lanes, lane, start, reach + front - start, LIGHT)
        if row >= 0 and gap - (front - start) >= 0.0:
            signal[i] = row


def read_signs(map: RoadMap, placed: Places) -> RoadSigns:
    """Limit and governing light at these places."""
    signs = RoadSigns(np.empty(len(placed)), np.empty(len(placed), dtype=np.int64))
    _read_signs(map.held, placed, signs.limit, signs.signal)
    return signs


def ground_height(map: RoadMap, x: float, y: float, z: float) -> float:
    """Height of the nearest lane of any kind, m; z beside all roads."""
    place = map.project(x, y, z, driving=False)
    return z if place is None else place.z
