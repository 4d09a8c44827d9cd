"""A body: its mesh, which of its vertices are wheels, and the shapes that bodies are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, merge, patches, quads

Point = tuple[float, float, float]


class Wheel(NamedTuple):
    """One wheel of a body; its vertices are `first` to `end` - 1 of the body's mesh."""

    first: int
    spins: int  # from here on they turn with the wheel: the face of the rim, or the spokes
    end: int
    x: float  # m, of the hub
    y: float
    z: float
    radius: float  # m
    steered: bool


class Limb(NamedTuple):
    """A leg or an arm of a walker; its vertices are `first` to `end` - 1 of the body's mesh."""

    first: int
    end: int
    pivot: float  # m, height of hip or shoulder
    low: float  # m, height of its lowest point
    reach: float  # m by which its end is drawn ahead of the pivot, negative behind
    lift: float  # m by which its end rises where it moves ahead


class Body(NamedTuple):
    """What is drawn of an actor, in its own frame."""

    mesh: Mesh
    wheels: tuple[Wheel, ...] = ()
    axle_front: float = 0.0  # m, x of the steered axle
    limbs: tuple[Limb, ...] = ()


class Part(NamedTuple):
    """The mesh of a wheel before it is mounted; vertices from `spins` on turn with it."""

    mesh: Mesh
    spins: int
    hub: Point
    radius: float
    steered: bool


def assemble(fixed: Sequence[Mesh], wheels: Sequence[Part]) -> Body:
    """Returns the body of fixed meshes and wheels."""
    first = sum(len(m.vertices) for m in fixed)
    mounted = []
    for w in wheels:
        end = first + len(w.mesh.vertices)
        mounted.append(Wheel(first, first + w.spins, end, *w.hub, w.radius, w.steered))
        first = end
    front = max((w.hub[0] for w in wheels), default=0.0)
    return Body(merge([*fixed, *(w.mesh for w in wheels)]), tuple(mounted), front)


def skin(
    rings: Points, label: int, material: int, others: Mapping[tuple[int, int], int] | None = None
) -> Mesh:
    """The skin over (r, k, 3) rings, closed around and capped; others: material by (ring, point).

    Face (i, j) lies between rings i and i + 1, and between points j and j + 1 of them.
    """
    r, k, _ = rings.shape
    i, j = np.meshgrid(np.arange(r - 1), np.arange(k), indexing="ij")
    n = (j + 1) % k
    corners = np.stack([i * k + j, (i + 1) * k + j, (i + 1) * k + n, i * k + n], axis=-1)
    cap = _cap(k)
    triangles = np.concatenate([quads(corners.reshape(-1, 4)), cap, cap + (r - 1) * k])
    mesh = Mesh.of(rings.reshape(-1, 3), triangles, label, material)
    for (ring, point), other in (others or {}).items():
        face = 2 * (ring * k + point % k)
        mesh.material[face : face + 2] = other
    return without_slivers(mesh)


def _cap(points: int) -> NDArray[np.int32]:
    """Triangles of a face over a ring: strips from its one side to the other, as bodies have two."""
    found = []
    for q in range((points - 1) // 2):
        a, b, c, d = q, q + 1, points - 2 - q, points - 1 - q
        found += [(a, b, d)] if b == c else [(a, b, c), (a, c, d)]
    return np.array([t for t in found if len(set(t)) == 3], dtype=np.int32)


def without_slivers(mesh: Mesh) -> Mesh:
    """Returns the mesh without triangles that have no area."""
    a, b, c = (mesh.vertices[mesh.triangles[:, q]] for q in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    some = area > 1e-9
    return mesh._replace(
        triangles=mesh.triangles[some], label=mesh.label[some], material=mesh.material[some]
    )


def tube(
    ends: tuple[Point, Point], radii: tuple[float, float], label: int, material: int, sides: int = 6
) -> Mesh:
    """A round bar between two points with a radius in m at either end."""
    a, b = (np.asarray(p, dtype=np.float64) for p in ends)
    along = (b - a) / np.linalg.norm(b - a)
    other = np.array([0.0, 1.0, 0.0]) if abs(along[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    u = np.cross(along, other)
    u /= np.linalg.norm(u)
    v = np.cross(along, u)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    circle = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    rings = np.stack([a + radii[0] * circle, b + radii[1] * circle])
    return skin(rings, label, material)


def ball(centre: Point, radii: Point, label: int, material: int, sides: int = 8) -> Mesh:
    """An ellipsoid about a centre, with a half-axis along each of x, y and z."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rings = []
    for rise in np.linspace(-0.5 * np.pi, 0.5 * np.pi, 6):
        flat, up = max(np.cos(rise), 0.05), np.sin(rise)
        rings.append(
            np.stack([flat * np.cos(angle), flat * np.sin(angle), np.full(sides, up)], axis=1)
        )
    points = np.array(rings) * np.asarray(radii) + np.asarray(centre)
    return skin(points, label, material)


def upright(
    label: int, x: float, y: tuple[float, float], z: tuple[float, float], material: int
) -> Mesh:
    """An upright rectangle that looks along x."""
    left = np.array([[x, y[0], z[0]], [x, y[0], z[1]]])
    right = np.array([[x, y[1], z[0]], [x, y[1], z[1]]])
    return patches(left, right, np.array([[0, 1]]), label, material)


def sideways(
    label: int, y: float, x: tuple[float, float], z: tuple[float, float], material: int
) -> Mesh:
    """An upright rectangle that looks along y."""
    left = np.array([[x[0], y, z[0]], [x[0], y, z[1]]])
    right = np.array([[x[1], y, z[0]], [x[1], y, z[1]]])
    return patches(left, right, np.array([[0, 1]]), label, material)


def span(a: float, b: float) -> tuple[float, float]:
    """Returns both numbers, the smaller one first."""
    return (a, b) if a < b else (b, a)


def plate_of(label: int, x: float, z: float, wide: float = 0.52) -> Mesh:
    """A number plate that looks along x, its lower edge at z."""
    return upright(label, x, (-0.5 * wide, 0.5 * wide), (z, z + 0.11), Material.PLATE)
