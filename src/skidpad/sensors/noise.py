"""Random numbers as a pure function of (key, tick, index), for kernels."""

from __future__ import annotations

import numpy as np

from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.kernels.splitmix import GOLDEN, scrambled, unit

_TICK = np.uint64(0xD1342543DE82EF95)


@inner_kernel
def mixed(key: np.uint64, tick: int, index: int) -> np.uint64:
    """Returns 64 random bits that depend only on key, tick and index."""
    return scrambled(key + np.uint64(tick) * _TICK + np.uint64(index) * GOLDEN + GOLDEN)


@inner_kernel
def uniform(key: np.uint64, tick: int, index: int) -> float:
    """Returns a random number in [0, 1) that depends only on key, tick and index."""
    return unit(mixed(key, tick, index))
