"""The tyre: an isotropic brush (Fiala) with combined slip and a fall-off past the peak.

Slip is a vector: what the contact patch moves over the road, divided by a reference speed. Force
points against it and grows along the brush curve up to mu * Fz; once the whole patch slides, at
sigma = stiffness * slip / (3 mu Fz) = 1, the force falls towards `SLIDE_SHARE` of that. One
magnitude for both directions keeps braking and cornering together inside the friction circle.
Source: Pacejka, Tire and Vehicle Dynamics (2012), section 3.3 (brush model, isotropic); fall-off
after section 1.2 (sliding below peak).
"""

from __future__ import annotations

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
def brush_secant(sigma: float) -> float:
    """Force over (initial stiffness * slip) against sigma, sigma >= 0: 1 at first, then falling."""
    if sigma < 1.0:
        return 1.0 + sigma * (sigma / 3.0 - 1.0)
    return brush_curve(sigma) / (3.0 * sigma)
