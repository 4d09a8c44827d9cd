"""Steering by a point on the lane ahead (A-142 to A-153). Left positive throughout."""

from __future__ import annotations

from math import atan2, cos, hypot, isnan, nan, pi, sin
from typing import NamedTuple

from skidpad.core.kernels.jit import kernel
from skidpad.core.run import Function
from skidpad.core.settings.stack import Lookahead, StackSettings
from skidpad.stack.configurations import Functions
from skidpad.stack.memory import Record

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


class SteeringRules(NamedTuple):
    """How a stack steers along its lane."""

    centres: bool  # lane centring; else small errors are ignored, others corrected in part
    lookahead: float  # m; 0: by speed
    dead_band: float  # steer that is ignored
    gain: float  # share of steer that is applied
    smooths: bool
    share: float  # of the change of the command that counts in one tick
    step: float  # most by which the command changes in one tick


def steering_rules(functions: Functions, settings: StackSettings, dt: float) -> SteeringRules:
    """Returns how a set of functions steers; dt: s, one tick."""
    centres = Function.LCA in functions
    fixed = LOOKAHEAD_FIXED if settings.lookahead is Lookahead.FIXED else 0.0
    return SteeringRules(
        centres=centres,
        lookahead=fixed if centres else settings.lazy_lookahead,
        dead_band=settings.lazy_dead_band,
        gain=settings.lazy_gain,
        smooths=settings.steer_smoothing,
        share=dt / (SMOOTHING_TIME + dt),
        step=SMOOTHING_RATE * dt,
    )


@kernel
def lookahead_distance(v_kmh: float) -> float:
    """Returns the look-ahead of lane centring in m at a speed in km/h (eq. 12)."""
    return min(max(LOOKAHEAD_PER_KMH * v_kmh, LOOKAHEAD_MIN), LOOKAHEAD_MAX)


@kernel
def steering_gain(v_kmh: float) -> float:
    """Returns the steer per rad, falling with speed in km/h (eq. 14)."""
    if v_kmh < GAIN_FROM_KMH:
        return GAIN_LOW_SPEED
    return max(GAIN_MIN, GAIN_LOW_SPEED - GAIN_SLOPE * (v_kmh - GAIN_FROM_KMH))


@kernel
def angle_to(x: float, y: float, yaw: float, target_x: float, target_y: float) -> float:
    """Returns the angle in rad from the heading to the target, positive to the left (eq. 13).

    NaN when it is nearer than TARGET_TOO_NEAR, or NaN itself.
    """
    dx, dy = target_x - x, target_y - y
    if hypot(dx, dy) < TARGET_TOO_NEAR:
        return nan
    c, s = cos(yaw), sin(yaw)
    return atan2(c * dy - s * dx, c * dx + s * dy)


@kernel
def steer_command(angle: float, v_kmh: float) -> float:
    """Returns steer in [-1, 1] for the angle to the target in rad (A-146)."""
    damping = 1.0 - DAMPING * abs(angle) / pi
    return min(max(angle * steering_gain(v_kmh) * damping, -1.0), 1.0)


@kernel
def look_distance(rules: SteeringRules, v_kmh: float) -> float:
    """Returns how far ahead on the lane the point lies that is steered by, in m (A-143, A-150)."""
    return rules.lookahead if rules.lookahead > 0.0 else lookahead_distance(v_kmh)


@kernel
def steer_towards(rules: SteeringRules, angle: float, v_kmh: float) -> float:
    """Returns steer in [-1, 1] for the angle to the target in rad; 0 for NaN: no place to steer by.

    Without lane centring, proportional with a dead band (A-150).
    """
    command = 0.0 if isnan(angle) else steer_command(angle, v_kmh)
    if rules.centres:
        return command
    return 0.0 if abs(command) < rules.dead_band else rules.gain * command


@kernel
def smooth(m: Record, rules: SteeringRules, command: float) -> float:
    """Returns the command of one more tick, low-passed and limited in its change if so set (A-152)."""
    if not rules.smooths:
        return command
    change = rules.share * (command - m.steer)
    m.steer += min(max(change, -rules.step), rules.step)
    return float(m.steer)
