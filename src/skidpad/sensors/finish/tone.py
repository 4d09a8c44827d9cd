"""Contrast and corners of a picture for people: a camera's curve by day, and the fall of light in its lens.

Light that a simple lens throws on its sensor falls with the fourth power of the angle's cosine; half of
that fall is drawn, as lenses of vehicles make up for some of it. The curve keeps mid-grey (18 % of white),
is steeper there and flatter towards black and white. Both strengths are by eye.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.packing import grid_noise, pack, unpack
from skidpad.sensors.raster.view import View

CURVE = 1.4  # beyond 1.73 it would not rise everywhere
MIDDLE = np.float32(0.424)  # root of 0.18: what the curve keeps
GAIN = 1.16  # of exposure, which makes up in light for the darker corners
FALL = np.float32(0.5)  # share of the lens's fall of light


def curve_of(light: Lighting) -> float:
    """Returns the strength of the curve in a light: full by day."""
    return CURVE * max(1.0 - light.lamps, 0.0)


@kernel
def set_tone(view: View, curve: float, out: NDArray[np.uint32]) -> None:
    """Applies lens and curve to the rows of a view's picture `out`, packed."""
    per, middle = np.float32(1.0 / view.focal), np.float32(0.5 - view.cx)
    one, white = np.float32(1.0), np.float32(254.999)
    gain = np.float32(np.sqrt(GAIN) / 255.0)
    k = np.float32(curve)
    for row in range(view.top, view.height):
        v = np.float32(row + 0.5 - view.cy) * per
        pixels, beyond, line = out[row], one + v * v, np.float32(row)
        for x in range(pixels.size):
            column = np.float32(np.int32(x))  # of 64 bits it takes three times as long
            u = (column + middle) * per
            size = one / (beyond + u * u)
            left = gain * np.sqrt(one - FALL * (one - size * size))
            a, b, c = unpack(pixels[x])
            a, b, c = a * left, b * left, c * left
            a, b, c = (a if a < one else one), (b if b < one else one), (c if c < one else one)
            a += k * a * (one - a) * (a - MIDDLE)
            b += k * b * (one - b) * (b - MIDDLE)
            c += k * c * (one - c) * (c - MIDDLE)
            step = grid_noise(column, line)
            pixels[x] = pack(a * white + step, b * white + step, c * white + step)
