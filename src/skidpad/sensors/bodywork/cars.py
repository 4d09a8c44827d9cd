"""Cars and vans: a hull with wheel arches, a glasshouse over it, and wheels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from skidpad.sensors.bodywork.body import Body, Point, assemble, skin
from skidpad.sensors.bodywork.car_details import make_ends, make_light_bar, make_mirrors, make_rails
from skidpad.sensors.bodywork.car_shape import (
    SIDE,
    CarSize,
    CarStyle,
    curve_at,
    half_width_at,
    make_glass_ring,
    side_at,
)
from skidpad.sensors.bodywork.wheels import car_wheel
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, box

DECK_POINTS = ((0.72, 0.6), (0.0, 1.0))  # share of the width, of the crown
ARCH = 1.14  # radii of the wheel
ARCH_STEPS = (1.0, 0.88, 0.55, 0.0, -0.55, -0.88, -1.0)
DOOR_GAP = 0.012  # m
LEAST_HULL = 0.84  # width of the hull, of a box with mirrors
UNDER_BAR = 0.935  # height of a roof with a light bar, of the box


def make_car(
    label: int,
    style: CarStyle,
    length: float,
    width: float,
    height: float,
    axles: tuple[float, float] | None = None,
    wheel: float | None = None,
) -> Body:
    """Returns the body of a car within its box in m. axles, wheel: x and radius where known."""
    x = (0.5 - style.axles[0]) * length, (0.5 - style.axles[1]) * length
    top, height = height, height * (UNDER_BAR if style.light_bar else 1.0)
    hull = 0.5 * min(max(style.breadth * height, LEAST_HULL * width), width)
    size = CarSize(length, width, height, hull, axles or x, wheel or style.wheel * height)
    fixed = [
        _hull(label, style, size),
        _glasshouse(label, style, size),
        _floor(label, size),
        *make_ends(label, style, size),
        *make_mirrors(label, style, size),
    ]
    if style.light_bar:
        fixed.append(make_light_bar(label, style, size, top))
    if style.rails:
        fixed += make_rails(label, style, size)
    breadth = min(0.26, 0.13 * size.width)
    wheels = [
        car_wheel(
            label,
            (place, s * (size.half - 0.5 * breadth - 0.012), size.wheel),
            size.wheel,
            breadth,
            row == 0,
            style.spokes,
        )
        for row, place in enumerate(size.axles)
        for s in (1.0, -1.0)
    ]
    return assemble(fixed, wheels)


def _stations(style: CarStyle, size: CarSize) -> list[tuple[float, bool]]:
    """x in m of the hull's rings from nose to tail, and whether the ring lies in a wheel's arch."""
    h, radius = 0.5 * size.length, ARCH * size.wheel
    plain = [0.012, 0.035, 0.075, 0.14, 0.26, 0.45]
    places = [h - p for p in plain] + [-h + p for p in (0.05, 0.075, 0.13, 0.24, 0.42)]
    places += [h - t * size.length for t, _ in style.deck[1:-1]]
    places += [h - t * size.length for t in _gaps(style)]
    places += [h - t * size.length - DOOR_GAP for t in _gaps(style)]
    rows = [(x, False) for x in places if all(abs(x - a) > radius + 0.01 for a in size.axles)]
    for a in size.axles:
        rows += [(a + radius + 1e-4, False), (a - radius - 1e-4, False)]
        rows += [(a + step * radius, True) for step in ARCH_STEPS]
        inside = [x for x in places if abs(x - a) <= radius + 0.01]
        rows += [
            (x, True) for x in inside if min(abs(x - a - s * radius) for s in ARCH_STEPS) > 0.03
        ]
    return sorted((r for r in rows if abs(r[0]) <= h - 0.011), reverse=True)


def _gaps(style: CarStyle) -> tuple[float, ...]:
    """Places of the gaps of the doors: before, between and behind the side windows."""
    first, last = style.pillars[0][0], style.pillars[-1][1]
    return (first - 0.025, *(p[0] - 0.012 for p in style.pillars[1:]), last)


def _ring(style: CarStyle, size: CarSize, x: float, arched: bool) -> list[Point]:
    """Points of the hull's cross-section at x, from the left lower edge over the deck to the right."""
    h, t = size.height, 0.5 - x / size.length
    deck, low = curve_at(style.deck, t) * h, style.sill * h
    inside = min(0.5 * size.length - x, 0.5 * size.length + x)
    low += 0.09 * h * max(0.0, 1.0 - inside / 0.30) ** 2
    bottom = low
    if arched:
        near = min(size.axles, key=lambda a: abs(a - x))
        away = min(abs(x - near) / (ARCH * size.wheel), 1.0)
        bottom = max(low, size.wheel * (1.0 + ARCH * np.sqrt(1.0 - away * away)))
        bottom = min(bottom, 0.97 * deck)
    half, crown = half_width_at(style, size, x), 0.035 * h
    points = []
    for share, _ in SIDE:
        z = max(low + share * (deck - low), bottom)
        points.append((x, half * side_at((z - low) / (deck - low)), z))
    for wide, high in DECK_POINTS[:-1]:
        points.append((x, half * wide, deck + high * crown))
    middle = (x, 0.0, deck + crown)
    return [*points, middle, *((a, -b, c) for a, b, c in reversed(points))]


def _hull(label: int, style: CarStyle, size: CarSize) -> Mesh:
    """The painted hull with doors, arches, and lamps at its corners."""
    stations = _stations(style, size)
    rings = np.array([_ring(style, size, x, arched) for x, arched in stations])
    count = rings.shape[1]
    gaps = [(0.5 - t) * size.length for t in _gaps(style)]
    others: dict[tuple[int, int], int] = {}
    for i, ((x0, in_arch), (x1, arched)) in enumerate(pairwise(stations)):
        faces = {count - 1: int(Material.TRIM)}  # below
        gap = any(abs(x0 - g) < 1e-6 and x0 - x1 < 2.0 * DOOR_GAP for g in gaps)
        dark = 5 if gap else 2 if style.cladding and in_arch and arched else int(style.cladding)
        if in_arch != arched:
            dark = max(dark, 1)
        for side in range(dark):
            faces |= _both(side, count, Material.TRIM)
        middle = 0.5 * (x0 + x1)
        faces |= _nose_faces(0.5 * size.length - middle, count)
        faces |= _tail_faces(style, 0.5 + middle / size.length, size.length, count)
        others |= {(i, j): material for j, material in faces.items()}
    return skin(rings, label, Material.PAINT, others)


def _both(side: int, count: int, left: int, right: int | None = None) -> dict[int, int]:
    """Materials of a face on either side of a ring; right: where it has another one."""
    return {side: int(left), count - 2 - side: int(left if right is None else right)}


def _nose_faces(inside: float, count: int) -> dict[int, int]:
    """Materials of the faces so many m behind the nose: bumper, grille, head lamps, indicators."""
    faces: dict[int, int] = {}
    if inside < 0.10:
        faces |= _both(0, count, Material.TRIM) | _both(1, count, Material.TRIM)
    if inside < 0.05:
        faces |= _both(len(SIDE), count, Material.TRIM)
    if 0.012 < inside < 0.32:
        faces |= _both(3, count, Material.LAMP_GLASS) | _both(4, count, Material.LAMP_GLASS)
    if 0.012 < inside < 0.15:
        faces |= _both(len(SIDE) - 1, count, Material.LAMP_GLASS)
    if 0.20 < inside < 0.40:
        faces |= _both(3, count, Material.INDICATOR_LEFT, Material.INDICATOR_RIGHT)
    return faces


def _tail_faces(style: CarStyle, t: float, length: float, count: int) -> dict[int, int]:
    """Materials of the faces a share of the length before the tail: lamps, load bed."""
    if style.bed is None:
        if t * length > 0.20:
            return {}
        return _both(3, count, Material.TAIL_LAMP) | _both(2, count, Material.TAIL_LAMP)
    first, last = style.bed
    if not first < 1.0 - t < last:
        return {}
    return {j: int(Material.TRIM) for j in range(len(SIDE), count - len(SIDE) - 1)}


def _roof_stations(style: CarStyle) -> list[float]:
    """Places of the glasshouse's rings from the windscreen's foot to the rear window's foot."""
    begin, end = style.roof[0][0], style.roof[-1][0]
    places = {p[0] for p in style.roof}
    for first, last in style.pillars:
        places |= {first, last}
    ordered = sorted(p for p in places if begin <= p <= end)
    filled = [ordered[0]]
    for a, b in pairwise(ordered):
        steps = 2 if b - a > 0.09 else 1
        filled += [a + (b - a) * (q + 1) / steps for q in range(steps)]
    return filled


def _glasshouse(label: int, style: CarStyle, size: CarSize) -> Mesh:
    """Windows between painted pillars under a painted roof."""
    stations = _roof_stations(style)
    rings = np.array([make_glass_ring(style, size, t) for t in stations])
    count = rings.shape[1]
    screen, rear = style.roof[style.screen[0]][0], style.roof[style.screen[1]][0]
    others: dict[tuple[int, int], int] = {}
    for i, (a, b) in enumerate(pairwise(stations)):
        middle = 0.5 * (a + b)
        if any(first < middle < last for first, last in style.pillars):
            for j in (1, count - 3):
                others[i, j] = Material.GLASS
        elif style.pillars[0][1] <= middle <= style.pillars[-1][0]:
            for j in (1, count - 3):
                others[i, j] = Material.TRIM
        before, behind = middle < screen, middle > rear and style.rear_window
        if before or behind:
            for j in (4, 5):
                others[i, j] = Material.GLASS
    return skin(rings, label, Material.PAINT, others)


def _floor(label: int, size: CarSize) -> Mesh:
    """The dark underside between the wheels, also what one sees in the arches."""
    h = 0.5 * size.length
    inner = size.half - 0.28
    top = min(2.1 * size.wheel, 0.52 * size.height)
    return box(
        (-h + 0.30, h - 0.32), (-inner, inner), (0.11 * size.height, top), label, Material.TRIM
    )
