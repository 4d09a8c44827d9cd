"""Blocks of a row of pixels: what every stage of shading works on.

All values between the stages lie in lanes of one array at constant distances: only then can the
compiler prove that they do not overlap, and vectorise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.packing import pack
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import MATERIALS

# Columns of the look-up table, one row per (instance, material).
RED, GREEN, BLUE, GLOW, WETTABLE, GLOSS = range(6)
COLUMNS = 6
BLOCK = 256
STRIDE = 32  # keys that are compared at once
LANES = 13
(R, G, B, L, T, S, U, W, GX, GY, H, P, M) = (np.intp(n * BLOCK) for n in range(LANES))
ZERO, ONE = np.float32(0.0), np.float32(1.0)
_WHITE = np.float32(255.0)


@inner_kernel
def end_of_run(keys: NDArray[np.int32], x: int) -> int:
    """Returns where the run of equal keys that begins at x ends; looked through `STRIDE` at a time."""
    k, count = keys[x], keys.size
    end = x + 1
    while end + STRIDE <= count:
        ahead, others = keys[end:], 0
        for n in range(STRIDE):
            others |= ahead[n] ^ k
        if others != 0:
            break
        end += STRIDE
    while end < count and keys[end] == k:
        end += 1
    return end


@kernel
def gather(
    key: NDArray[np.int32], y: int, first: int, count: int, table: Floats32, work: Floats32
) -> None:
    """Writes colour and behaviour of a block's pixels from the table into the lanes R to S of `work`.

    y, first, count: the block's row, first column and number of pixels.
    """
    keys = key[y, first : first + count]
    x = 0
    while x < count:
        k = keys[x]
        end = end_of_run(keys, x)
        i = (k >> 16) * MATERIALS + (k & 255)
        red, green, blue = table[i, 0], table[i, 1], table[i, 2]
        glow, wettable, gloss = table[i, 3], table[i, 4], table[i, 5]
        run = work[x:]  # one slice for all six lanes: a slice costs more than a short run
        for n in range(end - x):
            run[R + n] = red
            run[G + n] = green
            run[B + n] = blue
            run[L + n] = glow
            run[T + n] = wettable
            run[S + n] = gloss
        x = end


@inner_kernel
def slopes(
    inverse: Floats32, y: int, first: int, count: int, view: View, work: Floats32
) -> tuple[bool, bool]:
    """Writes viewing direction, inverse depth and its two slopes of a block's pixels into `work`.

    Of the two differences on either side the gentler one counts: the other may cross an edge.
    Returns whether any pixel shows a surface, and whether any shows sky.
    """
    height, width = inverse.shape
    focal = np.float32(view.focal)
    per_pixel = np.float32(1.0 / view.focal)
    start = np.float32((first + 0.5 - view.cx) / view.focal)
    here = inverse[y, first : first + count]
    above = inverse[max(y - 1, 0), first : first + count]
    below = inverse[min(y + 1, height - 1), first : first + count]
    top, bottom = y == 0, y == height - 1
    solid = np.int32(0)
    for x in range(count):
        w = here[x]
        a = below[x] - w
        b = w - above[x]
        work[W + x] = w
        work[GY + x] = (a if (abs(a) < abs(b) or top) and not bottom else b) * focal
        column = np.float32(np.int32(x))  # of 64 bits it takes four times as long
        work[U + x] = start + column * per_pixel
        solid = np.int32(solid + np.int32(w > ZERO))
    for x in range(1, count - 1):
        a = here[x + 1] - here[x]
        b = here[x] - here[x - 1]
        work[GX + x] = (a if abs(a) < abs(b) else b) * focal
    for x in (0, count - 1):
        left, right = first + x == 0, first + x == width - 1
        behind = inverse[y, max(first + x - 1, 0)]
        ahead = inverse[y, min(first + x + 1, width - 1)]
        a = ahead - here[x]
        b = here[x] - behind
        work[GX + x] = (a if (abs(a) < abs(b) or left) and not right else b) * focal
    return solid > 0, solid < count


@inner_kernel
def develop(count: int, exposure: np.float32, work: Floats32, out: NDArray[np.uint32]) -> None:
    """Writes a block's linear light into `out` as bytes: gamma 2, clipped, packed red, green, blue, 255.

    exposure: what the light is multiplied by before.
    """
    if exposure != ONE:
        for x in range(count):
            work[R + x] *= exposure
            work[G + x] *= exposure
            work[B + x] *= exposure
    for x in range(count):
        r, g, b = work[R + x], work[G + x], work[B + x]
        r = np.sqrt(r if r < ONE else ONE) * _WHITE
        g = np.sqrt(g if g < ONE else ONE) * _WHITE
        b = np.sqrt(b if b < ONE else ONE) * _WHITE
        out[x] = pack(r, g, b)
