"""Air that a lorry, a bus or a van pushes aside, as a wind on the vehicles that it passes or that pass it.

A Rankine body: a source of strength m at the front and a sink at the rear, whose velocities m / (4 pi r^2)
add up; far from its ends such a body has the cross section m / U in a stream U, by conservation of mass (MIT,
fluids modules, potential flows, "3D Rankine half-body" and "radius of the 3D Rankine body"). The road is a
mirror, so m = U 2 A with the frontal area A, width times height. The air so moved acts as wind does
(`physics.wind`), at the middle of each vehicle. Assumptions: that the air closes behind a lorry as
before it, though a real one leaves a wake of slower, turbulent air; that the force at a distance of a lane is
that of a uniform wind; no shelter from side wind. No force of a passing lorry could be read to compare with
(Howell, SAE 2014-01-0604 and 1973; Weir, Hoh and Teper 1973: abstracts). Valid: beside and around a
vehicle, not within its box.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.physics.types import VehicleType

FRONTAL_LEAST = 4.0  # m^2, width times height; cars have less, vans, buses and lorries more
REACH = 50.0  # m from an end, beyond which less than 0.01 m/s is left behind a lorry at 25 m/s


class Displacing(NamedTuple):
    """The m vehicles that push much air aside, arrays (m,)."""

    row: Ints
    strength: Floats  # m^2, of the source over the speed, over 4 pi
    half_length: Floats  # m
    half_width: Floats  # m


def displacing(types: Sequence[VehicleType], on: bool) -> Displacing:
    """Returns the vehicles that push air aside; none where the effect is off."""
    large = [i for i, t in enumerate(types) if on and t.width * t.height >= FRONTAL_LEAST]
    return Displacing(
        np.array(large, dtype=np.int64),
        np.array([2.0 * types[i].width * types[i].height / (4.0 * pi) for i in large]),
        np.array([0.5 * types[i].length for i in large]),
        np.array([0.5 * types[i].width for i in large]),
    )


@inner_kernel
def fill_air(
    states: ActorStates, large: Displacing, wind_x: float, wind_y: float, air: Floats
) -> None:
    """Writes the velocity of the air at each vehicle, (n, 2) in m/s in world axes.

    wind_x, wind_y: m/s of the undisturbed air.
    """
    for i in range(len(air)):
        air[i, 0], air[i, 1] = wind_x, wind_y
    for k in range(len(large.row)):
        j = large.row[k]
        if not states.present[j]:
            continue
        c, s = cos(states.yaw[j]), sin(states.yaw[j])
        speed = (states.vx[j] - wind_x) * c + (states.vy[j] - wind_y) * s
        for i in range(len(air)):
            if i == j or not states.present[i]:
                continue
            for end in (1.0, -1.0):
                x = states.x[i] - states.x[j] - end * large.half_length[k] * c
                y = states.y[i] - states.y[j] - end * large.half_length[k] * s
                r = max(sqrt(x * x + y * y), large.half_width[k])
                if r < REACH:
                    share = end * speed * large.strength[k] / (r * r * r)
                    air[i, 0] += share * x
                    air[i, 1] += share * y
