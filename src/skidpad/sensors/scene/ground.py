"""Terrain under and around the roads: a height field that no road ever dips into.

Near roads it follows the lowest road within reach, so an overpass stands clear of the road below;
elsewhere it is a smooth continuation. Decoration only: nothing drives on it.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import LaneSamples
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, quads
from skidpad.sensors.scene.road_mesh import CHUNK, LEVELS, ChunkKey

CELL = 8.0  # m, resolution at which road heights are gathered
FINE, COARSE = 2, 6  # cells per quad: 16 m, and 48 m where that is flat enough
BULGE = (0.002, 0.002, 0.005, 0.03)  # m, what counts as flat at each level
MARGIN = 4 * CHUNK  # m of terrain around the map
APRON = 4000.0  # m, flat land beyond it, out to the horizon
CLEARANCE = 0.3  # m below the lowest road in reach
Heights = NDArray[np.float64]


def ground_pieces(samples: LaneSamples) -> Iterator[tuple[ChunkKey, list[Mesh]]]:
    """Terrain chunks on a grid of `CHUNK` m, and the apron around them."""
    x0, y0, nx, ny = _grid(samples)
    height = _terrain(_lowest_road(samples, x0, y0, nx, ny))
    for i in range(0, nx - 1, COARSE):
        for j in range(0, ny - 1, COARSE):
            bulge = _bulge(height[i : i + COARSE + 1, j : j + COARSE + 1])
            strides = [COARSE if bulge < limit else FINE for limit in BULGE]
            tiles = {stride: _tile(height, x0, y0, i, j, stride) for stride in set(strides)}
            yield ("ground", i, j, 0), [tiles[stride] for stride in strides]
    x1, y1 = x0 + (nx - 1) * CELL, y0 + (ny - 1) * CELL
    apron = _apron(x0, y0, x1, y1, float(height.min()))
    yield ("apron", 0, 0, 0), [apron] * LEVELS


def _grid(samples: LaneSamples) -> tuple[float, float, int, int]:
    """Corner, and nodes per axis (a whole number of chunks plus one)."""
    x0 = CHUNK * np.floor((samples.x.min() - MARGIN) / CHUNK)
    y0 = CHUNK * np.floor((samples.y.min() - MARGIN) / CHUNK)
    nx = COARSE * int(np.ceil((samples.x.max() + MARGIN - x0) / CHUNK)) + 1
    ny = COARSE * int(np.ceil((samples.y.max() + MARGIN - y0) / CHUNK)) + 1
    return float(x0), float(y0), nx, ny


def _lowest_road(samples: LaneSamples, x0: float, y0: float, nx: int, ny: int) -> Heights:
    """(nx, ny) lowest edge of any road sample that rounds to a node; inf where there is none."""
    low = np.full((nx, ny), np.inf)
    z = samples.z - np.abs(np.sin(samples.bank)) * samples.width / 2.0
    i = np.rint((samples.x - x0) / CELL).astype(int)
    j = np.rint((samples.y - y0) / CELL).astype(int)
    np.minimum.at(low, (i, j), z)
    return low


def _terrain(lowest: Heights) -> Heights:
    """(nx, ny) heights such that quads of `FINE` cells stay below every road."""
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


def _bulge(tile: Heights) -> float:
    """Largest height in m by which a tile differs from the surface through its four corners."""
    t = np.linspace(0.0, 1.0, len(tile))
    a, b = t[:, None], t[None, :]
    flat = (1 - a) * ((1 - b) * tile[0, 0] + b * tile[0, -1]) + a * (
        (1 - b) * tile[-1, 0] + b * tile[-1, -1]
    )
    twist = abs(tile[0, 0] + tile[-1, -1] - tile[0, -1] - tile[-1, 0]) / 4.0
    return float(np.abs(tile - flat).max() + twist)


def _tile(height: Heights, x0: float, y0: float, i: int, j: int, stride: int) -> Mesh:
    at = np.arange(0, COARSE + 1, stride)
    a, b = np.meshgrid(i + at, j + at, indexing="ij")
    vertices = np.stack([x0 + a * CELL, y0 + b * CELL, height[a, b]], axis=-1).reshape(-1, 3)
    n = len(at)
    p, q = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    corners = np.stack([p * n + q, (p + 1) * n + q, (p + 1) * n + q + 1, p * n + q + 1], axis=-1)
    return Mesh.of(vertices, quads(corners), SemanticClass.TERRAIN, Material.GRASS)


def _apron(x0: float, y0: float, x1: float, y1: float, z: float) -> Mesh:
    """Four flat trapezia from the terrain's border to the horizon."""
    inner = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
    out = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * APRON
    corners = np.array([[i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4)])
    return Mesh.of(
        np.concatenate([inner, inner + out]), quads(corners), SemanticClass.TERRAIN, Material.GRASS
    )
