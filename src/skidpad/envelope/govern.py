"""`govern(stack, settings)`: any stack, kept inside the envelope of its grip and sight.

It lowers acceleration and nothing else: it takes throttle away and adds brake, never steers, and never
takes away the stack's own braking. It sees the frame that the stack sees, the map, two sensors of its
own, and the commands that it returned: no weather, no friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite, nan
from typing import Any

from skidpad.core.errors import ConfigError, require_range
from skidpad.core.frames import SensorFrame
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
from skidpad.core.states import EgoEstimate, StackReport, VehicleCommand
from skidpad.core.vocabulary import Supervision
from skidpad.envelope.belief import BRIDGE_K, COLD_C, prior_grip
from skidpad.envelope.bridges import BridgesAhead
from skidpad.envelope.grip import STIFFNESS, Grip, GripEstimator
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
from skidpad.envelope.sight import Sight, Way, way_ahead
from skidpad.envelope.signals import BusModel, CarBus
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
PULSE_BELOW, PULSE_V_LEAST, PULSE_AY_MOST = 0.3, 8.0, 0.5  # confidence, m/s, m/s^2 across
GripAt = Callable[[float], float]  # grip at a speed in m/s


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
        oracle: true grip, for studies only.
        oracle_sight: true range in m of a radar with a nominal one, for studies only.
        limits: those that count; all but for ablations.
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
    oracle: GripAt | None = None
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
        self.sight = Sight(radar, settings.dt, known)
        self.grip = GripEstimator(settings.dt, stiffness=settings.stiffness)
        self.bus = CarBus(settings.seed, settings.bus, self.grip.car.steer_max)
        self.further: FurtherSight | None = None
        if settings.walkers or settings.lanes:
            self.further = FurtherSight(specs, settings.dt, settings.walkers, settings.lanes)
        self.bridges = BridgesAhead(map) if settings.bridges else None
        self.bridge: float | None = None  # m to the next one that may be frozen

    def reset(self) -> None:
        """Forgets what was seen and felt at another place.

        Keeps the radar's reach and the belief of the grip.
        """
        self.sight.reset()
        self.grip.reset()

    def update(self, frame: SensorFrame, applied: VehicleCommand) -> Allowed:
        """Takes one frame and returns what is allowed in its tick; to be called once in every tick.

        applied: the command of the tick before. The frame's `extra` must hold RAIN_ID and AIR_ID.
        """
        set_to, ego, v = self.settings, frame.ego, max(frame.ego.speed, 0.0)
        stage, air_c = read_sensor(frame, RAIN_ID, int), read_sensor(frame, AIR_ID, float)
        way = way_ahead(self.map, ego.pose)
        grade = 0.0 if way is None else way.grade
        drive = self.grip.car.drive_at(applied.throttle, v)
        signals = self.bus.read(ego, applied, drive, grade)
        grip = self.grip.update(signals, stage, air_c, grade)
        if set_to.oracle is not None:
            true = set_to.oracle(v)
            grip = Grip(true, true, 1.0, grip.prior)
        elif set_to.factor != 1.0:
            grip = replace(grip, value=grip.value * set_to.factor)
        if set_to.table_kmh is not None:
            row = 2 if air_c < COLD_C else min(stage, 1)
            limits, reach = {Binding.TABLE: set_to.table_kmh[row] / 3.6}, 0.0
        elif set_to.rss:
            limits, reach = self._limit_by_rss(frame, way, v), 0.0
        else:
            limits, reach = self._limits(frame, way, grip, stage, v)
            if way is not None:
                limits |= self._limit_by_further_sight(frame, way, grip)
                limits |= self._limit_by_bridge(frame, grip, stage, air_c, reach)
            limits = {name: limit for name, limit in limits.items() if name in set_to.limits}
        return Allowed(*lowest(limits, set_to.most), grip, reach, v, self._numbers())

    def _limit_by_further_sight(
        self, frame: SensorFrame, way: Way, grip: Grip
    ) -> dict[Binding, float]:
        """Returns the limits by walkers and lane boundaries, where they are asked for and seen.

        Where walkers are expected the car can stop within the distance at which they are first seen, and
        before one that is in the way.
        """
        if self.further is None:
            return {}
        self.further.look(frame, way)
        set_to, limits = self.settings, {}
        reach, lane = self.further.walker_reach, self.further.lane_reach
        if self.further.walker is not None:
            gap = self.further.walker - CLOSE
            reach = gap if reach is None else min(reach, gap)
        if reach is not None:
            limits[Binding.WALKER] = sight_speed(reach, set_to.share * grip.value * G, set_to.delay)
        if lane is not None:
            limits[Binding.LANE] = preview_speed(lane, set_to.preview)
        return limits

    def _limit_by_bridge(
        self, frame: SensorFrame, grip: Grip, stage: int, air_c: float, reach: float
    ) -> dict[Binding, float]:
        """Returns the limit by the next bridge where it may be frozen; stage: of the rain sensor."""
        self.bridge = None
        if self.bridges is None or air_c - BRIDGE_K >= COLD_C:
            return {}
        self.bridge = self.bridges.find_next(frame.ego.pose)
        if self.bridge is None:
            return {}
        set_to = self.settings
        expected = min(grip.value, prior_grip(stage, air_c - BRIDGE_K))
        approach = min(set_to.approach, set_to.share * grip.value * G)
        v = max(frame.ego.speed, 0.0)
        on_bridge = set_to.share * expected * G
        limit = bridge_speed(self.bridge, reach, on_bridge, approach, set_to.delay, v)
        return {Binding.BRIDGE: limit}

    def _numbers(self) -> dict[str, float]:
        """Returns what is recorded of sight of lanes and walkers and of bridges; empty where none counts."""
        told = {} if self.further is None else self.further.numbers()
        if self.bridges is not None:
            told["bridge_m"] = nan if self.bridge is None else self.bridge
        return told

    def _limit_by_rss(self, frame: SensorFrame, way: Way | None, v: float) -> dict[Binding, float]:
        """Returns the speed limits in m/s of the rival: a fixed table speed and RSS behind the lead."""
        limits = {Binding.TABLE: TABLE_KMH[0] / 3.6}
        lead = None if way is None else self.sight.look(frame.radar, frame.ego.pose, way, v)
        if lead is not None:
            limits[Binding.LEAD] = rss_speed(lead.gap, lead.speed, RssParameters())
        return limits

    def _limits(
        self, frame: SensorFrame, way: Way | None, grip: Grip, stage: int, v: float
    ) -> tuple[dict[Binding, float], float]:
        """Returns the speed limits in m/s by their cause, and the m that are seen to be clear.

        Off every lane (way None) only water limits, and nothing is seen: 0 m. stage: of the rain sensor.
        """
        set_to = self.settings
        braking = set_to.share * grip.value * G
        limits = {Binding.WATER: floating_speed(FILMS[stage])}
        if way is None:  # off every lane: nothing is known of what lies ahead
            return limits, 0.0
        lead = self.sight.look(frame.radar, frame.ego.pose, way, v)
        reach = min(self.sight.reach, self.sight.clear_way(frame.ego.pose, way))
        limits[Binding.SIGHT] = sight_speed(reach, braking, set_to.delay)
        limits[Binding.BEND] = bends_speed(
            zip(way.s.tolist(), way.curvature.tolist(), strict=True),
            set_to.lateral_share * grip.value * G, min(set_to.approach, braking), set_to.delay, v,
        )  # fmt: skip
        if lead is not None:
            hardest = min(LEAD_GRIP * grip.value * G, LEAD_BRAKE)
            gap = lead.gap - CLOSE
            limits[Binding.LEAD] = following_speed(gap, lead.speed, braking, hardest, set_to.delay)
        return limits, reach


def lower(
    command: VehicleCommand, v: float, allowed: float, approach: float, a_brake: float
) -> VehicleCommand:
    """Returns the command with less throttle above `allowed` - SOFT m/s and more brake above `allowed`.

    Unchanged when backing up, below V_CREEP, or where it asks for no more. approach: m/s^2 of braking at
    most; a_brake: m/s^2 of full brake.
    """
    if v <= max(allowed - SOFT, V_CREEP) or command.reverse:
        return command
    share = min(max((allowed - v) / SOFT, 0.0), 1.0)
    brake = min(BRAKE_GAIN * max(v - allowed, 0.0), approach) / a_brake
    throttle = command.throttle * share
    if throttle == command.throttle and brake <= command.brake:
        return command
    return replace(command, throttle=throttle, brake=max(command.brake, brake))


class BrakePulses:
    """Brakes a little, now and then, where nothing is known of the grip and the way is free."""

    def __init__(self, dt: float) -> None:
        self.dt, self.way, self.left = dt, 0.0, 0.0

    def update(self, ego: EgoEstimate, allowed: Allowed, has_lead: bool) -> float:
        """Returns m/s^2 to brake with in this tick, PULSE_BRAKE in a pulse, else 0; call it in every tick.

        A pulse lasts PULSE_TIME s and comes after PULSE_EVERY m. None comes from confidence PULSE_BELOW on,
        behind a lead, at PULSE_V_LEAST or slower, or from PULSE_AY_MOST on.
        """
        self.way += max(ego.speed, 0.0) * self.dt
        is_free = not has_lead and ego.speed > PULSE_V_LEAST and abs(ego.ay) < PULSE_AY_MOST
        if allowed.grip.confidence >= PULSE_BELOW or not is_free:
            self.left = 0.0
            return 0.0
        if self.way > PULSE_EVERY:
            self.way, self.left = 0.0, PULSE_TIME
        self.left -= self.dt
        return PULSE_BRAKE if self.left > 0.0 else 0.0


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
        self.pulses = BrakePulses(settings.dt) if settings.pulses else None

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
        driven = frame.supervision is Supervision.NONE
        self.allowed = self.envelope.update(frame, self.applied if driven else VehicleCommand())
        acts = driven and not self.settings.watches
        tell = getattr(self.inner, "limit_speed", None)
        if callable(tell) and not self.settings.watches:
            tell(max(self.allowed.speed, V_CREEP))
        command = self.inner.tick(frame)
        if acts and isinstance(command, VehicleCommand) and isfinite(frame.ego.speed):
            braking = self.settings.share * self.allowed.grip.value * G
            approach = min(self.settings.approach, braking)
            if self.allowed.binding is Binding.LEAD:  # a lead may brake at any moment
                approach = braking
            car = self.envelope.grip.car
            command = lower(command, frame.ego.speed, self.allowed.speed, approach, car.a_brake)
            if self.pulses is not None:
                least = self.pulses.update(
                    frame.ego, self.allowed, self.envelope.sight.lead is not None
                )
                if least > 0.0:
                    brake = max(command.brake, least / car.a_brake)
                    command = replace(command, throttle=0.0, brake=brake)
        self.applied = command
        return command


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
