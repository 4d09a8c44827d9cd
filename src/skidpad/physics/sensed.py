"""Stability and traction control from wheel speeds, yaw rate and accelerometers, never from the friction.

Speed: the fastest wheel while the car brakes, else the slowest one, each seen from the middle of the car by
the yaw rate; it changes no faster than the accelerometer says and a margin. Grip that is known to be there
is what the car has just used. A yaw rate may exceed what the path curves, a_y / v, by a margin, which a
turn-in needs. Side slip is the integral of a_y / v - r, drawn back to that of the linear car within a
second. From these `stability.correction` asks for a turn, whose moment is limited in size and in rise.
Traction control takes the engine back while a driven wheel spins, holds it, and gives it again (engine
first: Buick Encore 2017, service manual, "Traction Control System"; wheels that do not drive as reference:
Saab 9-3 2003, "TCS"). Bounds, rates, margins and times are ours (assumptions).
Left out: brakes against one spinning wheel, and offsets and noise of sensors.
"""

from __future__ import annotations

from math import sqrt

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.constants import G
from skidpad.physics.rollover import MEMORY as FIRST
from skidpad.physics.stability import (
    A_YAW_CUT,
    RATE_SHARE,
    V_LEAST,
    Correction,
    Model,
    Motion,
    correction,
)

# Columns of a vehicle's memory: m/s; share of g that was used; rad; rad/s^2; share of the drive; whether
# it is being taken back; counts
SPEED, USED, SIDE, TURN, DRIVE, CUTTING, CUTS, STEPS = range(FIRST, FIRST + 8)
MEMORY = FIRST + 8

# m/s^2 by which the speed may change faster than the accelerometer says: slopes of 15 %; under brakes
# all wheels may slip at once
MARGIN, MARGIN_BRAKED = 1.5, 0.5
FORGET = 1.5  # s in which the grip that was used is forgotten
SETTLE = 1.0  # s in which side slip returns to that of the linear car
EXCESS = 0.10  # rad/s
USED_MOST = 1.2  # of g
TURN_MOST, RISE, FALL = 8.0, 40.0, 80.0  # rad/s^2, and rad/s^3 up and back
SPIN_HIGH, SPIN_LOW = 0.20, 0.08  # slip at which the engine is taken back, and given again
V_SPIN = 2.0  # m/s, least speed by which a spin is divided
CUT, RAISE = 10.0, 1.0  # 1/s of the drive


@inner_kernel
def note_motion(
    m: Floats, omega: Floats, radius: float, half_track: float, yaw_rate: float, a_x: float,
    a_y: float, braked: bool, h: float,
) -> None:  # fmt: skip
    """Moves speed and used grip in `m` on by h seconds, from what the car measures.

    omega (4,): rad/s; radius, half_track: m; a_x, a_y: specific force, m/s^2.
    """
    slowest, fastest = 1.0e9, 0.0
    for w in range(4):
        arm = half_track if w % 2 == 0 else -half_track
        seen = omega[w] * radius + yaw_rate * arm
        slowest, fastest = min(slowest, seen), max(fastest, seen)
    wheels = fastest if braked else max(slowest, 0.0)
    if m[STEPS] == 0.0:
        m[SPEED], m[DRIVE] = wheels, 1.0
    m[STEPS] += 1.0
    expected = m[SPEED] + a_x * h
    margin = (MARGIN_BRAKED if braked else MARGIN) * h
    m[SPEED] = min(max(wheels, expected - margin), expected + margin)
    used = sqrt(a_x * a_x + a_y * a_y) / G
    m[USED] = max(used, m[USED] * (1.0 - h / FORGET))


@inner_kernel
def sensed_correction(
    m: Floats, model: Model, to_rear: float, yaw_rate: float, a_y: float, steer: float, h: float
) -> Correction:
    """Returns what stability control asks for by what it measured; moves side slip and turn in `m` on.

    to_rear: m from the middle to the rear axle. Nothing is asked for below V_LEAST.
    """
    u = m[SPEED]
    if u < V_LEAST:
        m[TURN] = m[SIDE] = 0.0
        return Correction(0.0, False, 1.0)
    linear = to_rear * yaw_rate / u - a_y / G * model.slip_slide / 3.0
    m[SIDE] += h * (a_y / u - yaw_rate + (linear - m[SIDE]) / SETTLE)
    known = min(max(m[USED], (abs(a_y) + EXCESS * u) / (RATE_SHARE * G)), USED_MOST)
    slip = m[SIDE] - to_rear * yaw_rate / u
    asked = correction(Motion(u, yaw_rate, slip, steer, known), model).turn
    asked = min(max(asked, -TURN_MOST), TURN_MOST)
    grows = asked * m[TURN] >= 0.0 and abs(asked) > abs(m[TURN])
    step = (RISE if grows else FALL) * h
    m[TURN] += min(max(asked - m[TURN], -step), step)
    turn = m[TURN]
    return Correction(turn, turn * yaw_rate > 0.0, max(1.0 - abs(turn) / A_YAW_CUT, 0.0))


@inner_kernel
def limit_drive(
    m: Floats, omega: Floats, radius: float, half_track: float, yaw_rate: float, front: float,
    pedal: bool, h: float,
) -> float:  # fmt: skip
    """Returns the share of the drive that traction control leaves h seconds later; keeps it in `m`.

    front: share of the drive at the front axle. 1 without a pedal.
    """
    spin = 0.0
    for w in range(4):
        if (front if w < 2 else 1.0 - front) > 0.0:
            arm = half_track if w % 2 == 0 else -half_track
            over = omega[w] * radius - (m[SPEED] - yaw_rate * arm)
            spin = max(spin, over / max(m[SPEED], V_SPIN))
    if not pedal:
        m[DRIVE], m[CUTTING] = 1.0, 0.0
    elif spin > SPIN_HIGH:
        m[CUTS] += 1.0 - m[CUTTING]
        m[DRIVE], m[CUTTING] = max(m[DRIVE] - CUT * h, 0.0), 1.0
    elif spin < SPIN_LOW:
        m[DRIVE], m[CUTTING] = min(m[DRIVE] + RAISE * h, 1.0), 0.0
    return float(m[DRIVE])
