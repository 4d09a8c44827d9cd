"""Soft borders between what wheels polish, what oil darkens and the asphalt beside them, in colour pictures.

The strips of a lane are triangles of one colour each. Along a row of pixels their colours run into each other
over the width that a wheel's way varies by; depth and classes keep the strips.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.blocks import ONE, B, G, R, W, end_of_run
from skidpad.sensors.scene.materials import MATERIALS, TRACKS

WIDTH = np.float32(0.28)  # m on either side of a border over which colours run into each other
_HALF, _TWO, _THREE = np.float32(0.5), np.float32(2.0), np.float32(3.0)
_NO_FAMILY, _ACTORS = np.uint8(0), np.int32(1 << 16)  # keys from the latter on are of actors


def strip_families() -> NDArray[np.uint8]:
    """Returns (256,) numbers that strips of one asphalt share; 0 for what is no strip."""
    families = np.zeros(MATERIALS, dtype=np.uint8)
    for number, (asphalt, others) in enumerate(TRACKS.items(), 1):
        families[[asphalt, *others]] = number
    return families


FAMILIES = strip_families()


@kernel
def soften_strips(
    focal: np.float32, count: int, keys: NDArray[np.int32], table: Floats32, work: Floats32
) -> None:
    """Lets the colours of neighbouring strips of one asphalt run into each other in a block, in `work`.

    table: colour by instance and material, as in `gather`.
    """
    begin, middle = 0, end_of_run(keys, 0)
    while middle < count:
        end = end_of_run(keys, middle)
        before, after = keys[middle - 1], keys[middle]
        family = FAMILIES[before & 255]
        if (
            family != _NO_FAMILY
            and family == FAMILIES[after & 255]
            and max(before, after) < _ACTORS
        ):
            reach = WIDTH * focal * work[W + middle]
            left, right = _HALF * np.float32(middle - begin), _HALF * np.float32(end - middle)
            left, right = min(reach, left), min(reach, right)
            _blend(middle, left, right, before & 255, after & 255, table, work)
        begin, middle = middle, end


@inner_kernel
def _blend(
    middle: int, left: np.float32, right: np.float32, first: int, second: int, table: Floats32, work: Floats32
) -> None:  # fmt: skip
    """Mixes two materials' colours from `left` px before a border to `right` px after it."""
    per = ONE / (left + right + ONE)
    start = middle - int(left)
    for x in range(start, middle + int(right)):
        t = (np.float32(x - start) + ONE) * per
        t = t * t * (_THREE - _TWO * t)
        own = first if x < middle else second
        for lane, column in ((R, 0), (G, 1), (B, 2)):
            a, b = table[first, column], table[second, column]
            work[lane + x] *= (a + t * (b - a)) / table[own, column]
