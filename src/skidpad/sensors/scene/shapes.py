"""Meshes of the shapes that fill boxes of generated scenery, at every level of detail.

Frame of a box: x along its length, y across, z up from its foot. A mesh stays inside its box.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.roads.roadside import Box, Shape
from skidpad.sensors.scene.bodies import body_mesh
from skidpad.sensors.scene.facades import flat_roofed_levels, gabled_levels
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, box, loft, merge, ribbon
from skidpad.sensors.scene.road_mesh import LEVELS

Rng = np.random.Generator
SIDES = (8, 6, 5, 4)  # of round things, by level
RINGS = (6, 5, 4, 3)  # of crowns


def shape_levels(thing: Box, material: int) -> list[Mesh]:
    """Returns one mesh per level of detail; the nearest comes first."""
    return SHAPES[thing.shape](thing, material)


def _post(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of an elliptic post by level of detail."""

    def one(level: int) -> Mesh:
        rings = np.stack([_ring(thing, SIDES[level], z) for z in (0.0, thing.height)])
        return loft(rings, thing.label, material)

    return [one(max(level, 1)) for level in range(LEVELS)]


def _ring(thing: Box, sides: int, z: float, share: float = 1.0) -> Points:
    """Returns the points (sides, 3) in m of an ellipse in the thing's box at height z, scaled by share."""
    angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
    x = 0.5 * thing.length * share * np.cos(angle)
    y = 0.5 * thing.width * share * np.sin(angle)
    return np.stack([x, y, np.full(sides, z)], axis=1)


def _crown(thing: Box, material: int) -> list[Mesh]:
    """Returns lumps of leaves by level: one in the middle, smaller ones around it break its outline."""
    lumps = (4, 3, 0, 0)

    def one(level: int) -> Mesh:
        rng = np.random.default_rng(thing.variant)
        size = np.array([thing.length, thing.width, thing.height])
        turn = float(rng.uniform(0.0, 2.0 * np.pi))
        count = lumps[level]
        middle = _lump_of_leaves(thing, level, rng, size * ((0.84, 0.84, 0.96) if count else 1.0))
        parts = [middle.moved(np.eye(3), np.array([0.0, 0.0, 0.02 * thing.height * bool(count)]))]
        for k in range(count):
            angle = turn + 2.0 * np.pi * k / count
            small = size * rng.uniform(0.44, 0.56) * (1.0, 1.0, 0.9)
            away = 0.5 * (size - small)
            up = float(rng.uniform(0.0, 0.75)) * (size[2] - small[2])
            place = np.array([away[0] * np.cos(angle), away[1] * np.sin(angle), up])
            parts.append(_lump_of_leaves(thing, level + 1, rng, small).moved(np.eye(3), place))
        mesh = merge(parts)
        return mesh._replace(material=np.full(len(mesh.triangles), material, dtype=np.uint8))

    return [one(level) for level in range(LEVELS)]


def _lump_of_leaves(thing: Box, level: int, rng: Rng, size: Points) -> Mesh:
    """Returns rings of uneven radius, most in the lower middle, from the ground up. size: (3,) m."""
    sides, rings = SIDES[level], []
    for h in np.linspace(0.0, 1.0, RINGS[level]).tolist():
        share = (1.0 - abs(2.0 * h - 0.85) ** 2.2 / 2.6) * (0.35 if h in (0.0, 1.0) else 0.97)
        angle = 2.0 * np.pi * (np.arange(sides) + 0.5) / sides
        radius = 0.5 * share * rng.uniform(0.78, 1.0, sides)
        ring = [radius * np.cos(angle) * size[0], radius * np.sin(angle) * size[1]]
        rings.append(np.stack([*ring, np.full(sides, h * size[2])], axis=1))
    return loft(np.array(rings), thing.label, 0)


def _cone(thing: Box, material: int) -> list[Mesh]:
    """Returns a conifer by level of detail: skirts of branches one above the other."""

    def one(level: int) -> Mesh:
        tiers = 4 - level
        steps = np.linspace(0.0, 1.0, tiers + 1)
        rings = []
        for low, high in itertools.pairwise(steps):
            rings.append(_ring(thing, SIDES[level], low * thing.height, 1.0 - 0.86 * low))
            share = max(0.55 * (1.0 - low) * (1.0 - 0.3 * high), 0.04) if high < 1.0 else 0.03
            rings.append(_ring(thing, SIDES[level], high * thing.height, share))
        return loft(np.array(rings), thing.label, material)

    return [one(min(level, 3)) for level in range(LEVELS)]


def _lamp(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a lamp head by level of detail: a lid above a bright pane."""
    a, b, h = thing.length / 2, thing.width / 2, thing.height
    lid = box((-a, a), (-b, b), (0.4 * h, h), thing.label, material)
    pane = box(
        (-0.8 * a, 0.8 * a), (-0.8 * b, 0.8 * b), (0.0, 0.4 * h), thing.label, Material.HEADLAMP
    )
    return [merge([lid, pane])] * LEVELS


def _lump(thing: Box, material: int, step: float, rough: float) -> list[Mesh]:
    """Returns a row of bushes or trees by level: cross-sections of uneven height, width and top.

    step: m between cross-sections; rough: share by which heights differ.
    """

    def one(level: int) -> Mesh:
        rng = np.random.default_rng(thing.variant)
        n = max(int(thing.length / (step * (1.0, 1.5, 2.0, 3.0)[level])), 2) + 1
        x = np.linspace(-0.5, 0.5, n) * thing.length
        high = rng.uniform(1.0 - rough, 1.0, n) * thing.height
        wide = rng.uniform(1.0 - 0.5 * rough, 1.0, (n, 2)) * thing.width / 2.0
        high[[0, -1]] *= 0.85
        rings = np.empty((n, 6, 3))
        rings[:, :, 0] = x[:, None]
        rings[:, 0, 1:] = np.stack([wide[:, 0], np.zeros(n)], axis=1)
        rings[:, 1, 1:] = np.stack([wide[:, 0] * 0.97, 0.62 * high], axis=1)
        rings[:, 2, 1:] = np.stack([wide[:, 0] * 0.55, high * rng.uniform(0.9, 1.0, n)], axis=1)
        rings[:, 3, 1:] = np.stack([-wide[:, 1] * 0.55, high], axis=1)
        rings[:, 4, 1:] = np.stack([-wide[:, 1] * 0.97, 0.62 * high], axis=1)
        rings[:, 5, 1:] = np.stack([-wide[:, 1], np.zeros(n)], axis=1)
        return loft(rings, thing.label, material)

    return [one(level) for level in range(LEVELS)]


def _hedge(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a hedge by level of detail."""
    return _lump(thing, material, 1.2, 0.18)


def _wood(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a row of trees by level of detail."""
    return _lump(thing, material, 3.2, 0.5)


def _shelter(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a bus shelter by level of detail: roof, back, posts and bench."""
    a, b, h = thing.length / 2, thing.width / 2, thing.height
    roof = box((-a, a), (-b, b), (h - 0.12, h), thing.label, Material.TRIM)
    back = box((-a, a), (-0.04, 0.04), (0.3, h - 0.2), thing.label, material)
    posts = [
        box((x - 0.05, x + 0.05), (y - 0.05, y + 0.05), (0.0, h - 0.1), thing.label, Material.STEEL)
        for x in (-a + 0.06, a - 0.06) for y in (-b + 0.06, b - 0.06)
    ]  # fmt: skip
    bench = box((-0.7 * a, 0.7 * a), (0.08, 0.45), (0.72, 0.78), thing.label, Material.FENCE)
    return [merge([roof, back, bench, *posts])] * LEVELS


def _car(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a parked car by level of detail, painted with the material."""
    body = body_mesh(ActorKind.CAR, thing.length, thing.width, thing.height)
    painted = np.where(body.material == Material.PAINT, np.uint8(material), body.material)
    return [body._replace(material=painted.astype(np.uint8))] * LEVELS


def _fence(thing: Box, material: int) -> list[Mesh]:
    """Returns the meshes of a rail fence by level of detail; the far ones are one band."""
    a, h, label = thing.length / 2, thing.height, SemanticClass.FENCE
    ends = np.array([[-a, 0.0, 0.0], [a, 0.0, 0.0]])

    def rail(low: float, high: float) -> Mesh:
        up, down = np.array([0.0, 0.0, high * h]), np.array([0.0, 0.0, low * h])
        return ribbon(ends + up, ends + down, label, material)

    posts = [
        box((x - 0.05, x + 0.05), (-0.05, 0.05), (0.0, h), label, material)
        for x in np.linspace(-a + 0.05, a - 0.05, max(int(thing.length / 2.5), 1) + 1).tolist()
    ]
    near = merge([rail(0.85, 0.98), rail(0.55, 0.68), rail(0.32, 0.42), *posts])
    far = rail(0.35, 0.95)
    return [near, near, far, far][:LEVELS]


def _sign(thing: Box, material: int) -> list[Mesh]:
    """Returns a plate that looks back along the box, with its back, and a red rim unless it is an octagon.

    The number of its corners is the box's variant; one mesh for all levels.
    """
    half, size = 0.5 * thing.length, 0.5 * thing.height
    turn = np.pi / thing.variant if thing.variant != 3 else -np.pi / 2.0  # yield stands on its tip

    def plate(x: float, radius: float, of: int) -> Mesh:
        angle = turn + 2.0 * np.pi * np.arange(thing.variant) / thing.variant
        y, z = radius * np.cos(angle), size + radius * np.sin(angle)
        corners = np.stack([np.full(thing.variant, x), y, z], axis=1)
        fan = np.array([[0, k, k + 1] for k in range(1, thing.variant - 1)], dtype=np.int32)
        return Mesh.of(corners, fan, thing.label, of)

    back = plate(-half + 0.01, size, Material.STEEL)
    rim = plate(-half + 0.005, size, material if thing.variant == 8 else Material.TAIL_LAMP)
    return [merge([back, rim, plate(-half, 0.8 * size, material)])] * LEVELS


SHAPES: dict[Shape, Callable[[Box, int], list[Mesh]]] = {
    Shape.BLOCK: flat_roofed_levels,
    Shape.HOUSE: gabled_levels,
    Shape.POST: _post,
    Shape.CROWN: _crown,
    Shape.CONE: _cone,
    Shape.LAMP: _lamp,
    Shape.HEDGE: _hedge,
    Shape.WOOD: _wood,
    Shape.SHELTER: _shelter,
    Shape.CAR: _car,
    Shape.FENCE: _fence,
    Shape.SIGN: _sign,
}
