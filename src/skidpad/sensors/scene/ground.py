"""Triangles of the terrain under and around the roads. Decoration only: nothing drives on it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import LaneSamples
from skidpad.roads.terrain import CELL, COARSE, FINE, Heights, terrain_of
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, quads
from skidpad.sensors.scene.road_mesh import LEVELS, ChunkKey

BULGE = (0.002, 0.002, 0.005, 0.03)  # m, what counts as flat at each level
APRON = 4000.0  # m, flat land beyond it, out to the horizon


def ground_pieces(samples: LaneSamples) -> Iterator[tuple[ChunkKey, list[Mesh]]]:
    """Terrain chunks on a grid of `CHUNK` m, and the apron around them."""
    x0, y0, height = terrain_of(samples)
    nx, ny = height.shape
    for i in range(0, nx - 1, COARSE):
        for j in range(0, ny - 1, COARSE):
            bulge = _bulge(height[i : i + COARSE + 1, j : j + COARSE + 1])
            strides = [COARSE if bulge < limit else FINE for limit in BULGE]
            tiles = {stride: _tile(height, x0, y0, i, j, stride) for stride in set(strides)}
            yield ("ground", i, j, 0), [tiles[stride] for stride in strides]
    x1, y1 = x0 + (nx - 1) * CELL, y0 + (ny - 1) * CELL
    apron = _apron(x0, y0, x1, y1, float(height.min()))
    yield ("apron", 0, 0, 0), [apron] * LEVELS


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
    """Returns the mesh of one tile of terrain, every `stride` cells a vertex."""
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
