"""The buffers of one raster pass, and the images that are views of them."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel
from skidpad.core.specs import CameraSpec
from skidpad.sensors.raster.canvas import BACKGROUND
from skidpad.sensors.raster.view import View


class Sight(NamedTuple):
    """How far along a ray the weather lets a camera see, in m."""

    depth: float
    labels: float


UNLIMITED = Sight(inf, inf)
NOTHING = range(0)
LAND = 5000.0  # m; nothing is drawn further away, so a longer sight hides nothing


class Pass:
    """Inverse depth and key of one view; `labels` and `instances` are views of the key.

    drawn: the rows that show the present.
    """

    def __init__(self, camera: CameraSpec, sight: Sight = UNLIMITED) -> None:
        shape = (camera.height, camera.width)
        self.sight = sight
        self.drawn = NOTHING
        self.inverse = np.zeros(shape, dtype=np.float32)
        self.key = np.zeros(shape, dtype=np.dtype("<i4"))
        self.labels = self.key.view(np.uint8).reshape(*shape, 4)[..., 1]
        self.instances = self.key.view(np.uint16).reshape(*shape, 2)[..., 1]

    def missing(self, rows: range) -> range:
        """Returns the rows to draw before `rows` show the present; NOTHING if they do."""
        done = self.drawn
        if not done:
            return rows
        if done.start <= rows.start and rows.stop <= done.stop:
            return NOTHING
        return range(min(done.start, rows.start), max(done.stop, rows.stop))

    def limit_sight(self, view: View) -> None:
        """Removes what the weather hides from the rows of the view, in place."""
        if min(self.sight) < LAND:
            depth, labels = (np.float32(min(s, 10.0 * LAND)) for s in self.sight)
            hide_beyond(depth, labels, view, self.inverse, self.key)


@kernel
def hide_beyond(
    depth_sight: np.float32,
    label_sight: np.float32,
    view: View,
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
) -> None:
    """Clears the depth, and turns the class to sky, of pixels whose ray is longer than the sight in m."""
    width = inverse.shape[1]
    start = np.float32((0.5 - view.cx) / view.focal)
    step = np.float32(1.0 / view.focal)
    none, one = np.float32(0.0), np.float32(1.0)
    for y in range(view.top, view.height):
        v = np.float32((y + 0.5 - view.cy) / view.focal)
        depths, keys = inverse[y], key[y]
        for x in range(width):
            u = start + np.float32(np.int32(x)) * step
            square = u * u + v * v + one
            w = depths[x]
            near = w * depth_sight
            known = w * label_sight
            depths[x] = w if near * near >= square else none
            keys[x] = keys[x] if known * known >= square else BACKGROUND


def poison(*buffers: NDArray[Any]) -> None:
    """Fills buffers with what no sensor delivers, so that a reader of a stale frame fails loudly."""
    for buffer in buffers:
        buffer.view(np.uint8)[...] = 0xA5 if buffer.dtype.kind != "f" else 0xFF
