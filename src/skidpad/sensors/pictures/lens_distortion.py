"""Distortion by a lens as CARLA's cameras have it: each pixel shows that of another place in the picture.

The equation is that of the material `PhysicLensDistortion`, which CARLA lays over the pictures of all its
cameras (read in its node graph, as github.com/nvdomidi/CapSim ships it): for a place (x, y) of -1 to 1,

    r = x_size x^2 + y_size y^2,  f = 1 + r (k + kcube sqrt(r)),  m = (multiplier min(sqrt(r), 1))^falloff,
    x' = x - 2 m sign(x) x_size x^2 f,  and y' likewise,

is where the pixel comes from. With the blueprint's multiplier of 0 nothing moves. The material samples the
nearest pixel, and so do labels and depth keep their values. Checked against a calibration that was not
used: docs/carla.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel


class LensShape(NamedTuple):
    """What a lens does to a picture, in the attributes of CARLA's blueprints."""

    falloff: float
    multiplier: float
    k: float
    kcube: float
    x_size: float
    y_size: float

    @property
    def bends(self) -> bool:
        """Whether any pixel shows that of another place."""
        return self.multiplier > 0.0 and max(self.x_size, self.y_size) > 0.0


def source_of(shape: LensShape, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Returns where places of a picture come from; all -1 to 1, right and down from its middle."""
    across, down = shape.x_size * x * x, shape.y_size * y * y
    r = across + down
    root = np.sqrt(r)
    f = 1.0 + r * (shape.k + shape.kcube * root)
    moved = 2.0 * (shape.multiplier * np.minimum(root, 1.0)) ** shape.falloff * f
    return x - np.sign(x) * moved * across, y - np.sign(y) * moved * down


def source_pixels(shape: LensShape, width: int, height: int) -> NDArray[np.int32]:
    """Returns (H, W) the number, row by row, of the pixel that each pixel shows; at the edge the last one."""
    x = (2.0 * np.arange(width) + 1.0) / width - 1.0
    y = (2.0 * np.arange(height) + 1.0) / height - 1.0
    from_x, from_y = source_of(shape, *np.meshgrid(x, y))
    column = np.clip(np.floor(0.5 * width * (from_x + 1.0)), 0, width - 1)
    row = np.clip(np.floor(0.5 * height * (from_y + 1.0)), 0, height - 1)
    return np.asarray(row * width + column, dtype=np.int32)


@kernel
def resample(
    source: NDArray[np.int32], picture: NDArray[np.uint32], out: NDArray[np.uint32]
) -> None:
    """Writes into `out` (H, W) the pixels of `picture` (H, W) whose numbers are in `source` (H, W)."""
    height, width = source.shape
    flat = picture.reshape(height * width)
    for y in range(height):
        numbers, row = source[y], out[y]
        for x in range(width):
            row[x] = flat[numbers[x]]
