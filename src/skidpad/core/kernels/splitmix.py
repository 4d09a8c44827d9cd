"""Random numbers as a pure function of a counter, for kernels (Steele, Lea, Flood 2014)."""

from __future__ import annotations

import numpy as np

from skidpad.core.kernels.jit import inner_kernel

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_A = np.uint64(0xBF58476D1CE4E5B9)
_MIX_B = np.uint64(0x94D049BB133111EB)
_UNIT = 1.0 / 2**53


@inner_kernel
def scrambled(z: np.uint64) -> np.uint64:
    """Returns 64 random bits of a counter: the finaliser of SplitMix64."""
    z = (z ^ (z >> np.uint64(30))) * _MIX_A
    z = (z ^ (z >> np.uint64(27))) * _MIX_B
    bits: np.uint64 = z ^ (z >> np.uint64(31))
    return bits


@inner_kernel
def unit(bits: np.uint64) -> float:
    """Returns a number in [0, 1) of 64 random bits."""
    return float(bits >> np.uint64(11)) * _UNIT
