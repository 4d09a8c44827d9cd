"""Exposure of a client's colour camera by the attributes that CARLA's blueprints have for it.

Light is measured on CARLA's scale, in EV100 of the camera that shows it as pictures here do: clear noon has
12, the upper end of the blueprint's range. That CARLA's daylight has it is an assumption; a user matched its
picture by 1/3000 s at f/1.4 and ISO 100, EV100 12.5 (carla-simulator/carla#3634). By default the range of 10
to 12 leaves pictures as they are, so night is dark. Light is measured, not the picture: what a camera looks
at changes nothing.
"""

from __future__ import annotations

from math import log2

import numpy as np

from skidpad.core.weather import Weather
from skidpad.physics.camera import exposure_value
from skidpad.physics.optics import daylight
from skidpad.physics.presets import preset
from skidpad.sensors.pictures.exposure import LUMA
from skidpad.sensors.pictures.lighting import Lighting, lighting
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.sensing.additions import read_addition
from skidpad.simulation.carla_server.sensing.settings import PostSettings

DARKEST, BRIGHTEST = 10.0, 12.0  # EV100: the range of CARLA's blueprint
SPEEDS = (3.0, 1.0)  # f-stops per s towards brighter and darker surroundings: its defaults
NOON = preset("clear-noon")


def white_level(light: Lighting) -> float:
    """Returns the light of a white level surface under sun and sky, in a picture."""
    return float(LUMA @ (max(float(light.sun_direction[2]), 0.0) * light.sun + light.sky))


def brightness(weather: Weather) -> float:
    """Returns the EV100, on CARLA's scale, of a camera that has adapted to a weather without limits."""
    by_day = BRIGHTEST + log2(daylight(weather) / daylight(NOON))
    shown = white_level(lighting(weather)) / white_level(lighting(NOON))
    return float(np.clip(by_day, DARKEST, BRIGHTEST)) + log2(shown)


class ExposureControl:
    """What one camera multiplies light by; `move` once per reading."""

    def __init__(self, actor: Actor) -> None:
        """WireError for values that no camera has."""
        read = PostSettings(actor)
        self.factor = 1.0
        self._weather: Weather | None = None
        self._scene = BRIGHTEST  # EV100 of the weather
        self._adapted: float | None = None  # EV100 now; None before the first reading
        self._more = 2.0 ** read.number("exposure_compensation", 0.0, -20.0, 20.0)
        self._is_ours = bool(read_addition(actor, "camera_exposure"))
        self._manual = read.word("exposure_mode", "histogram") == "manual"
        stop, iso = read.number("fstop", 1.4, 0.1, 64.0), read.number("iso", 100.0, 1.0, 1e6)
        time = 1.0 / read.number("shutter_speed", 200.0, 1e-3, 1e6)
        self._fixed = exposure_value(stop, time, iso)
        self._range = (
            read.number("exposure_min_bright", DARKEST, -20.0, 30.0),
            read.number("exposure_max_bright", BRIGHTEST, -20.0, 30.0),
        )
        self._speeds = (
            read.number("exposure_speed_up", SPEEDS[0], 0.0, 1e3),
            read.number("exposure_speed_down", SPEEDS[1], 0.0, 1e3),
        )
        if self._range[0] > self._range[1]:
            raise read.error(
                "exposure_min_bright", f"at most exposure_max_bright, {self._range[1]:g}"
            )

    def move(self, weather: Weather, dt: float) -> None:
        """Adapts for `dt` s to the light of a weather; at once unless one of the speeds is set."""
        if self._is_ours:  # and already in the light; the client's compensation comes on top
            self.factor = self._more
            return
        if self._weather is not weather:
            self._weather, self._scene = weather, brightness(weather)
        as_shown = _within(self._scene, (DARKEST, BRIGHTEST))
        if self._manual:
            self.factor = self._more * 2.0 ** (as_shown - self._fixed)
            return
        wanted = _within(self._scene, self._range)
        if self._adapted is None or self._speeds == SPEEDS:
            self._adapted = wanted
        up, down = self._speeds
        step = min(max(wanted - self._adapted, -down * dt), up * dt)
        self._adapted += step
        self.factor = self._more * 2.0 ** (as_shown - self._adapted)


def _within(value: float, limits: tuple[float, float]) -> float:
    """Returns the value, or the limit that it lies beyond."""
    return min(max(value, limits[0]), limits[1])
