"""Steering by a point on the lane ahead (A-142 to A-153). Left positive throughout."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple

from skidpad.core.geometry import Pose, kmh_from_mps
from skidpad.core.run import Function
from skidpad.core.settings.stack import Lookahead, StackSettings
from skidpad.roads.queries import LanePoint
from skidpad.stack.configurations import Functions

LOOKAHEAD_PER_KMH = 0.4  # m per km/h
LOOKAHEAD_MIN = 12.0  # m
LOOKAHEAD_MAX = 65.0  # m
LOOKAHEAD_FIXED = 12.0  # m (D-054)
GAIN_LOW_SPEED = 1.2
GAIN_FROM_KMH = 40.0  # km/h
GAIN_SLOPE = 0.008  # per km/h
GAIN_MIN = 0.35
DAMPING = 0.3
TARGET_TOO_NEAR = 0.1  # m
SMOOTHING_TIME = 0.10  # s
SMOOTHING_RATE = 3.0  # per s

# Where the lane is `distance` m further on, None where it ends: (distance, heading) -> place.
PathAhead = Callable[[float, float], LanePoint | None]


def lookahead_distance(v_kmh: float) -> float:
    """Returns the look-ahead of lane centring in m at a speed in km/h (eq. 12)."""
    return min(max(LOOKAHEAD_PER_KMH * v_kmh, LOOKAHEAD_MIN), LOOKAHEAD_MAX)


def steering_gain(v_kmh: float) -> float:
    """Returns the steer per rad, falling with speed in km/h (eq. 14)."""
    if v_kmh < GAIN_FROM_KMH:
        return GAIN_LOW_SPEED
    return max(GAIN_MIN, GAIN_LOW_SPEED - GAIN_SLOPE * (v_kmh - GAIN_FROM_KMH))


def angle_to(pose: Pose, target: LanePoint) -> float | None:
    """Returns the angle in rad from the heading to the target, positive to the left (eq. 13).

    None when it is nearer than TARGET_TOO_NEAR.
    """
    dx, dy = target.x - pose.x, target.y - pose.y
    if hypot(dx, dy) < TARGET_TOO_NEAR:
        return None
    c, s = cos(pose.yaw), sin(pose.yaw)
    return atan2(c * dy - s * dx, c * dx + s * dy)


def steer_command(angle: float, v_kmh: float) -> float:
    """Returns steer in [-1, 1] for the angle to the target in rad (A-146)."""
    damping = 1.0 - DAMPING * abs(angle) / pi
    return min(max(angle * steering_gain(v_kmh) * damping, -1.0), 1.0)


class LaneCentring:
    """Steers by a point whose distance grows with speed."""

    def __init__(self, lookahead: Lookahead) -> None:
        self.dynamic = lookahead is Lookahead.DYNAMIC

    def steer(self, pose: Pose, v: float, path: PathAhead) -> float:
        """Returns steer in -1..1, left positive, at `pose` and v m/s; 0 without a place to steer by."""
        v_kmh = kmh_from_mps(v)
        distance = lookahead_distance(v_kmh) if self.dynamic else LOOKAHEAD_FIXED
        return steer_towards(pose, v_kmh, path(distance, pose.yaw))


class LazyDriver:
    """A driver who ignores small errors and corrects the others by half (A-150)."""

    def __init__(self, lookahead: float, dead_band: float, gain: float) -> None:
        self.lookahead, self.dead_band, self.gain = lookahead, dead_band, gain

    def steer(self, pose: Pose, v: float, path: PathAhead) -> float:
        """Returns the steering command in -1..1 by a proportional law with a dead band; v: m/s.

        0 without a place to steer by.
        """
        command = steer_towards(pose, kmh_from_mps(v), path(self.lookahead, pose.yaw))
        return 0.0 if abs(command) < self.dead_band else self.gain * command


def steer_towards(pose: Pose, v_kmh: float, target: LanePoint | None) -> float:
    """Returns steer in [-1, 1] towards a place; 0 when there is none or it is too near."""
    angle = None if target is None else angle_to(pose, target)
    return 0.0 if angle is None else steer_command(angle, v_kmh)


Steering = LaneCentring | LazyDriver


def steering_of(functions: Functions, settings: StackSettings) -> Steering:
    """Returns lane centring if it is switched on, else the lazy driver."""
    if Function.LCA in functions:
        return LaneCentring(settings.lookahead)
    return LazyDriver(settings.lazy_lookahead, settings.lazy_dead_band, settings.lazy_gain)


class Smoothing:
    """First-order low-pass with a rate limit on the steer command (A-152)."""

    def __init__(self, dt: float) -> None:
        self.share = dt / (SMOOTHING_TIME + dt)
        self.step = SMOOTHING_RATE * dt
        self.reset()

    def reset(self) -> None:
        """Resets the smoothed command to a straight wheel."""
        self.steer = 0.0

    def update(self, command: float) -> float:
        """Returns the command of one more tick, smoothed and limited in its change."""
        change = self.share * (command - self.steer)
        self.steer += min(max(change, -self.step), self.step)
        return self.steer


class NoSmoothing(NamedTuple):
    """The command as it is."""

    def reset(self) -> None:
        """Does nothing, as nothing is remembered."""

    def update(self, command: float) -> float:
        """Returns the command as it is."""
        return command
