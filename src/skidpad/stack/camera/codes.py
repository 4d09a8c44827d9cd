"""What goes into the camera driver's network and what comes out of it, as numbers of a like size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32

AHEAD = (6.0, 12.0, 20.0, 30.0, 45.0)  # m along the lane, where its offset is told
OFFSET_SCALE = 8.0  # of an angle in rad
GAP_SCALE, GAP_SHIFT = 8.0, 6.0  # m: 1.33 at a touch, 0.12 at 60 m
SEEN = 60.0  # m, farthest gap that is told
OUTPUTS = len(AHEAD) + 2  # offsets, whether somebody is there, how near


@dataclass(frozen=True, slots=True)
class Label:
    """What is ahead, in the ego's axes."""

    offsets: tuple[float, ...]  # m left of the ego's axis, of the lane's middle at AHEAD
    gap: float | None  # m from bumper to whoever is first in the lane ahead; None: nobody


def mosaic(images: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Returns (96, 128, 3): the centre above, left and right beside each other below.

    images: centre (64, 128, 3), left and right (32, 64, 3).
    """
    centre, left, right = images
    return np.concatenate([centre, np.concatenate([left, right], axis=1)], axis=0)


def network_input(picture: NDArray[np.uint8]) -> Floats32:
    """Returns a mosaic as the network's input, (1, 3, 96, 128) from -0.5 to 0.5."""
    planes = picture.transpose(2, 0, 1)[None].astype(np.float32)
    scaled: Floats32 = planes / np.float32(255.0) - np.float32(0.5)
    return scaled


def encode_label(label: Label) -> Floats32:
    """Returns (OUTPUTS,) what the network should say: scaled offsets, presence, nearness.

    Presence is 1, 0, or 0.5 for a gap from SEEN m on, where it does not matter.
    """
    offsets = [OFFSET_SCALE * y / d for y, d in zip(label.offsets, AHEAD, strict=True)]
    if label.gap is None:
        return np.array([*offsets, 0.0, 0.0], dtype=np.float32)
    present = 1.0 if label.gap < SEEN else 0.5
    near = GAP_SCALE / (label.gap + GAP_SHIFT)
    return np.array([*offsets, present, near], dtype=np.float32)


def decode_output(output: Floats32) -> Label:
    """Returns what the network says as a label; no gap where the presence, a logit, is not above 0."""
    offsets = tuple(float(v) * d / OFFSET_SCALE for v, d in zip(output, AHEAD, strict=False))
    logit, near = float(output[-2]), float(output[-1])
    if logit <= 0.0:
        return Label(offsets, None)
    return Label(offsets, max(GAP_SCALE / max(near, 1e-3) - GAP_SHIFT, 0.0))
