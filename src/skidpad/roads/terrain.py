"""The height of the land under and around the roads: a field that no road ever dips into.

Near roads it follows the lowest road within reach, so an overpass stands clear of the road below;
elsewhere it is a smooth continuation.
"""

from __future__ import annotations

from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from skidpad.roads.lanes import LaneSamples

CELL = 8.0  # m, resolution at which road heights are gathered
FINE, COARSE = 2, 6  # cells per quad: 16 m, and 48 m where that is flat enough
SQUARE = CELL * COARSE  # m, edge of the largest quads
MARGIN = 4 * SQUARE  # m of terrain around the map
CLEARANCE = 0.3  # m below the lowest road in reach
Heights = NDArray[np.float64]


class Terrain(NamedTuple):
    """Heights at the nodes of a grid of `CELL` m."""

    x0: float
    y0: float
    height: Heights  # (nx, ny)

    def at(self, x: Heights, y: Heights) -> Heights:
        """Returns the heights at (n,) places; beyond the grid those of its border."""
        nx, ny = self.height.shape
        u = np.clip((np.asarray(x) - self.x0) / CELL, 0.0, nx - 1.001)
        v = np.clip((np.asarray(y) - self.y0) / CELL, 0.0, ny - 1.001)
        i, j = u.astype(int), v.astype(int)
        a, b, h = u - i, v - j, self.height
        low = (1.0 - a) * h[i, j] + a * h[i + 1, j]
        high = (1.0 - a) * h[i, j + 1] + a * h[i + 1, j + 1]
        found: Heights = (1.0 - b) * low + b * high
        return found


def terrain_of(samples: LaneSamples) -> Terrain:
    """Returns the height of the land of a map, MARGIN m beyond its roads."""
    x0, y0, nx, ny = _lay_grid(samples)
    return Terrain(x0, y0, _terrain(_lowest_road(samples, x0, y0, nx, ny)))


def _lay_grid(samples: LaneSamples) -> tuple[float, float, int, int]:
    """Returns x and y in m of a corner, and the nodes per axis (a whole number of squares plus one)."""
    x0 = SQUARE * np.floor((samples.x.min() - MARGIN) / SQUARE)
    y0 = SQUARE * np.floor((samples.y.min() - MARGIN) / SQUARE)
    nx = COARSE * int(np.ceil((samples.x.max() + MARGIN - x0) / SQUARE)) + 1
    ny = COARSE * int(np.ceil((samples.y.max() + MARGIN - y0) / SQUARE)) + 1
    return float(x0), float(y0), nx, ny


def _lowest_road(samples: LaneSamples, x0: float, y0: float, nx: int, ny: int) -> Heights:
    """Returns (nx, ny) the lowest edge in m of any road sample that rounds to a node; inf without one."""
    low = np.full((nx, ny), np.inf)
    z = samples.z - np.abs(np.sin(samples.bank)) * samples.width / 2.0
    i = np.rint((samples.x - x0) / CELL).astype(int)
    j = np.rint((samples.y - y0) / CELL).astype(int)
    np.minimum.at(low, (i, j), z)
    return low


def _terrain(lowest: Heights) -> Heights:
    """Returns (nx, ny) heights such that quads of FINE cells stay CLEARANCE below every road."""
    reach = ceil(FINE * sqrt(2.0)) + 1  # a quad's diagonal, and the rounding to nodes
    span = np.arange(-reach, reach + 1)
    disc = span[:, None] ** 2 + span[None, :] ** 2 <= reach**2
    near = ndimage.minimum_filter(lowest, footprint=disc, mode="nearest") - CLEARANCE
    bound = np.isfinite(near)
    nearest = ndimage.distance_transform_edt(~bound, return_distances=False, return_indices=True)
    filled = near[tuple(nearest)]
    smooth = ndimage.gaussian_filter(filled, 4.0, mode="nearest")
    terrain: Heights = np.where(bound, near, smooth)
    return terrain
