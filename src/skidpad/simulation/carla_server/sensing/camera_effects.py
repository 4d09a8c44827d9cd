"""What weather and exposure do to one camera's pictures, as its attributes say; by default light alone acts.

The order is that of runs (`sensors.suite`): spray, drops on the glass, then the published stages. A camera
of a client stands in no cockpit, so its whole picture is behind the glass.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from skidpad.core.inputs import Beam
from skidpad.core.settings.parts import NightRain
from skidpad.core.specs import CameraSpec
from skidpad.core.vocabulary import RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate, road_surface
from skidpad.physics.optics import depth_range, label_range
from skidpad.sensors.pictures.degradation import CameraNoise, degradation
from skidpad.sensors.pictures.exposure import expose
from skidpad.sensors.pictures.lens import LensDrops
from skidpad.sensors.pictures.lighting import Lighting, lighting
from skidpad.sensors.pictures.shading import Shading
from skidpad.sensors.pictures.spray import veil_by_spray
from skidpad.sensors.ranging.clouds import SprayClouds
from skidpad.sensors.raster.passes import UNLIMITED, Pass, Sight
from skidpad.sensors.raster.view import View
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.sensing.additions import read_addition
from skidpad.simulation.carla_server.sensing.exposure_control import ExposureControl
from skidpad.simulation.carla_server.sensing.surroundings import Pictured


class CameraEffects:
    """The effects on one camera; `move` once per reading, before its picture is made."""

    def __init__(self, actor: Actor, spec: CameraSpec, seed: int) -> None:
        """WireError for attributes that cannot be used."""
        noise_seed = actor.attributes.get("noise_seed", "0")
        self._spec, self._seed = replace(spec, id=noise_seed), seed
        self._sight = read_addition(actor, "range_model") is RangeModel.PHYSICAL
        self._degrades = read_addition(actor, "camera_effect")
        self._exclusive = read_addition(actor, "night_rain") is NightRain.RAIN_ONLY
        self._haze = bool(read_addition(actor, "camera_haze"))
        self._exposes = read_addition(actor, "camera_exposure")
        self._wets = read_addition(actor, "camera_drops")
        self._sprays = read_addition(actor, "camera_spray")
        self._weather: Weather | None = None
        self._light: Lighting | None = None  # that the camera records; None: the scene's
        self._exposure = ExposureControl(actor)
        self._film = 0.0  # m of water on the road
        self._noise: CameraNoise | None = None
        self._drops: LensDrops | None = None
        self._dt, self._reading = 0.0, 0
        self.sight = UNLIMITED

    def move(self, weather: Weather, ground: float, speed: float, dt: float) -> None:
        """Begins a reading `dt` s after the last one. ground: m, of the fog; speed: m/s, of the camera."""
        self._reading += 1
        self._exposure.move(weather, dt)
        if self._wets and (self._drops is None or self._dt != dt):
            self._drops, self._dt = LensDrops(self._spec, self._seed, rain_rate(weather), dt), dt
        if self._weather is not weather:
            self._weather = weather
            self._look_out(weather, ground)
        if self._drops is not None:
            self._drops.move(self._reading, speed)

    def _look_out(self, weather: Weather, ground: float) -> None:
        """Sets what a weather changes; labels reach as far as a low beam by night, as pictures are lit."""
        if self._sight:
            self.sight = Sight(depth_range(weather), label_range(weather, Beam.LOW))
        if self._haze or self._exposes:
            light = lighting(weather, haze=self._haze, ground=ground)
            self._light = expose(light, weather) if self._exposes else light
        if self._sprays:
            self._film = road_surface(weather).film_mm / 1000.0
        if self._degrades:
            effect = replace(degradation(weather, exclusive=self._exclusive), glass=False)
            self._noise = CameraNoise(self._spec.id, self._seed, effect)
        if self._drops is not None:
            self._drops.change(rain_rate(weather))

    def limit_sight(self, view: View, drawn: Pass) -> None:
        """Removes from what is drawn what the weather hides from this camera."""
        drawn.sight = self.sight
        drawn.limit_sight(view)

    def shading(self, scene: Pictured) -> Shading:
        """Returns the colours of the scene in the light that this camera records."""
        light = self._exposed_light(scene)
        if light is scene.shading.light:
            return scene.shading
        shading = copy(scene.shading)  # snow and lamps are the same, so all else is
        shading.light = light
        return shading

    def _exposed_light(self, scene: Pictured) -> Lighting:
        """Returns the light of the scene as this camera exposes it."""
        light = self._light or scene.shading.light
        factor = self._exposure.factor
        return light if factor == 1.0 else light._replace(exposure=factor)

    def add_weather(
        self, scene: Pictured, view: View, drawn: Pass, rgb: NDArray[np.uint32]
    ) -> None:
        """Adds spray and drops to a painted picture (H, W), in place."""
        light = self._exposed_light(scene)
        if self._sprays:
            clouds = SprayClouds(scene.bodies, self._film).at(scene.states)
            if len(clouds):
                haze = light.horizon * np.float32(light.exposure)
                veil_by_spray(view, clouds, drawn.inverse, haze, rgb)
        if self._drops is not None:
            self._drops.draw(view, light, rgb)

    def add_noise(self, rgb: NDArray[np.uint32]) -> None:
        """Adds the published stages to a finished picture (H, W), in place."""
        if self._noise is not None:
            self._noise.apply(self._reading, rgb)
