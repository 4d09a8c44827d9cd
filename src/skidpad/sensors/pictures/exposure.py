"""Exposure of colour pictures by a camera with limits: what daylight and headlights are worth in its scale.

The camera makes a white level surface under sun and sky just white, as far as aperture, time and
sensitivity reach: f/2, 1/30 s and ISO 1600 at the dark end, 1/20 000 s and ISO 100 at the bright one
(assumptions). Daylight is `optics.daylight`, the scale `camera.exposed_share`. Headlights keep their shape
and are worth, 20 m ahead, what 10 000 cd are there. Lamps, street lights and what glows keep the strength
of the published pictures. Checked against tabulated exposure values of daylight scenes
(docs/camera-exposure.csv), which were not used. Valid: sun, sky and the ego's own beam.
"""

from __future__ import annotations

from math import log2, pi

import numpy as np

from skidpad.core.kernels.jit import kernel
from skidpad.core.weather import Weather
from skidpad.physics.camera import (
    SATURATION,
    exposed_share,
    exposure_value,
    saturation_luminance,
)
from skidpad.physics.optics import HEADLIGHT_CANDELA, HIGH_BEAM_CANDELA, daylight
from skidpad.sensors.pictures.headlamps import beam_at, beam_of
from skidpad.sensors.pictures.lighting import Lighting

DARKEST = exposure_value(2.0, 1.0 / 30.0, 1600.0)  # EV100 of the longest exposure
BRIGHTEST = exposure_value(2.0, 1.0 / 20_000.0, 100.0)
BEAM_AT = 20.0  # m, where headlights have their strength
LUMA = np.array([0.2126, 0.7152, 0.0722])  # of linear red, green, blue (ITU-R BT.709)


def exposure_of(weather: Weather) -> float:
    """Returns the EV100 that the camera chooses in a weather, within its limits."""
    return min(max(log2(daylight(weather) / pi / SATURATION), DARKEST), BRIGHTEST)


@kernel
def beam_ahead(light: Lighting, ahead: float) -> float:
    """Returns the light of the ego's beam on a white surface `ahead` m before the lamps, at their height."""
    beam, slope, reach = beam_of(light)
    none = np.float32(0.0)
    return float(beam_at(np.float32(ahead), none, none, beam, slope, reach))


def expose(light: Lighting, weather: Weather) -> Lighting:
    """Returns the light of a weather in the scale of the camera's exposure."""
    ev100 = exposure_of(weather)
    level = float(LUMA @ (max(float(light.sun_direction[2]), 0.0) * light.sun + light.sky))
    share = np.float32(exposed_share(daylight(weather) / pi, ev100) / level)
    beam = light.headlights
    if beam > 0.0:
        candela = HIGH_BEAM_CANDELA if light.high else HEADLIGHT_CANDELA
        shown = beam_ahead(light, BEAM_AT)
        beam *= candela / BEAM_AT**2 / pi / saturation_luminance(ev100) / shown
    return light._replace(
        sun=light.sun * share,
        sky=light.sky * share,
        bounce=light.bounce * share,
        zenith=light.zenith * share,
        horizon=light.horizon * share,
        headlights=beam,
    )
