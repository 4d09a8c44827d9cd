"""Clouds in the sky of a picture for people: a flat layer with a texture made by code.

A ray of the sky meets the layer where its slope says; so clouds grow smaller towards the horizon, but the
layer bends down there, no flatter than FLATTEST: clouds are about as high as they are wide. They drift with
the simulated time. Shapes and strengths are by eye.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.maths.randomness import stream
from skidpad.core.weather import Weather
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View

SIZE = 512  # texels of the texture, which repeats
OCTAVES = ((96.0, 1.0), (40.0, 0.55), (16.0, 0.34), (6.0, 0.17))  # texels of blur, weight
PER_HEIGHT = 150.0  # texels per layer's height
DRIFT = 0.9  # texels/s in a full wind
STEP = 8  # px between two looks at the texture along a row
FLATTEST = (
    0.38  # of a cloud's length along the line of sight at the horizon, as a share of its width
)
LOWEST = 0.025  # of a ray's climb: below it the layer is lost in haze
FADE = 0.16  # climb at which it is seen in full
LIT, SHADED = 0.9, 0.55  # of a cloud's thin and thick parts, in the sky's own light


class Layer(NamedTuple):
    """The clouds of one weather."""

    texture: NDArray[np.float32]  # (SIZE, SIZE) how much cloud, 0 to 1
    thin: NDArray[np.float32]  # (3,) colour in bytes
    thick: NDArray[np.float32]
    strength: float


@lru_cache(maxsize=1)
def _noise() -> NDArray[np.float32]:
    """Returns (SIZE, SIZE) ranks of a smooth field, even in [0, 1): a share of it is a quantile."""
    rng = stream(0, "clouds")
    total = np.zeros((SIZE, SIZE))
    for blur, weight in OCTAVES:
        field = ndimage.gaussian_filter(rng.standard_normal((SIZE, SIZE)), blur / 4.0, mode="wrap")
        total += weight * field / field.std()
    ranks = np.empty(SIZE * SIZE, dtype=np.float32)
    ranks[np.argsort(total, axis=None)] = np.linspace(0.0, 1.0, SIZE * SIZE, dtype=np.float32)
    return ranks.reshape(SIZE, SIZE)


def layer_of(weather: Weather, light: Lighting) -> Layer:
    """Returns the clouds of a weather; a strength of 0 where there are none to be seen."""
    cover = weather.cloudiness / 100.0
    soft = 0.10 + 0.55 * cover
    clear = (1.0 - cover) ** 1.4
    texture = np.clip((_noise() - clear) / soft, 0.0, 1.0).astype(np.float32)
    glow = light.horizon + 0.55 * light.sun
    grey = 0.5 * (light.zenith + light.horizon) * (1.0 - 0.35 * cover)
    thin, thick = (
        np.minimum(np.sqrt(np.maximum(c, 0.0)), 1.0) * 255.0
        for c in (LIT * glow + (1.0 - LIT) * grey, SHADED * glow * (1.0 - cover) + grey * cover)
    )
    strength = min(cover * 8.0, 1.0) * (0.85 - 0.35 * cover) * (1.0 - light.lamps)
    return Layer(texture, thin.astype(np.float32), thick.astype(np.float32), float(strength))


@kernel
def draw_clouds(
    view: View, layer: Layer, shift: float, inverse: NDArray[np.float32], out: NDArray[np.uint32]
) -> None:
    """Lays the clouds over the sky in the rows of a view, in `out`. shift: texels that they have drifted."""
    r, width = view.rotation, out.shape[1]
    nodes = width // STEP + 2
    seen, amount = np.empty(nodes, dtype=np.float32), np.empty(nodes, dtype=np.float32)
    lanes = np.empty((2, nodes * STEP), dtype=np.float32)
    texture, last = layer.texture, layer.texture.shape[0] - 1
    any_sky = False
    for row in range(view.top, view.height):
        if (row - view.top) % 2:  # two rows share a look
            if any_sky:
                _blend(row, width, amount, seen, lanes, layer, inverse, out)
            continue
        v = (row + 0.5 - view.cy) / view.focal
        any_sky = False
        for n in range(nodes):
            u = (n * STEP + 0.5 - view.cx) / view.focal
            amount[n] = 0.0
            dx = r[0, 0] * u + r[1, 0] * v + r[2, 0]
            dy = r[0, 1] * u + r[1, 1] * v + r[2, 1]
            dz = r[0, 2] * u + r[1, 2] * v + r[2, 2]
            seen[n] = 0.0
            climb = dz / np.sqrt(dx * dx + dy * dy + dz * dz)
            if climb <= LOWEST:
                continue
            any_sky = True
            ray = PER_HEIGHT * climb / (dz * (climb + FLATTEST))
            at_x, at_y = ray * dx + shift, ray * dy
            i, j = int(np.floor(at_x)), int(np.floor(at_y))
            a, b = np.float32(at_x - i), np.float32(at_y - j)
            upper = texture[i & last, j & last] * (1 - b) + texture[i & last, (j + 1) & last] * b
            lower = (
                texture[(i + 1) & last, j & last] * (1 - b)
                + texture[(i + 1) & last, (j + 1) & last] * b
            )
            amount[n] = upper + (lower - upper) * a
            seen[n] = min((climb - LOWEST) / FADE, 1.0) * layer.strength
        if any_sky:
            _blend(row, width, amount, seen, lanes, layer, inverse, out)


@inner_kernel
def _blend(
    row: int,
    width: int,
    amount: NDArray[np.float32],
    seen: NDArray[np.float32],
    lanes: NDArray[np.float32],
    layer: Layer,
    inverse: NDArray[np.float32],
    out: NDArray[np.uint32],
) -> None:
    """Lays clouds over one row's sky by what its nodes say, in between along straight lines.

    lanes: (2, width and STEP more) room for thickness and share of every pixel.
    """
    part = np.float32(1.0 / STEP)
    for n in range(amount.size - 1):
        c0, s0 = amount[n], amount[n] * seen[n]
        c1, s1 = (amount[n + 1] - c0) * part, (amount[n + 1] * seen[n + 1] - s0) * part
        for x in range(STEP):
            lanes[0, n * STEP + x] = c0 + np.float32(x) * c1
            lanes[1, n * STEP + x] = s0 + np.float32(x) * s1
    r0, g0, b0 = layer.thin[0], layer.thin[1], layer.thin[2]
    r1, g1, b1 = layer.thick[0] - r0, layer.thick[1] - g0, layer.thick[2] - b0
    thickness, shares, depths, pixels = lanes[0], lanes[1], inverse[row], out[row]
    none = np.float32(0.0)
    for x in range(width):
        thick = thickness[x]
        share = shares[x] if depths[x] <= none else none
        red, green, blue = unpack(pixels[x])
        red += share * (r0 + r1 * thick - red)
        green += share * (g0 + g1 * thick - green)
        blue += share * (b0 + b1 * thick - blue)
        pixels[x] = pack(red, green, blue)
