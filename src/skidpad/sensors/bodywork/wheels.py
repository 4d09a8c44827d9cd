"""Meshes of wheels: tyre and rim of cars, rim and spokes of two-wheelers."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from skidpad.sensors.bodywork.body import Part, Point, skin
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, merge, quads

TYRE_SIDES = 16


def car_wheel(
    label: int, hub: Point, radius: float, breadth: float, steered: bool, spokes: int = 5
) -> Part:
    """A tyre around y whose outer face has a rim with spokes; it lies to the side of the hub's y."""
    x, y, z = hub
    side = 1.0 if y > 0.0 else -1.0
    rings = [
        _circle(x, y + side * s * breadth, z, radius * r, TYRE_SIDES)
        for s, r in ((-0.5, 0.86), (-0.42, 1.0), (0.38, 1.0), (0.48, 0.90), (0.47, 0.74))
    ]
    tyre = skin(np.array(rings), label, Material.TYRE)
    face = _make_rim(label, (x, y + side * (0.48 * breadth + 0.004), z), 0.74 * radius, spokes)
    return Part(merge([tyre, face]), len(tyre.vertices), hub, radius, steered)


def _circle(x: float, y: float, z: float, radius: float, sides: int) -> list[Point]:
    """Points of a circle around y whose lowest point is one of them."""
    angles = [2.0 * pi * q / sides - 0.5 * pi for q in range(sides)]
    return [(x + radius * cos(a), y, z + radius * sin(a)) for a in angles]


def _make_rim(label: int, centre: Point, radius: float, spokes: int) -> Mesh:
    """A round face of spokes with dark gaps, and a bright edge."""
    x, y, z = centre
    n = 2 * spokes
    points: list[Point] = [centre]
    for share in (0.86, 1.0):
        for q in range(n):
            a = 2.0 * pi * (q + (0.22 if q % 2 else -0.22)) / n
            points.append((x + share * radius * cos(a), y, z + share * radius * sin(a)))
    triangles, materials = [], []
    for q in range(n):
        a, b = 1 + q, 1 + (q + 1) % n
        triangles += [(0, a, b), (a, b, b + n), (a, b + n, a + n)]
        materials += [Material.RIM if q % 2 else Material.TRIM, Material.RIM, Material.RIM]
    mesh = Mesh.of(np.array(points), np.array(triangles, dtype=np.int32), label, Material.RIM)
    mesh.material[:] = materials
    return mesh


def spoked_wheel(label: int, hub: Point, radius: float, breadth: float, steered: bool) -> Part:
    """A tyre that one can see through, with four spokes that turn."""
    x, y, z = hub
    inner, half = radius - max(0.035, 0.8 * breadth), 0.5 * breadth
    circles = [
        _circle(x, y + s * half, z, r, TYRE_SIDES)
        for s, r in (
            (-1.0, inner),
            (-1.0, 0.97 * radius),
            (0.0, radius),
            (1.0, 0.97 * radius),
            (1.0, inner),
        )
    ]
    rings = np.array(circles).swapaxes(0, 1)
    rings = np.concatenate([rings, rings[:1]])  # around the wheel and back to its begin
    tyre = _open_skin(rings, label)
    bars = []
    for q in range(4):
        a, wide = pi * q / 4.0, 0.012 if breadth < 0.1 else 0.035
        way, across = np.array([cos(a), 0.0, sin(a)]), np.array([-sin(a), 0.0, cos(a)]) * wide
        middle = np.array(hub)
        ends = [middle + s * inner * way + t * across for s in (-1, 1) for t in (-1, 1)]
        bars.append(
            Mesh.of(
                np.array(ends),
                np.array([[0, 1, 3], [0, 3, 2]], dtype=np.int32),
                label,
                Material.RIM,
            )
        )
    return Part(merge([tyre, *bars]), len(tyre.vertices), hub, radius, steered)


def _open_skin(rings: Points, label: int) -> Mesh:
    """The skin over rings that end where they begin, without caps."""
    r, k, _ = rings.shape
    i, j = np.meshgrid(np.arange(r - 1), np.arange(k), indexing="ij")
    n = (j + 1) % k
    corners = np.stack([i * k + j, (i + 1) * k + j, (i + 1) * k + n, i * k + n], axis=-1)
    return Mesh.of(rings.reshape(-1, 3), quads(corners.reshape(-1, 4)), label, Material.TYRE)


def heavy_wheels(
    label: int, places: tuple[float, ...], half: float, radius: float, breadth: float
) -> list[Part]:
    """Returns wheels on either side at every place; twin ones but for the first."""
    front = max(places)
    return [
        car_wheel(
            label,
            (x, s * (half - 0.5 * wide - 0.015), radius),
            radius,
            wide,
            x == front,
            6,
        )
        for x in places
        for s in (1.0, -1.0)
        for wide in (breadth if x == front else 1.9 * breadth,)
    ]
