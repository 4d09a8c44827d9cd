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
LIGHT = np.square(np.arange(256, dtype=np.float32) / np.float32(255.0))  # of each grey level
SHARPEST = 4.0  # px of deviation, from which on a picture is made smaller first


def add_bloom(intensity: float, picture: NDArray[np.uint32]) -> None:
    """Adds bloom to a picture (H, W), packed, in place."""
    height, width = picture.shape
    rgb = picture.view(np.uint8).reshape(height, width, 4)[..., :3]
    light: Floats32 = LIGHT[rgb]
    half = _resize(light, (width + 1) // 2, (height + 1) // 2)
    first, *others = (
        (np.float32(intensity * tint / len(STAGES)), 0.005 * size * SCALE * width * WIDTH)
        for tint, size in STAGES
    )
    glow = np.zeros_like(half)
    for share, sigma in others:
        glow += share * _blur(half, 0.5 * sigma)
    light += first[0] * _blur(light, first[1]) + _resize(glow, width, height)
    rgb[:] = np.sqrt(np.minimum(light, 1.0)) * np.float32(255.0) + np.float32(0.5)


def _blur(light: Floats32, sigma: float) -> Floats32:
    """Returns light (H, W, 3) spread by a Gaussian of a deviation in px; at the edge it goes on."""
    height, width = light.shape[:2]
    less = max(sigma / SHARPEST, 1.0)
    near = _resize(light, max(round(width / less), 1), max(round(height / less), 1))
    blurred = cv2.GaussianBlur(near, (0, 0), sigma / less, borderType=cv2.BORDER_REPLICATE)
    return _resize(np.asarray(blurred, dtype=np.float32), width, height)


def _resize(light: Floats32, width: int, height: int) -> Floats32:
    """Returns light (H, W, 3) in another size: means of what becomes smaller, else straight lines between."""
    if light.shape[:2] == (height, width):
        return light
    way = cv2.INTER_AREA if width < light.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(light, (width, height), interpolation=way), dtype=np.float32)
