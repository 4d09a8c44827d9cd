"""Cars and vans: a hull with wheel arches, a glasshouse over it, lamps, plates, mirrors and wheels.

Places along a car are shares of its length from the nose, heights are shares of its height.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from skidpad.sensors.bodywork.body import (
    Body,
    Point,
    assemble,
    plate_of,
    sideways,
    skin,
    upright,
)
from skidpad.sensors.bodywork.wheels import car_wheel
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, box

Curve = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CarStyle:
    """What one kind of car looks like."""

    deck: Curve  # upper edge of the hull: nose, bonnet, sill of the windows, boot, tail
    roof: Curve  # from the foot of the windscreen over the roof to the foot of the rear window
    pillars: Curve  # of the side windows: begin and end
    axles: tuple[float, float] = (0.19, 0.80)
    wheel: float = 0.215  # radius
    breadth: float = 1.25  # of the hull, over the height; in wider boxes mirrors stand out
    tumble: float = 0.30  # by how much windows lean in, of their height
    sill: float = 0.13  # lower edge of the hull
    screen: tuple[int, int] = (1, -2)  # rows of `roof` where windscreen ends and rear window begins
    nose: float = 0.16  # by how much the nose is narrower than the hull
    tail: float = 0.10
    cladding: bool = False  # dark sills and arches
    bed: tuple[float, float] | None = None  # an open load bed
    rear_window: bool = True
    rails: bool = False  # on the roof
    light_bar: bool = False
    tail_lamp: tuple[float, float] = (0.42, 0.60)
    spokes: int = 5


class _Size(NamedTuple):
    """Size of a car in m, and what follows from it."""

    length: float
    width: float
    height: float
    half: float  # of the hull
    axles: tuple[float, float]  # x
    wheel: float


SIDE = ((0.0, 0.90), (0.10, 0.972), (0.42, 1.0), (0.66, 0.995), (0.86, 0.978), (1.0, 0.935))
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
    size = _Size(length, width, height, hull, axles or x, wheel or style.wheel * height)
    fixed = [
        _hull(label, style, size),
        _glasshouse(label, style, size),
        _floor(label, size),
        *_ends(label, style, size),
        *_mirrors(label, style, size),
    ]
    if style.light_bar:
        fixed.append(_light_bar(label, style, size, top))
    if style.rails:
        fixed += _rails(label, style, size)
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


def _at(curve: Curve, t: float) -> float:
    """Value of a curve at t."""
    return float(np.interp(t, [p[0] for p in curve], [p[1] for p in curve]))


def _side_at(share: float) -> float:
    """Share of the hull's half-width at a share of its height."""
    return float(np.interp(share, [p[0] for p in SIDE], [p[1] for p in SIDE]))


def _plan(style: CarStyle, size: _Size, x: float) -> float:
    """Returns the half-width of the hull in m at x m ahead of its centre; less at nose and tail."""
    out = size.half
    for end, share, deep in ((1.0, style.nose, 0.62), (-1.0, style.tail, 0.42)):
        inside = 0.5 * size.length - end * x
        if inside < deep:
            out -= size.half * share * (1.0 - inside / deep) ** 2.4
    return out


def _stations(style: CarStyle, size: _Size) -> list[tuple[float, bool]]:
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


def _ring(style: CarStyle, size: _Size, x: float, arched: bool) -> list[Point]:
    """Points of the hull's cross-section at x, from the left lower edge over the deck to the right."""
    h, t = size.height, 0.5 - x / size.length
    deck, low = _at(style.deck, t) * h, style.sill * h
    inside = min(0.5 * size.length - x, 0.5 * size.length + x)
    low += 0.09 * h * max(0.0, 1.0 - inside / 0.30) ** 2
    bottom = low
    if arched:
        near = min(size.axles, key=lambda a: abs(a - x))
        away = min(abs(x - near) / (ARCH * size.wheel), 1.0)
        bottom = max(low, size.wheel * (1.0 + ARCH * np.sqrt(1.0 - away * away)))
        bottom = min(bottom, 0.97 * deck)
    half, crown = _plan(style, size, x), 0.035 * h
    points = []
    for share, _ in SIDE:
        z = max(low + share * (deck - low), bottom)
        points.append((x, half * _side_at((z - low) / (deck - low)), z))
    for wide, high in DECK_POINTS[:-1]:
        points.append((x, half * wide, deck + high * crown))
    middle = (x, 0.0, deck + crown)
    return [*points, middle, *((a, -b, c) for a, b, c in reversed(points))]


def _hull(label: int, style: CarStyle, size: _Size) -> Mesh:
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


def _glass_ring(style: CarStyle, size: _Size, t: float) -> list[Point]:
    """Cross-section of the glasshouse: sill, window, rail, roof, and the other side."""
    x = (0.5 - t) * size.length
    h = size.height
    foot = _at(style.deck, t) * h - 0.004
    top = max(_at(style.roof, t) * h, foot + 0.006)
    tall = top - foot
    wide = 0.925 * _plan(style, size, x)
    lean = style.tumble * tall
    crown = 0.05 * h * min(tall / (0.30 * h), 1.0) * 0.8
    edge = top - crown
    points = [
        (x, wide, foot),
        (x, wide - 0.06 * lean, foot + 0.08 * (edge - foot)),
        (x, wide - 0.80 * lean, foot + 0.88 * (edge - foot)),
        (x, wide - lean, edge),
        (x, 0.86 * (wide - lean), edge + 0.55 * crown),
    ]
    return [*points, (x, 0.0, top), *((a, -b, c) for a, b, c in reversed(points))]


def _glasshouse(label: int, style: CarStyle, size: _Size) -> Mesh:
    """Windows between painted pillars under a painted roof."""
    stations = _roof_stations(style)
    rings = np.array([_glass_ring(style, size, t) for t in stations])
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


def _floor(label: int, size: _Size) -> Mesh:
    """The dark underside between the wheels, also what one sees in the arches."""
    h = 0.5 * size.length
    inner = size.half - 0.28
    top = min(2.1 * size.wheel, 0.52 * size.height)
    return box(
        (-h + 0.30, h - 0.32), (-inner, inner), (0.11 * size.height, top), label, Material.TRIM
    )


def _ends(label: int, style: CarStyle, size: _Size) -> list[Mesh]:
    """Bumpers, grille, plates, lamps on the tail; the outermost faces in x."""
    h, half, tall = 0.5 * size.length, size.half, size.height
    nose = _at(style.deck, 0.0) * tall
    deck = _at(style.deck, 1.0) * tall
    low = (style.sill + 0.09) * tall
    parts = [
        _bumper(label, style, size, 1.0, low - 0.05 * tall, min(low + 0.13 * tall, 0.96 * nose)),
        _bumper(label, style, size, -1.0, low - 0.05 * tall, low + 0.13 * tall),
    ]
    grille = (low + 0.02 * tall, max(nose - 0.02, low + 0.10 * tall))
    parts.append(upright(label, h - 0.003, (-0.42 * half, 0.42 * half), grille, Material.TRIM))
    middle = 0.5 * (grille[0] + grille[1]) - 0.055
    parts += [plate_of(label, h, middle), plate_of(label, -h + 0.018, 0.44 * tall)]
    x, (z0, z1) = (
        -h + 0.044,
        (style.tail_lamp[0] * tall, min(style.tail_lamp[1] * tall, deck - 0.02)),
    )
    wide = _plan(style, size, -h + 0.05)
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        cut = z0 + 0.30 * (z1 - z0)
        inner, outer = 0.60 * wide * s, 0.955 * wide * s
        parts.append(upright(label, x, (inner, outer), (cut, z1), Material.TAIL_LAMP))
        parts.append(upright(label, x, (inner, outer), (z0, cut), turn))
    if style.rear_window:
        parts.append(_brake_lamp(label, style, size))
    return parts


def _brake_lamp(label: int, style: CarStyle, size: _Size) -> Mesh:
    """The middle brake lamp, at the upper edge of the rear window."""
    (t0, z0), (t1, z1) = style.roof[style.screen[1]], style.roof[-1]
    z = z0 * size.height - 0.022
    lean = (t1 - t0) * size.length / ((z0 - z1) * size.height)
    x = (0.5 - t0) * size.length - 0.034 * lean - 0.008
    x = max(x, 0.004 - 0.5 * size.length)
    return upright(label, x, (-0.16, 0.16), (z - 0.012, z + 0.012), Material.BRAKE_LAMP)


def _bumper(label: int, style: CarStyle, size: _Size, end: float, low: float, high: float) -> Mesh:
    """A rounded bar across the nose (end 1) or the tail (-1), dark below."""
    h = 0.5 * size.length
    rings = []
    for inside, thin in ((0.004, 0.25), (0.05, 0.06), (0.16, 0.0), (0.34, 0.0)):
        x = end * (h - inside)
        wide = _plan(style, size, x) * 1.004
        wide = min(wide, size.half)
        cut = thin * (high - low)
        profile = [(low + cut, 0.97), (low + 0.45 * (high - low), 1.0), (high - cut, 0.985)]
        ring = [(x, wide * w, z) for z, w in profile]
        rings.append(ring + [(x, -b, c) for _, b, c in reversed(ring)])
    others = {(i, j): int(Material.TRIM) for i in range(3) for j in (0, 4, 5)}
    return skin(np.array(rings), label, Material.PAINT, others)


def _mirrors(label: int, style: CarStyle, size: _Size) -> list[Mesh]:
    """A mirror on either side at the foot of the windscreen, as far out as the box."""
    t = style.pillars[0][0] + 0.005
    x = (0.5 - t) * size.length
    deck = _at(style.deck, t) * size.height
    outer = 0.5 * size.width
    inner = min(0.86 * size.half, outer - 0.16)
    parts: list[Mesh] = []
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        rings = []
        for y, deep, tall in (
            (inner, 0.05, 0.03),
            (outer - 0.13, 0.13, 0.11),
            (outer - 0.03, 0.13, 0.12),
            (outer, 0.09, 0.08),
        ):
            z = deck + 0.02
            rings.append(
                [
                    (x, s * y, z),
                    (x + deep, s * y, z + 0.2 * tall),
                    (x + 0.8 * deep, s * y, z + 0.9 * tall),
                    (x, s * y, z + tall),
                ]
            )
        parts.append(
            skin(
                np.array(rings),
                label,
                Material.PAINT,
                {(i, 3): int(Material.GLASS) for i in range(3)},
            )
        )
        lamp = sideways(
            label, s * (outer - 0.001), (x + 0.03, x + 0.085), (deck + 0.045, deck + 0.075), turn
        )
        parts.append(lamp)
    return parts


def _light_bar(label: int, style: CarStyle, size: _Size, top: float) -> Mesh:
    """A bar of lamps on the roof, up to the top of the box in m."""
    t = style.roof[style.screen[0]][0] + 0.06
    x = (0.5 - t) * size.length
    roof = _at(style.roof, t) * size.height
    wide = 0.55 * size.half
    return box((x - 0.14, x + 0.14), (-wide, wide), (roof - 0.06, top), label, Material.TRIM)


def _rails(label: int, style: CarStyle, size: _Size) -> list[Mesh]:
    """Two bars along the roof."""
    first, last = style.roof[style.screen[0]][0] + 0.07, style.roof[style.screen[1]][0] - 0.05
    x = (0.5 - last) * size.length, (0.5 - first) * size.length
    ring = _glass_ring(style, size, 0.5 * (first + last))
    y, z = ring[4][1], ring[4][2]
    return [
        box(x, (s * y - 0.02, s * y + 0.02), (z - 0.03, z + 0.018), label, Material.TRIM)
        for s in (1.0, -1.0)
    ]
