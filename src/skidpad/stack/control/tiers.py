"""The seven tiers: an ordered list of rules of which the first that makes a request wins.

Distances in m, speeds in m/s unless the name says km/h. The rules know nothing of sensors. NaN: none.
"""

from __future__ import annotations

from math import isnan, sqrt
from typing import NamedTuple

from skidpad.core.kernels.jit import kernel
from skidpad.core.run import Function
from skidpad.core.settings.stack import (
    CruiseLaw,
    Follower,
    LightBraking,
    StackSettings,
    Unconfirmed,
)
from skidpad.core.vocabulary import Tier
from skidpad.stack.configurations import Functions
from skidpad.stack.control.pid import DISTANCE_GAINS, SPEED_GAINS, regulate
from skidpad.stack.control.steady import hold_speed
from skidpad.stack.memory import Record
from skidpad.stack.timing import ticks_to_reach

V_GAP_MIN = 0.1  # m/s, divisor of the time gap
TOO_CLOSE = 5.0  # m
HARD_STOP_ABOVE_KMH = 10.0  # km/h
CREEP_KMH = 3.0  # km/h; below it the target is verified first
EMERGENCY_GAP = 0.75  # s
EMERGENCY_FULL_GAP = 1.2  # s
EMERGENCY_SPAN = 0.5  # s
EMERGENCY_BRAKE_MIN = 0.5
LEAD_LIGHT_RANGE = 50.0  # m
STAND_OFF = 2.5  # m kept behind the lead at a light
LEAD_HOLD = 2.0  # m
LEAD_DECELERATION = 2.5  # m/s^2
LEAD_V_MIN = 1.5  # m/s
LEAD_BRAKE_SPAN = 2.0  # m/s
LEAD_BRAKE_MIN = 0.4
LEAD_THROTTLE = 0.2
HANDBRAKE_BELOW_KMH = 3.0  # km/h
FOLLOW_GAP = 5.0  # s
FOLLOW_DISTANCE = 40.0  # m
TARGET_GAP = 2.5  # s
DEAD_BAND = 0.3  # s
HOLD_MARGIN = 0.1  # s
HOLD_THROTTLE_OPENING = 0.30
HOLD_THROTTLE = 0.15
HOLD_BRAKE = 0.10
OPEN_THROTTLE = 0.4
OPEN_THROTTLE_MORE = 0.4
OPEN_SPAN = 1.5  # s
CLOSE_BRAKE = 0.2
CLOSE_BRAKE_MORE = 0.3
CLOSE_SPAN = 1.0  # s
LINE_HOLD = 0.5  # m
LINE_NEAR = 5.0  # m
LINE_NEAR_DECELERATION = 0.5  # m/s^2
LINE_NEAR_BRAKE = 0.2
LINE_NEAR_THROTTLE = 0.15
LINE_DECELERATION = 1.5  # m/s^2
LINE_THROTTLE = 0.35
LINE_BRAKE_SPAN = 2.5  # m/s (eq. 18, A-133)
LINE_BRAKE_MIN = 0.3  # (eq. 18, A-133)
COAST_DURATION = 1.0  # s
COAST_ABOVE_KMH = 15.0  # km/h
COAST_BRAKE = 0.10
CRUISE_BRAKE_MAX = 0.2

(
    NONE, HARD_STOP, STOPPED_TOO_CLOSE, EMERGENCY, STOPPED_BEHIND_CAR, APPROACH, ACC_HOLD, ACC_OPEN,
    ACC_CLOSE, LIGHT_STOP, HOLDING_AT_LINE, COAST, CRUISE, BEND,
) = map(int, Tier)  # fmt: skip
# Modes after which the car coasts before it accelerates again.
COASTED_FROM = (
    HARD_STOP, STOPPED_TOO_CLOSE, EMERGENCY, STOPPED_BEHIND_CAR, ACC_HOLD, ACC_OPEN, ACC_CLOSE,
)  # fmt: skip


class Situation(NamedTuple):
    """What the tiers decide on."""

    v: float
    v_kmh: float
    distance: float  # to the detected target ahead
    gap: float  # s, time gap to it
    confirmed: bool  # seen for long enough, or by radar
    stop_distance: float  # to the line where the light assist wants to stop
    cruise_kmh: float
    follow_cap_kmh: float  # following gives no throttle above it


class Request(NamedTuple):
    """What a rule wants; every request starts from a fresh control (A-112)."""

    tier: int  # Tier, or -1: the rule leaves it to the next one
    throttle: float
    brake: float
    handbrake: bool


PASSED = Request(-1, 0.0, 0.0, False)
NO_ACTION = Request(NONE, 0.0, 0.0, False)


class TierRules(NamedTuple):
    """Which tiers a stack has, and what they do where the sources leave a choice."""

    brakes: bool  # tiers 1 to 3: with ACC, or with emergency braking alone
    follows: bool  # tier 5
    consumes: bool  # a target that is not confirmed ends the tick in tiers 1 and 3 (D-044)
    by_distance: bool  # the distance PID follows, not the zones (D-039)
    by_pid: bool  # the speed PID brakes before a line (D-047)
    steady: bool  # smooth pedals hold the cruise speed
    coast_ticks: int
    dt: float  # s


def tier_rules(functions: Functions, settings: StackSettings, dt: float) -> TierRules:
    """Returns the tiers of a set of functions; dt: s, one tick."""
    return TierRules(
        brakes=bool(functions & {Function.ACC, Function.AEB}),
        follows=Function.ACC in functions,
        consumes=settings.unconfirmed is Unconfirmed.CONSUME,
        by_distance=settings.follower is not Follower.ZONES,
        by_pid=settings.light_braking is LightBraking.SPEED_PID,
        steady=settings.cruise is CruiseLaw.STEADY,
        coast_ticks=ticks_to_reach(COAST_DURATION, dt),
        dt=dt,
    )


@kernel
def clip(value: float, low: float, high: float) -> float:
    """Returns the value limited to [low, high]."""
    return min(max(value, low), high)


@kernel
def time_gap(distance: float, v: float) -> float:
    """Returns the s to cover a measured distance in m at the ego's speed, V_GAP_MIN at least (A-110)."""
    return distance / max(v, V_GAP_MIN)


@kernel
def stopping_speed(deceleration: float, distance: float) -> float:
    """Returns the m/s from which `deceleration` just stops within `distance` (eq. 17, A-170); 0 beyond it."""
    return sqrt(2.0 * deceleration * max(distance, 0.0))


@kernel
def needs_verification(rules: TierRules, distance: float, v_kmh: float) -> bool:
    """Returns whether tier 2 at creeping speed needs the cameras to say that the target is real (A-115)."""
    return rules.brakes and distance < TOO_CLOSE and v_kmh <= CREEP_KMH


@kernel
def hard_stop(rules: TierRules, s: Situation) -> Request:
    """Tier 1: returns full brake when too close and moving (A-113); by D-044 before confirmation."""
    if s.distance < TOO_CLOSE and s.v_kmh > HARD_STOP_ABOVE_KMH:
        if s.confirmed:
            return Request(HARD_STOP, 0.0, 1.0, False)
        return NO_ACTION if rules.consumes else PASSED
    return PASSED


@kernel
def low_speed_stop(s: Situation) -> Request:
    """Tier 2: returns full brake when too close and slow; a standing ego's target was verified (A-114)."""
    if s.distance < TOO_CLOSE and s.v_kmh <= HARD_STOP_ABOVE_KMH:
        return Request(STOPPED_TOO_CLOSE, 0.0, 1.0, False)
    return PASSED


@kernel
def emergency(rules: TierRules, s: Situation) -> Request:
    """Tier 3: returns braking by urgency for a short time gap (eq. 11, A-117); by D-044 if not confirmed."""
    if s.gap < EMERGENCY_GAP:
        if s.confirmed:
            urgency = (EMERGENCY_FULL_GAP - s.gap) / EMERGENCY_SPAN
            return Request(EMERGENCY, 0.0, clip(urgency, EMERGENCY_BRAKE_MIN, 1.0), False)
        return NO_ACTION if rules.consumes else PASSED
    return PASSED


@kernel
def lead_at_light(m: Record, s: Situation) -> Request:
    """Tier 4: returns a hold, or the approach to the nearer of lead and line (A-119 to A-122).

    A hold lasts until no stop is asked for.
    """
    if isnan(s.stop_distance):
        m.holding = False
        return PASSED
    if isnan(s.distance) or s.stop_distance >= LEAD_LIGHT_RANGE:
        return PASSED
    effective = min(s.distance - STAND_OFF, s.stop_distance)
    if effective < LEAD_HOLD or m.holding:
        m.holding = True
        return Request(STOPPED_BEHIND_CAR, 0.0, 1.0, s.v_kmh < HANDBRAKE_BELOW_KMH)
    v_required = max(stopping_speed(LEAD_DECELERATION, effective), LEAD_V_MIN)
    if s.v > v_required:
        brake = clip((s.v - v_required) / LEAD_BRAKE_SPAN, LEAD_BRAKE_MIN, 1.0)
        return Request(APPROACH, 0.0, brake, False)
    return Request(APPROACH, LEAD_THROTTLE, 0.0, False)


@kernel
def zones(gap: float) -> Request:
    """Returns the actuation of following for a time gap in s, by its error (A-124 to A-128)."""
    error = round(gap - TARGET_GAP, 9)  # 2.8 - 2.5 falls just short of 0.3
    if error >= DEAD_BAND:
        more = OPEN_THROTTLE_MORE * min(error / OPEN_SPAN, 1.0)
        return Request(ACC_OPEN, OPEN_THROTTLE + more, 0.0, False)
    if error <= -DEAD_BAND:
        more = CLOSE_BRAKE_MORE * min(-error / CLOSE_SPAN, 1.0)
        return Request(ACC_CLOSE, 0.0, CLOSE_BRAKE + more, False)
    if error > HOLD_MARGIN:
        return Request(ACC_HOLD, HOLD_THROTTLE_OPENING, 0.0, False)
    if error < -HOLD_MARGIN:
        return Request(ACC_HOLD, 0.0, HOLD_BRAKE, False)
    return Request(ACC_HOLD, HOLD_THROTTLE, 0.0, False)


@kernel
def following(m: Record, rules: TierRules, s: Situation) -> Request:
    """Tier 5: returns throttle or brake that keep the time gap (A-123), no throttle above the cap (A-129).

    By zones, or by the distance PID (D-039), which aims at TARGET_GAP times the own speed.
    """
    if not (s.gap < FOLLOW_GAP or s.distance < FOLLOW_DISTANCE):
        return PASSED
    tier, throttle, brake, _ = zones(s.gap)
    if rules.by_distance:
        error = s.distance - TARGET_GAP * s.v
        u, m.distance_integral = regulate(
            DISTANCE_GAINS, rules.dt, m.distance_previous, m.distance_integral, error
        )
        m.distance_previous = error
        throttle, brake = max(u, 0.0), max(-u, 0.0)
    return Request(tier, 0.0 if s.v_kmh > s.follow_cap_kmh else throttle, brake, False)


@kernel
def regulate_speed(m: Record, rules: TierRules, error: float) -> float:
    """Returns the output of the speed PID for an error in km/h (A-107)."""
    u, m.speed_integral = regulate(SPEED_GAINS, rules.dt, m.speed_previous, m.speed_integral, error)
    m.speed_previous = error
    return u


@kernel
def light_stop(m: Record, rules: TierRules, s: Situation) -> Request:
    """Tier 6: returns what stops at a line without a lead, from approach to hold (A-130 to A-133)."""
    d = s.stop_distance
    if isnan(d):
        return PASSED
    if d < LINE_HOLD:
        return Request(HOLDING_AT_LINE, 0.0, 1.0, s.v_kmh < HANDBRAKE_BELOW_KMH)
    if d < LINE_NEAR:
        if s.v > stopping_speed(LINE_NEAR_DECELERATION, d):
            return Request(LIGHT_STOP, 0.0, LINE_NEAR_BRAKE, False)
        return Request(LIGHT_STOP, LINE_NEAR_THROTTLE, 0.0, False)
    v_required = stopping_speed(LINE_DECELERATION, d)
    if s.v < v_required:
        return Request(LIGHT_STOP, LINE_THROTTLE, 0.0, False)
    if rules.by_pid:
        brake = abs(regulate_speed(m, rules, (v_required - s.v) * 3.6))
    else:
        brake = clip((s.v - v_required) / LINE_BRAKE_SPAN, LINE_BRAKE_MIN, 1.0)
    return Request(LIGHT_STOP, 0.0, brake, False)


@kernel
def cruise(m: Record, rules: TierRules, s: Situation) -> Request:
    """Tier 7: returns coasting for a second after a lead, else what holds the cruise speed (A-134 to 136)."""
    if m.ticks_since_lead < rules.coast_ticks and s.v_kmh > COAST_ABOVE_KMH:
        return Request(COAST, 0.0, COAST_BRAKE, False)
    error = s.cruise_kmh - s.v_kmh
    if rules.steady:
        u, m.steady_integral = hold_speed(rules.dt, m.steady_integral, error)
    else:
        u = regulate_speed(m, rules, error)
    if u > 0.0:
        return Request(CRUISE, min(u, 1.0), 0.0, False)
    return Request(CRUISE, 0.0, min(-u, CRUISE_BRAKE_MAX), False)


@kernel
def reset_controllers(m: Record) -> None:
    """Resets the controllers, as after tiers 1 and 3 and after a relocation (A-109)."""
    m.speed_previous = m.speed_integral = m.steady_integral = 0.0
    m.distance_previous = m.distance_integral = 0.0


@kernel
def begin_tiers(m: Record, rules: TierRules) -> None:
    """Sets what the tiers remember to nothing: no hold, no coasting due, controllers at rest."""
    reset_controllers(m)
    m.holding, m.tier, m.ticks_since_lead = False, NONE, rules.coast_ticks


@kernel
def decide(m: Record, rules: TierRules, s: Situation) -> Request:
    """Returns the first request in the order of the tiers (A-111); call it once per tick.

    Tiers 1 and 3 reset the controllers, cruise that begins the distance controller (A-109).
    """
    request = hard_stop(rules, s) if rules.brakes else PASSED
    if request.tier < 0 and rules.brakes:
        request = low_speed_stop(s)
    if request.tier < 0 and rules.brakes:
        request = emergency(rules, s)
    if request.tier < 0:
        request = lead_at_light(m, s)
    if request.tier < 0 and rules.follows:
        request = following(m, rules, s)
    if request.tier < 0:
        request = light_stop(m, rules, s)
    if request.tier < 0:
        request = cruise(m, rules, s)  # it always makes a request, so that the hierarchy is total
    if request.tier in (HARD_STOP, EMERGENCY):
        reset_controllers(m)
    elif request.tier == CRUISE and m.tier != CRUISE:
        m.distance_previous = m.distance_integral = 0.0
    m.ticks_since_lead = 0 if request.tier in COASTED_FROM else m.ticks_since_lead + 1
    m.tier = request.tier
    return request
