"""The tyre: a brush (Fiala) with combined slip, load sensitivity and a fall-off past the peak.

Slip is a vector: what the contact patch moves over the road, divided by a reference speed. Force
grows along the brush curve up to mu * Fz; once the whole patch slides, at sigma = stiffness * slip
/ (3 mu Fz) = 1, it falls towards `SLIDE_SHARE` of that. Sideways the tyre is softer than along, so
the slip is weighted; a sliding patch knows no such difference, and the weights fade beyond sigma 1.
One magnitude for both directions keeps braking and cornering together inside the friction circle.
Sources: brush curve and its extension to a slip vector, Pacejka, Tire and Vehicle Dynamics; checked
here against bristles integrated one by one. Load: two measured tyres in Magic Formula terms,
205/60R15 (Pacejka, Tyre and Vehicle Dynamics, 2nd edition 2006, table A3.1) and 245/40R18 (Project
Chrono, Sedan_Pac02Tire.tir).
"""

from __future__ import annotations

from skidpad.core.kernels.jit import inner_kernel, kernel

SLIDE_SHARE = 0.88  # sliding to peak force; our assumption
FALL_OFF = 1.0 - SLIDE_SHARE
FALL_OFF_WIDTH = 2.0  # slip beyond the peak, in units of the peak slip, that halves the fall-off
V_SLIP_MIN = 2.0  # m/s, floor of the slip's reference speed, keeps standstill finite
# Share of mu lost when the load doubles, -PD2/PD1: 0.03 along and 0.15 across in the 205/60R15, 0.14
# and 0.17 in the 245/40R18. One value for both directions: their mean.
LOAD_GRIP = 0.12
GRIP_LEAST = 0.5  # of mu, however large the load; keeps the law finite
# Load over nominal at which cornering stiffness peaks, PKY2: 2.13 in the 205/60R15, 2.00 in the other.
LOAD_PEAK = 2.07
STIFFNESS_ALONG = 22.0  # per unit slip over load, PKX1: 21.5 and 22.3; nearly proportional to load
RELAXATION_RADII = 1.72  # PTY1 sin(2 atan(1 / PTY2)) of the 245/40R18: 0.59 m at radius 0.344 m


@kernel
def brush_curve(sigma: float) -> float:
    """Returns force over mu * Fz against slip over the slip of full sliding, sigma >= 0; at most 1."""
    if sigma < 1.0:
        return sigma * (3.0 + sigma * (sigma - 3.0))
    beyond = (sigma - 1.0) / FALL_OFF_WIDTH
    return SLIDE_SHARE + FALL_OFF / (1.0 + beyond * beyond)


@kernel
def brush_secant(sigma: float) -> float:
    """Returns force over (initial stiffness * slip) against sigma, sigma >= 0: 1 at first, then falling."""
    if sigma < 1.0:
        return 1.0 + sigma * (sigma / 3.0 - 1.0)
    return brush_curve(sigma) / (3.0 * sigma)


@inner_kernel
def grip_share(load: float) -> float:
    """Returns friction over that at nominal load; load over nominal. Magic Formula: PD1 + PD2 dfz."""
    return max(1.0 - LOAD_GRIP * (load - 1.0), GRIP_LEAST)


@inner_kernel
def stiffness_share(load: float) -> float:
    """Returns cornering stiffness per load over that at nominal load; load over nominal.

    Magic Formula: stiffness PKY1 Fz0 sin(2 atan(load / PKY2)), as sin(2 atan x) = 2 x / (1 + x^2).
    """
    x = load / LOAD_PEAK
    return (1.0 + 1.0 / (LOAD_PEAK * LOAD_PEAK)) / (1.0 + x * x)
