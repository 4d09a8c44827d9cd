"""Slowing for bends by the map: a function that no published configuration has."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, sqrt

from skidpad.core.kernels.jit import kernel
from skidpad.stack.control.tiers import BEND, Request, clip, stopping_speed
from skidpad.stack.timing import ticks_to_reach

# Lateral acceleration: of 2, 3 and 4 m/s^2 on a test track, 28 drivers often called the first too
# slow and the last too fast ("Optimal Lateral Acceleration for Different Levels of Automated
# Driving", 2025, doi 10.31234/osf.io/kcw2d). The function knows no grip.
A_LATERAL = 3.0  # m/s^2
A_AHEAD = 1.5  # m/s^2, braking before a bend; as before a line
BRAKE_SPAN = 2.5  # m/s too fast for full brake; as before a line (eq. 18)
BRAKE_MAX = 0.4
LOOK_PERIOD = 0.2  # s between two looks along the road
STEP = 5.0  # m between two places looked at
STRAIGHT = 1e-5  # 1/m, less is no bend

CurvatureAhead = Callable[[float], float]  # 1/m at so many m further along the lane


def bend_speed(curvature: float) -> float:
    """Returns the m/s through a bend of `curvature` 1/m at A_LATERAL; inf on a straight."""
    return sqrt(A_LATERAL / abs(curvature)) if abs(curvature) > STRAIGHT else inf


def speed_before(v_bend: float, distance: float) -> float:
    """Returns the m/s allowed `distance` m before a bend that is driven at v_bend; inf for inf."""
    return sqrt(v_bend * v_bend + stopping_speed(A_AHEAD, distance) ** 2)


class BendSpeed:
    """The speed that the bends within braking distance allow."""

    def __init__(self, dt: float) -> None:
        self.period = ticks_to_reach(LOOK_PERIOD, dt)
        self.reset()

    def reset(self) -> None:
        """Resets the allowed speed to none, so that bends are looked at anew."""
        self.allowed, self.wait = inf, 0

    def update(self, v: float, curvature: CurvatureAhead) -> float:
        """Returns the m/s that bends within braking distance allow; inf: none is within reach.

        Looks along the road every LOOK_PERIOD s only; call it once per tick.
        """
        if self.wait == 0:
            self.wait = self.period
            places = range(int(v * v / (2.0 * A_AHEAD) / STEP) + 2)
            self.allowed = min(
                speed_before(bend_speed(curvature(k * STEP)), k * STEP) for k in places
            )
        self.wait -= 1
        return self.allowed


@kernel
def slow_for_bend(request: Request, v: float, v_allowed: float) -> Request:
    """Returns the request, or braking for a bend where that is harder; no throttle above v_allowed (m/s)."""
    if v <= v_allowed:
        return request
    brake = clip((v - v_allowed) / BRAKE_SPAN, 0.0, BRAKE_MAX)
    if brake > request.brake:
        return Request(BEND, 0.0, brake, False)
    return Request(request.tier, 0.0, request.brake, request.handbrake)
