"""The ego's sensors at either level behind one call: the state of the world in, readings out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import CameraImage, RadarObjects, RadarPoints, RadarTracks, Segments
from skidpad.core.inputs import Outside
from skidpad.core.setup import Setup
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LightState, RadarModel, RangeModel, SensorLevel
from skidpad.roads.queries import RoadMap
from skidpad.sensors.object_level.objects import ObjectSuite
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from skidpad.sensors.suite import PixelSettings, PixelSuite

NO_IMAGES: Mapping[str, CameraImage] = MappingProxyType({})
NO_SEGMENTS: Mapping[str, Segments] = MappingProxyType({})


class CameraRadarReadings(NamedTuple):
    """One tick of cameras and radar at either level."""

    images: Mapping[str, CameraImage]
    segments: Mapping[str, Segments]
    radar: RadarPoints
    radar_objects: RadarObjects | None = None
    radar_tracks: RadarTracks | None = None


NO_READINGS = CameraRadarReadings(NO_IMAGES, NO_SEGMENTS, RadarPoints.none())


class Sensing(Protocol):
    """What the engine asks of a suite."""

    def read(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> CameraRadarReadings:
        """Readings of this state; valid until the next call (decision X-11)."""
        ...

    def change(self, outside: Outside) -> None:
        """Weather and headlights are others from the next reading on."""
        ...


class Pixels:
    """Real images and radar points."""

    def __init__(
        self, map: RoadMap, table: ActorTable, setup: Setup, seed: int, poison: bool
    ) -> None:
        self.suite = PixelSuite(
            map,
            table,
            setup.specs,
            setup.weather,
            PixelSettings(
                range_model=setup.range_model,
                camera_effect=setup.camera_effect,
                optics=setup.camera_optics,
                exclusive_stages=setup.rain_hides_night,
                seed=seed,
                dt=setup.dt,
                render_all=setup.render_all,
                poison_old=poison,
                bodywork=setup.bodywork,
                quality=setup.quality,
            ),
        )

    def read(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> CameraRadarReadings:
        """Images are rendered when first read."""
        seen = self.suite.observe(tick, states, lights, braking)
        return CameraRadarReadings(seen.images, NO_SEGMENTS, seen.radar)

    def change(self, outside: Outside) -> None:
        """Weather and headlights are others from the next reading on."""
        self.suite.change(outside)


class Objects:
    """Geometric detection from boxes (decision M-3)."""

    def __init__(self, map: RoadMap, table: ActorTable, setup: Setup, seed: int) -> None:
        physical = setup.range_model is RangeModel.PHYSICAL
        self.suite = ObjectSuite(
            map.roadside,
            table,
            setup.specs,
            seed,
            setup.dt,
            weather=setup.weather if physical else None,
            lanes=map.held,
        )
        self.is_blind = not (self.suite.cameras or self.suite.antennas)

    def read(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> CameraRadarReadings:
        """Segments of the depth cameras; lights and lamps play no part at this level."""
        del lights, braking
        if self.is_blind:
            return NO_READINGS
        return CameraRadarReadings(NO_IMAGES, *self.suite.read(tick, states))

    def change(self, outside: Outside) -> None:
        """Weather and headlights are others from the next reading on."""
        physical = outside.range_model is RangeModel.PHYSICAL
        self.suite.see_through(outside.weather if physical else None, outside.beam)


class WithPhysicalRadar:
    """A suite whose radar is replaced by the first one of the set-up with noise and clutter."""

    def __init__(
        self,
        suite: Sensing,
        spec: RadarSpec,
        map: RoadMap,
        table: ActorTable,
        setup: Setup,
        seed: int,
    ) -> None:
        weather = setup.weather if setup.range_model is RangeModel.PHYSICAL else None
        self.suite = suite
        self.radar = PhysicalRadar(
            spec,
            map.roadside,
            table,
            seed,
            weather,
            multipath=setup.radar_multipath,
            output=setup.radar_output,
            interference=setup.radar_interference,
            dt=setup.dt,
        )

    def read(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: NDArray[np.bool_],
    ) -> CameraRadarReadings:
        """Readings of the suite with the radar's detections."""
        seen = self.suite.read(tick, states, lights, braking)
        found = self.radar.read(tick, states)
        return seen._replace(
            radar=found.points, radar_objects=found.objects, radar_tracks=found.tracks
        )

    def change(self, outside: Outside) -> None:
        """Weather and headlights are others from the next reading on."""
        self.suite.change(outside)
        physical = outside.range_model is RangeModel.PHYSICAL
        self.radar.change(outside.weather if physical else None)


def sensing_of(
    map: RoadMap, table: ActorTable, setup: Setup, seed: int, poison: bool = False
) -> Sensing:
    """The suite at the level of the set-up."""
    radars = [spec for spec in setup.specs if isinstance(spec, RadarSpec)]
    if radars and setup.radar_model is RadarModel.PHYSICAL:
        others = tuple(spec for spec in setup.specs if not isinstance(spec, RadarSpec))
        suite = sensing_of(map, table, replace(setup, specs=others), seed, poison)
        return WithPhysicalRadar(suite, radars[0], map, table, setup, seed)
    if setup.level is SensorLevel.OBJECTS:
        return Objects(map, table, setup, seed)
    return Pixels(map, table, setup, seed, poison)
