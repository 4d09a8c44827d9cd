"""CARLA's depth images: 24 bits per pixel in BGRA bytes, the low byte in red (A-033)."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel

RANGE: Final = 1000.0  # m, full scale; there is nothing nearer
STEPS: Final = 256.0**3 - 1.0  # of the code


@kernel
def bgra_from_inverse_depth(inverse: NDArray[np.float32], out: NDArray[np.uint8]) -> None:
    """Writes inverse depths (H, W) in 1/m as CARLA's depth code into out (H, W, 4); 0 is full scale."""
    for y in range(inverse.shape[0]):
        for x in range(inverse.shape[1]):
            share = 1.0
            if inverse[y, x] * RANGE > 1.0:
                share = 1.0 / (float(inverse[y, x]) * RANGE)
            code = int(share * STEPS + 0.5)
            out[y, x, 2] = code & 255
            out[y, x, 1] = (code >> 8) & 255
            out[y, x, 0] = (code >> 16) & 255
            out[y, x, 3] = 255


@kernel
def inverse_depth_from_bgra(bgra: NDArray[np.uint8], out: NDArray[np.float32]) -> None:
    """Writes CARLA's depth code (H, W, 4) as inverse depths in 1/m into out (H, W); full scale is 0."""
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            code = (
                np.int64(bgra[y, x, 2])
                + 256 * np.int64(bgra[y, x, 1])
                + 65536 * np.int64(bgra[y, x, 0])
            )
            out[y, x] = 0.0 if code >= STEPS else 1.0 / (max(code, 1) * (RANGE / STEPS))
