"""Fog and rain before the sky of a picture for people, and the dim light that lamps give fog at night.

Both are level layers over the ground: a ray of the sky passes through more of them the less it climbs,
and loses light by the extinction at the ground. A fog that thins with height is as deep as the same fog
of even density would be. Depths of the layers and light at night are by eye.
"""

from __future__ import annotations

from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.weather import Weather
from skidpad.physics.camera import share_left
from skidpad.physics.optics import CLEAR, fog_extinction
from skidpad.sensors.pictures.lighting import Colour, Lighting
from skidpad.sensors.pictures.packing import grid_noise, pack, unpack
from skidpad.sensors.raster.view import View

LAYER = 150.0  # m of fog above the ground, if it does not thin out sooner
RAINY = 250.0  # m of rain above the ground
LEAST = 0.05  # depth of the layers in nepers, seen upwards, below which the sky keeps its colour
LAMPLIGHT = np.array([0.046, 0.042, 0.037], dtype=np.float32)  # of dense fog at night
BYTE = np.float32(254.999)


class Fog(NamedTuple):
    """The fog and rain of one weather before the sky."""

    depth: float  # nepers of both, seen upwards from the ground; 0 for none to be seen
    fog: float  # of these those of the fog
    start: float  # nepers that do not count on any way, as fog begins later
    thinning: float  # 1/m, with which the fog thins with height; 0: not
    ground: float  # m, on which the fog lies
    colour: Colour  # (3,) linear


def fog_of(weather: Weather, light: Lighting) -> Fog:
    """Returns the fog of a weather, in the colour that the ground fades into."""
    air = light.air
    per_m = fog_extinction(weather) - CLEAR
    fog = per_m * (min(LAYER, 1.0 / air.thinning) if air.thinning > 0.0 else LAYER)
    depth = fog + air.rain * RAINY
    if depth <= LEAST:
        depth = fog = 0.0
    return Fog(depth, fog, per_m * air.fog_start, air.thinning, air.ground, light.horizon)


def share_of_beam(fog: Fog, climb: float) -> float:
    """Returns the share of the sun's beam that fog and rain let through; climb: m up per m of its way."""
    return float(np.exp(-fog.depth / climb))


def light_fog(light: Lighting, weather: Weather) -> Lighting:
    """Returns the light of a weather in which fog at night has the dim light of lamps about it."""
    per_m = fog_extinction(weather) - CLEAR
    glow = np.float32(
        light.lamps * (1.0 - np.exp(-LAYER * per_m)) if LAYER * per_m > LEAST else 0.0
    )
    return light._replace(horizon=light.horizon + glow * LAMPLIGHT)


@inner_kernel
def _shows_sky(depths: NDArray[np.float32]) -> bool:
    """Returns whether a row of inverse depths has a pixel without any."""
    empty = 0
    for x in range(depths.size):
        empty += depths[x] <= np.float32(0.0)
    return empty > 0


@kernel
def veil_sky(view: View, fog: Fog, inverse: NDArray[np.float32], out: NDArray[np.uint32]) -> None:
    """Fades the sky in the rows of a view, in `out`, into the fog."""
    r = view.rotation
    one, none = np.float32(1.0), np.float32(0.0)
    per, curved = np.float32(1.0 / view.focal), np.float32(1.0)
    above = exp(-fog.thinning * max(view.centre[2] - fog.ground, 0.0))
    depth, start = np.float32(fog.depth - fog.fog * (1.0 - above)), np.float32(fog.start)
    least = np.float32(1e-3)
    middle = np.float32(0.5 - view.cx)
    red, green, blue = fog.colour[0], fog.colour[1], fog.colour[2]
    up_u, white = np.float32(r[0, 2]), BYTE
    byte = np.float32(1.0 / 255.0)
    for row in range(view.top, view.height):
        depths, pixels, line = inverse[row], out[row], np.float32(row)
        if not _shows_sky(depths):
            continue
        v = np.float32(row + 0.5 - view.cy) * per
        up_1 = np.float32(r[1, 2]) * v + np.float32(r[2, 2])
        for x in range(pixels.size):
            column = np.float32(np.int32(x))  # of 64 bits it takes three times as long
            u = (column + middle) * per
            climb = (up_u * u + up_1) / np.sqrt(u * u + v * v + one)
            tau = depth / (climb if climb > least else least) - start
            tau = tau if tau > none else none
            through = share_left(tau, curved)
            veil = one - through
            a, b, c = unpack(pixels[x])
            a, b, c = a * byte, b * byte, c * byte
            a = np.sqrt(a * a * through + veil * red)
            b = np.sqrt(b * b * through + veil * green)
            c = np.sqrt(c * c * through + veil * blue)
            a, b, c = (a if a < one else one), (b if b < one else one), (c if c < one else one)
            step = grid_noise(column, line)
            veiled = pack(a * white + step, b * white + step, c * white + step)
            pixels[x] = veiled if depths[x] <= none else pixels[x]
