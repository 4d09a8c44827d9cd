"""What is hidden by what is drawn already: the least inverse depth of each tile of a picture.

Depth only comes nearer while a picture is drawn, so an old value of a tile is never too near: it is
read again only where the old one cannot decide, and at most once for each band of distance.
"""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Floats32, Ints32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.raster.canvas import TILE
from skidpad.sensors.raster.projection import BEHIND, Scratch
from skidpad.sensors.raster.view import NEAR, View

SLACK = 1e-4  # of inverse depth, far more than rounding can bring a pixel nearer than its corners
RIM = 1.0  # px around a box, far more than rounding can move a span beyond its corners


class Tiles(NamedTuple):
    """The tiles of the rows of a view; bits of floats that are not negative are in their order."""

    least: (
        Ints32  # (rows, columns) bits of the least inverse depth in it, as it was when it was read
    )
    read: Ints32  # (rows, columns) the band of distance at which it was read; 0: it was not
    inverse: Ints32  # (n,) bits of the inverse depth of the view's rows


@inner_kernel
def make_tiles(view: View, inverse: Floats32) -> Tiles:
    """Returns the tiles of an empty picture. inverse: (n,) of the view's rows, one after the other."""
    rows, columns = (view.height - view.top + TILE - 1) // TILE, (view.width + TILE - 1) // TILE
    least, read = (
        np.zeros((rows, columns), dtype=np.int32),
        np.zeros((rows, columns), dtype=np.int32),
    )
    return Tiles(least, read, inverse.view(np.int32))


@inner_kernel
def _read(tiles: Tiles, view: View, i: int, j: int) -> None:
    """Writes the least inverse depth of tile (i, j) as it is now."""
    left, right = j * TILE, min((j + 1) * TILE, view.width)
    least = np.int32(0x7FFFFFFF)
    for row in range(i * TILE, min((i + 1) * TILE, view.height - view.top)):
        pixels = tiles.inverse[row * view.width + left : row * view.width + right]
        for x in range(pixels.size):
            least = min(least, pixels[x])
    tiles.least[i, j] = least


@inner_kernel
def is_hidden(
    left: float, right: float, top: float, bottom: float, nearest: float, band: int,
    view: View, tiles: Tiles,
) -> bool:  # fmt: skip
    """Returns whether all pixels of a box on screen (px) are nearer than `nearest` (1/m) already.

    band: of distance; a tile that was read in it is not read again.
    """
    bits = np.float32(nearest * (1.0 + SLACK)).view(np.int32)
    first, last = (
        floor(max(left - RIM, 0.0)) // TILE,
        floor(min(right + RIM, view.width - 1.0)) // TILE,
    )
    rows = view.height - view.top
    upper = floor(max(top - view.top - RIM, 0.0)) // TILE
    lower = floor(min(bottom - view.top + RIM, rows - 1.0)) // TILE
    for i in range(upper, lower + 1):
        for j in range(first, last + 1):
            if tiles.least[i, j] > bits:
                continue
            if tiles.read[i, j] == band:
                return False
            _read(tiles, view, i, j)
            tiles.read[i, j] = band
            if tiles.least[i, j] <= bits:
                return False
    return True


@inner_kernel
def is_sphere_hidden(
    centre: Floats, radius: float, band: int, view: View, shift: Floats, tiles: Tiles
) -> bool:
    """Returns whether no pixel of what lies in a sphere can be seen.

    shift: (3,) of the world's origin in camera axes.
    """
    r = view.rotation
    x = r[0, 0] * centre[0] + r[0, 1] * centre[1] + r[0, 2] * centre[2] + shift[0]
    y = r[1, 0] * centre[0] + r[1, 1] * centre[1] + r[1, 2] * centre[2] + shift[1]
    z = r[2, 0] * centre[0] + r[2, 1] * centre[1] + r[2, 2] * centre[2] + shift[2]
    if z - radius <= NEAR:
        return False
    nearest, least = 1.0 / (z - radius), 1.0 / (z + radius)
    left = view.cx + view.focal * (x - radius) * (nearest if x < radius else least)
    right = view.cx + view.focal * (x + radius) * (nearest if x > -radius else least)
    top = view.cy + view.focal * (y - radius) * (nearest if y < radius else least)
    bottom = view.cy + view.focal * (y + radius) * (nearest if y > -radius else least)
    return is_hidden(left, right, top, bottom, nearest, band, view, tiles)


@inner_kernel
def is_block_hidden(count: int, band: int, view: View, scratch: Scratch, tiles: Tiles) -> bool:
    """Returns whether no pixel of a block that `project_block` has prepared can be seen."""
    screen, code = scratch.screen, scratch.code
    left, right, top, bottom, nearest = np.inf, -np.inf, np.inf, -np.inf, 0.0
    every, some = 255, 0
    for i in range(count):
        x, y, w = screen[i, 0], screen[i, 1], screen[i, 2]
        every &= code[i]
        some |= code[i]
        left, right = min(left, x), max(right, x)
        top, bottom = min(top, y), max(bottom, y)
        nearest = max(nearest, w)
    if every:
        return True
    if some & BEHIND:
        return False
    return is_hidden(left, right, top, bottom, nearest, band, view, tiles)
