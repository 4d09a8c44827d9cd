"""What an environment says of each tick: a vehicle's own motion, its lane, and the vehicle ahead.

Perception is ideal up to `REACH`; friction is not observed, only what the car feels of it.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.simulation.world.feel import feel_motion
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.step import Arena

REACH = 150.0  # m to the vehicle ahead; farther ones are not observed
LONGEST = 30.0  # m by which the middle of a vehicle may lie beyond REACH
FASTEST = 100.0  # m/s, bound of speeds


class Quantity(NamedTuple):
    """One number of an observation."""

    name: str
    unit: str
    low: float
    high: float


OBSERVED = (
    Quantity("speed", "m/s", -FASTEST, FASTEST),  # along the body
    Quantity("ax", "m/s^2", -100.0, 100.0),
    Quantity("ay", "m/s^2", -100.0, 100.0),
    Quantity("yaw_rate", "rad/s", -20.0, 20.0),
    Quantity("wheel_slip", "m/s", -FASTEST, FASTEST),  # slowest wheel minus speed
    Quantity("lane_offset", "m", -20.0, 20.0),  # left of the lane's centre
    Quantity("heading_error", "rad", -3.2, 3.2),
    Quantity("curvature", "1/m", -1.0, 1.0),  # of the lane here, left positive
    Quantity("limit", "m/s", 0.0, FASTEST),
    Quantity("gap", "m", -10.0, REACH),  # bumper to bumper; REACH without a vehicle ahead
    Quantity("closing_speed", "m/s", -FASTEST, FASTEST),  # positive when closing; 0 without one
    Quantity("has_lead", "1", 0.0, 1.0),
)
LOW = np.array([q.low for q in OBSERVED], dtype=np.float32)
HIGH = np.array([q.high for q in OBSERVED], dtype=np.float32)
GAP, CLOSING = 9, 10  # columns
Observations = NDArray[np.float32]  # (n, len(OBSERVED))


@kernel
def observe(arena: Held[Arena], out: Observations) -> None:
    """Writes what the first vehicles observe in this tick, within its bounds; a row of `out` for each."""
    placed, net = arena.value.rows.placed, arena.value.streets.net
    for i in range(len(out)):
        here, row = placed[i], out[i]
        _, _, _, _, _, yaw, speed, yaw_rate, ax, ay, fl, fr, rl, rr = feel_motion(arena, i)
        row[0], row[1], row[2], row[3] = speed, ax, ay, yaw_rate
        row[4] = min(fl, fr, rl, rr) - speed
        row[5:] = 0.0
        row[GAP] = REACH
        if here.lane >= 0:
            point = net.point[here.sample]
            turned = (yaw - here.heading + pi) % (2.0 * pi) - pi
            row[5], row[6] = here.offset, pi if turned == -pi else turned
            row[7], row[8] = point.curvature, point.limit
            lead, way = find_lead(placed, net.lane, i)
            if lead >= 0:
                gap = way - placed[lead].half_length - here.half_length
                if gap <= REACH:
                    row[GAP], row[CLOSING], row[11] = gap, here.v - placed[lead].v, 1.0
        for k in range(len(row)):
            row[k] = min(max(row[k], LOW[k]), HIGH[k])


@inner_kernel
def find_lead(placed: Places, lanes: NDArray[np.void], i: int) -> tuple[int, float]:
    """Returns the nearest vehicle ahead on the lanes that follow straight on, and the m to its middle.

    Row -1: none is near. Lanes are followed until the first one comes again.
    """
    here = placed[i]
    lane, begin = here.lane, -here.s  # m from the vehicle to the lane's begin
    while begin <= REACH + LONGEST:
        nearest, lead = np.inf, -1
        for j in range(len(placed)):
            if placed[j].lane == lane and placed[j].present:
                way = begin + placed[j].s
                if j != i and 0.0 < way < nearest:
                    nearest, lead = way, j
        if lead >= 0:
            return lead, nearest
        begin += lanes[lane].length
        lane = lanes[lane].ahead
        if lane < 0 or lane == here.lane:
            break
    return -1, np.inf
