"""Random numbers as a pure function of (key, tick, index), for kernels."""

from __future__ import annotations

import numpy as np

from skidpad.core.jit import inner_kernel
from skidpad.core.splitmix import GOLDEN, scrambled, unit

_TICK = np.uint64(0xD1342543DE82EF95)


@inner_kernel
def mixed(key: np.uint64, tick: int, index: int) -> np.uint64:
    """64 random bits."""
    return scrambled(key + np.uint64(tick) * _TICK + np.uint64(index) * GOLDEN + GOLDEN)


@inner_kernel
def uniform(key: np.uint64, tick: int, index: int) -> float:
    """A number in [0, 1)."""
    return unit(mixed(key, tick, index))
