"""Rain and snow in the air of a picture for people: drops and flakes in space, as strokes of one exposure.

Drops fill boxes before the camera, small near ones and large far ones, so that near strokes are long and
bright and far ones many and faint. Each lies where code puts it in the world, falls, drifts with the wind
and is drawn along its way past the moving camera during the exposure, where nothing nearer hides it. Speed of
fall is physics (Atlas et al., 1973, for 2 mm); numbers, widths and brightness are by eye.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.weather import Weather
from skidpad.physics.optics import snow_rate
from skidpad.physics.wind import wind_of_intensity
from skidpad.sensors.pictures.headlamps import HEADLAMP_X, HEADLAMP_Z, beam_at, beam_of
from skidpad.sensors.pictures.lighting import Colour, Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View

BOXES = np.array([[7.0, 0.4], [18.0, 1.0], [40.0, 1.0]])  # m of edge, share of DROPS
DROPS = 1600  # at a precipitation of 100
RAIN_FALL, SNOW_FALL = 6.5, 1.2  # m/s, of drops of 2 mm and of flakes
EXPOSED = 0.018  # s
RAIN_WIDTH, SNOW_WIDTH = 0.004, 0.012  # m
RAIN_SEEN, SNOW_SEEN = 0.6, 0.85  # share of the light behind that a near stroke hides
NEAR = 1.6  # m, before which none is drawn: there is a car or a glass
SHELTER = 0.35  # share of the wind near the ground
LEAST = 0.02  # share below which a stroke is not seen
LONGEST = 160.0  # px
WHITE = np.float32(255.0)


class Falling(NamedTuple):
    """What falls in one weather."""

    share: float  # of the drops of BOXES; 0: nothing falls
    velocity: Floats  # (3,) m/s, world
    width: float  # m
    seen: float
    colour: Colour  # (3,) linear


def falling_in(weather: Weather, light: Lighting) -> Falling:
    """Returns what falls in a weather, in its light."""
    snow = snow_rate(weather) > 0.0
    fall, width, seen = (
        (SNOW_FALL, SNOW_WIDTH, SNOW_SEEN) if snow else (RAIN_FALL, RAIN_WIDTH, RAIN_SEEN)
    )
    wind = SHELTER * wind_of_intensity(weather.wind_intensity)
    sky = 0.5 * (light.zenith + light.horizon)
    dull = 0.8 * 0.5 * (light.sky + light.bounce) + 0.3 * light.sun
    colour = dull if snow else 1.3 * sky + 0.15 * light.sun
    return Falling(
        (weather.precipitation / 100.0) ** 0.7,
        np.array([-wind, 0.0, -fall]),
        width,
        seen,
        np.minimum(colour, 1.0).astype(np.float32),
    )


@kernel
def draw_falling(
    view: View,
    falling: Falling,
    light: Lighting,
    boxes: Floats,
    places: Floats,
    time: float,
    velocity: Floats,
    ego: Floats,
    inverse: NDArray[np.float32],
    out: NDArray[np.uint32],
) -> None:
    """Draws strokes of drops or flakes into the rows of a view, in `out`.

    boxes: (k, 2) m of edge and share of the drops; places: (n, 3) of all drops, in edges; time: s;
    velocity: (3,) m/s of the camera; ego: x, y, z in m and yaw in rad of what carries the headlights.
    """
    r, c = view.rotation, view.centre
    cos_ego, sin_ego = np.cos(ego[3]), np.sin(ego[3])
    strength, slope, reach = beam_of(light)
    strength *= np.float32(light.lamps)
    moved = (falling.velocity - velocity) * EXPOSED
    nearing = r[2, 0] * moved[0] + r[2, 1] * moved[1] + r[2, 2] * moved[2]
    wide_u, wide_v = 0.5 * view.width / view.focal, (view.height + view.cy) / view.focal
    for b in range(len(boxes)):
        edge, count = boxes[b, 0], int(len(places) * boxes[b, 1] * falling.share)
        low = c + 0.46 * edge * r[2] - 0.5 * edge  # corner of the box before the camera
        shift = (falling.velocity * time - low) / edge
        shift -= np.floor(shift)
        low -= c
        for n in range(count):
            x, y, z = places[n, 0] + shift[0], places[n, 1] + shift[1], places[n, 2] + shift[2]
            x = low[0] + edge * (x - 1.0 if x >= 1.0 else x)
            y = low[1] + edge * (y - 1.0 if y >= 1.0 else y)
            z = low[2] + edge * (z - 1.0 if z >= 1.0 else z)
            depth = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
            if depth < NEAR or depth + nearing < NEAR:
                continue
            right = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
            down = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
            if abs(right) > wide_u * depth + 1.0 or abs(down) > wide_v * depth + 1.0:
                continue
            wide = falling.width * view.focal / depth
            share = falling.seen * min(wide, 1.0) * min((0.96 * edge - depth) / (0.3 * edge), 1.0)
            if share < LEAST:
                continue
            u0, v0 = view.cx + view.focal * right / depth, view.cy + view.focal * down / depth
            x, y, z = x + moved[0], y + moved[1], z + moved[2]
            u1 = view.cx + view.focal * (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z) / (
                depth + nearing
            )
            v1 = view.cy + view.focal * (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z) / (
                depth + nearing
            )
            lit = np.float32(0.0)
            if strength > 0.0:
                dx, dy, dz = x + c[0] - ego[0], y + c[1] - ego[1], z + c[2] - ego[2]
                ahead_of_lamps = np.float32(cos_ego * dx + sin_ego * dy - HEADLAMP_X)
                beside, above = np.float32(cos_ego * dy - sin_ego * dx), np.float32(dz - HEADLAMP_Z)
                lit = beam_at(ahead_of_lamps, beside, above, strength, slope, reach)
            _stroke(view, (u0, v0, u1, v1), depth, wide, share, falling.colour, lit, inverse, out)


@inner_kernel
def _stroke(
    view: View,
    ends: tuple[float, float, float, float],
    depth: float,
    wide: float,
    share: float,
    colour: Colour,
    lit: np.float32,
    inverse: NDArray[np.float32],
    out: NDArray[np.uint32],
) -> None:
    """Draws a soft stroke `wide` px across where nothing nearer than `depth` m hides it."""
    u0, v0, u1, v1 = ends
    du, dv = u1 - u0, v1 - v0
    steep = abs(dv) >= abs(du)
    length = max(abs(dv), abs(du), 1e-3)
    along_u, along_v = du / length, (dv / length if length > 1e-3 else 1.0)
    if length > LONGEST or not (-LONGEST < u0 < view.width + LONGEST):
        return
    if max(v0, v1) < view.top - wide or min(v0, v1) > view.height + wide:
        return
    half = 0.5 * max(wide, 1.0)
    steps = int(length + 2.0 * half) + 1
    nearest = np.float32(1.0 / depth)
    red = WHITE * np.sqrt(min(colour[0] + lit, np.float32(1.0)))
    green = WHITE * np.sqrt(min(colour[1] + lit, np.float32(1.0)))
    blue = WHITE * np.sqrt(min(colour[2] + lit, np.float32(1.0)))
    for k in range(steps):
        off = k + 0.5 - half
        inside = min(max(half + min(off, length - off), 0.0), 1.0)
        u, v = u0 + along_u * off, v0 + along_v * off
        main = v if steep else u
        side = u if steep else v
        for across in range(int(np.ceil(side - half - 1.0)), int(np.floor(side + half)) + 1):
            cover = min(max(half + 0.5 - abs(across + 0.5 - side), 0.0), 1.0)
            row = int(np.floor(main)) if steep else across
            column = across if steep else int(np.floor(main))
            if not (view.top <= row < view.height and 0 <= column < view.width):
                continue
            a = np.float32(share * inside * cover)
            if a < 0.004 or inverse[row, column] > nearest:
                continue
            p, q, s = unpack(out[row, column])
            p, q, s = p + a * (red - p), q + a * (green - q), s + a * (blue - s)
            out[row, column] = pack(p, q, s)
