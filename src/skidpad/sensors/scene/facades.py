"""Buildings of generated scenery: walls, rows of windows, doors, roofs, at every level of detail."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.roads.roadside import Box
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, box, merge, quads

STOREY = 3.1  # m
FOOT = 0.8  # m between a building's foot, part of it in the ground, and its lowest floor
PROUD = 0.03  # m by which a pane stands out, so that depth decides which is in front
LIT = 0.22  # share of windows with a light behind them at night


class _Style(NamedTuple):
    """How a front is parted, m."""

    width: float  # of a window
    pitch: float  # from window to window
    sill: float  # above the floor
    height: float


STYLES = (
    _Style(1.2, 2.4, 0.9, 1.45),
    _Style(1.7, 3.2, 0.85, 1.4),
    _Style(0.95, 1.9, 0.8, 1.7),
    _Style(2.7, 3.0, 0.9, 1.5),  # nearly a band
)


def storeys_of(thing: Box) -> int:
    """Returns how many storeys a building has."""
    return max(thing.variant % 16, 1)


def flat_roofed_levels(thing: Box, material: int) -> list[Mesh]:
    """Returns a building with a flat roof, one mesh per level of detail, the nearest first."""
    a, b, h = thing.length / 2, thing.width / 2, thing.height
    rng = np.random.default_rng(thing.variant)
    body = box((-a, a), (-b, b), (0.0, h - 0.9), thing.label, material)
    rim = 0.35
    roof = box(
        (-a + rim, a - rim), (-b + rim, b - rim), (h - 0.9, h - 0.8), thing.label, Material.CONCRETE
    )
    x, y = rng.uniform(-0.4, 0.2) * a, rng.uniform(-0.4, 0.2) * b
    cabin = box((x, x + 0.35 * a), (y, y + 0.4 * b), (h - 0.9, h), thing.label, Material.TRIM)
    far = merge([body, roof, cabin])
    windows = _windows(thing, a, b, rng)
    bands = _bands(thing, a, b)
    return [merge([far, windows]), merge([far, windows]), merge([far, bands]), far]


def gabled_levels(thing: Box, material: int) -> list[Mesh]:
    """Returns a building with a gable roof along its length, one mesh per level, the nearest first."""
    eaves = 0.35
    a, b, h = thing.length / 2 - eaves, thing.width / 2 - eaves, thing.height
    rng = np.random.default_rng(thing.variant)
    wall = h - 0.32 * thing.width
    body = box((-a, a), (-b, b), (0.0, wall), thing.label, material)
    roof = _gable(thing, wall, h, material, a, b, rng)
    x = float(rng.uniform(-0.5, 0.4)) * a
    chimney = box((x, x + 0.6), (0.3, 0.9), (wall, h), thing.label, Material.ROOF)
    far = merge([body, roof])
    near = merge([far, chimney, _windows(thing, a, b, rng)])
    return [near, near, merge([far, _bands(thing, a, b)]), far]


def _gable(
    thing: Box, wall: float, top: float, material: int, a: float, b: float, rng: np.random.Generator
) -> Mesh:
    """Returns two slopes that reach over the walls, and the two triangles below them.

    wall, top: m, height of walls and ridge; a, b: m, half length and width between the walls.
    """
    length, width = thing.length / 2, thing.width / 2
    low = wall - 0.2
    slopes = np.array(
        [
            [-length, -width, low], [length, -width, low], [length, 0.0, top], [-length, 0.0, top],
            [-length, width, low], [length, width, low], [length, 0.0, top], [-length, 0.0, top],
        ]
    )  # fmt: skip
    cover = Material.ROOF if rng.random() < 0.6 else Material.TRIM
    tiles = Mesh.of(slopes, quads(np.arange(8, dtype=np.int32).reshape(2, 4)), thing.label, cover)
    ends = np.array(
        [[x, y, z] for x in (-a, a) for y, z in ((-b, wall), (b, wall), (0.0, top - 0.05))]
    )
    gables = Mesh.of(ends, np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32), thing.label, material)
    return merge([tiles, gables])


def _panes(corners: Points, thing: Box, material: int) -> Mesh:
    """Returns the quads (q, 4, 3) as a mesh of one material."""
    index = np.arange(4 * len(corners), dtype=np.int32).reshape(-1, 4)
    return Mesh.of(corners.reshape(-1, 3), quads(index), thing.label, material)


def _fronts(a: float, b: float) -> list[tuple[Points, Points, float]]:
    """Returns middle of the foot, direction along, and half length of the four walls.

    a, b: m, half length and width between them.
    """
    p = PROUD
    return [
        (np.array([0.0, -b - p, 0.0]), np.array([1.0, 0.0, 0.0]), a),
        (np.array([0.0, b + p, 0.0]), np.array([1.0, 0.0, 0.0]), a),
        (np.array([-a - p, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), b),
        (np.array([a + p, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), b),
    ]


def _quads_on(
    front: tuple[Points, Points, float], u: Points, z: Points, width: float, height: float
) -> Points:
    """Returns (q, 4, 3) upright rectangles around places u along a wall whose lower edges are at z, in m."""
    middle, along, _ = front
    sides = np.array([-0.5, 0.5, 0.5, -0.5]) * width
    rise = np.array([0.0, 0.0, 1.0, 1.0]) * height
    x = u[:, None] + sides
    corners = middle + x[..., None] * along
    corners[..., 2] += z[:, None] + rise
    found: Points = corners
    return found


def _windows(thing: Box, a: float, b: float, rng: np.random.Generator) -> Mesh:
    """Returns all windows, and two doors unless the ground floor of a larger building is shops."""
    style = STYLES[int(rng.integers(len(STYLES)))]
    storeys = storeys_of(thing)
    has_shops = storeys > 2 and rng.random() < 0.6
    dark, lit = [], []
    for front in _fronts(a, b):
        half = front[2] - 0.5
        count = int(2.0 * half / style.pitch)
        if count < 1:
            continue
        u: Points = (np.arange(count, dtype=np.float64) - 0.5 * (count - 1)) * style.pitch
        floors = np.arange(1 if has_shops else 0, storeys, dtype=np.float64)
        at, floor = (m.ravel() for m in np.meshgrid(u, floors))
        found = _quads_on(front, at, FOOT + floor * STOREY + style.sill, style.width, style.height)
        shines = rng.random(len(found)) < LIT
        dark.append(found[~shines])
        lit.append(found[shines])
        if has_shops:
            shop = 0.86 * style.pitch
            shown = _quads_on(front, u, np.full(count, FOOT + 0.35), shop, 2.3)
            lit.append(shown[::2])
            dark.append(shown[1::2])
    panes = [_panes(np.concatenate(dark), thing, Material.GLASS)] if dark else []
    panes += [_panes(np.concatenate(lit), thing, Material.LIT_WINDOW)] if lit else []
    if not has_shops:
        panes += [_door(front, thing) for front in _fronts(a, b)[:2]]
    return merge(panes)


def _door(front: tuple[Points, Points, float], thing: Box) -> Mesh:
    """Returns a door in the last bay of a wall."""
    middle, along, half = front
    place = np.array([half - 0.9])
    shifted = (middle + (middle / max(np.abs(middle).max(), 1e-9)) * PROUD, along, half)
    return _panes(
        _quads_on(shifted, place, np.array([FOOT - 0.2]), 1.0, 2.2), thing, Material.FRAME
    )


def _bands(thing: Box, a: float, b: float) -> Mesh:
    """Returns a strip of glass per storey and wall: windows from afar. Walls below 2.4 m have none."""
    z: Points = FOOT + np.arange(storeys_of(thing), dtype=np.float64) * STOREY + 1.1
    panes = [
        _quads_on(front, np.zeros(len(z)), z, 2.0 * front[2] - 1.6, 0.75)
        for front in _fronts(a, b)
        if front[2] > 1.2
    ]
    return _panes(np.concatenate(panes), thing, Material.GLASS) if panes else merge([])
