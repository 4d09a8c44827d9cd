"""The published controller (A-103 to A-109)."""

from __future__ import annotations

from typing import NamedTuple

from skidpad.core.kernels.jit import kernel

INTEGRAL_LIMIT = 50.0  # of the error times s


class Gains(NamedTuple):
    """Holds a controller's gains and the limits of its output."""

    kp: float
    ki: float
    kd: float
    low: float = -1.0
    high: float = 1.0


SPEED_GAINS = Gains(0.4, 0.0132, 0.225)  # error in km/h
DISTANCE_GAINS = Gains(0.2, 0.005, 1.2)  # error in m


@kernel
def regulate(
    g: Gains, dt: float, previous: float, integral: float, error: float
) -> tuple[float, float]:
    """Returns u = kp e + ki I + kd de/dt, clipped, and the integral I, clipped before use (eq. 1).

    previous, integral: of the step before, 0 after a reset (A-106). No derivative without a step (A-105).
    """
    integral = min(max(integral + error * dt, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)
    derivative = (error - previous) / dt if dt > 0.0 else 0.0
    u = g.kp * error + g.ki * integral + g.kd * derivative
    return min(max(u, g.low), g.high), integral
