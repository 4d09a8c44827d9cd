"""Electronic stability control: which brake torques, and how much less drive, keep a car turning as
it is steered.

The wanted yaw rate is that of the linear single-track model, within what the grip at hand allows;
the rear axle's slip angle is bounded apart. A car that turns too much is braked at the outer front
wheel, one that turns too little at the inner rear one; where the driver brakes already, the other
wheel of the axle is released by as much. Ideal in one respect: it is told the friction, which a
real one estimates. Brake-force distribution: no rear wheel is asked for more of its load than the
front axle is of its own, nor of more grip than the other one has.
Assumptions: the bound 0.85 mu g / v and the least speed of 20 km/h, which textbooks and UN
Regulation 140 are said to name but which we have not read there. Gains and dead bands are ours,
chosen on the sine with dwell (docs/physics.md).
"""

from __future__ import annotations

from typing import NamedTuple

from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.constants import G

V_LEAST = 20.0 / 3.6  # m/s
RATE_SHARE = 0.85  # of mu g / v, most yaw rate that is wanted
RATE_DEAD = 0.05  # rad/s
RATE_GAIN = 10.0  # 1/s, yaw acceleration for a yaw rate beyond the dead band
SLIP_DEAD = 0.6  # of the slip angle at which the rear tyres slide
SLIP_GAIN = 40.0  # 1/s^2, yaw acceleration for a rear slip angle beyond that
A_YAW_CUT = 1.0  # rad/s^2 of correction at which the engine is taken off whole


class Motion(NamedTuple):
    """What the control knows of the vehicle."""

    u: float  # m/s, forward
    yaw_rate: float  # rad/s
    slip_rear: float  # sideways over forward motion at the rear axle
    steer: float  # rad, road wheel
    mu: float


class Model(NamedTuple):
    """What the control knows about the vehicle beforehand."""

    wheelbase: float  # m
    understeer: float  # rad s^2/m
    slip_slide: float  # rear slip over friction at which the rear tyres slide


class Correction(NamedTuple):
    """What it asks for."""

    turn: float  # rad/s^2 of yaw acceleration, left positive
    rear: bool  # at the rear axle
    drive: float  # share of the drive force that is left


@inner_kernel
def correction(m: Motion, model: Model) -> Correction:
    """Returns the yaw acceleration that brakes have to give; none below V_LEAST or within the dead bands."""
    if m.u < V_LEAST:
        return Correction(0.0, False, 1.0)
    wanted = m.u * m.steer / (model.wheelbase + model.understeer * m.u * m.u)
    most = RATE_SHARE * m.mu * G / m.u
    error = min(max(wanted, -most), most) - m.yaw_rate
    turn = RATE_GAIN * (error - min(max(error, -RATE_DEAD), RATE_DEAD))
    dead = SLIP_DEAD * model.slip_slide * m.mu
    turn += SLIP_GAIN * (m.slip_rear - min(max(m.slip_rear, -dead), dead))
    left = max(1.0 - abs(turn) / A_YAW_CUT, 0.0)
    return Correction(turn, turn * m.yaw_rate > 0.0, left)
