"""One wheel for one substep: its slip, its torques, and the forces that body and wheel feel alike.

Spin is integrated semi-implicitly with the secant of the tyre curve, so locking and spin-up stay
stable at steps of 10 ms. Lateral slip follows the contact patch over the relaxation length.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from skidpad.core.kernels.jit import inner_kernel
from skidpad.physics.tyre import (
    STIFFNESS_ALONG,
    V_SLIP_MIN,
    brush_curve,
    brush_secant,
    grip_share,
    stiffness_share,
)

ABS_UTILISATION = 0.99  # of the grip that the idealised slip control keeps
ABS_RELEASE = 0.6  # of the grip, while a wheel is past its peak
TRACTION_UTILISATION = 0.95  # of the grip that idealised traction control lets drive and side take
TRACTION_RELEASE = 0.5  # of it, while a wheel spins
DRAG_CONTROL = 0.5  # of the grip, most that engine drag takes with anti-lock brakes; our assumption
MU_MIN = 1e-6  # keeps slip over grip finite


class Contact(NamedTuple):
    """A wheel on the road, in its own axes."""

    v_x: float  # m/s
    v_y: float
    omega: float  # rad/s
    slip_y: float  # lateral slip that the tyre feels
    load: float  # N
    mu: float  # at nominal load
    stiffness: float  # slip stiffness over that on a dry road


class Tyre(NamedTuple):
    """What a wheel is."""

    stiffness: float  # lateral, per unit slip over load, at nominal load
    nominal: float  # N
    relaxation: float  # m
    radius: float  # m
    inertia: float  # kg m^2


class Torques(NamedTuple):
    """What turns a wheel and holds it, and which controls stand between."""

    drive: float  # N at the tread, negative in reverse
    brake: float  # N m
    handbrake: float  # N m, past every control
    rolling: float  # of the load
    engine_drag: float  # N at the tread
    own: float  # N m that slow the wheel itself
    anti_lock: bool
    traction: bool


class Turned(NamedTuple):
    """A wheel after the substep."""

    omega: float
    slip_y: float
    slide: float  # slip over the slip of full sliding
    f_x: float  # N
    f_y: float
    held: float  # N that brakes could hold at standstill


@inner_kernel
def turn(c: Contact, tyre: Tyre, q: Torques, h: float) -> Turned:
    """Returns the wheel h seconds later, and the force on it meanwhile."""
    share = c.load / tyre.nominal
    mu = max(c.mu * grip_share(share), MU_MIN)
    grip = mu * c.load
    rim = c.omega * tyre.radius
    speed = sqrt(c.v_x * c.v_x + c.v_y * c.v_y)
    per_speed = 1.0 / max(speed, abs(rim), V_SLIP_MIN)
    s_x = (rim - c.v_x) * per_speed
    way = max(speed, V_SLIP_MIN) * h / tyre.relaxation
    s_y = c.slip_y + (-c.v_y * per_speed - c.slip_y) * way / (1.0 + way)
    softer = tyre.stiffness * stiffness_share(share) / STIFFNESS_ALONG
    slip = sqrt(s_x * s_x + softer * softer * s_y * s_y)
    stiffness = STIFFNESS_ALONG * c.stiffness
    sigma = stiffness * slip / (3.0 * mu)
    if sigma < 1.0:
        k = stiffness * c.load * brush_secant(sigma)
    else:  # towards a force against the slip itself
        softer = 1.0 - (1.0 - softer) / sigma
        k = grip * brush_curve(sigma) / sqrt(s_x * s_x + softer * softer * s_y * s_y)
    f_y = k * softer * s_y

    engine = min(q.engine_drag, DRAG_CONTROL * grip) if q.anti_lock else q.engine_drag
    drag = tyre.radius * (q.rolling * c.load + engine)
    brake = q.brake
    if q.anti_lock:
        past = sigma > 1.0 and s_x * c.v_x < 0.0
        limit = tyre.radius * grip * (ABS_RELEASE if past else ABS_UTILISATION)
        brake = min(brake, max(limit + q.own - drag, 0.0))
    brake += q.handbrake
    drive = q.drive
    if q.traction:
        most = _traction(grip, f_y, sigma > 1.0 and s_x * drive > 0.0) + drag / tyre.radius
        drive = min(max(drive, -most), most)
    omega = _spin(
        c.omega, drive * tyre.radius, brake + drag, k * per_speed, c.v_x, tyre.radius,
        tyre.inertia, h,
    )  # fmt: skip
    # Body and wheel feel the same force, that of the new spin; the secant may overshoot.
    f_x = k * (omega * tyre.radius - c.v_x) * per_speed
    square = f_x * f_x + f_y * f_y
    if square > grip * grip:
        cut = grip / sqrt(square)
        f_x, f_y = f_x * cut, f_y * cut
    return Turned(omega, s_y, sigma, f_x, f_y, min(brake / tyre.radius, grip))


@inner_kernel
def _traction(grip: float, f_y: float, spinning: bool) -> float:
    """Returns the most drive force in N that ideal traction control lets through beside a side force f_y."""
    share = TRACTION_UTILISATION * (TRACTION_RELEASE if spinning else 1.0)
    return sqrt(max(share * share * grip * grip - f_y * f_y, 0.0))


@inner_kernel
def _spin(
    omega: float, drive: float, resist: float, k: float, v_x: float, radius: float, inertia: float,
    h: float,
) -> float:  # fmt: skip
    """Returns the spin in rad/s after h seconds: implicit in the tyre (k in N per m/s), Coulomb in `resist`.

    drive, resist: N m. 0 where `resist` brings it to a stop within the step.
    """
    denominator = inertia + h * radius * radius * k
    free = (inertia * omega + h * (drive + radius * k * v_x)) / denominator
    loss = h * resist / denominator
    if abs(free) <= loss:
        return 0.0
    return free - loss if free > 0.0 else free + loss
