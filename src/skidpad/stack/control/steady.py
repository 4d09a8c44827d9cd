"""A cruise control with smooth pedals: proportional and integral, without a derivative.

The published PID (A-107) multiplies the change of the speed error per tick by 4.5: an acceleration
of 1 m/s^2 outweighs an error of 2 km/h, so that full throttle and brake take turns at constant speed.
"""

from __future__ import annotations

from skidpad.core.kernels.jit import kernel

# Ours. With 2.5 to 5 m/s^2 at full throttle the closed loop has 0.3 to 0.5 rad/s and a damping of 0.8
# or more; a steady grade or wind is made up for within about 5 s.
THROTTLE_GAIN = 0.06  # per km/h
INTEGRAL_GAIN = 0.012  # per km/h and s
COAST_BAND = 2.0  # km/h too fast, within which the engine's drag is brake enough
BRAKE_GAIN = 0.04  # per km/h beyond that


@kernel
def hold_speed(dt: float, integral: float, error: float) -> tuple[float, float]:
    """Returns throttle if positive, brake if negative, and the integral: the throttle that needs no error.

    error: wanted minus driven speed in km/h.
    """
    summed = integral + INTEGRAL_GAIN * error * dt
    if error < -COAST_BAND:
        return BRAKE_GAIN * (error + COAST_BAND), max(summed, 0.0)
    if 0.0 <= THROTTLE_GAIN * error + summed <= 1.0:  # no wind-up at the limits
        integral = summed
    return min(max(THROTTLE_GAIN * error + integral, 0.0), 1.0), integral
