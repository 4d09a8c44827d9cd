"""What the light is like: sun, sky, air and lamps as functions of the weather.

Light is linear, 1 = a horizontal white surface at clear noon after exposure. The camera exposes
for the scene as the published histogram exposure does, so a sunrise is not half as bright as noon.
Colours and strengths are chosen by eye for legible pictures; the air's extinction is physics.
"""

from __future__ import annotations

from math import cos, radians, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.inputs import Beam
from skidpad.core.maths.lefthanded import mirror_value
from skidpad.core.weather import Weather
from skidpad.physics.optics import Air, air_of, extinction

Colour = NDArray[np.float32]

NIGHT_BELOW, DAY_ABOVE = -8.0, 12.0  # deg of sun altitude between which dusk happens
MILKY = 30.0  # percent of ice_thickness, from which on no road is seen through it; by eye


class Lighting(NamedTuple):
    """Light of one weather; colours (3,) float32 linear, directions world frame."""

    sun_direction: NDArray[np.float64]  # (3,) unit, towards the sun
    sun: Colour  # on a surface that faces it
    sky: Colour  # diffuse, on a surface that faces up
    bounce: Colour  # diffuse, on a surface that faces down: light from the ground
    zenith: Colour  # colour of the sky overhead
    horizon: Colour  # and at the horizon; also the colour of haze
    disc: float  # brightness of the sun's disc and glow
    air: Air  # along the line of sight
    curved: float  # 1: contrast falls as by Koschmieder, 0: as in the published pictures
    wet: float  # 0 dry .. 1 water on the road
    snow: float  # 0 .. 1 share of white ground
    ice: float  # 0 .. 1, 0 where it is none or as clear as water
    headlights: float  # strength of the ego's beam, 0 off
    high: bool  # it is the high beam
    lamps: float  # strength of other vehicles' lamps, 0 by day
    glow: float = 1.0  # share of the sun's disc and glow that the sky has; 0: drawn by `finish`
    dome: float = 0.0  # how far veils of the sky bend down at the horizon; 0: not, as published
    onset: float = 0.0  # m over which the beam rises before the lamps; 0: at once, as published
    exposure: float = 1.0  # what all light of a picture is multiplied by


def lighting(
    weather: Weather,
    beam: Beam | None = None,
    *,
    haze: bool = False,
    ground: float | None = None,
) -> Lighting:
    """Returns the light of a weather.

    Args:
        weather: what sun, sky and air are like.
        beam: of the ego; None: low beam by night, else none (A-218).
        haze: contrast falls with distance as `physics.camera` says; else as in the published pictures.
        ground: m, height above which fog thins as fog_falloff says; None: not at all. With neither,
            rain begins where the fog does, as in the published pictures.
    """
    if beam is None:
        beam = Beam.LOW if weather.is_night else Beam.OFF
    altitude = radians(weather.sun_altitude_deg)
    azimuth = radians(mirror_value(weather.sun_azimuth_deg))
    direction = np.array(
        [cos(altitude) * cos(azimuth), cos(altitude) * sin(azimuth), sin(altitude)]
    )
    day = _smooth((weather.sun_altitude_deg - NIGHT_BELOW) / (DAY_ABOVE - NIGHT_BELOW))
    high = _smooth(weather.sun_altitude_deg / 45.0)
    cloud = weather.cloudiness / 100.0
    clear = 1.0 - 0.94 * cloud
    low_sun, noon_sun = np.array([1.55, 0.98, 0.52]), np.array([0.76, 0.73, 0.68])
    sun = day * clear * (low_sun + high * (noon_sun - low_sun))
    blue, grey = np.array([0.24, 0.29, 0.37]), np.array([0.48, 0.49, 0.50])
    diffuse = blue + cloud * (grey - blue)
    dusk = _mix(np.array([0.48, 0.42, 0.44]), np.array([0.40, 0.36, 0.34]), cloud)
    sky = day * (dusk + high * (diffuse - dusk)) + (1.0 - day) * NIGHT_SKY_LIGHT
    grey_sky = _mix(DAWN_OVERCAST, OVERCAST, high)
    zenith = day * _mix(_mix(DAWN_ZENITH, DAY_ZENITH, high), grey_sky, cloud)
    horizon = day * _mix(_mix(DAWN_HORIZON, DAY_HORIZON, high), grey_sky * 1.12, cloud)
    night = 1.0 - day
    return Lighting(
        direction,
        sun.astype(np.float32),
        sky.astype(np.float32),
        (0.95 * sky).astype(np.float32),
        (zenith + night * NIGHT_ZENITH).astype(np.float32),
        (horizon + night * NIGHT_HORIZON).astype(np.float32),
        float(day * clear * (0.35 if cloud > 0.5 else 1.0)),
        _published_air(weather) if ground is None and not haze else air_of(weather, ground),
        float(haze),
        max(weather.wetness, weather.precipitation_deposits) / 100.0,
        _smooth(weather.snow_depth_mm / 20.0),
        _smooth(weather.ice_thickness / MILKY),
        0.0 if beam is Beam.OFF else 1.0,
        beam is Beam.HIGH,
        night,
    )


def _published_air(weather: Weather) -> Air:
    """Returns the air of the published pictures: all of it begins with the fog, or at the lens without."""
    start = float(weather.fog_distance) if weather.fog_density > 0.0 else 0.0
    return Air(extinction(weather), start, 0.0)


DAY_ZENITH, DAY_HORIZON = np.array([0.10, 0.26, 0.60]), np.array([0.48, 0.64, 0.82])
DAWN_ZENITH, DAWN_HORIZON = np.array([0.16, 0.24, 0.46]), np.array([0.92, 0.60, 0.36])
OVERCAST, DAWN_OVERCAST = np.array([0.40, 0.42, 0.45]), np.array([0.36, 0.30, 0.27])
NIGHT_SKY_LIGHT = np.array([0.010, 0.012, 0.018])
NIGHT_ZENITH, NIGHT_HORIZON = np.array([0.002, 0.003, 0.008]), np.array([0.010, 0.012, 0.022])


def _mix(a: NDArray[np.float64], b: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Returns the colour at the share 0..1 from a to b."""
    return a + share * (b - a)


def _smooth(t: float) -> float:
    """Returns the smoothstep of t, 0 below 0 and 1 above 1."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)
