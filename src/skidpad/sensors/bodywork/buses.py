"""Buses within their boxes in m: windows all round, doors on the right."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from skidpad.sensors.bodywork.body import Body, assemble, plate_of, skin, span, upright
from skidpad.sensors.bodywork.wheels import heavy_wheels
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, box, ribbon


@dataclass(frozen=True, slots=True, kw_only=True)
class BusStyle:
    """What one kind of bus looks like; places are shares of its length from the nose."""

    axles: tuple[float, float] = (0.225, 0.715)
    doors: tuple[tuple[float, float], ...] = ((0.03, 0.145), (0.40, 0.515), (0.80, 0.89))
    wheel: float = 0.155
    hull: float = 1.0
    windows: int = 7


CITY_BUS = BusStyle()
COACH = BusStyle(hull=0.84, doors=((0.14, 0.22),), windows=6, axles=(0.20, 0.72), wheel=0.12)


ROOF = 0.945  # height of the hull
SIDE = (  # height and half width of the hull, in shares of its own
    (0.10, 0.97), (0.15, 1.0), (0.26, 1.0), (0.42, 1.0),
    (0.80, 0.985), (0.83, 0.98), (0.91, 0.95), (ROOF, 0.85),
)  # fmt: skip


def make_bus(
    label: int,
    style: BusStyle,
    length: float,
    width: float,
    height: float,
    axles: tuple[float, float] | None = None,
    wheel: float | None = None,
) -> Body:
    """Returns the body of a bus: windows all round, doors on the right, boxes on the roof."""
    h, half = 0.5 * length, 0.5 * width * style.hull
    radius = wheel or style.wheel * height
    places = axles or (h - style.axles[0] * length, h - style.axles[1] * length)
    stations = _bus_stations(style, length, places, radius)
    rings, count = _bus_rings(stations, h, half, height, places, radius)
    others = _bus_materials(style, stations, length, count)
    fixed = [
        skin(rings, label, Material.PAINT, others),
        *_bus_ends(label, h, half, height),
        box(
            (-h + 0.30, h - 0.30),
            (-half + 0.55, half - 0.55),
            (0.09 * height, 2.2 * radius),
            label,
            Material.TRIM,
        ),
        box(
            (-0.35 * h, 0.30 * h),
            (-0.62 * half, 0.62 * half),
            (ROOF * height - 0.01, height),
            label,
            Material.CARGO,
        ),
        *_bus_mirrors(label, h, half, 0.5 * width, height),
    ]
    return assemble(fixed, heavy_wheels(label, places, half, radius, 0.28))


def _bus_rings(
    stations: list[tuple[float, bool]],
    h: float,
    half: float,
    height: float,
    places: tuple[float, ...],
    radius: float,
) -> tuple[Points, int]:
    """Returns the hull's rings (r, k, 3) from nose to tail, and how many points one side of them has.

    h, half: m, half the length of the bus and half the width of the hull; places: x of the axles.
    """
    rows = [(share * height, wide) for share, wide in SIDE]
    low = rows[0][0]
    rings = []
    for x, arched in stations:
        inside = min(h - x, h + x)
        narrow = 1.0 - 0.10 * max(0.0, 1.0 - inside / 0.35) ** 2
        bottom = low
        if arched:
            away = min(min(abs(x - a) for a in places) / (1.13 * radius), 1.0)
            bottom = max(low, radius * (1.0 + 1.13 * np.sqrt(1.0 - away * away)))
        side = [(x, half * wide * narrow, max(z, bottom)) for z, wide in rows]
        lean = (0.16 if x > 0.0 else 0.05) * max(0.0, 1.0 - inside / 0.20)
        side = [(a - np.sign(a) * lean * max(0.0, c / height - 0.4), b, c) for a, b, c in side]
        rings.append(side + [(a, -b, c) for a, b, c in reversed(side)])
    return np.array(rings), len(rows)


def _bus_mirrors(label: int, h: float, half: float, outer: float, height: float) -> list[Mesh]:
    """Mirrors on arms at both sides of the nose, as far out as the box (outer, m)."""
    parts = []
    for s in (1.0, -1.0):
        arm, glass = span(s * (0.80 * half), s * outer), span(s * (outer - 0.16), s * outer)
        z = 0.80 * height
        parts += [
            box((h - 0.16, h - 0.08), arm, (z, 0.815 * height), label, Material.TRIM),
            box((h - 0.18, h - 0.06), glass, (0.66 * height, z), label, Material.TRIM),
        ]
    return parts


def _bus_stations(
    style: BusStyle, length: float, places: tuple[float, ...], radius: float
) -> list[tuple[float, bool]]:
    """x of the rings from front to rear, and whether a ring lies in a wheel's arch."""
    h, arch = 0.5 * length, 1.13 * radius
    at = [h - p for p in (0.012, 0.06, 0.18, 0.35)] + [-h + p for p in (0.012, 0.06, 0.18, 0.35)]
    at += [h - t * length for door in style.doors for t in (*door, 0.5 * (door[0] + door[1]))]
    at += [x - 0.05 for x in at[8:]]
    span = length - 1.2
    for q in range(style.windows + 1):
        x = h - 0.6 - span * q / style.windows
        at += [x, x - 0.09]
    rows = [(x, False) for x in at if all(abs(x - a) > arch + 0.01 for a in places) and abs(x) < h]
    for a in places:
        rows += [(a + arch + 1e-4, False), (a - arch - 1e-4, False)]
        rows += [(a + s * arch, True) for s in (1.0, 0.88, 0.55, 0.0, -0.55, -0.88, -1.0)]
        rows += [(x, True) for x in at if abs(x - a) < arch - 0.02]
    return sorted(rows, reverse=True)


def _bus_materials(
    style: BusStyle, stations: list[tuple[float, bool]], length: float, count: int
) -> dict[tuple[int, int], int]:
    """Windows between pillars, glass doors on the right, a dark underside."""
    others: dict[tuple[int, int], int] = {}
    h, span = 0.5 * length, length - 1.2
    pillars = [h - 0.6 - span * q / style.windows for q in range(style.windows + 1)]
    for i, ((x0, _), (x1, _)) in enumerate(pairwise(stations)):
        x = 0.5 * (x0 + x1)
        left, right = 3, 2 * count - 5
        others[i, 2 * count - 1] = Material.TRIM
        thin = any(p - 0.09 < x < p for p in pillars)
        for j in (left, right):
            if h - x > 0.06 and h + x > 0.06:
                others[i, j] = Material.TRIM if thin else Material.GLASS
        t = 0.5 - x / length
        for first, last in style.doors:
            if first < t < last + 0.05 / length:
                frame = min(abs(x - (h - e * length)) for e in (first, last, 0.5 * (first + last)))
                for j in (2 * count - 4, 2 * count - 3, right):
                    others[i, j] = (
                        Material.TRIM if x0 - x1 < 0.06 and frame < 0.06 else Material.GLASS
                    )
    return others


def _bus_ends(label: int, h: float, half: float, height: float) -> list[Mesh]:
    """Screens, destination signs, lamps and plates at both ends."""
    top = 0.79 * height

    def pane(x: float, lean: float, y: float, z: tuple[float, float], material: int) -> Mesh:
        """A pane that leans as the ends of the body do."""
        side = -1.0 if x > 0.0 else 1.0
        levels = sorted({*z, min(max(0.42 * height, z[0]), z[1])})
        left = np.array(
            [(x + side * lean * max(0.0, c / height - 0.4), y, c) for c in levels], dtype=np.float64
        )
        return ribbon(left, left * (1.0, -1.0, 1.0), label, material)

    parts = [
        pane(h - 0.004, 0.15, 0.84 * half, (0.30 * height, top), Material.GLASS),
        pane(h - 0.004, 0.15, 0.70 * half, (0.82 * height, 0.90 * height), Material.LAMP_DARK),
        pane(h - 0.002, 0.15, 0.50 * half, (0.838 * height, 0.882 * height), Material.MARKING),
        pane(-h + 0.004, 0.05, 0.72 * half, (0.48 * height, 0.78 * height), Material.GLASS),
        plate_of(label, h, 0.135 * height),
        plate_of(label, -h + 0.003, 0.30 * height),
        upright(
            label,
            -h + 0.006,
            (-0.55 * half, 0.55 * half),
            (0.17 * height, 0.27 * height),
            Material.TRIM,
        ),
    ]
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        low = 0.185 * height
        parts.append(
            upright(
                label,
                h - 0.003,
                (s * 0.52 * half, s * 0.80 * half),
                (low, low + 0.20),
                Material.LAMP_GLASS,
            )
        )
        parts.append(
            upright(label, h - 0.003, (s * 0.80 * half, s * 0.88 * half), (low, low + 0.20), turn)
        )
        for q, material in enumerate((Material.TAIL_LAMP, turn)):
            z = 0.20 * height + 0.34 * q
            parts.append(
                upright(label, -h, (s * 0.70 * half, s * 0.86 * half), (z, z + 0.30), material)
            )
    parts.append(
        upright(label, -h, (-0.25, 0.25), (0.90 * height, 0.92 * height), Material.BRAKE_LAMP)
    )
    return parts
