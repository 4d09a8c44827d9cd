"""Our own stack at the wheel of an actor of a scenario file: controller `SkidpadStack`.

The actor has sensors of its own: cameras and radar at the object level, mounted as on the ego. The
stack is given their readings and the actor's own motion, never the truth of other actors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from types import MappingProxyType
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.outdoors import weather_of
from skidpad.core.errors import ConfigError
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose, kmh_from_mps, mps_from_kmh
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import ActorStates, ActorTable, EgoEstimate, VehicleCommand, WorldTruth
from skidpad.core.text.told import describe_value
from skidpad.core.vocabulary import RangeModel
from skidpad.core.weather import Weather
from skidpad.envelope.envelope import EnvelopeSettings
from skidpad.envelope.govern import govern
from skidpad.physics.presets import find_weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.scene import Scene
from skidpad.scenarios.traffic import V_UNKNOWN
from skidpad.sensors.object_level.objects import ObjectSuite
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.requested import AskedSensors
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import CRUISE_RANGE, numbered_driver
from skidpad.stack.interface import Stack

NUMBERS = (1, 6)  # configurations that drive by themselves
USUAL_NUMBER = 2  # adaptive cruise control and lane centring
SPEEDS = tuple(mps_from_kmh(v) for v in CRUISE_RANGE)  # m/s
NAME = "SkidpadStack"
CLEAR = "clear-noon"  # the weather where no run says one
NO_IMAGES: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class PilotConditions:
    """The conditions in which stacks of actors drive. setup: of the run, None for a clear noon."""

    setup: Setup | None = None
    seed: int = 0
    profile: str = "recommended"
    settings: Mapping[str, Any] = field(default_factory=dict)  # of the stack
    weather_of_file: bool = False  # events of the file change what its sensors see through


@dataclass(frozen=True, slots=True)
class PilotMaker:
    """Makes the controller of one actor; its properties are checked as the file is compiled."""

    conditions: PilotConditions = PilotConditions()
    checks_properties = True

    def __call__(self, properties: Mapping[str, str]) -> StackPilot:
        """Returns the controller; ConfigError for a property that it does not know."""
        return StackPilot(properties, self.conditions)


class View(NamedTuple):
    """The world as one actor's sensors need it: its own row first."""

    order: NDArray[np.int64]
    states: ActorStates
    suite: ObjectSuite
    asked: AskedSensors


class StackPilot:
    """Drives an actor by our own stack.

    Properties: configuration, 1 to 6 (default 2); cruiseSpeed, m/s (default: the speed at which it is
    activated, 50 km/h for an actor that stands).
    """

    def __init__(self, properties: Mapping[str, str], conditions: PilotConditions) -> None:
        self.number = int(_read(properties, "configuration", NUMBERS, float(USUAL_NUMBER)))
        self.v_cruise = _read(properties, "cruiseSpeed", SPEEDS, inf)
        self.conditions = conditions
        self._stack: Stack | None = None
        self._view: View | None = None
        self._environments = 0  # of the file's events that it has seen

    def drive(self, scene: Scene, name: str) -> VehicleCommand:
        """Returns the stack's command for what actor `name` senses; a neutral one before there is a world."""
        truth, actor = scene.truth, scene.actors[name]
        if truth is None:
            return VehicleCommand()
        if self._stack is None or self._view is None:
            setup = self.conditions.setup or _usual_setup(scene.dt)
            self._stack = self._make_stack(setup, scene, actor.motion.speed)
            more = tuple(getattr(self._stack, "sensors", tuple)())
            asked = frozenset(spec.id for spec in more)
            setup = replace(setup, specs=(*setup.specs, *more), asked=asked)
            seed = self.conditions.seed ^ crc32(name.encode())
            self._view = _make_view(truth.table, actor.row, scene.network.map, setup, seed)
        if self.conditions.weather_of_file:
            self._view = self._change_weather(self._view, scene)
        return self._stack.tick(_frame(self._view, truth, scene))

    def _change_weather(self, view: View, scene: Scene) -> View:
        """Returns the view through the weather that events have set since the last tick."""
        new, self._environments = scene.environments[self._environments :], len(scene.environments)
        if not new:
            return view
        asked = view.asked
        weather = asked.setup.weather
        for environment in new:
            weather = weather_of(environment, weather, NAME)
        setup = replace(asked.setup, weather=weather)
        view.suite.see_through(_limiting_weather(setup), None)
        return view._replace(
            asked=AskedSensors(scene.network.map, asked.table, setup, seed=asked.seed)
        )

    def _make_stack(self, setup: Setup, scene: Scene, v: float) -> Stack:
        """Returns our stack for the actor, from the driver of its number and the conditions; `v` in m/s."""
        c, driver = self.conditions, numbered_driver(self.number)
        kind = govern(AdasStack, EnvelopeSettings(dt=setup.dt)) if driver.envelope else AdasStack
        v_cruise = self.v_cruise if isfinite(self.v_cruise) else max(v, 0.0) or V_UNKNOWN
        settings = {
            "functions": sorted(f.value for f in driver.functions),
            "profile": c.profile,
            "set": dict(c.settings),
            "cruise_kmh": max(kmh_from_mps(v_cruise), CRUISE_RANGE[0]),
        }
        return kind(setup.specs, scene.network.map, settings)


def _limiting_weather(setup: Setup) -> Weather | None:
    """Returns the weather that limits the ranges of cameras and radar; None: it does not."""
    return setup.weather if setup.range_model is RangeModel.PHYSICAL else None


def _usual_setup(dt: float) -> Setup:
    """Returns the set-up of a usual ego with twelve sensors in clear weather; `dt` is in s."""
    ego = ActorSetup(name="", type=EGO_TYPE, place=Pose(0.0, 0.0))
    return Setup(map="", weather=find_weather(CLEAR), specs=twelve_sensors(), ego=ego, dt=dt)


def _make_view(table: ActorTable, row: int, map: RoadMap, setup: Setup, seed: int) -> View:
    """Returns the world as the actor in `row` sees it: itself first, with sensors of its own."""
    n = len(table)
    order = np.array([row, *(i for i in range(n) if i != row)])
    own = ActorTable(
        names=tuple(table.names[i] for i in order),
        types=tuple(table.types[i] for i in order),
        kind=table.kind[order],
        length=table.length[order],
        width=table.width[order],
        height=table.height[order],
        rgb=table.rgb[order],
    )
    suite = ObjectSuite(
        map.roadside,
        own,
        setup.specs,
        seed,
        setup.dt,
        weather=_limiting_weather(setup),
        lanes=map.held,
    )
    asked = AskedSensors(map, own, setup, seed=seed)
    return View(order, ActorStates.empty(n), suite, asked)


def _frame(view: View, truth: WorldTruth, scene: Scene) -> SensorFrame:
    """Returns what the actor's sensors see of a moment."""
    for own, column in zip(view.states, truth.states, strict=True):
        np.take(column, view.order, out=own)
    hidden = {a.row for a in scene.actors.values() if not a.visible}
    for i, row in enumerate(view.order.tolist()):
        if row in hidden and i > 0:
            view.states.present[i] = False
    s, me, braking = view.states, int(view.order[0]), truth.commands[view.order, BRAKE] > 0.0
    pose = s.pose(0)
    speed = float(s.vx[0] * np.cos(pose.yaw) + s.vy[0] * np.sin(pose.yaw))
    return SensorFrame(
        tick=truth.tick,
        ego=EgoEstimate(
            pose=pose,
            speed=speed,
            yaw_rate=float(s.yaw_rate[0]),
            ax=float(s.ax[0]),
            ay=float(s.ay[0]),
            wheel_speeds=(speed, speed, speed, speed),
            gear=-1 if truth.commands[me, REVERSE] else 1,
        ),
        images=NO_IMAGES,
        segments=view.suite.segments(s),
        radar=view.suite.radar(truth.tick, s),
        lights=dict(truth.lights),
        extra=view.asked.read(truth.tick, s, NO_IMAGES, truth.lights, braking),
    )


BRAKE, REVERSE = 1, 4  # columns of the commands


def _read(
    properties: Mapping[str, str], name: str, bounds: tuple[float, ...], default: float
) -> float:
    """Returns a property that is a number within bounds; ConfigError for anything else."""
    if name not in properties:
        return default
    low, high = bounds
    whole = bounds is NUMBERS
    try:
        value = float(properties[name])
    except ValueError:
        value = inf
    if not low <= value <= high or (whole and value % 1.0):
        kind = "a whole number" if whole else "a number"
        given = describe_value(properties[name], 100)
        raise ConfigError(f"property {name} must be {kind} from {low:g} to {high:g}, got {given}")
    return value
