"""Bloom of a finished picture: light that a lens spreads over what is beside it.

Unreal's standard method: the sum of six Gaussians with its default tints and sizes in percent of the width
(public source, Scene.cpp and PostProcessWeightedSampleSum.cpp). Light comes from a picture in which white is
clipped, so lamps and sun spread less than in Unreal, whose light has no upper end.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32

STAGES = ((0.3465, 0.3), (0.138, 1.0), (0.1176, 2.0), (0.066, 10.0), (0.066, 30.0), (0.061, 64.0))
SCALE = 4.0  # of all sizes
WIDTH = 1.0 / np.sqrt(2.0 * 16.7)  # deviation over radius: a kernel is exp(-16.7 (x / radius)^2)
SHARPEST = 4.0  # px of deviation, from which on a picture is made smaller first


def add_bloom(intensity: float, picture: NDArray[np.uint32]) -> None:
    """Adds bloom to a picture (H, W), packed, in place."""
    height, width = picture.shape
    rgb = picture.view(np.uint8).reshape(height, width, 4)[..., :3]
    light: Floats32 = np.square(rgb.astype(np.float32) / np.float32(255.0))
    total = light.copy()
    for tint, size in STAGES:
        sigma = 0.01 * size * SCALE * 0.5 * width * WIDTH
        total += np.float32(intensity * tint / len(STAGES)) * _blur(light, sigma)
    rgb[:] = np.rint(255.0 * np.sqrt(np.minimum(total, 1.0)))


def _blur(light: Floats32, sigma: float) -> Floats32:
    """Returns light (H, W, 3) spread by a Gaussian of a deviation in px; at the edge it goes on."""
    height, width = light.shape[:2]
    less = max(sigma / SHARPEST, 1.0)
    small = (max(round(width / less), 1), max(round(height / less), 1))
    near = light if less == 1.0 else cv2.resize(light, small, interpolation=cv2.INTER_AREA)
    blurred = cv2.GaussianBlur(near, (0, 0), sigma / less, borderType=cv2.BORDER_REPLICATE)
    whole = cv2.resize(blurred, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(whole, dtype=np.float32)
