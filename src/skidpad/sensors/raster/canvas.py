"""The rows of a picture that are drawn at once, few enough to stay in a processor's nearest memory.

A pixel holds its inverse depth and what is nearest there: the number of a triangle of the map, of equals
the first, in whatever order they are drawn. What is no triangle of the map is a key, as its complement.
Spans are half open at pixel centres and every edge is evaluated from its upper to its lower end, so two
triangles that share an edge neither leave a gap nor fight for a pixel. Edge set-up in float64,
spans in float32, no fast-math: the same bytes on every processor.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32, Ints32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.raster.lanes import LANES, draw_lanes
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import Material

BACKGROUND = int(SemanticClass.SKY) << 8 | int(Material.SKY)
TILE = 8  # px
KEY = 0xFFFF  # bits of a key of the map
PIXELS = 1 << 18  # that are drawn at once
SLIVER = 1e-7  # px^2, twice the area below which a triangle has no usable slope of depth


class Canvas(NamedTuple):
    """Rows of a picture, one after the other."""

    inverse: Floats32  # (n,) inverse depth, 1/m
    seen: Ints32  # (n,) rank << 16 | key of the map, or the complement of a key


def make_canvas(widest: int) -> Canvas:
    """Returns room for pictures of so many columns."""
    n = max(PIXELS, TILE * widest) + LANES
    return Canvas(np.empty(n, dtype=np.float32), np.empty(n, dtype=np.int32))


@inner_kernel
def rows_at_once(width: int) -> int:
    """Returns how many rows of so many columns are drawn at once."""
    return max(PIXELS // width // TILE, 1) * TILE


@inner_kernel
def clear(view: View, canvas: Canvas) -> None:
    """Removes everything from the rows of the view."""
    n = (view.height - view.top) * view.width
    canvas.inverse[:n] = np.float32(0.0)
    canvas.seen[:n] = ~BACKGROUND


@inner_kernel
def fill(
    x0: float,
    y0: float,
    w0: float,
    x1: float,
    y1: float,
    w1: float,
    x2: float,
    y2: float,
    w2: float,
    value: np.int32,
    limit: np.int32,
    view: View,
    canvas: Canvas,
) -> None:
    """Draws a projected triangle where it is nearest: columns x, rows y, inverse depths w at its corners.

    value: what is seen there. limit: it is seen also where a greater value is equally near.
    """
    width = view.width
    top = max(view.top, ceil(min(y0, y1, y2) - 0.5))
    bottom = min(view.height, ceil(max(y0, y1, y2) - 0.5))
    if top >= bottom:
        return
    if max(x0, x1, x2) <= 0.5 or min(x0, x1, x2) > width - 0.5:
        return
    det = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if abs(det) > SLIVER:
        slope_x = ((w1 - w0) * (y2 - y0) - (w2 - w0) * (y1 - y0)) / det
        slope_y = ((x1 - x0) * (w2 - w0) - (x2 - x0) * (w1 - w0)) / det
        anchor = w0 - slope_x * x0 - slope_y * y0
    else:
        slope_x = 0.0
        slope_y = 0.0
        anchor = (w0 + w1 + w2) / 3.0
    if y1 < y0:
        x0, y0, x1, y1 = x1, y1, x0, y0
    if y2 < y0:
        x0, y0, x2, y2 = x2, y2, x0, y0
    if y2 < y1:
        x1, y1, x2, y2 = x2, y2, x1, y1
    long_edge = (x2 - x0) / (y2 - y0)
    upper_edge = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
    lower_edge = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
    step = np.float32(slope_x)
    for row in range(top, bottom):
        yc = row + 0.5
        xa = x0 + (yc - y0) * long_edge
        if yc < y1:
            xb = x0 + (yc - y0) * upper_edge
        else:
            xb = x1 + (yc - y1) * lower_edge
        first = ceil(max(min(xa, xb), 0.0) - 0.5)
        last = ceil(min(max(xa, xb), float(width)) - 0.5)
        if first >= last:
            continue
        start = np.float32(anchor + slope_x * (first + 0.5) + slope_y * yc)
        begin = (row - view.top) * width + first
        for i in range(0, last - first, LANES):
            draw_lanes(
                canvas.inverse, canvas.seen, begin + i, i, last - first, start, step, value, limit
            )


@inner_kernel
def settle(view: View, canvas: Canvas, inverse: NDArray[np.float32], key: Ints32) -> None:
    """Writes the rows of the view into `inverse` (H, W) and `key` (H, W)."""
    width = view.width
    for row in range(view.top, view.height):
        begin = (row - view.top) * width
        depths, seen = canvas.inverse[begin : begin + width], canvas.seen[begin : begin + width]
        out, keys = inverse[row], key[row]
        for x in range(width):
            out[x] = depths[x]
        for x in range(width):
            v = seen[x]
            of_map, other = np.int32(v & np.int32(KEY)), np.int32(~v)
            keys[x] = of_map if v >= 0 else other
