"""Images as CARLA's clients decode them: BGRA, tags in red."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Bytes
from skidpad.core.kernels.jit import kernel


def bgra_from_rgb(packed: NDArray[np.uint32], out: Bytes) -> None:
    """Writes (H, W) packed red, green, blue, 255 as BGRA into out (H, W, 4)."""
    rgba = packed.view(np.uint8).reshape(*packed.shape, 4)
    cv2.cvtColor(rgba, cv2.COLOR_RGBA2BGRA, dst=out)


@kernel
def bgra_from_labels(labels: Bytes, out: Bytes) -> None:
    """Writes tags (H, W) into the red channel of the picture `out` (H, W, 4)."""
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            out[y, x, 0] = 0
            out[y, x, 1] = 0
            out[y, x, 2] = labels[y, x]
            out[y, x, 3] = 255


@kernel
def bgra_from_instances(
    labels: Bytes, rows: NDArray[np.uint16], ids: NDArray[np.int64], out: Bytes
) -> None:
    """Writes tags into red and actor ids into green (low byte) and blue of out (H, W, 4).

    rows (H, W): 0 static, else row + 1; ids: actor ids by that number.
    """
    for y in range(labels.shape[0]):
        for x in range(labels.shape[1]):
            id = ids[rows[y, x]]
            out[y, x, 0] = (id >> 8) & 255
            out[y, x, 1] = id & 255
            out[y, x, 2] = labels[y, x]
            out[y, x, 3] = 255
