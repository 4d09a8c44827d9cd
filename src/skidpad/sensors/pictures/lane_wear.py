"""Soft borders between what wheels polish, what oil darkens and the asphalt beside them, in colour pictures.

The strips of a lane are triangles of one colour each. Along a row of pixels their colours run into each other
over the width that a wheel's way varies by; depth and classes keep the strips.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.blocks import ONE, B, G, R, W
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
def soften_border(
    focal: np.float32, begin: int, middle: int, end: int, keys: NDArray[np.int32], table: Floats32,
    work: Floats32,
) -> None:  # fmt: skip
    """Lets the colours of two neighbouring strips of one asphalt run into each other in a block, in `work`.

    A border between two blocks stays hard, as the colours of the first are written already.
    begin, middle, end: of the block's pixels, where the first strip begins, the second, and what follows it.
    table: colour by instance and material, as in `gather`.
    """
    before, after = keys[middle - 1], keys[middle]
    family = FAMILIES[before & 255]
    if family == _NO_FAMILY or family != FAMILIES[after & 255] or max(before, after) >= _ACTORS:
        return
    reach = WIDTH * focal * work[W + middle]
    left, right = _HALF * np.float32(middle - begin), _HALF * np.float32(end - middle)
    _blend(middle, min(reach, left), min(reach, right), before & 255, after & 255, table, work)


@inner_kernel
def _blend(
    middle: int, left: np.float32, right: np.float32, first: int, second: int, table: Floats32, work: Floats32
) -> None:  # fmt: skip
    """Mixes two materials' colours from `left` px before a border to `right` px after it."""
    per, before = ONE / (left + right + ONE), int(left)
    red, green, blue = (
        table[second, 0] / table[first, 0] - ONE,
        table[second, 1] / table[first, 1] - ONE,
        table[second, 2] / table[first, 2] - ONE,
    )
    run = work[middle - before :]
    for x in range(before):
        t = (np.float32(x) + ONE) * per
        t = t * t * (_THREE - _TWO * t)
        run[R + x] *= ONE + t * red
        run[G + x] *= ONE + t * green
        run[B + x] *= ONE + t * blue
    red, green, blue = (
        table[first, 0] / table[second, 0] - ONE,
        table[first, 1] / table[second, 1] - ONE,
        table[first, 2] / table[second, 2] - ONE,
    )
    run = work[middle:]
    for x in range(int(right)):
        t = ONE - (np.float32(x + before) + ONE) * per
        t = t * t * (_THREE - _TWO * t)
        run[R + x] *= ONE + t * red
        run[G + x] *= ONE + t * green
        run[B + x] *= ONE + t * blue
