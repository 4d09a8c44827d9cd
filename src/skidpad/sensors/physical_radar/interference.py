"""Radars of other vehicles that raise the noise of ours, by the ways on which they see each other.

Every vehicle that has one carries it in the middle of its front, with the lobe of ours: an assumption, as
is that chirps cross ours in a hundredth of the samples at all times. A raised noise is a loss of all
else over the noise.
"""

from __future__ import annotations

from math import exp, log

import numpy as np

from skidpad.core.arrays import Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.sensors.noise import uniform
from skidpad.sensors.physical_radar.echoes import (
    RadarWorld,
    Screens,
    Sensor,
    is_behind_wall,
    is_hidden,
)
from skidpad.sensors.physical_radar.setup import RadarSetup

NEAREST = 1.0  # m between two antennas


@inner_kernel
def add_interference(
    radar: RadarSetup, world: RadarWorld, states: ActorStates, sensor: Sensor, screens: Screens,
    rails: Ints,
) -> Sensor:  # fmt: skip
    """The sensor whose losses hold what other radars add to its noise, in nepers; rails: walls in view."""
    origin, r = sensor.origin, sensor.rotation
    key, added = radar.key + np.uint64(5), 0.0
    for k in range(screens.row.size):
        i = screens.row[k]
        if not world.targets.lobed[i] or uniform(key, 0, i) >= radar.rivals:
            continue
        c, s, half = screens.cos[k], screens.sin[k], 0.5 * world.length[i]
        x, y = states.x[i] + half * c - origin[0], states.y[i] + half * s - origin[1]
        way = (x, y, states.z[i] + world.targets.rise[i] - origin[2])
        ahead = r[0, 0] * way[0] + r[1, 0] * way[1] + r[2, 0] * way[2]
        back = -(c * x + s * y)  # of our antenna before the other one
        if ahead <= 0.0 or back <= 0.0:
            continue
        ours = np.arctan2(r[0, 1] * way[0] + r[1, 1] * way[1] + r[2, 1] * way[2], ahead)
        theirs = np.arctan2(s * x - c * y, back)
        off = (ours / radar.wide) ** 2 + (theirs / radar.wide) ** 2
        if is_hidden(world, states, origin, screens, i, way):
            continue
        if is_behind_wall(world.walls, rails, origin, way):
            continue
        distance = max(np.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2), NEAREST)
        lost = 4.0 * log(2.0) * off + 0.5 * radar.air.loss * distance + sensor.wet
        added += radar.rival / (distance * distance) * exp(-lost)
    wet = sensor.wet + log(1.0 + added)
    return Sensor(origin, r, sensor.vx, sensor.vy, wet)
