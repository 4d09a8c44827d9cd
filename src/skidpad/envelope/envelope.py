"""The speed that is safe here and now, from what is seen of the road and felt of the grip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, require_range
from skidpad.core.frames import SensorFrame
from skidpad.core.kernels.jit import hold
from skidpad.core.maths.constants import G
from skidpad.core.sensor_types import read_sensor
from skidpad.core.setup import DT
from skidpad.core.specs import AIR_THERMOMETER, RAIN_SENSOR, PointSensorSpec, RadarSpec, SensorSpec
from skidpad.core.states import VehicleCommand
from skidpad.envelope.belief import BRIDGE_K, COLD_C, prior_grip
from skidpad.envelope.bridges import BridgesAhead
from skidpad.envelope.govern_kernel import (
    CLOSE,
    EnvelopeArrays,
    EnvelopeParts,
    EnvelopeRules,
    Told,
    find_limits,
)
from skidpad.envelope.grip import STIFFNESS, Car, leave_place, new_estimator
from skidpad.envelope.limits import (
    Binding,
    RssParameters,
    bridge_speed,
    lowest,
    preview_speed,
    sight_speed,
)
from skidpad.envelope.seen import FurtherSight
from skidpad.envelope.sight import Motion, SightRules, lose_lead, make_way, new_sight, sight_rules
from skidpad.envelope.signals import BLOCK, BusModel, BusRules, CarBus
from skidpad.roads.queries import RoadMap

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
