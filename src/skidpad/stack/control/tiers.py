"""The seven tiers: an ordered list of rules of which the first that makes a request wins.

Distances in m, speeds in m/s unless the name says km/h. The rules know nothing of sensors.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple, Protocol

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
from skidpad.stack.control.pid import DISTANCE_GAINS, SPEED_GAINS, Pid
from skidpad.stack.control.steady import SteadySpeed
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

# Modes after which the car coasts before it accelerates again.
COASTED_FROM = frozenset(
    {
        Tier.HARD_STOP,
        Tier.STOPPED_TOO_CLOSE,
        Tier.EMERGENCY,
        Tier.STOPPED_BEHIND_CAR,
        Tier.ACC_HOLD,
        Tier.ACC_OPEN,
        Tier.ACC_CLOSE,
    }
)
RESET_BY = frozenset({Tier.HARD_STOP, Tier.EMERGENCY})


class Lead(NamedTuple):
    """Holds the detected target ahead, and whether it is sure."""

    distance: float
    gap: float  # s, time gap
    confirmed: bool  # seen for long enough, or by radar


class Situation(NamedTuple):
    """What the tiers decide on."""

    v: float
    v_kmh: float
    lead: Lead | None
    stop_distance: float | None  # to the line where the light assist wants to stop
    cruise_kmh: float
    follow_cap_kmh: float  # following gives no throttle above it


class Request(NamedTuple):
    """What a rule wants; every request starts from a fresh control (A-112)."""

    tier: Tier
    throttle: float = 0.0
    brake: float = 0.0
    handbrake: bool = False


NO_ACTION = Request(Tier.NONE)


class SpeedControl(Protocol):
    """Holds a speed: what any speed controller offers."""

    def reset(self) -> None:
        """Resets what the controller has summed up."""
        ...

    def update(self, error: float) -> float:
        """Returns throttle if positive, brake if negative; error: wanted minus driven speed in km/h."""
        ...


class Rule(Protocol):
    """Makes the request of one tier, or passes."""

    def __call__(self, s: Situation) -> Request | None:
        """Returns a request, or None to leave it to the next tier."""
        ...


def clip(value: float, low: float, high: float) -> float:
    """Returns the value limited to [low, high]."""
    return min(max(value, low), high)


def time_gap(distance: float, v: float) -> float:
    """Returns the s to cover a measured distance in m at the ego's speed, V_GAP_MIN at least (A-110)."""
    return distance / max(v, V_GAP_MIN)


def stopping_speed(deceleration: float, distance: float) -> float:
    """Returns the m/s from which `deceleration` just stops within `distance` (eq. 17, A-170); 0 beyond it."""
    return sqrt(2.0 * deceleration * max(distance, 0.0))


class HardStop:
    """Tier 1: too close and moving (A-113). Returns `unconfirmed` before confirmation (D-044)."""

    def __init__(self, unconfirmed: Request | None) -> None:
        self.unconfirmed = unconfirmed

    def __call__(self, s: Situation) -> Request | None:
        """Returns full brake for a lead nearer than TOO_CLOSE; None for none and up to HARD_STOP_ABOVE_KMH.

        `unconfirmed` for a lead that is not confirmed.
        """
        if s.lead is None or s.lead.distance >= TOO_CLOSE or s.v_kmh <= HARD_STOP_ABOVE_KMH:
            return None
        return Request(Tier.HARD_STOP, brake=1.0) if s.lead.confirmed else self.unconfirmed


def low_speed_stop(s: Situation) -> Request | None:
    """Returns tier 2, full brake, when too close and slow; None else.

    The target of a standing ego was verified before (A-114).
    """
    if s.lead is None or s.lead.distance >= TOO_CLOSE or s.v_kmh > HARD_STOP_ABOVE_KMH:
        return None
    return Request(Tier.STOPPED_TOO_CLOSE, brake=1.0)


def needs_verification(s: Situation) -> bool:
    """Returns whether tier 2 at creeping speed needs the cameras to say that the target is real (A-115)."""
    return s.lead is not None and s.lead.distance < TOO_CLOSE and s.v_kmh <= CREEP_KMH


class Emergency:
    """Tier 3: the time gap is too short (eq. 11, A-117)."""

    def __init__(self, unconfirmed: Request | None) -> None:
        self.unconfirmed = unconfirmed

    def __call__(self, s: Situation) -> Request | None:
        """Returns braking by urgency for a time gap below EMERGENCY_GAP, else None.

        `unconfirmed` for a lead that is not confirmed.
        """
        if s.lead is None or s.lead.gap >= EMERGENCY_GAP:
            return None
        if not s.lead.confirmed:
            return self.unconfirmed
        urgency = (EMERGENCY_FULL_GAP - s.lead.gap) / EMERGENCY_SPAN
        return Request(Tier.EMERGENCY, brake=clip(urgency, EMERGENCY_BRAKE_MIN, 1.0))


class LeadAtLight:
    """Tier 4: a red light behind a lead (A-119 to A-122)."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Releases the hold behind a lead at a red light."""
        self.holding = False

    def __call__(self, s: Situation) -> Request | None:
        """Returns a hold, or the approach to the nearer of lead and line; None without a red light or a lead.

        A hold lasts until no stop is asked for.
        """
        if s.stop_distance is None:
            self.holding = False
            return None
        if s.lead is None or s.stop_distance >= LEAD_LIGHT_RANGE:
            return None
        effective = min(s.lead.distance - STAND_OFF, s.stop_distance)
        if effective < LEAD_HOLD or self.holding:
            self.holding = True
            return Request(
                Tier.STOPPED_BEHIND_CAR, brake=1.0, handbrake=s.v_kmh < HANDBRAKE_BELOW_KMH
            )
        v_required = max(stopping_speed(LEAD_DECELERATION, effective), LEAD_V_MIN)
        if s.v > v_required:
            brake = clip((s.v - v_required) / LEAD_BRAKE_SPAN, LEAD_BRAKE_MIN, 1.0)
            return Request(Tier.APPROACH, brake=brake)
        return Request(Tier.APPROACH, throttle=LEAD_THROTTLE)


def zones(gap: float) -> Request:
    """Returns the actuation of following for a time gap in s, by its error (A-124 to A-128)."""
    error = round(gap - TARGET_GAP, 9)  # 2.8 - 2.5 falls just short of 0.3
    if error >= DEAD_BAND:
        more = OPEN_THROTTLE_MORE * min(error / OPEN_SPAN, 1.0)
        return Request(Tier.ACC_OPEN, throttle=OPEN_THROTTLE + more)
    if error <= -DEAD_BAND:
        more = CLOSE_BRAKE_MORE * min(-error / CLOSE_SPAN, 1.0)
        return Request(Tier.ACC_CLOSE, brake=CLOSE_BRAKE + more)
    if error > HOLD_MARGIN:
        return Request(Tier.ACC_HOLD, throttle=HOLD_THROTTLE_OPENING)
    if error < -HOLD_MARGIN:
        return Request(Tier.ACC_HOLD, brake=HOLD_BRAKE)
    return Request(Tier.ACC_HOLD, throttle=HOLD_THROTTLE)


class Following:
    """Tier 5: keep the time gap (A-123), by zones or by the distance PID (D-039)."""

    def __init__(self, follower: Follower, distance_pid: Pid) -> None:
        self.by_zones = follower is Follower.ZONES
        self.pid = distance_pid

    def __call__(self, s: Situation) -> Request | None:
        """Returns throttle or brake by the gap, no throttle above the cap (A-129).

        None without a lead in reach.
        """
        if s.lead is None or (s.lead.gap >= FOLLOW_GAP and s.lead.distance >= FOLLOW_DISTANCE):
            return None
        request = zones(s.lead.gap) if self.by_zones else self._by_distance(s, s.lead)
        return request._replace(throttle=0.0) if s.v_kmh > s.follow_cap_kmh else request

    def _by_distance(self, s: Situation, lead: Lead) -> Request:
        """Returns throttle and brake that regulate the distance to TARGET_GAP in s of the own speed."""
        u = self.pid.update(lead.distance - TARGET_GAP * s.v)
        return zones(lead.gap)._replace(throttle=max(u, 0.0), brake=max(-u, 0.0))


class LightStop:
    """Tier 6: a red light without a lead in range (A-130 to A-133)."""

    def __init__(self, braking: LightBraking, speed_pid: Pid) -> None:
        self.by_pid = braking is LightBraking.SPEED_PID
        self.pid = speed_pid

    def __call__(self, s: Situation) -> Request | None:
        """Returns what stops at the line, from approach to hold; None where no stop is asked for."""
        d = s.stop_distance
        if d is None:
            return None
        if d < LINE_HOLD:
            return Request(Tier.HOLDING_AT_LINE, brake=1.0, handbrake=s.v_kmh < HANDBRAKE_BELOW_KMH)
        if d < LINE_NEAR:
            if s.v > stopping_speed(LINE_NEAR_DECELERATION, d):
                return Request(Tier.LIGHT_STOP, brake=LINE_NEAR_BRAKE)
            return Request(Tier.LIGHT_STOP, throttle=LINE_NEAR_THROTTLE)
        v_required = stopping_speed(LINE_DECELERATION, d)
        if s.v < v_required:
            return Request(Tier.LIGHT_STOP, throttle=LINE_THROTTLE)
        return Request(Tier.LIGHT_STOP, brake=self._brake(s.v, v_required))

    def _brake(self, v: float, v_required: float) -> float:
        """Returns the brake in 0..1 for a speed v that should be v_required, both in m/s."""
        if self.by_pid:
            return abs(self.pid.update((v_required - v) * 3.6))
        return clip((v - v_required) / LINE_BRAKE_SPAN, LINE_BRAKE_MIN, 1.0)


class Cruise:
    """Tier 7: coast for a second after a lead, else hold the cruise speed (A-134 to A-136)."""

    def __init__(self, speed: SpeedControl, dt: float) -> None:
        self.speed = speed
        self.coast_ticks = ticks_to_reach(COAST_DURATION, dt)
        self.reset()

    def reset(self) -> None:
        """Resets the time since the last lead, so that no coasting is due."""
        self.ticks_since_lead = self.coast_ticks

    def __call__(self, s: Situation) -> Request:
        """Returns a request in every case, so that the hierarchy is total: coasting, or the cruise speed."""
        if self.ticks_since_lead < self.coast_ticks and s.v_kmh > COAST_ABOVE_KMH:
            return Request(Tier.COAST, brake=COAST_BRAKE)
        u = self.speed.update(s.cruise_kmh - s.v_kmh)
        if u > 0.0:
            return Request(Tier.CRUISE, throttle=min(u, 1.0))
        return Request(Tier.CRUISE, brake=min(-u, CRUISE_BRAKE_MAX))

    def conclude(self, winner: Tier) -> None:
        """Counts the ticks since a tier that follows a lead has won; call it with each tick's winner."""
        self.ticks_since_lead = 0 if winner in COASTED_FROM else self.ticks_since_lead + 1


class Hierarchy:
    """Tiers 1 to 7 for a set of functions (A-111)."""

    def __init__(self, functions: Functions, settings: StackSettings, dt: float) -> None:
        self.speed_pid = Pid(SPEED_GAINS, dt)
        self.distance_pid = Pid(DISTANCE_GAINS, dt)
        self.lead_at_light = LeadAtLight()
        steady = settings.cruise is CruiseLaw.STEADY
        self.speed_hold = SteadySpeed(dt) if steady else self.speed_pid
        self.cruise = Cruise(self.speed_hold, dt)
        self.last = Tier.NONE
        self.brakes = bool(functions & {Function.ACC, Function.AEB})  # tiers 1 to 3
        self.rules = self._rules(functions, settings)

    def _rules(self, functions: Functions, settings: StackSettings) -> tuple[Rule, ...]:
        """Returns the rules in order; tiers 1 to 3 come with ACC, or with emergency braking alone (A-140)."""
        unconfirmed = NO_ACTION if settings.unconfirmed is Unconfirmed.CONSUME else None
        following = Following(settings.follower, self.distance_pid)
        braking: tuple[Rule, ...] = (
            HardStop(unconfirmed),
            low_speed_stop,
            Emergency(unconfirmed),
        )
        light_stop = LightStop(settings.light_braking, self.speed_pid)
        return (
            *(braking if self.brakes else ()),
            self.lead_at_light,
            *((following,) if Function.ACC in functions else ()),
            light_stop,
            self.cruise,
        )

    def reset_pids(self) -> None:
        """Resets the controllers after tiers 1 and 3 and after a relocation (A-109)."""
        self.speed_pid.reset()
        self.speed_hold.reset()
        self.distance_pid.reset()

    def reset(self) -> None:
        """Forgets everything of the old place after a relocation."""
        self.reset_pids()
        self.lead_at_light.reset()
        self.cruise.reset()
        self.last = Tier.NONE

    def decide(self, s: Situation) -> Request:
        """Returns the first request in the order of the tiers; call it once per tick.

        Tiers 1 and 3 reset the controllers, cruise that begins the distance controller.
        """
        request = NO_ACTION
        for rule in self.rules:  # the last one always makes a request
            found = rule(s)
            if found is not None:
                request = found
                break
        if request.tier in RESET_BY:
            self.reset_pids()
        elif request.tier is Tier.CRUISE and self.last is not Tier.CRUISE:
            self.distance_pid.reset()
        self.cruise.conclude(request.tier)
        self.last = request.tier
        return request
