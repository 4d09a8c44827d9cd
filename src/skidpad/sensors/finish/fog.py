"""Fog before the sky of a picture for people, and the dim light that lamps give it at night.

The fog is a level layer over the ground: a ray of the sky passes through more of it the less it climbs,
and loses light by the extinction of the ground. Depth of the layer and light at night are by eye.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel
from skidpad.core.weather import Weather
from skidpad.physics.camera import share_left
from skidpad.physics.optics import fog_extinction
from skidpad.sensors.pictures.lighting import Colour, Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View

LAYER = 150.0  # m of fog above the ground
LEAST = 0.05  # depth of the layer in nepers, seen upwards, below which the sky keeps its colour
LAMPLIGHT = np.array([0.046, 0.042, 0.037], dtype=np.float32)  # of dense fog at night
BYTE = np.float32(255.0)


class Fog(NamedTuple):
    """The fog of one weather before the sky."""

    per_m: float  # 1/m, extinction; 0 for none to be seen
    start: float  # m, where it begins
    colour: Colour  # (3,) linear


def fog_of(weather: Weather, light: Lighting) -> Fog:
    """Returns the fog of a weather, in the colour that the ground fades into."""
    clear = fog_extinction(replace(weather, fog_density=0.0))
    per_m = fog_extinction(weather) - clear
    seen = per_m if LAYER * per_m > LEAST else 0.0
    return Fog(seen, float(weather.fog_distance), light.horizon)


def light_fog(light: Lighting, weather: Weather) -> Lighting:
    """Returns the light of a weather in which fog at night has the dim light of lamps about it."""
    fog = fog_of(weather, light)
    glow = np.float32(light.lamps * (1.0 - np.exp(-LAYER * fog.per_m)))
    return light._replace(horizon=light.horizon + glow * LAMPLIGHT)


@kernel
def veil_sky(view: View, fog: Fog, inverse: NDArray[np.float32], out: NDArray[np.uint32]) -> None:
    """Fades the sky in the rows of a view, in `out`, into the fog."""
    r = view.rotation
    one, none = np.float32(1.0), np.float32(0.0)
    per, curved = np.float32(1.0 / view.focal), np.float32(1.0)
    layer, least = np.float32(LAYER), np.float32(1e-3)
    per_m, start = np.float32(fog.per_m), np.float32(fog.start)
    middle = np.float32(0.5 - view.cx)
    red, green, blue = fog.colour[0], fog.colour[1], fog.colour[2]
    up_u, white = np.float32(r[0, 2]), BYTE
    byte = np.float32(1.0 / 255.0)
    for row in range(view.top, view.height):
        v = np.float32(row + 0.5 - view.cy) * per
        up_1 = np.float32(r[1, 2]) * v + np.float32(r[2, 2])
        depths, pixels = inverse[row], out[row]
        for x in range(pixels.size):
            u = (np.float32(x) + middle) * per
            climb = (up_u * u + up_1) / np.sqrt(u * u + v * v + one)
            way = layer / (climb if climb > least else least) - start
            through = share_left(per_m * (way if way > none else none), curved)
            through = through if depths[x] <= none else one
            veil = one - through
            a, b, c = unpack(pixels[x])
            a, b, c = a * byte, b * byte, c * byte
            a = np.sqrt(a * a * through + veil * red)
            b = np.sqrt(b * b * through + veil * green)
            c = np.sqrt(c * c * through + veil * blue)
            a, b, c = (a if a < one else one), (b if b < one else one), (c if c < one else one)
            pixels[x] = pack(a * white, b * white, c * white) if depths[x] <= none else pixels[x]
