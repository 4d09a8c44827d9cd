"""Car following: the improved intelligent driver model, whose gap at steady speed is the one asked for.

Source: Treiber and Kesting (2013), Traffic Flow Dynamics, section 11.3.7. The background's drivers
use the plain model (`eqs. 11.14, 11.15`), whose gaps grow beyond s0 + v T near the desired speed.
"""

from __future__ import annotations

import math
from math import inf, sqrt
from typing import NamedTuple

GAP_MIN = 2.0  # m
EXPONENT = 4.0  # of free acceleration


class Manner(NamedTuple):
    """How a driver follows at the present speed."""

    headway: float  # s
    a_max: float  # m/s^2
    b: float  # m/s^2, comfortable braking
    a_min: float  # m/s^2, the hardest braking


def free_acceleration(v: float, v_desired: float, m: Manner) -> float:
    """Returns the acceleration in m/s^2 on an empty road.

    Above the desired speed braking stays comfortable.
    """
    if v <= v_desired:
        return m.a_max * (1.0 - math.pow(v / max(v_desired, 0.1), EXPONENT))
    return -m.b * (1.0 - math.pow(v_desired / v, EXPONENT * m.a_max / m.b))


def wanted_gap(v: float, v_lead: float, m: Manner) -> float:
    """Returns the gap in m that is kept, or aimed at while closing; v, v_lead: m/s."""
    dynamic = v * m.headway + v * (v - v_lead) / (2.0 * sqrt(m.a_max * m.b))
    return GAP_MIN + max(0.0, dynamic)


def acceleration(v: float, v_desired: float, gap: float, v_lead: float, m: Manner) -> float:
    """Returns m/s^2, in [m.a_min, m.a_max], behind a leader at `gap` m (inf: none)."""
    free = free_acceleration(v, v_desired, m)
    if gap == inf:
        return max(m.a_min, free)
    z = wanted_gap(v, v_lead, m) / max(gap, 0.1)
    if v > v_desired:
        a = free if z < 1.0 else free + m.a_max * (1.0 - z * z)
    elif z >= 1.0:
        a = m.a_max * (1.0 - z * z)
    else:
        a = free * (1.0 - math.pow(z, 2.0 * m.a_max / max(free, 1e-3)))
    return max(m.a_min, a)
