"""`govern(stack, settings)`: any stack, kept inside the envelope of its grip and sight.

It lowers acceleration and nothing else: it takes throttle away and adds brake, never steers, and never
takes away the stack's own braking. It sees the frame that the stack sees, the map, two sensors of its
own, and the commands that it returned: no weather, no friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, nan
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.frames import SensorFrame
from skidpad.core.kernels.jit import hold
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
from skidpad.envelope.belief import BRIDGE_K, COLD_C, prior_grip
from skidpad.envelope.bridges import BridgesAhead
from skidpad.envelope.govern_kernel import (
    CLOSE,
    V_CREEP,
    EnvelopeArrays,
    EnvelopeParts,
    EnvelopeRules,
    Told,
    find_limits,
    keep_inside,
)
from skidpad.envelope.grip import (
    STIFFNESS,
    Car,
    Grip,
    leave_place,
    make_grip,
    new_estimator,
)
from skidpad.envelope.limits import (
    Binding,
    RssParameters,
    bridge_speed,
    lowest,
    preview_speed,
    sight_speed,
)
from skidpad.envelope.seen import FurtherSight
from skidpad.envelope.sight import (
    Motion,
    SightRules,
    lose_lead,
    make_way,
    new_sight,
    sight_rules,
)
from skidpad.envelope.signals import (
    BLOCK,
    BusModel,
    BusRules,
    CarBus,
)
from skidpad.roads.queries import RoadMap
from skidpad.stack.interface import Stack

RAIN_ID, AIR_ID = "envelope_rain", "envelope_air"
SENSORS = (PointSensorSpec(RAIN_ID, RAIN_SENSOR), PointSensorSpec(AIR_ID, AIR_THERMOMETER))
EVERY = (1 << len(Binding)) - 1  # limits as bits
# settings that kernels take as they are, as floats: each other type would be another kernel
PLAIN = ("share", "lateral_share", "delay", "approach", "most", "stiffness", "factor", "dt")


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


class Envelope:
    """The speed that is safe here and now."""

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: EnvelopeSettings
    ) -> None:
        self.settings = settings
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
            np.zeros((BLOCK, 8)), np.zeros(2),
        )  # fmt: skip
        self.held = hold(EnvelopeParts(self.rules, self.arrays, map.held))
        self.further: FurtherSight | None = None
        if settings.walkers or settings.lanes:
            self.further = FurtherSight(specs, settings.dt, settings.walkers, settings.lanes)
        self.bridges = BridgesAhead(map) if settings.bridges else None
        self.bridge: float | None = None  # m to the next one that may be frozen

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


def with_pedals(command: VehicleCommand, throttle: float, brake: float) -> VehicleCommand:
    """Returns the command with these pedals, all else as it was; the very command where they are its own."""
    if throttle == command.throttle and brake <= command.brake:
        return command
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
        row = self.envelope.newest(ticks)[-1].tolist()
        speed, binding, value, confidence, prior, reach, v, shown = row
        grip = make_grip(value, shown, confidence, prior)
        self.applied, self.allowed = applied, Allowed(speed, Binding(int(binding)), grip, reach, v)

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
            command = with_pedals(command, throttle, brake)
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
