"""Light of street lamps at night as a grid over the ground, made once per map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.roads.roadside import Box, Shape

REACH = 30.0  # m beyond which a lamp lights nothing
HEIGHT = 7.0  # m of a lamp above the ground that it lights
BRIGHT = 3.0  # below a lamp, where a white surface at clear noon has 1; by eye
FALL = 2.5  # 1.5 for a point of light, more for one that sends most of it down; by eye
MOST_CELLS = 4_000_000


class StreetLight(NamedTuple):
    """Light at nodes of a square grid; without lamps it has none."""

    x0: float
    y0: float
    per_cell: float  # 1/m
    columns: int  # nodes along y
    rows: int  # nodes along x
    light: NDArray[np.float32]  # (rows * columns,)


NO_STREET_LIGHT = StreetLight(0.0, 0.0, 1.0, 0, 0, np.zeros(0, dtype=np.float32))


def street_light_of(boxes: Sequence[Box]) -> StreetLight:
    """Returns the light on the ground of all lamps among the boxes; NO_STREET_LIGHT without any.

    Each falls off as below a lantern that sends most of its light down, to 0 at REACH.
    """
    lamps = np.array([(b.x, b.y) for b in boxes if b.shape is Shape.LAMP]).reshape(-1, 2)
    if not len(lamps):
        return NO_STREET_LIGHT
    low, high = lamps.min(axis=0) - REACH, lamps.max(axis=0) + REACH
    cell = max(1.0, float(np.sqrt(np.prod(high - low) / MOST_CELLS)))
    rows, columns = (int(n) + 2 for n in (high - low) / cell)
    light = np.zeros((rows, columns), dtype=np.float32)
    span = int(REACH / cell)
    for x, y in (lamps - low) / cell:
        i, j = int(x), int(y)
        a = slice(max(i - span, 0), i + span + 1)
        b = slice(max(j - span, 0), j + span + 1)
        part = light[a, b]
        u = (np.arange(a.start, a.start + part.shape[0])[:, None] - x) * cell
        v = (np.arange(b.start, b.start + part.shape[1])[None, :] - y) * cell
        far = (u**2 + v**2) / HEIGHT**2
        edge = np.clip(1.0 - (u**2 + v**2) / REACH**2, 0.0, 1.0)
        part += (BRIGHT * edge / (1.0 + far) ** FALL).astype(np.float32)
    return StreetLight(float(low[0]), float(low[1]), 1.0 / cell, columns, rows, light.ravel())
