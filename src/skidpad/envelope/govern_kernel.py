"""The speed envelope in a tick, as kernels: what it allows, and the command that is held back to it."""

from __future__ import annotations

from math import inf, isfinite, isnan, nan
from typing import NamedTuple

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.frames import RadarPoints
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.maths.constants import G
from skidpad.envelope.belief import COLD, PRIORS
from skidpad.envelope.grip import Car, GripArrays, drive_at, estimate_grip
from skidpad.envelope.limits import (
    Binding,
    RssParameters,
    bends_speed,
    floating_speed,
    following_speed,
    lowest,
    rss_speed,
    sight_speed,
)
from skidpad.envelope.sight import (
    Motion,
    SightArrays,
    SightRules,
    clear_way,
    look_for_lead,
    trace_way,
)
from skidpad.envelope.signals import BusArrays, BusRules, write_message
from skidpad.roads.kernels import LaneArrays

# mm of water by stage of the rain sensor, as high as to be expected: wet, heavy rain and puddles of the
# friction table of the Bosch Automotive Handbook (docs/physics.md)
FILMS = (0.0, 0.2, 1.0, 2.0)
TABLE_KMH = (80.0, 60.0, 40.0)  # rows of the rival: dry, rain, cold
V_CREEP = 1.5  # m/s, below it the stack is left alone: it must be able to start
BRAKE_GAIN = 1.0  # 1/s, from too much speed to deceleration
SOFT = 1.0  # m/s below the limit, over which throttle is taken away
CLOSE = 2.0  # m kept behind a standing lead
LEAD_GRIP = 1.2  # times the estimate that a lead's tyres may have
LEAD_BRAKE = 8.0  # m/s^2 that it brakes at most
# of brake pulses: within what drivers find comfortable, 2 m/s^2 (our assumption)
PULSE_BRAKE, PULSE_TIME, PULSE_EVERY = 1.5, 0.8, 300.0  # m/s^2, s, m from one to the next
PULSE_BELOW, PULSE_V_LEAST, PULSE_AY_MOST = 0.3, 8.0, 0.5  # confidence, m/s, m/s^2 across
ORACLE_STEP = 0.5  # m/s between values of a grip that is known, for studies


class EnvelopeRules(NamedTuple):
    """What holds for an envelope in all ticks; fields as in `EnvelopeSettings`."""

    share: float
    lateral_share: float
    delay: float
    approach: float
    most: float
    stiffness: float
    factor: float
    has_table: bool
    table: tuple[float, float, float]  # m/s
    rss: bool
    rss_limits: RssParameters
    counted: int  # limits that count, as bits by Binding
    is_rival: bool  # a table or RSS in the place of the envelope
    acts: bool  # it does not only watch
    pulses: bool
    dt: float  # s
    car: Car
    bus: BusRules
    sight: SightRules


class EnvelopeArrays(NamedTuple):
    """What an envelope remembers, for kernels."""

    grip: GripArrays
    bus: BusArrays
    sight: SightArrays
    limits: Floats  # (9,) m/s by Binding, inf: none; of this tick
    true_grip: Floats  # (n,) at each ORACLE_STEP m/s, for studies only; (0,): unknown
    said: Floats  # (BLOCK, 8) RECORDED and `shown` of ticks, each in the row of its noise
    pulse: Floats  # m since the last brake pulse, s that are left of one


class EnvelopeParts(NamedTuple):
    """All that an envelope reads and writes: behind one pointer, as each array costs a call 0.2 us."""

    rules: EnvelopeRules
    arrays: EnvelopeArrays
    map: Held[LaneArrays]


class Told(NamedTuple):
    """What the envelope says in a tick: numbers of `Allowed`, NaN for None."""

    speed: float
    binding: int
    value: float  # grip, to confidence
    shown: float
    confidence: float
    prior: float
    reach: float
    places: int  # of the way ahead
    grade: float
    has_lead: bool


NOTHING_TOLD = Told(0.0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, False)
RECORDED = ("speed_mps", "binding", "grip", "confidence", "prior", "reach_m", "ego_mps")


@kernel
def find_limits(
    parts: Held[EnvelopeParts], distance: Floats32, azimuth: Floats32, altitude: Floats32,
    velocity: Floats32, ego: Motion, throttle: float, brake: float, steer: float, stage: int,
    is_cold: bool,
) -> Told:  # fmt: skip
    """Takes what is sensed in a tick, writes the limits of speed, and returns the lowest with its grounds.

    distance to velocity: of the radar, as `RadarPoints`. throttle, brake, steer: of the command of the tick
    before, 0 while a supervisor drives. stage: of the rain sensor, 0: dry; is_cold: by the thermometer. Once
    per tick.
    """
    r, arrays, map = parts.value.rules, parts.value.arrays, parts.value.map
    points = RadarPoints(distance, azimuth, altitude, velocity)
    limits, v = arrays.limits, max(ego.v, 0.0)
    limits[:] = inf
    places, grade = trace_way(map, ego.x, ego.y, ego.z, ego.yaw, arrays.sight.way)
    signals = write_message(
        arrays.bus, r.bus, ego.wheels, ego.ax, ego.ay, ego.yaw_rate, steer, brake,
        drive_at(r.car, throttle, v), grade,
    )  # fmt: skip
    expected = PRIORS[stage + COLD if is_cold else stage]
    value, shown, sure, prior = estimate_grip(
        arrays.grip, r.car, r.stiffness, r.dt, signals, stage, expected, grade
    )
    if len(arrays.true_grip) > 0:
        value = grip_at(arrays.true_grip, v)
        shown, sure = value, 1.0
    elif r.factor != 1.0:
        value *= r.factor
    reach, has_lead = 0.0, not isnan(arrays.sight.memory[0].gap)
    if r.has_table:
        limits[Binding.TABLE] = r.table[2 if is_cold else min(stage, 1)]
    elif r.rss:
        limits[Binding.TABLE] = TABLE_KMH[0] / 3.6
        if places > 0:
            has_lead = look_for_lead(arrays.sight, r.sight, points, places, ego)
            if has_lead:
                lead = arrays.sight.memory[0]
                limits[Binding.LEAD] = rss_speed(lead.gap, lead.lead_speed, r.rss_limits)
    else:
        limits[Binding.WATER] = floating_speed(FILMS[stage])
        if places > 0:  # else nothing is known of what lies ahead
            has_lead = look_for_lead(arrays.sight, r.sight, points, places, ego)
            reach = limit_ahead(arrays, r, places, ego, v, value, has_lead)
    speed, binding = lowest(limits, r.counted, r.most)
    said = arrays.said[arrays.bus.memory[0].drawn - 1]
    said[0], said[1], said[2], said[3] = speed, binding, value, sure
    said[4], said[5], said[6], said[7] = prior, reach, v, shown
    return Told(speed, binding, value, shown, sure, prior, reach, places, grade, has_lead)


@kernel
def grip_at(known: Floats, v: float) -> float:
    """Returns the grip at v in m/s from (n,) values for each ORACLE_STEP m/s; beyond them the last one."""
    if not isfinite(v):
        return nan
    i = min(max(int(v / ORACLE_STEP), 0), len(known) - 1)
    j = min(i + 1, len(known) - 1)
    return float(known[i] + (v / ORACLE_STEP - i) * (known[j] - known[i]))


@kernel
def limit_ahead(
    arrays: EnvelopeArrays, r: EnvelopeRules, places: int, ego: Motion, v: float, grip: float,
    has_lead: bool,
) -> float:  # fmt: skip
    """Writes the limits by sight, bends and lead, and returns the m that are seen to be clear."""
    limits, sight, way = arrays.limits, arrays.sight.memory[0], arrays.sight.way
    braking = r.share * grip * G
    reach = min(sight.reach, clear_way(way, r.sight, places, ego.x, ego.y, ego.yaw))
    limits[Binding.SIGHT] = sight_speed(reach, braking, r.delay)
    limits[Binding.BEND] = bends_speed(
        way[0, :places], way[4, :places], r.lateral_share * grip * G, min(r.approach, braking),
        r.delay, v,
    )  # fmt: skip
    if has_lead:
        hardest = min(LEAD_GRIP * grip * G, LEAD_BRAKE)
        limits[Binding.LEAD] = following_speed(
            sight.gap - CLOSE, sight.lead_speed, braking, hardest, r.delay
        )
    return float(reach)


@kernel
def hold_back(
    throttle: float, brake: float, reverse: bool, v: float, allowed: float, approach: float,
    a_brake: float,
) -> tuple[float, float]:  # fmt: skip
    """Returns less throttle above `allowed` - SOFT m/s and more brake above `allowed`.

    Unchanged when backing up, below V_CREEP, or where no more is asked for. approach: m/s^2 of braking at
    most; a_brake: m/s^2 of full brake.
    """
    if v <= max(allowed - SOFT, V_CREEP) or reverse:
        return throttle, brake
    share = min(max((allowed - v) / SOFT, 0.0), 1.0)
    asked = min(BRAKE_GAIN * max(v - allowed, 0.0), approach) / a_brake
    return throttle * share, max(brake, asked)


@kernel
def pulse_brake(
    pulse: Floats, v: float, ay: float, confidence: float, has_lead: bool, dt: float
) -> float:
    """Returns m/s^2 to brake with in this tick, PULSE_BRAKE in a pulse, else 0; call it in every tick.

    Brakes a little, now and then, where nothing is known of the grip and the way is free. pulse: m since the
    last one, s left. A pulse lasts PULSE_TIME s and comes after PULSE_EVERY m. None comes from confidence
    PULSE_BELOW on, behind a lead, at PULSE_V_LEAST or slower, or from PULSE_AY_MOST on.
    """
    pulse[0] += max(v, 0.0) * dt
    is_free = not has_lead and v > PULSE_V_LEAST and abs(ay) < PULSE_AY_MOST
    if confidence >= PULSE_BELOW or not is_free:
        pulse[1] = 0.0
        return 0.0
    if pulse[0] > PULSE_EVERY:
        pulse[0], pulse[1] = 0.0, PULSE_TIME
    pulse[1] -= dt
    return PULSE_BRAKE if pulse[1] > 0.0 else 0.0


@kernel
def keep_inside(
    parts: Held[EnvelopeParts], told: Told, v: float, ay: float, throttle: float, brake: float,
    reverse: bool,
) -> tuple[float, float]:  # fmt: skip
    """Returns throttle and brake of the stack's command, held back to the allowed speed.

    v, ay: of the ego, m/s and m/s^2.
    """
    r = parts.value.rules
    braking = r.share * told.value * G
    approach = min(r.approach, braking)
    if told.binding == Binding.LEAD:  # a lead may brake at any moment
        approach = braking
    throttle, brake = hold_back(throttle, brake, reverse, v, told.speed, approach, r.car.a_brake)
    if r.pulses:
        pulse = parts.value.arrays.pulse
        least = pulse_brake(pulse, v, ay, told.confidence, told.has_lead, r.dt)
        if least > 0.0:
            throttle, brake = 0.0, max(brake, least / r.car.a_brake)
    return throttle, brake
