"""Packed pixels: red, green, blue and 255 in the bytes of one word.

All in 32 bits: numba widens mixed integers to 64, and a loop over pixels then takes twice as long.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.kernels.jit import kernel

_BYTE, _G, _B = np.uint32(255), np.uint32(8), np.uint32(16)
_OPAQUE = np.uint32(0xFF000000)
_LOW, _HIGH, _HALF = np.float32(0.0), np.float32(255.0), np.float32(0.5)

_ACROSS, _DOWN, _TURNS = (np.float32(c) for c in (0.06711056, 0.00583715, 52.9829189))


@kernel
def pack(r: np.float32, g: np.float32, b: np.float32) -> np.uint32:
    """Returns a pixel of three values within 0 to 255, cut to whole numbers."""
    red, green, blue = np.uint32(np.int32(r)), np.uint32(np.int32(g)), np.uint32(np.int32(b))
    packed: np.uint32 = np.uint32(red | np.uint32(green << _G) | np.uint32(blue << _B) | _OPAQUE)
    return packed


@kernel
def unpack(p: np.uint32) -> tuple[np.float32, np.float32, np.float32]:
    """Returns red, green and blue of a pixel, 0 to 255."""
    return (
        np.float32(np.int32(p & _BYTE)),
        np.float32(np.int32(np.uint32(p >> _G) & _BYTE)),
        np.float32(np.int32(np.uint32(p >> _B) & _BYTE)),
    )


@kernel
def rounded(value: np.float32) -> np.float32:
    """Returns the value plus a half, clipped to 0 to 255, so that `pack` rounds it."""
    v: np.float32 = value + _HALF
    v = v if v > _LOW else _LOW
    return v if v < _HIGH else _HIGH


@kernel
def grid_noise(x: np.float32, row: np.float32) -> np.float32:
    """Returns noise in [0, 1) by pixel, which hides the steps between bytes when it is added before `pack`.

    Source: Jimenez (2014), Next generation post processing in Call of Duty: interleaved gradient noise.
    """
    a = _ACROSS * x + _DOWN * row
    b = _TURNS * (a - np.floor(a))
    noise: np.float32 = b - np.floor(b)
    return noise
