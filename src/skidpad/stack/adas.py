"""The published driver: dual-range vision, radar, seven tiers, lane centring (A-010)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import require_choice, require_range
from skidpad.core.frames import Segments, SensorFrame
from skidpad.core.kernels.jit import Held
from skidpad.core.run import Function
from skidpad.core.settings.parts import load_profile
from skidpad.core.settings.stack import StackSettings
from skidpad.core.setup import DT
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import DetectionStatus, LightState, Supervision, Tier
from skidpad.roads.queries import RoadMap
from skidpad.stack.configurations import (
    CRUISE_RANGE,
    V_CRUISE_KMH,
    V_LIMITER_KMH,
    Functions,
    functions_of,
    parse_functions,
)
from skidpad.stack.control.bends import BendSpeed
from skidpad.stack.control.caps import cap_rules
from skidpad.stack.control.text import mode_text
from skidpad.stack.control.tiers import tier_rules
from skidpad.stack.functions import AddedFunctions
from skidpad.stack.memory import Memory, new_memory
from skidpad.stack.perception.front import ROOM, VERIFIED_BY, Cameras
from skidpad.stack.perception.fusion import (
    MEDIAN_SAMPLES,
    far_samples,
    fusion_rules,
    rate_samples,
)
from skidpad.stack.perception.hsv import LampCamera
from skidpad.stack.perception.lights import NO_LIGHT, LightReading, StopLock, Way
from skidpad.stack.perception.persistence import detection_rules
from skidpad.stack.perception.radar import radar_rules
from skidpad.stack.road import Road, road_rules
from skidpad.stack.think import (
    Answer,
    Parts,
    Rules,
    act,
    forget_sight,
    forget_tiers,
    hold_rules,
    perceive,
    think,
)

HELD = VehicleCommand(brake=1.0)  # while the supervisor drives; it overrides this anyway
STATUSES, TIERS = tuple(DetectionStatus), tuple(Tier)  # by their numbers
EMPTY = np.empty(0, np.float32)
NO_SEGMENTS = Segments(EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, np.empty(0, np.uint8))
Rest = tuple[float, bool, float, float, float]
KEYS = ("configuration", "functions", "profile", "set", "cruise_kmh", "limiter_kmh", "dt")


@dataclass(frozen=True, slots=True, kw_only=True)
class AdasConfig:
    """What this stack drives with; speeds in km/h as at a cruise control's lever."""

    functions: Functions
    added: tuple[str, ...] = ()  # functions of packages
    settings: StackSettings
    cruise_kmh: float = V_CRUISE_KMH
    limiter_kmh: float = V_LIMITER_KMH
    dt: float = DT

    def __post_init__(self) -> None:
        require_range("cruise_kmh", self.cruise_kmh, *CRUISE_RANGE)
        require_range("limiter_kmh", self.limiter_kmh, *CRUISE_RANGE)
        require_range("dt", self.dt, 1e-3, 1.0)

    @classmethod
    def from_mapping(cls, plain: Mapping[str, Any]) -> AdasConfig:
        """Returns a configuration from plain data; every key is optional, see KEYS.

        `functions` (names) takes the place of `configuration` (0 to 4, default 4); `set` holds
        single settings on top of `profile`. ConfigError for an unknown key or name, or a number out of range.
        """
        for key in plain:
            require_choice("stack option", key, KEYS)
        settings = load_profile(plain.get("profile", "recommended"), plain.get("set")).stack
        added: tuple[str, ...] = ()
        if "functions" in plain:
            functions, added = parse_functions(",".join(plain["functions"]))
        else:
            functions = functions_of(plain.get("configuration", 4))
        if settings.aeb_without_acc and not functions & {Function.ACC}:
            functions |= {Function.AEB}
        numbers = {k: float(plain[k]) for k in ("cruise_kmh", "limiter_kmh", "dt") if k in plain}
        return cls(functions=functions, added=added, settings=settings, **numbers)


class StackParts(NamedTuple):
    """Rules and arrays of a stack, besides its memory, that kernels of a tick are given."""

    held: Held[Parts]
    samples: Floats
    history: Floats
    kept: NDArray[np.int64]  # room
    room: Floats


class AdasStack:
    """One vehicle's driver. Deterministic: its commands depend on the frames alone."""

    UNSAVED = ("_kept", "_room")
    report: StackReport

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        self.config = AdasConfig.from_mapping(settings)
        options, dt = self.config.settings, self.config.dt
        self.cameras = Cameras(specs, self.config.functions, options)
        self.memory = new_memory()
        self.road = Road(map, self.memory, road_rules(self.config.functions, options, dt))
        self._samples, self._history = far_samples(MEDIAN_SAMPLES), rate_samples(dt)
        self._kept, self._room = np.empty(ROOM, dtype=np.int64), np.empty((ROOM, 2))
        self.lamps = LampCamera(specs)
        self.lock = StopLock(dt, options.hsv_required, self.memory)
        self.added = AddedFunctions(self.config.added, map, dt)
        self.supervision = Supervision.NONE
        self.verified_by = ""
        self.v_told = inf
        self.report = StackReport()
        forget_sight(self.memory, self._samples, self._history)
        self.switch(self.config.functions)

    @property
    def mode(self) -> str:
        """The mode of the last tick as text for people (A-139), with those of added functions."""
        own = mode_text(self.report, Function.LCA in self.functions, self.verified_by)
        return own + self.added.mode

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the sensors that added functions ask for; the stack itself needs the common ones."""
        return self.added.sensors()

    def switch(self, functions: Functions) -> None:
        """Turns functions on and off while driving (A-011); tiers and controllers start afresh.

        functions: all that are on from now on. Added functions of packages are not touched.
        """
        c = self.config
        self.functions, self.assists = functions, Function.TLA in functions
        self.road.follow_rules(road_rules(functions, c.settings, c.dt))
        self.bends = BendSpeed(c.dt) if Function.BEND in functions else None
        self.cameras.switch(functions)
        s = c.settings
        self.follow_rules(
            Rules(
                tier_rules(functions, s, c.dt),
                cap_rules(functions, c.cruise_kmh, c.limiter_kmh, s, c.dt),
                fusion_rules(s, c.dt),
                detection_rules(s, c.dt),
                radar_rules(s),
                (self.cameras.bumper.keep, self.cameras.roof.keep),
            )
        )

    def follow_rules(self, rules: Rules) -> None:
        """Drives by these rules from now on; tiers start afresh."""
        self.rules, self.held = rules, hold_rules(rules, self.road.map.held)
        forget_tiers(self.memory, self.held)

    def limit_speed(self, v: float) -> None:
        """Cruises no faster than v m/s until told otherwise: whatever governs this stack says so."""
        self.v_told = v

    def relocated(self) -> None:
        """Forgets what was seen and summed before, as the ego now stands elsewhere (A-109)."""
        forget_sight(self.memory, self._samples, self._history)
        forget_tiers(self.memory, self.held)
        self.lock.reset()
        self.added.reset()
        if self.bends is not None:
            self.bends.reset()

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Senses, decides and returns the command of one tick (A-010).

        HELD, and no decision, while a supervisor drives. `report` is renewed either way.
        """
        self._follow_supervision(frame.supervision)
        drives = frame.supervision is Supervision.NONE
        v = frame.ego.speed
        way = self.road.read(frame.ego.pose, v, drives)
        light, hsv = self._light(frame, way)
        stop = self.lock.update(light, v, frame.lights, hsv) if self.assists else None
        stop_distance = nan if stop is None else stop.distance
        rest = (v, drives, stop_distance, self._speed_for_bends(frame), self.v_told)
        told = (self._think if frame.segments else self._think_of_images)(frame, rest)
        self.verified_by = VERIFIED_BY[told[4]]
        self.report = self._report(told, way, light, stop is not None, hsv)
        if not drives:
            return HELD
        _, throttle, brake, handbrake, *_ = told
        return self.added.update(frame, VehicleCommand(throttle, brake, way[4], handbrake))

    def _think(self, frame: SensorFrame, rest: Rest) -> Answer:
        """Returns what the tick comes to, by the runs of pixels of the object level; rest: for `act`."""
        pose = frame.ego.pose
        bumper = frame.segments.get(self.cameras.bumper.depth_id, NO_SEGMENTS)
        roof = frame.segments.get(self.cameras.roof.depth_id, NO_SEGMENTS)
        most = max(len(bumper.u), len(roof.u))
        if most > len(self._room):
            self._room = np.empty((most, 2))
        told: Callable[..., Answer] = think  # mypy takes a named tuple for one of any length
        return told(
            *self._memories(frame), self._room, *bumper, *roof, *frame.radar,
            self.road.on_highway, pose.x, pose.y, pose.z, pose.yaw, *rest,
        )  # fmt: skip

    def _think_of_images(self, frame: SensorFrame, rest: Rest) -> Answer:
        """Returns what the tick comes to, by images; rest: for `act`."""
        pose, m = frame.ego.pose, self.memory[0]
        yaw_error, kappa = float(m["yaw_error"]), float(m["kappa"])
        asks = perceive(
            *self._memories(frame), *self.cameras.read(frame, yaw_error, kappa), frame.radar,
            self.road.on_highway, pose.x, pose.y, pose.z, pose.yaw, rest[0],
        )  # fmt: skip
        by = self.cameras.verify(frame, float(m["distance"]), yaw_error, kappa) if asks else 0
        return act(self.memory, self.held, by, *rest)

    def _memories(
        self, frame: SensorFrame
    ) -> tuple[Memory, Held[Parts], Floats, Floats, NDArray[np.int64], Floats]:
        """Returns memory and rules, with room for the frame's radar points."""
        if len(frame.radar.range) > len(self._kept):
            self._kept = np.empty(len(frame.radar.range), dtype=np.int64)
        return self.memory, self.held, self._samples, self._history, self._kept, self.road.ways

    def why_not_quick(self) -> str:
        """Returns the first reason why a kernel cannot drive ticks by this stack; "": it can."""
        if self.added.kinds:
            return f"function {self.added.kinds[0].name} is a package's"
        return "the stack slows down in bends" if self.bends is not None else ""

    def parts(self, runs: int, points: int) -> StackParts:
        """Returns what kernels of a tick are given, with room for so many runs of pixels and radar points."""
        if points > len(self._kept):
            self._kept = np.empty(points, dtype=np.int64)
        if runs > len(self._room):
            self._room = np.empty((runs, 2))
        return StackParts(self.held, self._samples, self._history, self._kept, self._room)

    def _follow_supervision(self, phase: Supervision) -> None:
        """Notes which supervisor drives; forgets the old place where a warm-up begins (A-185)."""
        if phase is Supervision.WARM_UP and self.supervision is not Supervision.WARM_UP:
            self.relocated()
        self.supervision = phase

    def _light(self, frame: SensorFrame, way: Way) -> tuple[LightReading, LightState | None]:
        """Returns the light ahead by map, and the colour that the camera sees while there is one (M-4).

        NO_LIGHT and None without the assist; None, too, where no lamp is seen.
        """
        if not self.assists:
            return NO_LIGHT, None
        lane, _, _, _, _, trigger, line, distance = way
        s = float(self.memory["s"][0]) if trigger >= 0 else 0.0
        light = self.road.scan.name_light(lane, s, trigger, line, distance, frame.lights)
        if light.signal is None:
            return light, None
        return light, self.lamps.look(frame.images)

    def _speed_for_bends(self, frame: SensorFrame) -> float:
        """Returns the m/s that bends ahead allow; inf without the function."""
        if self.bends is None:
            return inf
        yaw = frame.ego.pose.yaw
        return self.bends.update(frame.ego.speed, lambda d: self.road.curvature(d, yaw))

    def _report(
        self,
        told: Answer,
        way: Way,
        light: LightReading,
        stopping: bool,
        hsv: LightState | None,
    ) -> StackReport:
        """Returns the report of this tick: detections, tier, target speed, light and lane."""
        (
            tier, _, _, _, _, cruise_kmh, status, distance, gap, bumper, roof, fused, radar_pre,
            radar_lane, radar_velocity, radar_points, resume_ticks,
        ) = told  # fmt: skip
        _, offset, yaw_error, curvature, *_ = way
        return StackReport(  # by position, as names take as long as all the rest
            STATUSES[status], TIERS[tier], distance == distance, _or_none(distance), _or_none(gap),
            _or_none(bumper), _or_none(roof), _or_none(fused), _or_none(radar_pre),
            _or_none(radar_lane), _or_none(radar_velocity), radar_points, cruise_kmh / 3.6,
            light.distance, light.state, light.source if self.assists else None, stopping, hsv,
            _or_none(offset), _or_none(yaw_error), _or_none(curvature),
            None if resume_ticks < 0 else resume_ticks * self.config.dt,
        )  # fmt: skip


def _or_none(value: float) -> float | None:
    """Returns a number of a kernel, None for NaN."""
    return value if value == value else None
