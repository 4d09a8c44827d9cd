"""The buffers of one raster pass, and the images that are views of them."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.jit import kernel
from skidpad.core.specs import CameraSpec
from skidpad.sensors.rasteriser import BACKGROUND
from skidpad.sensors.view import View

PassKey = tuple[Pose, int, int, float, bool, float]


class Pass:
    """Inverse depth and key of one view; `labels` and `instances` are views of the key."""

    def __init__(self, camera: CameraSpec, sight: float = inf) -> None:
        """sight: m along the ray beyond which nothing is seen."""
        shape = (camera.height, camera.width)
        self.sight = sight
        self.stale = True
        self.inverse = np.zeros(shape, dtype=np.float32)
        self.key = np.zeros(shape, dtype=np.dtype("<i4"))
        self.labels = self.key.view(np.uint8).reshape(*shape, 4)[..., 1]
        self.instances = self.key.view(np.uint16).reshape(*shape, 2)[..., 1]

    def limit_sight(self, view: View) -> None:
        """Remove what the weather hides."""
        if self.sight < inf:
            hide_beyond(self.sight, view, self.inverse, self.key)


@kernel
def hide_beyond(
    sight: float, view: View, inverse: NDArray[np.float32], key: NDArray[np.int32]
) -> None:
    """Turn every pixel whose ray is longer than `sight` m into sky without depth."""
    height, width = inverse.shape
    for y in range(height):
        v = (y + 0.5 - view.cy) / view.focal
        for x in range(width):
            u = (x + 0.5 - view.cx) / view.focal
            if inverse[y, x] * sight < np.sqrt(u * u + v * v + 1.0):
                inverse[y, x] = np.float32(0.0)
                key[y, x] = BACKGROUND


def poison(*buffers: NDArray[Any]) -> None:
    """Fill with what no sensor delivers, so that a reader of a stale frame fails loudly."""
    for buffer in buffers:
        buffer.view(np.uint8)[...] = 0xA5 if buffer.dtype.kind != "f" else 0xFF
