"""The tyre: an isotropic brush (Fiala) with combined slip and a fall-off past the peak.

Slip is a vector: what the contact patch moves over the road, divided by a reference speed. Force
points against it and grows along the brush curve up to mu * Fz; once the whole patch slides the
force falls towards `SLIDE_SHARE` of that. One magnitude for both directions keeps every combination
of braking and cornering inside the friction circle. Source: Pacejka, Tire and Vehicle Dynamics
(2012), section 3.3 (brush model, isotropic); fall-off after section 1.2 (sliding below peak).
"""

from __future__ import annotations

from math import sqrt

from skidpad.core.jit import kernel

SLIDE_SHARE = 0.88  # sliding to peak force; locked-wheel stops on dry asphalt, Noon (1994)
FALL_OFF = 1.0 - SLIDE_SHARE
FALL_OFF_WIDTH = 2.0  # slip beyond the peak, in units of the peak slip, that halves the fall-off
V_SLIP_MIN = 2.0  # m/s, floor of the slip's reference speed, keeps standstill finite


@kernel
def brush_curve(sigma: float) -> float:
    """Force over mu * Fz against slip over the slip of full sliding, sigma >= 0; at most 1."""
    if sigma < 1.0:
        return sigma * (3.0 + sigma * (sigma - 3.0))
    beyond = (sigma - 1.0) / FALL_OFF_WIDTH
    return SLIDE_SHARE + FALL_OFF / (1.0 + beyond * beyond)


@kernel
def force_per_slip(slip: float, stiffness: float, grip: float) -> float:
    """Secant of the force curve in N per unit slip.

    slip: magnitude, >= 0. stiffness: initial slope in N. grip: mu * Fz in N.
    """
    if grip <= 0.0:
        return 0.0
    theta = stiffness / (3.0 * grip)
    sigma = theta * slip
    if sigma < 1.0:
        return stiffness * (1.0 + sigma * (sigma / 3.0 - 1.0))
    return grip * brush_curve(sigma) / slip


@kernel
def tyre_force(
    v_x: float, v_y: float, v_rim: float, stiffness: float, grip: float
) -> tuple[float, float]:
    """Force of the road on the tyre in the wheel's own axes, N.

    v_x, v_y: velocity of the wheel's centre along and left of its plane. v_rim: omega * radius.
    """
    reference = max(sqrt(v_x * v_x + v_y * v_y), abs(v_rim), V_SLIP_MIN)
    s_x = (v_rim - v_x) / reference
    s_y = -v_y / reference
    k = force_per_slip(sqrt(s_x * s_x + s_y * s_y), stiffness, grip)
    return k * s_x, k * s_y
