"""Sensors that a stack asked for besides the common ones: by id, read when somebody looks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.frames import CameraImage, LidarPoints
from skidpad.core.setup import Setup
from skidpad.core.specs import (
    GNSS,
    IMU,
    SPEEDOMETER,
    CameraSpec,
    EyesSpec,
    LidarSpec,
    PointSensorSpec,
    SensorSpec,
)
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LightState, RangeModel
from skidpad.physics.optics import extinction
from skidpad.sensors import inertial
from skidpad.sensors.eyes import Eyes
from skidpad.sensors.lidar import Lidar
from skidpad.sensors.live_scene import LiveScene, SceneMap

EGO = 0


class GeoMap(SceneMap, Protocol):
    """What these sensors read of a road map."""

    geo_reference: str


class AskedSensors:
    """The readings that go to `frame.extra`: exact, and made only when somebody reads them.

    A lidar's intensity falls with the air's extinction where the range model is physical. Lidars
    need no images, so they work at the object level, too.
    """

    def __init__(
        self,
        map: GeoMap,
        table: ActorTable,
        setup: Setup,
        lidar: Callable[[LidarSpec], LidarPoints] | None = None,
    ) -> None:
        """lidar: where a simulator has lidars of its own; None: rays through the map's scene."""
        self.tick = -1
        self.images: Mapping[str, CameraImage] = {}
        self.states = ActorStates.empty(len(table))
        self.air = 0.0  # 1/m, extinction of light
        if setup.range_model is RangeModel.PHYSICAL:
            self.air = extinction(setup.weather)
        self._map, self._table, self._dt = map, table, setup.dt
        self._origin = inertial.map_origin(map.geo_reference) or (0.0, 0.0)
        self._lidar = lidar
        self._scene: LiveScene | None = None  # for the first lidar that is read
        self._placed = -1
        self._eyes = {
            s.id: Eyes(s, map.roadside, table, setup)
            for s in setup.specs
            if s.id in setup.asked and isinstance(s, EyesSpec)
        }
        self.readers = {s.id: self._reader(s) for s in setup.specs if s.id in setup.asked}

    def read(
        self,
        tick: int,
        states: ActorStates,
        images: Mapping[str, CameraImage],
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> Mapping[str, Any]:
        """Readings of this state by id, valid until the next call (decision X-11).

        braking: (n,) whose brake lamps are on. Eyes look in every tick, as they see late.
        """
        self.tick, self.states, self.images = tick, states, images
        for eyes in self._eyes.values():
            eyes.look(tick, states, lights, braking)
        return Readings(self, tick)

    def _reader(self, spec: SensorSpec) -> Callable[[], Any]:
        if isinstance(spec, CameraSpec):
            return partial(self._image, spec.id)
        if isinstance(spec, LidarSpec) and self._lidar is not None:
            return partial(self._lidar, spec)
        if isinstance(spec, LidarSpec):
            return partial(self._points, Lidar(spec, self._dt, self.air))
        if isinstance(spec, EyesSpec):
            return self._eyes[spec.id].view
        if isinstance(spec, PointSensorSpec):
            if spec.kind == GNSS:
                return lambda: inertial.gnss(self.states.pose(EGO) @ spec.mount, self._origin)
            if spec.kind == IMU:
                return lambda: inertial.imu(spec.mount, self.states, EGO)
            if spec.kind == SPEEDOMETER:
                return lambda: inertial.speed(self.states, EGO)
        raise ConfigError(f"no sensor like {spec} can be asked for")

    def _image(self, id: str) -> CameraImage:
        if id not in self.images:
            raise ConfigError(f"camera {id!r} delivers no image: run with --sensors pixels")
        return self.images[id]

    def _points(self, lidar: Lidar) -> LidarPoints:
        if self._scene is None:
            self._scene = LiveScene(self._map, self._table)
        if self._placed != self.tick:
            self._scene.place(self.states, self._dt)
            self._placed = self.tick
        return lidar.measure(self.tick, self.states.pose(EGO), self._scene, EGO)


class Readings(Mapping[str, Any]):
    """Readings by sensor id, each made when it is first read."""

    def __init__(self, sensors: AskedSensors, tick: int) -> None:
        self._sensors, self._tick = sensors, tick
        self._ready: dict[str, Any] = {}

    def __getitem__(self, id: str) -> Any:
        if id not in self._ready:
            reader = self._sensors.readers[id]
            if self._sensors.tick != self._tick:
                raise BackendError(
                    f"sensor {id} of tick {self._tick} was first read after tick "
                    f"{self._sensors.tick}; a frame is valid until the next step"
                )
            self._ready[id] = reader()
        return self._ready[id]

    def __iter__(self) -> Iterator[str]:
        return iter(self._sensors.readers)

    def __len__(self) -> int:
        return len(self._sensors.readers)
