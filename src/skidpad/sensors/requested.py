"""Sensors that a stack asked for besides the common ones: by id, measured when they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import count
from typing import Any, Protocol
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import ChannelView
from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.frames import CameraImage, GnssFix, ImuReading, LidarPoints
from skidpad.core.maths.randomness import stream_key
from skidpad.core.sensor_types import Measure, find_sensor_type
from skidpad.core.setup import Setup
from skidpad.core.specs import (
    AIR_SENSORS,
    CameraSpec,
    ChannelSpec,
    EyesSpec,
    LidarSpec,
    PointSensorSpec,
    SensorSpec,
)
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.traffic.sight import DriverView
from skidpad.core.vocabulary import LidarModel, LightState, RangeModel
from skidpad.physics.fog import with_fog
from skidpad.physics.grip import rain_rate, road_surface
from skidpad.physics.optics import LidarAir, extinction, lidar_air
from skidpad.physics.wetted import water_cover, window_loss
from skidpad.sensors import inertial
from skidpad.sensors.channels.presets import senses_of
from skidpad.sensors.channels.suite import CYCLE, ChannelSuite
from skidpad.sensors.object_level.eyes import Eyes
from skidpad.sensors.ranging.clouds import SprayClouds
from skidpad.sensors.ranging.lidar import Lidar
from skidpad.sensors.ranging.lidar_returns import ReturnModel
from skidpad.sensors.raster.live_scene import LiveScene, SceneMap

EGO = 0
Observe = Callable[
    [int, ActorStates, Mapping[int, LightState], NDArray[np.bool_]], None
]  # tick, states, lights, whose brake lamps are on


class GeoMap(SceneMap, Protocol):
    """What these sensors read of a road map."""

    geo_reference: str


class SensorHost(Protocol):
    """What a sensor is given to measure with: the world of the present tick, and the run.

    Attributes:
        tick: Number of the present tick.
        seed: Seed of the run, for noise.
        setup: Map, weather, settings and the length of a tick.
        table: Sizes and kinds of all actors; row 0 is the ego.
        states: Where all actors are in this tick, and how they move.

    Example:
        >>> def make_thermometer(spec, host):
        ...     return lambda: host.setup.weather.air_temperature_c
    """

    @property
    def tick(self) -> int:
        """Returns the number of the present tick."""

    @property
    def seed(self) -> int:
        """Returns the seed of the run, for noise."""

    @property
    def setup(self) -> Setup:
        """Returns map, weather, settings and the length of a tick."""

    @property
    def table(self) -> ActorTable:
        """Returns sizes and kinds of all actors; row 0 is the ego."""

    @property
    def states(self) -> ActorStates:
        """Returns where all actors are in this tick, and how they move."""

    def scene(self) -> LiveScene:
        """Returns the map's surfaces with all actors where they are now."""


class AskedSensors:
    """The readings that go to `frame.extra`: exact, and made only when they are read.

    A lidar's intensity falls with the air's extinction where the range model is physical. Lidars
    need no images, so they work at the object level, too.
    """

    def __init__(
        self,
        map: GeoMap,
        table: ActorTable,
        setup: Setup,
        lidar: Callable[[LidarSpec], LidarPoints] | None = None,
        seed: int = 0,
    ) -> None:
        """lidar: where a simulator has lidars of its own; None: rays through the map's scene."""
        self.tick = -1
        self.images: Mapping[str, CameraImage] = {}
        self.states = ActorStates.empty(len(table))
        self.air = 0.0  # 1/m, extinction of light
        if setup.range_model is RangeModel.PHYSICAL:
            self.air = extinction(setup.weather)
        self.map, self.table, self.setup, self.seed = map, table, setup, seed
        self.origin = inertial.map_origin(map.geo_reference) or (0.0, 0.0)
        self.server_lidar = lidar
        self.observers: list[Observe] = []  # that look in every tick, in the order of the specs
        self._scene: LiveScene | None = None  # for the first sensor that casts rays
        self._placed = -1
        self._serial = next(_SERIALS)
        _OPEN[self._serial] = self
        asked = [s for s in setup.specs if s.id in setup.asked]
        self.readers = {s.id: self._reader(s) for s in asked}
        self._kinds = {s.id: s.kind if isinstance(s, PointSensorSpec) else "" for s in asked}

    def read(
        self,
        tick: int,
        states: ActorStates,
        images: Mapping[str, CameraImage],
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> Mapping[str, Any]:
        """Returns the readings of this tick by sensor id; each is measured when it is first read.

        A first read after the next call raises BackendError (decision X-11). images: by camera id. lights:
        by signal id. braking: (n,) whose brake lamps are on. To be called in every tick: eyes and channels
        look in each.
        """
        self.tick, self.states, self.images = tick, states, images
        for observe in self.observers:
            observe(tick, states, lights, braking)
        return Readings(self._serial, tick, tuple(self.readers))

    @property
    def is_air_alone(self) -> bool:
        """Whether all that is asked for are sensors of the air, which change with the weather alone."""
        return all(kind in AIR_SENSORS for kind in self._kinds.values())

    def read_air(self) -> dict[str, float]:
        """Returns what sensors of the air say, by their kind."""
        return {kind: self.readers[id]() for id, kind in self._kinds.items() if kind in AIR_SENSORS}

    def scene(self) -> LiveScene:
        """Returns the map's surfaces with all actors where they are now."""
        if self._scene is None:
            self._scene = LiveScene(self.map, self.table, bodywork=self.setup.bodywork)
        if self._placed != self.tick:
            self._scene.place(self.states, self.setup.dt)
            self._placed = self.tick
        return self._scene

    def _reader(self, spec: SensorSpec) -> Measure:
        """Returns the function that measures with the asked sensor; raises ConfigError where none can."""
        kind = find_sensor_type(spec)
        if kind is None:
            raise ConfigError(f"no sensor like {spec} can be asked for")
        return kind.make(spec, self)


def make_camera(spec: CameraSpec, sensors: AskedSensors) -> Callable[[], CameraImage]:
    """Returns a function that gives the camera's image of the tick; ConfigError where none is rendered."""

    def image() -> CameraImage:
        if spec.id not in sensors.images:
            raise ConfigError(f"camera {spec.id!r} delivers no image: run with --sensors pixels")
        return sensors.images[spec.id]

    return image


def make_lidar(spec: LidarSpec, sensors: AskedSensors) -> Callable[[], LidarPoints]:
    """Returns a function that scans with a lidar: a simulator's own if it has one, else rays in the scene."""
    server = sensors.server_lidar
    if server is not None:
        return lambda: server(spec)
    returns, setup = None, sensors.setup
    effects, rain = setup.lidar_effects, rain_rate(setup.weather)
    if setup.lidar is LidarModel.PHYSICAL:
        physical = setup.range_model is RangeModel.PHYSICAL
        air = with_fog(lidar_air(setup.weather), effects.fog) if physical else LidarAir()
        film = road_surface(setup.weather).film_mm if effects.wet_ground else 0.0
        returns = ReturnModel(air, spec.range, water_cover(film))
    key = stream_key(sensors.seed, "lidar", spec.id)
    clouds = None
    if setup.spray:
        clouds = SprayClouds(sensors.table, road_surface(setup.weather).film_mm / 1000.0)
    window = partial(window_loss, effects.dirt, rain, stay=effects.drops_s)
    lidar = Lidar(spec, setup.dt, sensors.air, returns, key, clouds, window)
    return lambda: lidar.measure(
        sensors.tick, sensors.states.pose(EGO), sensors.scene(), EGO, sensors.states
    )


def make_gnss(spec: PointSensorSpec, sensors: AskedSensors) -> Callable[[], GnssFix]:
    """Returns the function that measures the antenna's position (deg, deg, m)."""
    return lambda: inertial.gnss(sensors.states.pose(EGO) @ spec.mount, sensors.origin)


def make_imu(spec: PointSensorSpec, sensors: AskedSensors) -> Callable[[], ImuReading]:
    """Returns a function that measures specific force and turn at the unit's mounting."""
    return lambda: inertial.imu(spec.mount, sensors.states, EGO)


def make_speedometer(spec: PointSensorSpec, sensors: AskedSensors) -> Callable[[], float]:
    """Returns a function that gives the ego's speed along its body in m/s, negative in reverse."""
    del spec
    return lambda: inertial.speed(sensors.states, EGO)


def make_eyes(spec: EyesSpec, sensors: AskedSensors) -> Callable[[], DriverView]:
    """Returns a function that gives what a driver's eyes see; adds them to what looks in every tick."""
    eyes = Eyes(spec, sensors.map.roadside, sensors.table, sensors.setup)
    sensors.observers.append(eyes.look)
    return eyes.view


def make_channel(spec: ChannelSpec, sensors: AskedSensors) -> Callable[[], ChannelView]:
    """Returns a function that gives what the channel measured in the first tick of its newest cycle.

    Adds an observer to `sensors` that measures in that tick; no view before the first one.
    """
    setup = sensors.setup
    suite = ChannelSuite(
        spec.id, senses_of(spec.id, spec.jumps), sensors.map.roadside, sensors.table,
        setup.weather, sensors.seed, noise=spec.noise,
    )  # fmt: skip
    measured = MeasuredCycles(spec, suite)
    sensors.observers.append(measured.observe)
    return measured.view


class MeasuredCycles:
    """Measures with the sensors of a channel in every cycle of a run."""

    def __init__(self, spec: ChannelSpec, suite: ChannelSuite) -> None:
        self._spec, self._suite, self._ticks = spec, suite, 0
        self._view: ChannelView | None = None

    def observe(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> None:
        """Counts a tick of the run, and measures in each that begins a cycle: every `period`-th."""
        del tick, braking
        cycle, rest = divmod(self._ticks, self._spec.period)
        self._ticks += 1
        if not rest:
            self._view = self._suite.observe((cycle + self._spec.first) * CYCLE, states, lights)

    def view(self) -> ChannelView:
        """Returns what the newest cycle measured."""
        assert self._view is not None, "the first tick of a run is measured"
        return self._view


_SERIALS = count()
_OPEN: WeakValueDictionary[int, AskedSensors] = WeakValueDictionary()  # by serial number


class Readings(Mapping[str, Any]):
    """Readings by sensor id, each made when it is first read.

    It holds readings and numbers alone: no attribute of it leads to the sensors or the world.
    """

    __slots__ = ("_ids", "_ready", "_serial", "_tick")

    def __init__(self, serial: int, tick: int, ids: tuple[str, ...]) -> None:
        """serial: of the sensors that measure."""
        self._serial, self._tick, self._ids = serial, tick, ids
        self._ready: dict[str, Any] = {}

    def __getitem__(self, id: str) -> Any:
        if id not in self._ready:
            if id not in self._ids:
                raise KeyError(id)
            sensors = _OPEN.get(self._serial)
            if sensors is None or sensors.tick != self._tick:
                now = "the run was closed" if sensors is None else f"tick {sensors.tick}"
                raise BackendError(
                    f"sensor {id} of tick {self._tick} was first read after "
                    f"{now}; a frame is valid until the next step"
                )
            self._ready[id] = sensors.readers[id]()
        return self._ready[id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._ids)

    def __len__(self) -> int:
        return len(self._ids)
