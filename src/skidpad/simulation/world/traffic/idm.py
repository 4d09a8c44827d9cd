"""Intelligent Driver Model: longitudinal acceleration behind a leader or alone.

Source: Treiber and Kesting (2013), Traffic Flow Dynamics, eqs. 11.14, 11.15 (IDM) and 11.23
(deceleration above the desired speed stays comfortable); parameters of Kesting, Treiber, Helbing
(2010), Enhanced intelligent driver model, table 1.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.kernels.jit import kernel

T_HEADWAY = 1.5  # s
GAP_MIN = 2.0  # m
A_MAX = 1.4  # m/s^2
B_COMFORT = 2.0  # m/s^2
A_EMERGENCY = -8.0  # m/s^2, the hardest braking that is asked of a car
# m/s^2, lateral acceleration that drivers accept at road speeds: Reymond et al. (2001), Human
# Factors 43(3). CARLA's Traffic Manager has 0.6 g, which leaves no grip for anything else.
A_CURVE = 3.5


class Character(NamedTuple):
    """How somebody follows."""

    headway: float = T_HEADWAY  # s
    a_max: float = A_MAX  # m/s^2
    b: float = B_COMFORT  # m/s^2, comfortable braking
    a_min: float = A_EMERGENCY  # m/s^2, the hardest braking
    is_exact: bool = False  # the steady gap is GAP_MIN + v headway at any speed: the improved model


@kernel
def improved(z: float, free: float, c: Character) -> float:
    """Returns the m/s^2 of the improved model; z: wanted over real gap, free: m/s^2 without a leader.

    Source: Treiber and Kesting (2013), eqs. 11.24 to 11.26.
    """
    closeness = c.a_max * (1.0 - z * z)
    if free <= 0.0:
        return free if z < 1.0 else max(c.a_min, free + closeness)
    if z >= 1.0:
        return max(c.a_min, closeness)
    return float(free * (1.0 - z ** (2.0 * c.a_max / max(free, 1e-6))))


@kernel
def idm(v: float, v_desired: float, gap: float, v_lead: float, c: Character) -> float:
    """Returns the acceleration in m/s^2 behind a leader at `gap` m; gap inf: no leader.

    At most c.a_max; with a leader at least c.a_min.
    """
    if v <= v_desired:
        free = c.a_max * (1.0 - (v / max(v_desired, 0.1)) ** 4)
    else:
        free = -c.b * (1.0 - (v_desired / v) ** (4.0 * c.a_max / c.b))
    if gap == np.inf:
        return free
    wanted = GAP_MIN + max(0.0, v * c.headway + v * (v - v_lead) / (2.0 * sqrt(c.a_max * c.b)))
    if c.is_exact:
        return improved(wanted / max(gap, 0.1), free, c)
    interaction = c.a_max * (wanted / max(gap, 0.1)) ** 2
    return max(c.a_min, free - interaction)
