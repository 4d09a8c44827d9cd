"""`govern(stack, settings)`: any stack, kept inside the envelope of its grip and sight.

It lowers acceleration and nothing else: it takes throttle away and adds brake, never steers, and never
takes away the stack's own braking. It sees the frame that the stack sees, the map, two sensors of its
own, and the commands that it returned: no weather, no friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, isnan, nan
from typing import Any, NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.maths.constants import G
from skidpad.core.sensor_types import read_sensor
from skidpad.core.setup import DT
from skidpad.core.specs import (
    AIR_THERMOMETER,
    RAIN_SENSOR,
    PointSensorSpec,
    RadarSpec,
    SensorSpec,
)
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import Supervision
from skidpad.envelope.belief import BRIDGE_K, COLD, COLD_C, PRIORS, prior_grip
from skidpad.envelope.bridges import BridgesAhead
from skidpad.envelope.grip import (
    STIFFNESS,
    Car,
    Grip,
    GripArrays,
    drive_at,
    estimate_grip,
    leave_place,
    make_grip,
    new_estimator,
)
from skidpad.envelope.limits import (
    Binding,
    RssParameters,
    bends_speed,
    bridge_speed,
    floating_speed,
    following_speed,
    lowest,
    preview_speed,
    rss_speed,
    sight_speed,
)
from skidpad.envelope.seen import FurtherSight
from skidpad.envelope.sight import (
    SightArrays,
    SightRules,
    clear_way,
    look_for_lead,
    lose_lead,
    make_way,
    new_sight,
    sight_rules,
    trace_way,
)
from skidpad.envelope.signals import (
    BLOCK,
    BusArrays,
    BusModel,
    BusRules,
    CarBus,
    write_message,
)
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.queries import RoadMap
from skidpad.stack.interface import Stack

RAIN_ID, AIR_ID = "envelope_rain", "envelope_air"
SENSORS = (PointSensorSpec(RAIN_ID, RAIN_SENSOR), PointSensorSpec(AIR_ID, AIR_THERMOMETER))
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
EVERY = (1 << len(Binding)) - 1  # limits as bits
# settings that kernels take as they are, as floats: each other type would be another kernel
PLAIN = ("share", "lateral_share", "delay", "approach", "most", "stiffness", "factor", "dt")
ORACLE_STEP = 0.5  # m/s between values of a grip that is known, for studies
PULSE_BELOW, PULSE_V_LEAST, PULSE_AY_MOST = 0.3, 8.0, 0.5  # confidence, m/s, m/s^2 across


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvelopeSettings:
    """How the envelope is set.

    Attributes:
        share: of the estimated grip that stopping may take.
        lateral_share: of it that bends may take.
        delay: s from a need to the deceleration.
        approach: m/s^2 with which a falling limit is approached.
        most: m/s, no limit is above it.
        stiffness: of the tyre that the estimator was designed with.
        factor: on the estimated grip, for studies.
        table_kmh: speeds when dry, in rain, in the cold, in the place of the envelope: a rival.
        oracle: true grip at each ORACLE_STEP m/s, for studies only.
        oracle_sight: true range in m of a radar with a nominal one, for studies only.
        limits: those of the envelope that count; all but for ablations.
        rss: RSS distances with constant grip and the dry row of the table, in its place: a rival.
        watches: it records what it would allow and leaves the stack alone.
        pulses: it brakes a little where nothing is known of the grip.
        lanes: the lane's boundaries limit, by how far the cameras see them; off for published results.
        walkers: likewise walkers.
        bridges: likewise what is expected on the bridges of the map.
        preview: s of driving whose lane boundaries must be seen.
        seed: of the errors of the car's signals.
        bus: errors of the car's signals.
    """

    share: float = 0.7
    lateral_share: float = 0.5
    delay: float = 0.5
    approach: float = 2.0
    most: float = 150.0 / 3.6
    stiffness: float = STIFFNESS
    factor: float = 1.0
    table_kmh: tuple[float, float, float] | None = None
    oracle: tuple[float, ...] | None = None
    oracle_sight: Callable[[float], float] | None = None
    limits: frozenset[Binding] = frozenset(Binding)
    rss: bool = False
    watches: bool = False
    pulses: bool = False
    lanes: bool = False
    walkers: bool = False
    bridges: bool = False
    preview: float = 1.8
    seed: int = 1
    bus: BusModel = BusModel()
    dt: float = DT

    def __post_init__(self) -> None:
        require_range("share", self.share, 0.05, 1.0)
        require_range("lateral_share", self.lateral_share, 0.05, 1.0)
        require_range("delay", self.delay, 0.0, 5.0)
        require_range("approach", self.approach, 0.1, 10.0)
        require_range("most", self.most, 1.0, 120.0)
        require_range("stiffness", self.stiffness, 5.0, 60.0)
        require_range("factor", self.factor, 0.1, 3.0)
        require_range("preview", self.preview, 0.1, 10.0)


@dataclass(frozen=True, slots=True)
class Allowed:
    """What the envelope said in a tick."""

    speed: float  # m/s
    binding: Binding
    grip: Grip
    reach: float  # m that is seen
    v: float = 0.0  # m/s that the car drives
    further: Mapping[str, float] = field(
        default_factory=dict
    )  # sight of lanes and walkers, bridges

    def numbers(self) -> dict[str, float]:
        """Returns what the envelope said as the columns of its recording."""
        return {
            "speed_mps": self.speed, "binding": float(self.binding), "grip": self.grip.value,
            "confidence": self.grip.confidence, "prior": self.grip.prior, "reach_m": self.reach,
            "ego_mps": self.v, **self.further,
        }  # fmt: skip


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


class Motion(NamedTuple):
    """Pose, speed and accelerations of the ego, as `feel_motion` has them."""

    x: float
    y: float
    z: float
    pitch: float
    yaw: float
    v: float
    yaw_rate: float
    ax: float
    ay: float
    wheels: tuple[float, float, float, float]


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


RECORDED = ("speed_mps", "binding", "grip", "confidence", "prior", "reach_m", "ego_mps")


@kernel
def find_limits(
    parts: Held[EnvelopeParts], distance: Floats32, azimuth: Floats32, altitude: Floats32,
    velocity: Floats32, ego: Motion, throttle: float, brake: float, steer: float, stage: int,
    is_cold: bool,
) -> Told:  # fmt: skip
    """Takes what is sensed in a tick and writes the limits of speed; returns what else is found.

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
            has_lead = see_lead(arrays, r, points, places, ego, v)
        if has_lead:
            lead = arrays.sight.memory[0]
            limits[Binding.LEAD] = rss_speed(lead.gap, lead.lead_speed, r.rss_limits)
    else:
        limits[Binding.WATER] = floating_speed(FILMS[stage])
        if places > 0:  # else nothing is known of what lies ahead
            has_lead = see_lead(arrays, r, points, places, ego, v)
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
def see_lead(
    arrays: EnvelopeArrays, r: EnvelopeRules, points: RadarPoints, places: int, ego: Motion,
    v: float,
) -> bool:  # fmt: skip
    """Returns whether there is a lead, whose gap and speed are noted."""
    return look_for_lead(
        arrays.sight, r.sight, points, places, ego.x, ego.y, ego.z, ego.pitch, ego.yaw, v
    )


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


class Envelope:
    """The speed that is safe here and now."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: EnvelopeSettings
    ) -> None:
        self.map, self.settings = map, settings
        radar = next((spec for spec in specs if isinstance(spec, RadarSpec)), None)
        true_range = settings.oracle_sight
        if true_range is not None and radar is None:
            raise ConfigError(
                "--govern oracle-sight needs a stack with a radar, and this one has none"
            )
        known = None if true_range is None or radar is None else true_range(radar.range)
        self.bus = CarBus(settings.seed, settings.bus, Car().steer_max)
        self.rules = make_rules(settings, self.bus.rules, sight_rules(radar, settings.dt, known))
        self.arrays = EnvelopeArrays(
            new_estimator(), self.bus.arrays, new_sight(self.rules.sight),
            np.full(len(Binding), inf), np.array(settings.oracle or (), dtype=np.float64),
            np.empty((BLOCK, 8)), np.zeros(2),
        )  # fmt: skip
        self.held = hold(EnvelopeParts(self.rules, self.arrays, map.held))
        self.further: FurtherSight | None = None
        if settings.walkers or settings.lanes:
            self.further = FurtherSight(specs, settings.dt, settings.walkers, settings.lanes)
        self.bridges = BridgesAhead(map) if settings.bridges else None
        self.bridge: float | None = None  # m to the next one that may be frozen

    @property
    def reach(self) -> float:
        """M at which leads are first seen."""
        return float(self.arrays.sight.memory["reach"][0])

    def newest(self, ticks: int) -> Floats:
        """Returns (ticks, 8) RECORDED and `shown` of the newest ticks, of one block of noise."""
        end = int(self.bus.arrays.memory["drawn"][0])
        return self.arrays.said[end - ticks : end]

    def drop_tick(self) -> None:
        """Takes back the row of a tick whose command was refused: it is not part of the run."""
        self.bus.arrays.memory["drawn"] -= 1

    def reset(self) -> None:
        """Forgets what was seen and felt at another place.

        Keeps the radar's reach and the belief of the grip.
        """
        lose_lead(self.arrays.sight)
        leave_place(self.arrays.grip)

    def update(self, frame: SensorFrame, applied: VehicleCommand) -> Told:
        """Takes one frame and returns what is allowed in its tick; to be called once in every tick.

        applied: the command of the tick before. The frame's `extra` must hold RAIN_ID and AIR_ID.
        """
        stage, air_c = read_sensor(frame, RAIN_ID, int), read_sensor(frame, AIR_ID, float)
        self.bus.draw_noise()
        told: Told = find_limits(
            self.held, *frame.radar, read_motion(frame), *read_pedals(applied),
            float(applied.steer), stage, air_c < COLD_C,
        )  # fmt: skip
        looks_further = self.further is not None or self.bridges is not None
        if told.places and looks_further and not self.rules.is_rival:
            self._limit_by_further_sight(frame, told)
            self._limit_by_bridge(frame, told, stage, air_c)
            rules = self.rules
            speed, binding = lowest(self.arrays.limits, rules.counted, rules.most)
            told = told._replace(speed=speed, binding=binding)
        return told

    def _limit_by_further_sight(self, frame: SensorFrame, told: Told) -> None:
        """Writes the limits by walkers and lane boundaries, where they are asked for and seen.

        Where walkers are expected the car can stop within the distance at which they are first seen, and
        before one that is in the way.
        """
        if self.further is None:
            return
        self.further.look(frame, make_way(self.arrays.sight.way, told.places, told.grade))
        set_to, limits = self.settings, self.arrays.limits
        reach, lane = self.further.walker_reach, self.further.lane_reach
        if self.further.walker is not None:
            gap = self.further.walker - CLOSE
            reach = gap if reach is None else min(reach, gap)
        if reach is not None:
            braking = set_to.share * told.value * G
            limits[Binding.WALKER] = sight_speed(reach, braking, set_to.delay)
        if lane is not None:
            limits[Binding.LANE] = preview_speed(lane, set_to.preview)

    def _limit_by_bridge(self, frame: SensorFrame, told: Told, stage: int, air_c: float) -> None:
        """Writes the limit by the next bridge where it may be frozen; stage: of the rain sensor."""
        self.bridge = None
        if self.bridges is None or air_c - BRIDGE_K >= COLD_C:
            return
        self.bridge = self.bridges.find_next(frame.ego.pose)
        if self.bridge is None:
            return
        set_to = self.settings
        expected = min(told.value, prior_grip(stage, air_c - BRIDGE_K))
        approach = min(set_to.approach, set_to.share * told.value * G)
        v = max(frame.ego.speed, 0.0)
        on_bridge = set_to.share * expected * G
        self.arrays.limits[Binding.BRIDGE] = bridge_speed(
            self.bridge, told.reach, on_bridge, approach, set_to.delay, v
        )

    def numbers(self) -> dict[str, float]:
        """Returns what is recorded of sight of lanes and walkers and of bridges; empty where none counts."""
        told = {} if self.further is None else self.further.numbers()
        if self.bridges is not None:
            told["bridge_m"] = nan if self.bridge is None else self.bridge
        return told


def make_rules(settings: EnvelopeSettings, bus: BusRules, sight: SightRules) -> EnvelopeRules:
    """Returns the settings as kernels take them."""
    s, is_rival = settings, settings.rss or settings.table_kmh is not None
    table = s.table_kmh or (0.0, 0.0, 0.0)
    return EnvelopeRules(
        **{name: float(getattr(s, name)) for name in PLAIN}, has_table=s.table_kmh is not None,
        table=(table[0] / 3.6, table[1] / 3.6, table[2] / 3.6), rss=s.rss,
        rss_limits=RssParameters(),
        counted=EVERY if is_rival else sum(1 << name for name in s.limits),
        is_rival=is_rival, acts=not s.watches, pulses=s.pulses, car=Car(), bus=bus, sight=sight,
    )  # fmt: skip


def read_motion(frame: SensorFrame) -> Motion:
    """Returns the ego's motion as kernels take it: floats, as each other type is another kernel."""
    ego, pose = frame.ego, frame.ego.pose
    fl, fr, rl, rr = map(float, ego.wheel_speeds)
    return Motion(
        float(pose.x), float(pose.y), float(pose.z), float(pose.pitch), float(pose.yaw),
        float(ego.speed), float(ego.yaw_rate), float(ego.ax), float(ego.ay), (fl, fr, rl, rr),
    )  # fmt: skip


def read_pedals(command: VehicleCommand) -> tuple[float, float]:
    """Returns throttle and brake as floats; NaN for what is no number."""
    try:
        return float(command.throttle), float(command.brake)
    except (TypeError, ValueError):
        return nan, nan


def lower(
    command: VehicleCommand, v: float, allowed: float, approach: float, a_brake: float
) -> VehicleCommand:
    """Returns the command as `hold_back` has it."""
    throttle, brake = hold_back(
        command.throttle, command.brake, command.reverse, v, allowed, approach, a_brake
    )
    return replace(command, throttle=throttle, brake=brake)


class GovernedStack:
    """A stack inside the envelope; to all others it looks like the stack itself."""

    def __init__(
        self, inner: Stack, specs: Sequence[SensorSpec], map: RoadMap, settings: EnvelopeSettings
    ) -> None:
        self.inner, self.settings = inner, settings
        self.envelope = Envelope(specs, map, settings)
        self.applied = VehicleCommand()
        self.supervision = Supervision.NONE
        self.allowed: Allowed | None = None

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the specs of what the stack itself asks for, and the two sensors of the envelope."""
        ask = getattr(self.inner, "sensors", None)
        return (*(() if ask is None else ask()), *SENSORS)

    @property
    def report(self) -> StackReport:
        """What the stack says about its last tick; an empty report where it says nothing."""
        return getattr(self.inner, "report", None) or StackReport()

    @property
    def mode(self) -> str:
        """The stack's mode in its own words; "" for a stack without one."""
        return str(getattr(self.inner, "mode", ""))

    def __getattr__(self, name: str) -> Any:
        """Returns any other attribute of the stack, such as a switch; AttributeError where it has none."""
        if name == "inner":  # it could not be built
            raise AttributeError(name)
        return getattr(self.inner, name)

    def why_not_quick(self) -> str:
        """Returns the first reason why the envelope is asked tick by tick; "": kernels do it."""
        further = self.envelope.further is not None or self.envelope.bridges is not None
        return "its envelope looks for walkers, lane boundaries and bridges" if further else ""

    def pass_ticks(self, ticks: int, applied: VehicleCommand) -> None:
        """Takes in that kernels drove so many ticks; applied: the last command."""
        *_, reach, v, shown = row = self.envelope.newest(ticks)[-1].tolist()
        self.applied = applied
        self.allowed = Allowed(
            row[0], Binding(int(row[1])), make_grip(row[2], shown, row[3], row[4]), reach, v
        )

    def close(self) -> None:
        """Calls the stack's `close` where it has one."""
        close = getattr(self.inner, "close", None)
        if callable(close):
            close()

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's command, with less acceleration where the envelope asks for it.

        Unchanged while a supervisor has the car, and with `watches`. A stack that has `limit_speed` is told
        the allowed speed first. A change of supervision resets the envelope.
        """
        if frame.supervision is not self.supervision:
            self.envelope.reset()
            self.supervision = frame.supervision
        driven, rules = frame.supervision is Supervision.NONE, self.envelope.rules
        told = self.envelope.update(frame, self.applied if driven else VehicleCommand())
        self.allowed = make_allowed(told, max(frame.ego.speed, 0.0), self.envelope.numbers())
        tell = getattr(self.inner, "limit_speed", None)
        if callable(tell) and rules.acts:
            tell(max(told.speed, V_CREEP))
        command = self.inner.tick(frame)
        acts = driven and rules.acts and isinstance(command, VehicleCommand)
        pedals = read_pedals(command) if acts else (nan, nan)
        if isfinite(sum(pedals) + frame.ego.speed):  # the guard refuses what is no number
            throttle, brake = keep_inside(
                self.envelope.held, told, float(frame.ego.speed), float(frame.ego.ay), *pedals,
                bool(command.reverse),
            )  # fmt: skip
            if throttle != command.throttle or brake > command.brake:
                command = replace(command, throttle=throttle, brake=brake)
        self.applied = command
        return command


def make_allowed(told: Told, v: float, further: Mapping[str, float]) -> Allowed:
    """Returns what the envelope said at v in m/s, with names."""
    grip = make_grip(told.value, told.shown, told.confidence, told.prior)
    return Allowed(told.speed, Binding(told.binding), grip, told.reach, v, further)


def govern(stack: type[Stack], settings: EnvelopeSettings | None = None) -> type[Stack]:
    """Returns a class like `stack`, of the same name, whose stacks stay inside the envelope.

    Defaults of EnvelopeSettings hold where none are given.
    """
    set_to = settings or EnvelopeSettings()

    class Governed(GovernedStack):
        def __init__(
            self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
        ) -> None:
            super().__init__(stack(specs, map, settings), specs, map, set_to)

    Governed.__name__ = Governed.__qualname__ = stack.__name__
    return Governed
