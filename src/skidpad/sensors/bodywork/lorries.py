"""Lorries within their boxes in m: cab, cargo, guards and wheels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidpad.sensors.bodywork.body import Body, assemble, plate_of, sideways, skin, span, upright
from skidpad.sensors.bodywork.wheels import heavy_wheels
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, box, merge

LAMP = 0.16  # m


@dataclass(frozen=True, slots=True, kw_only=True)
class LorryStyle:
    """What one kind of lorry looks like; places are shares of its length from the nose."""

    cab: float = 0.25  # its rear wall
    cab_height: float = 0.84
    axles: tuple[float, ...] = (0.16, 0.72)
    wheel: float = 0.135  # radius, of the height
    hull: float = 1.0  # width of the cargo, of the box
    cargo: int = Material.CARGO
    shutters: int = 0  # on either side
    light_bar: bool = False


BOX_LORRY = LorryStyle()
HEAVY_LORRY = LorryStyle(axles=(0.15, 0.68, 0.84), hull=0.90, cab=0.29)
FIRE_ENGINE = LorryStyle(
    axles=(0.17, 0.74),
    hull=0.88,
    cab=0.34,
    cab_height=0.80,
    cargo=Material.PAINT,
    shutters=4,
    light_bar=True,
)
DRINKS_LORRY = LorryStyle(
    axles=(0.2, 0.76),
    hull=0.84,
    cab=0.36,
    cab_height=0.80,
    cargo=Material.PAINT,
    shutters=4,
    wheel=0.16,
)


def make_lorry(
    label: int,
    style: LorryStyle,
    length: float,
    width: float,
    height: float,
    axles: tuple[float, float] | None = None,
    wheel: float | None = None,
) -> Body:
    """Returns the body of a lorry with cab and cargo. axles, wheel: x and radius where known."""
    h, half = 0.5 * length, 0.5 * width * style.hull
    radius = wheel or style.wheel * height
    places = axles or tuple(h - a * length for a in style.axles)
    back = h - style.cab * length
    floor = 2.0 * radius + 0.12
    parts = [
        _cab(label, (back, h), 0.97 * half, (0.62 * radius, style.cab_height * height)),
        *_cargo(label, style, (-h + 0.02, back - 0.16), half, (floor, height)),
        box((-h + 0.10, back + 0.2), (-0.42, 0.42), (radius, floor), label, Material.TRIM),
        box((-h + 0.02, -h + 0.12), (-0.9 * half, 0.9 * half), (0.45, 0.60), label, Material.STEEL),
        *_tail(label, -h, half, floor),
        *_cab_mirrors(label, (back, h), width, half, style.cab_height * height),
    ]
    for s in (1.0, -1.0):
        parts += _between(label, s * (half - 0.06), places, radius, floor, back)
    if style.light_bar:
        top = style.cab_height * height
        parts.append(
            box(
                (back + 0.5, back + 0.8),
                (-0.7 * half, 0.7 * half),
                (top, top + 0.2),
                label,
                Material.TRIM,
            )
        )
    return assemble(parts, heavy_wheels(label, places, half, radius, 0.30))


def _cab(label: int, x: tuple[float, float], half: float, z: tuple[float, float]) -> Mesh:
    """The cab: upright, its screen a little raked, its edges rounded; glass, doors and grille."""
    (back, front), (low, top) = x, z
    tall, front = top - low, front - 0.012
    rows = (  # height, how far back its front is, share of the width
        (0.0, 0.05, 0.94),
        (0.10, 0.0, 0.98),
        (0.30, 0.0, 1.0),
        (0.46, 0.02, 1.0),
        (0.50, 0.03, 1.0),
        (0.84, 0.13, 0.985),
        (0.90, 0.17, 0.97),
        (0.97, 0.26, 0.93),
        (1.0, 0.40, 0.86),
    )
    rings = []
    for share, inset, wide in rows:
        zz, y, f = low + share * tall, half * wide, front - inset
        corner = 0.12
        rings.append(
            [
                (back, y, zz),
                (back + 0.45, y, zz),
                (back + 0.49, y, zz),
                (f - 0.55, y, zz),
                (f - corner, y, zz),
                (f, y - corner, zz),
                (f, -y + corner, zz),
                (f - corner, -y, zz),
                (f - 0.55, -y, zz),
                (back + 0.49, -y, zz),
                (back + 0.45, -y, zz),
                (back, -y, zz),
            ]
        )
    others: dict[tuple[int, int], int] = {(4, 5): Material.GLASS}
    for j in (2, 3, 7, 8):
        others[4, j] = Material.GLASS
    for i in range(5):
        for j in (1, 9):
            others[i, j] = Material.TRIM  # the door's gap
    for j in (4, 5, 6):
        others[0, j] = Material.TRIM
    others[2, 5] = Material.TRIM  # grille
    for j in (4, 6):
        others[1, j] = Material.LAMP_GLASS
    others[1, 3] = Material.INDICATOR_LEFT
    others[1, 7] = Material.INDICATOR_RIGHT
    mesh = skin(np.array(rings), label, Material.PAINT, others)
    plate = plate_of(label, front + 0.012, low + 0.12 * tall)
    lamps = [
        upright(
            label,
            front + 0.006,
            (s * 0.50 * half, s * 0.86 * half),
            (low + 0.13 * tall, low + 0.13 * tall + LAMP),
            Material.LAMP_GLASS,
        )
        for s in (1.0, -1.0)
    ]
    return merge([mesh, plate, *lamps])


def _cargo(
    label: int, style: LorryStyle, place: tuple[float, float], half: float, z: tuple[float, float]
) -> list[Mesh]:
    """The box of the cargo with its frame, doors at the rear, shutters on the sides."""
    (back, front), (low, top) = place, z
    edge, out = 0.07, 0.006
    inner, rims = half - out, ((low, low + edge), (top - edge, top))
    parts = [box((back, front), (-inner, inner), (low, top), label, style.cargo)]
    for s in (1.0, -1.0):
        y = s * half
        step = (front - back - 0.4) / max(style.shutters, 1)
        doors = [back + 0.2 + q * step for q in range(style.shutters)]
        panels = [((back, front), z) for z in rims]
        panels += [((a + 0.05, a + step - 0.05), (low + 0.12, top - 0.45)) for a in doors]
        parts += [sideways(label, y, x, z, Material.STEEL) for x, z in panels]
    bars = [(y, (low, top)) for y in ((-half, -half + edge), (half - edge, half), (-0.02, 0.02))]
    bars += [((-half, half), z) for z in rims]
    parts += [upright(label, back - out, y, z, Material.STEEL) for y, z in bars]
    locks = [(y - 0.015, y + 0.015) for y in (-0.25, 0.25)]
    return parts + [upright(label, back - 2.0 * out, y, (low, top), Material.TRIM) for y in locks]


def _tail(label: int, x: float, half: float, floor: float) -> list[Mesh]:
    """Lamps and plate under the cargo, and a board that carries them."""
    low, high = floor - 0.30, floor - 0.06
    parts = [
        box(
            (x + 0.02, x + 0.06),
            (-0.96 * half, 0.96 * half),
            (low - 0.04, high + 0.04),
            label,
            Material.TRIM,
        ),
        plate_of(label, x + 0.006, low + 0.05),
    ]
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        outer, cut, inner = (s * share * half for share in (0.93, 0.82, 0.64))
        parts.append(upright(label, x, (cut, outer), (low, high), turn))
        parts.append(upright(label, x, (inner, cut), (low, high), Material.TAIL_LAMP))
    return parts


def _between(
    label: int, y: float, places: tuple[float, ...], radius: float, floor: float, back: float
) -> list[Mesh]:
    """Side guard between the axles, and guards over the rear wheels."""
    front, rear = max(places), max(p for p in places if p != max(places))
    x = (rear + radius + 0.25, min(front - radius - 0.25, back))
    parts = []
    if x[1] - x[0] > 0.6:
        parts += [sideways(label, y, x, (z, z + 0.12), Material.STEEL) for z in (0.45, 0.75)]
        side = 1.0 if y > 0.0 else -1.0
        parts.append(
            box(
                (x[0] + 0.2, x[0] + 1.1),
                span(y - side * 0.5, y - side * 0.03),
                (0.5, floor - 0.1),
                label,
                Material.TRIM,
            )
        )
    inside = y + (0.05 if y > 0.0 else -0.05)
    guards = [(p - 1.06 * radius, p + 1.06 * radius) for p in places if p != front]
    height = (2.03 * radius, 2.03 * radius + 0.05)
    parts += [sideways(label, inside, guard, height, Material.TRIM) for guard in guards]
    return parts


def _cab_mirrors(
    label: int, x: tuple[float, float], width: float, half: float, top: float
) -> list[Mesh]:
    """Returns the two upright mirrors beside a lorry's windscreen, within the width of the box.

    x: rear and front of the cab; width: of the box; half: half the width of the hull; top: height of
    the cab; all in m.
    """
    place = x[1] - 0.32
    outer = 0.5 * width
    inner = min(outer - 0.14, half - 0.02) if outer - half > 0.05 else outer - 0.05
    z = 0.60 * top, 0.60 * top + 0.5
    return [
        box((place, place + 0.08), span(s * inner, s * outer), z, label, Material.TRIM)
        for s in (1.0, -1.0)
    ]
