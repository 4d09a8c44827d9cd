"""What is mounted on a car's body: bumpers, grille, lamps, plates, mirrors, light bar and rails."""

from __future__ import annotations

import numpy as np

from skidpad.sensors.bodywork.body import plate_of, sideways, skin, upright
from skidpad.sensors.bodywork.car_shape import (
    CarSize,
    CarStyle,
    curve_at,
    half_width_at,
    make_glass_ring,
)
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, box


def make_ends(label: int, style: CarStyle, size: CarSize) -> list[Mesh]:
    """Returns bumpers, grille, plates and lamps on the tail; the outermost faces in x."""
    h, half, tall = 0.5 * size.length, size.half, size.height
    nose = curve_at(style.deck, 0.0) * tall
    deck = curve_at(style.deck, 1.0) * tall
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
    wide = half_width_at(style, size, -h + 0.05)
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        cut = z0 + 0.30 * (z1 - z0)
        inner, outer = 0.60 * wide * s, 0.955 * wide * s
        parts.append(upright(label, x, (inner, outer), (cut, z1), Material.TAIL_LAMP))
        parts.append(upright(label, x, (inner, outer), (z0, cut), turn))
    if style.rear_window:
        parts.append(_brake_lamp(label, style, size))
    return parts


def _brake_lamp(label: int, style: CarStyle, size: CarSize) -> Mesh:
    """The middle brake lamp, at the upper edge of the rear window."""
    (t0, z0), (t1, z1) = style.roof[style.screen[1]], style.roof[-1]
    z = z0 * size.height - 0.022
    lean = (t1 - t0) * size.length / ((z0 - z1) * size.height)
    x = (0.5 - t0) * size.length - 0.034 * lean - 0.008
    x = max(x, 0.004 - 0.5 * size.length)
    return upright(label, x, (-0.16, 0.16), (z - 0.012, z + 0.012), Material.BRAKE_LAMP)


def _bumper(
    label: int, style: CarStyle, size: CarSize, end: float, low: float, high: float
) -> Mesh:
    """A rounded bar across the nose (end 1) or the tail (-1), dark below."""
    h = 0.5 * size.length
    rings = []
    for inside, thin in ((0.004, 0.25), (0.05, 0.06), (0.16, 0.0), (0.34, 0.0)):
        x = end * (h - inside)
        wide = half_width_at(style, size, x) * 1.004
        wide = min(wide, size.half)
        cut = thin * (high - low)
        profile = [(low + cut, 0.97), (low + 0.45 * (high - low), 1.0), (high - cut, 0.985)]
        ring = [(x, wide * w, z) for z, w in profile]
        rings.append(ring + [(x, -b, c) for _, b, c in reversed(ring)])
    others = {(i, j): int(Material.TRIM) for i in range(3) for j in (0, 4, 5)}
    return skin(np.array(rings), label, Material.PAINT, others)


def make_mirrors(label: int, style: CarStyle, size: CarSize) -> list[Mesh]:
    """Returns a mirror on either side at the foot of the windscreen, as far out as the box."""
    t = style.pillars[0][0] + 0.005
    x = (0.5 - t) * size.length
    deck = curve_at(style.deck, t) * size.height
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


def make_light_bar(label: int, style: CarStyle, size: CarSize, top: float) -> Mesh:
    """Returns a bar of lamps on the roof, up to the top of the box in m."""
    t = style.roof[style.screen[0]][0] + 0.06
    x = (0.5 - t) * size.length
    roof = curve_at(style.roof, t) * size.height
    wide = 0.55 * size.half
    return box((x - 0.14, x + 0.14), (-wide, wide), (roof - 0.06, top), label, Material.TRIM)


def make_rails(label: int, style: CarStyle, size: CarSize) -> list[Mesh]:
    """Returns two bars along the roof."""
    first, last = style.roof[style.screen[0]][0] + 0.07, style.roof[style.screen[1]][0] - 0.05
    x = (0.5 - last) * size.length, (0.5 - first) * size.length
    ring = make_glass_ring(style, size, 0.5 * (first + last))
    y, z = ring[4][1], ring[4][2]
    return [
        box(x, (s * y - 0.02, s * y + 0.02), (z - 0.03, z + 0.018), label, Material.TRIM)
        for s in (1.0, -1.0)
    ]
