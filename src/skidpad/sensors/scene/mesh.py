"""Triangle meshes and the few shapes that everything in the scene is made of."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


class Mesh(NamedTuple):
    """Triangles with a label and a material each; both sides of every triangle are visible."""

    vertices: Points  # (n, 3) m
    triangles: NDArray[np.int32]  # (m, 3) indices into vertices
    label: NDArray[np.uint8]  # (m,) SemanticClass
    material: NDArray[np.uint8]  # (m,) Material

    @classmethod
    def of(cls, vertices: Points, triangles: NDArray[np.int32], label: int, material: int) -> Mesh:
        """Returns the triangles with one label and one material for all."""
        m = len(triangles)
        return cls(
            np.ascontiguousarray(vertices, dtype=np.float64),
            np.ascontiguousarray(triangles, dtype=np.int32),
            np.full(m, label, dtype=np.uint8),
            np.full(m, material, dtype=np.uint8),
        )

    def moved(self, rotation: Points, shift: Points) -> Mesh:
        """Returns the mesh turned by the (3, 3) rotation, then shifted."""
        return self._replace(vertices=self.vertices @ np.asarray(rotation).T + shift)


EMPTY = Mesh.of(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), 0, 0)


def merge(meshes: Sequence[Mesh]) -> Mesh:
    """Returns all the meshes as one mesh; EMPTY for none."""
    if not meshes:
        return EMPTY
    sizes = np.array([len(m.vertices) for m in meshes], dtype=np.int32)
    offsets = np.cumsum(sizes, dtype=np.int32) - sizes
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles for m in meshes])
        + np.repeat(offsets, [len(m.triangles) for m in meshes])[:, None],
        np.concatenate([m.label for m in meshes]),
        np.concatenate([m.material for m in meshes]),
    )


def quads(corners: NDArray[np.int32]) -> NDArray[np.int32]:
    """Returns (2q, 3) triangles of (q, 4) corner indices around each quad."""
    c = np.asarray(corners, dtype=np.int32).reshape(-1, 4)
    return np.concatenate([c[:, [0, 1, 2]], c[:, [0, 2, 3]]], axis=1).reshape(-1, 3)


def ribbon(left: Points, right: Points, label: int, material: int) -> Mesh:
    """Returns the strip between two polylines of k points each, k >= 2."""
    return Mesh.of(np.concatenate([left, right]), _strip(len(left)), label, material)


@lru_cache(maxsize=1024)
def _strip(k: int) -> NDArray[np.int32]:
    """Returns the triangles between a polyline of k points and another one, whose points follow."""
    i = np.arange(k - 1, dtype=np.int32)
    return _freeze(quads(np.stack([i, i + 1, i + 1 + k, i + k], axis=1)))


def patches(
    left: Points, right: Points, pairs: NDArray[np.intp], label: int, material: int
) -> Mesh:
    """Returns separate quads between two polylines, from index pairs[:, 0] to pairs[:, 1] of each."""
    a, b = pairs[:, 0], pairs[:, 1]
    vertices = np.stack([left[a], left[b], right[b], right[a]], axis=1).reshape(-1, 3)
    return Mesh.of(vertices, _separate(len(pairs)), label, material)


@lru_cache(maxsize=1024)
def _separate(n: int) -> NDArray[np.int32]:
    """Returns the triangles of n quads without a common corner."""
    return _freeze(quads(np.arange(4 * n, dtype=np.int32).reshape(-1, 4)))


def _freeze(triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    """Returns the triangles, which many meshes hold, after they were made read-only."""
    triangles.setflags(write=False)
    return triangles


_BOX_FACES = np.array(
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)


def hexahedron(corners: Points, label: int, material: int) -> Mesh:
    """Returns six faces over 8 corners, ordered by bits: 4 = +x, 2 = +y, 1 = +z."""
    return Mesh.of(corners, quads(_BOX_FACES), label, material)


def box(
    x: tuple[float, float],
    y: tuple[float, float],
    z: tuple[float, float],
    label: int,
    material: int,
) -> Mesh:
    """Returns the mesh of an axis-parallel box between the limits (low, high) in m."""
    corners = np.array([[a, b, c] for a in x for b in y for c in z], dtype=np.float64)
    return hexahedron(corners, label, material)


def loft(rings: Points, label: int, material: int) -> Mesh:
    """Returns the skin over (r, k, 3) rings of k points, closed around and capped at both ends."""
    r, k, _ = rings.shape
    i, j = np.meshgrid(np.arange(r - 1), np.arange(k), indexing="ij")
    n = (j + 1) % k
    corners = np.stack([i * k + j, (i + 1) * k + j, (i + 1) * k + n, i * k + n], axis=-1)
    fan = np.array([[0, j, j + 1] for j in range(1, k - 1)])
    triangles = np.concatenate([quads(corners.reshape(-1, 4)), fan, fan + (r - 1) * k])
    return Mesh.of(rings.reshape(-1, 3), triangles.astype(np.int32), label, material)


def disc(
    centre: Sequence[float], normal_axis: int, radius: float, sides: int, label: int, material: int
) -> Mesh:
    """Returns a flat regular polygon across the given axis (0 x, 1 y, 2 z)."""
    a, b = [(1, 2), (0, 2), (0, 1)][normal_axis]
    vertices = np.tile(np.asarray(centre, dtype=np.float64), (sides, 1))
    for i in range(sides):
        angle = 2.0 * pi * (i + 0.5) / sides
        vertices[i, a] += radius * cos(angle)
        vertices[i, b] += radius * sin(angle)
    fan = np.array([[0, j, j + 1] for j in range(1, sides - 1)], dtype=np.int32)
    return Mesh.of(vertices, fan, label, material)


def cylinder_y(
    centre: Sequence[float], radius: float, width: float, sides: int, label: int, material: int
) -> Mesh:
    """Returns a wheel-like cylinder around the y axis, capped."""
    angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = np.stack([radius * np.cos(angle), np.zeros(sides), radius * np.sin(angle)], axis=1)
    half = np.array([0.0, width / 2, 0.0])
    rings = np.stack([ring - half, ring + half]) + np.asarray(centre)
    return loft(rings, label, material)
