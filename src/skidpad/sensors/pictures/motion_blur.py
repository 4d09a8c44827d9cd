"""Motion blur of a picture: each pixel is the mean of what passed it while it was exposed.

As Unreal's settings have it: an intensity of 1 exposes for one frame of 30 per second, whatever the frame
rate is, and the way in the picture is at most a share of its width. Half of it lies before and half after the
place; what a moving edge uncovers is not known and is taken from the picture beside it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import kernel
from skidpad.sensors.pictures.packing import pack, rounded, unpack

FRAME = 1.0 / 30.0  # s, of Unreal's MotionBlurTargetFPS
MOST = 64  # samples of one pixel
LEAST = 1.0  # px of way, below which nothing is blurred


@kernel
def smear(
    flow: Floats32,
    share: float,
    longest: float,
    picture: NDArray[np.uint32],
    out: NDArray[np.uint32],
) -> None:
    """Writes a picture (H, W), packed, with its motion into `out` (H, W).

    Args:
        flow: (H, W, 2) right and up since the last picture, in halves of width and height.
        share: of that way, which is exposed.
        longest: px that a pixel is blurred over.
        picture: what is blurred.
        out: the result.
    """
    height, width = out.shape
    for y in range(height):
        for x in range(width):
            dx = 0.5 * width * share * flow[y, x, 0]
            dy = -0.5 * height * share * flow[y, x, 1]
            way = sqrt(dx * dx + dy * dy)
            if way < LEAST:
                out[y, x] = picture[y, x]
                continue
            if way > longest:
                dx, dy, way = dx * longest / way, dy * longest / way, longest
            samples = min(int(way) + 1, MOST)
            red, green, blue = np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for k in range(samples):
                at = (k + 0.5) / samples - 0.5
                column = min(max(int(x + 0.5 + at * dx), 0), width - 1)
                row = min(max(int(y + 0.5 + at * dy), 0), height - 1)
                r, g, b = unpack(picture[row, column])
                red, green, blue = red + r * r, green + g * g, blue + b * b
            part = np.float32(1.0 / samples)
            out[y, x] = pack(
                rounded(np.sqrt(red * part)),
                rounded(np.sqrt(green * part)),
                rounded(np.sqrt(blue * part)),
            )
