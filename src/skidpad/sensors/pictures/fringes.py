"""Coloured fringes of a simple lens: red and green are magnified a little more than blue.

As Unreal's post-process settings have it (public source, PostProcessTonemap.cpp of Unreal 4.26): linear in
wavelength from blue's 464.3 nm on, 0.007 % of the distance from the middle per nm at an intensity of 1, and
beyond a start only, of 0 to 1 of half a picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.packing import pack, rounded, unpack

RED, GREEN, BLUE = 611.3, 549.1, 464.3  # nm, of the primaries
PER_NM = 0.007 * 0.01  # share of the distance from the middle


class Fringes(NamedTuple):
    """Where red and green of each column and row come from, in pixels."""

    red_x: Floats32
    red_y: Floats32
    green_x: Floats32
    green_y: Floats32


def fringes_of(intensity: float, start: float, width: int, height: int) -> Fringes:
    """Returns the fringes of a picture; start < 1."""
    per = intensity * PER_NM / (1.0 - start)
    red, green = per * (RED - BLUE), per * (GREEN - BLUE)
    return Fringes(
        _places_on_line(red, start, width),
        _places_on_line(red, start, height),
        _places_on_line(green, start, width),
        _places_on_line(green, start, height),
    )


def _places_on_line(share: float, start: float, size: int) -> Floats32:
    """Returns (size,) the place, in pixels, that each pixel of a line shows."""
    x = (2.0 * np.arange(size) + 1.0) / size - 1.0
    source = x - np.sign(x) * np.clip(np.abs(x) - start, 0.0, 1.0) * share
    return np.clip(0.5 * size * (source + 1.0) - 0.5, 0.0, size - 1).astype(np.float32)


@inner_kernel
def _light_at(
    picture: NDArray[np.uint32], x: np.float32, y: np.float32, shift: np.uint32
) -> np.float32:
    """Returns the linear light, of 255 squared, of one colour at a place between four pixels."""
    left, top = np.int32(x), np.int32(y)
    right, bottom = min(left + 1, picture.shape[1] - 1), min(top + 1, picture.shape[0] - 1)
    a, b = x - np.float32(left), y - np.float32(top)
    byte = np.uint32(255)
    p = np.float32(np.int32(np.uint32(picture[top, left] >> shift) & byte))
    q = np.float32(np.int32(np.uint32(picture[top, right] >> shift) & byte))
    r = np.float32(np.int32(np.uint32(picture[bottom, left] >> shift) & byte))
    s = np.float32(np.int32(np.uint32(picture[bottom, right] >> shift) & byte))
    upper, lower = p * p + a * (q * q - p * p), r * r + a * (s * s - r * r)
    found: np.float32 = upper + b * (lower - upper)
    return found


@kernel
def split_colours(fringes: Fringes, picture: NDArray[np.uint32], out: NDArray[np.uint32]) -> None:
    """Writes a picture (H, W), packed, with its fringes into `out` (H, W)."""
    for y in range(out.shape[0]):
        row = out[y]
        for x in range(row.size):
            _, _, blue = unpack(picture[y, x])
            red = _light_at(picture, fringes.red_x[x], fringes.red_y[y], np.uint32(0))
            green = _light_at(picture, fringes.green_x[x], fringes.green_y[y], np.uint32(8))
            row[x] = pack(rounded(np.sqrt(red)), rounded(np.sqrt(green)), blue)
