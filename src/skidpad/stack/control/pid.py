"""The published controller (A-103 to A-109)."""

from __future__ import annotations

from dataclasses import dataclass

INTEGRAL_LIMIT = 50.0  # of the error times s


@dataclass(frozen=True, slots=True)
class Gains:
    """Holds a controller's gains and the limits of its output."""

    kp: float
    ki: float
    kd: float
    low: float = -1.0
    high: float = 1.0


SPEED_GAINS = Gains(0.4, 0.0132, 0.225)  # error in km/h
DISTANCE_GAINS = Gains(0.2, 0.005, 1.2)  # error in m


class Pid:
    """u = kp e + ki I + kd de/dt, clipped; I is clipped before use (eq. 1)."""

    def __init__(self, gains: Gains, dt: float) -> None:
        self.gains, self.dt = gains, dt
        self.reset()

    def reset(self) -> None:
        """Clears the previous error and the integral (A-106)."""
        self.previous = 0.0
        self.integral = 0.0

    def update(self, error: float) -> float:
        """Returns the output for the error of one more step of dt.

        After a reset the first error counts as a step.
        """
        g = self.gains
        self.integral += error * self.dt
        self.integral = min(max(self.integral, -INTEGRAL_LIMIT), INTEGRAL_LIMIT)
        derivative = (error - self.previous) / self.dt if self.dt > 0.0 else 0.0
        self.previous = error
        u = g.kp * error + g.ki * self.integral + g.kd * derivative
        return min(max(u, g.low), g.high)
