"""Waiting at zebras for pedestrians that walk over them or step from the kerb."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from skidpad.core.kernels.jit import inner_kernel
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.traffic.care import reach
from skidpad.simulation.world.traffic.path import PATH
from skidpad.simulation.world.traffic.right_of_way import REACH
from skidpad.simulation.world.traffic.state import Drivers, Streets, View

KERB = 0.5  # m beside the road from which a pedestrian in motion counts as on the zebra
V_WALKING = 0.1  # m/s


@inner_kernel
def note_walkers(streets: Streets, placed: Places) -> None:
    """Notes in `streets.busy` the zebras on which a pedestrian walks, or steps from the kerb."""
    for z in range(len(streets.zebras)):
        zebra = streets.zebras[z]
        c, s = cos(zebra[2]), sin(zebra[2])
        streets.busy[z] = False
        for i in streets.walkers:
            who = placed[i]
            if not who.present or who.vx * who.vx + who.vy * who.vy <= V_WALKING * V_WALKING:
                continue
            dx, dy = who.x - zebra[0], who.y - zebra[1]
            along, across = c * dx + s * dy, -s * dx + c * dy
            if abs(along) < zebra[3] + KERB and abs(across) < zebra[4]:
                streets.busy[z] = True


@inner_kernel
def zebra_gap(view: View, d: Drivers, i: int) -> float:
    """Returns the m from the front bumper to a zebra on which a pedestrian walks; inf: none within reach."""
    body = view.placed[i]
    start = -d.state[i].s - body.half_length
    far = reach(view.care, body.speed, REACH)
    for k in range(PATH):
        lane = d.path[i, k]
        if lane < 0 or start > far:
            break
        entry = view.streets.entry[lane]
        for row in range(entry.zebra_first, entry.zebra_first + entry.zebras):
            gap = start + view.streets.zebra[row].s - 1.0
            if gap > -1.0 and view.streets.busy[view.streets.zebra[row].zebra]:
                return float(max(gap, 0.1))
        start += view.streets.net.lane[lane].length
    return np.inf
