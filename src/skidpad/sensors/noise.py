"""Random numbers as a pure function of (key, tick, index), for kernels."""

from __future__ import annotations

import numpy as np

from skidpad.core.jit import kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_A = np.uint64(0xBF58476D1CE4E5B9)
_MIX_B = np.uint64(0x94D049BB133111EB)
_TICK = np.uint64(0xD1342543DE82EF95)
_UNIT = 1.0 / 9007199254740992.0  # 2^-53


@kernel
def mixed(key: np.uint64, tick: int, index: int) -> np.uint64:
    """64 random bits: the finaliser of SplitMix64 (Steele, Lea, Flood 2014) over a counter."""
    z = key + np.uint64(tick) * _TICK + np.uint64(index) * _GOLDEN + _GOLDEN
    z = (z ^ (z >> np.uint64(30))) * _MIX_A
    z = (z ^ (z >> np.uint64(27))) * _MIX_B
    bits: np.uint64 = z ^ (z >> np.uint64(31))
    return bits


@kernel
def uniform(key: np.uint64, tick: int, index: int) -> float:
    """A number in [0, 1)."""
    return float(np.float64(mixed(key, tick, index) >> np.uint64(11)) * _UNIT)
