"""Meshes of what moves: road vehicles, riders, pedestrians and props, scaled to their boxes.

Body frame: x forward, y left, z up, origin at the centre of the footprint at road height. A mesh
fills its box exactly, so that pixels, boxes and contacts agree. Vans count as cars in semantic
images, as the published stack looks for car, truck and bus only (A-034).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind, SemanticClass
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import (
    Mesh,
    Points,
    box,
    cylinder_y,
    disc,
    hexahedron,
    loft,
    merge,
    patches,
)

WHEEL_SIDES = 10


def body_mesh(kind: ActorKind, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of one actor, in metres in its own frame; it fills its box."""
    shapes = {
        ActorKind.CAR: _car,
        ActorKind.VAN: _van,
        ActorKind.TRUCK: _truck,
        ActorKind.BUS: _bus,
        ActorKind.MOTORCYCLE: _two_wheeler,
        ActorKind.BICYCLE: _two_wheeler,
        ActorKind.PEDESTRIAN: _pedestrian,
        ActorKind.PROP: _prop,
    }
    return shapes[kind](int(LABEL_OF_KIND[kind]), length, width, height)


def _hull(label: int, stations: Sequence[tuple[float, float, float, float]], half: float) -> Mesh:
    """Returns a painted lower body: stations (x, half-width share, z low, z high), edges rounded.

    half: m, half of the width.
    """
    rings = []
    for x, share, low, high in stations:
        y, rise = half * share, high - low
        side = [
            (0.88 * y, low),
            (y, low + 0.25 * rise),
            (y, low + 0.72 * rise),
            (0.90 * y, high),
        ]
        rings.append([(x, b, c) for b, c in side] + [(x, -b, c) for b, c in reversed(side)])
    return loft(np.array(rings), label, Material.PAINT)


def _cabin(
    label: int,
    bottom: tuple[float, float, float],
    top: tuple[float, float, float],
    half: tuple[float, float],
    pillars: Sequence[float] = (0.0, 0.52, 1.0),
) -> Mesh:
    """Returns a glasshouse with a painted roof and pillars.

    bottom, top: x rear, x front and z of sill and roof; half: their half-widths, all in m. pillars:
    where along the side, as shares from rear to front.
    """
    (xr, xf, z0), (tr, tf, z1) = bottom, top
    corners = np.array(
        [
            (x, s * y, z)
            for x_low, x_high in ((xr, tr), (xf, tf))
            for s in (-1, 1)
            for x, y, z in ((x_low, half[0], z0), (x_high, half[1], z1))
        ]
    )
    shell = hexahedron(corners, label, Material.GLASS)
    shell.material[6:8] = Material.PAINT  # lower face, never seen
    roof = np.array([[tr, -half[1], z1], [tf, -half[1], z1], [tf, half[1], z1], [tr, half[1], z1]])
    faces = [Mesh.of(roof, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), label, Material.PAINT)]
    keep = np.ones(12, dtype=bool)
    keep[[10, 11]] = False  # the glass face under the painted roof
    shell = Mesh(shell.vertices, shell.triangles[keep], shell.label[keep], shell.material[keep])
    wide, gap = 0.045, 0.006
    for share in pillars:
        a, b = max(0.0, share - wide), min(1.0, share + wide)
        for s in (-1.0, 1.0):
            low = [(xr + q * (xf - xr), s * (half[0] + gap), z0) for q in (a, b)]
            high = [(tr + q * (tf - tr), s * (half[1] + gap), z1) for q in (b, a)]
            faces.append(
                Mesh.of(
                    np.array(low + high),
                    np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
                    label,
                    Material.PAINT,
                )
            )
    return merge([shell, *faces])


def _wheels(label: int, axles: Sequence[float], half: float, radius: float, breadth: float) -> Mesh:
    """Returns the mesh of a pair of wheels and their rims at each axle's x in m."""
    parts = []
    for x in axles:
        for s in (-1.0, 1.0):
            y = s * (half - breadth / 2)
            parts.append(
                cylinder_y((x, y, radius), radius, breadth, WHEEL_SIDES, label, Material.TYRE)
            )
            face = (x, s * (half + 0.004), radius)
            parts.append(disc(face, 1, 0.62 * radius, 8, label, Material.RIM))
    return merge(parts)


def _plate(
    label: int, x: float, y: tuple[float, float], z: tuple[float, float], material: Material
) -> Mesh:
    """Returns an upright rectangle that looks along x; y, z: limits in m."""
    left = np.array([[x, y[0], z[0]], [x, y[0], z[1]]])
    right = np.array([[x, y[1], z[0]], [x, y[1], z[1]]])
    return patches(left, right, np.array([[0, 1]]), label, material)


def _lamps(label: int, length: float, width: float, z: float, size: tuple[float, float]) -> Mesh:
    """Returns head lamps, tail lamps and number plates; the outermost faces of the mesh in x.

    z: m, lower edge of the head lamps; size: width and height of a lamp.
    """
    front, rear = length / 2, -length / 2
    inner, outer = 0.40 * width - size[0], 0.40 * width
    parts = []
    for s in (-1.0, 1.0):
        y = (s * inner, s * outer)
        parts.append(_plate(label, front, y, (z, z + size[1]), Material.HEADLAMP))
        parts.append(_plate(label, rear, y, (z + 0.05, z + 0.05 + size[1]), Material.TAIL_LAMP))
    number = ((-0.26, 0.26), (0.62 * z, 0.62 * z + 0.11))
    return merge([*parts, *(_plate(label, x, *number, Material.PLATE) for x in (front, rear))])


def _car(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a car within its box in m, with cabin, wheels, lamps and a rear plate."""
    h, half = length / 2, width / 2
    e = 0.004  # the lamps stand this far out of the hull, and fill the box
    low, waist = 0.13 * height, 0.58 * height
    hull = _hull(
        label,
        [
            (-h + e, 0.84, 0.24 * height, 0.54 * height),
            (-0.92 * h, 0.97, low, 0.61 * height),
            (-0.55 * h, 1.0, low, 0.62 * height),
            (0.25 * h, 1.0, low, waist),
            (0.60 * h, 0.99, low, 0.56 * height),
            (0.90 * h, 0.95, low, 0.49 * height),
            (h - e, 0.80, 0.2 * height, 0.42 * height),
        ],
        half,
    )
    cabin = _cabin(
        label,
        (-0.88 * h, 0.46 * h, 0.57 * height),
        (-0.62 * h, 0.08 * h, height),
        (0.90 * half, 0.70 * half),
    )
    wheel = 0.215 * height
    parts = [
        hull,
        cabin,
        _wheels(label, (-0.62 * h, 0.63 * h), half, wheel, 0.22),
        _lamps(label, length, width, 0.36 * height, (0.30, 0.12)),
        box(
            (-0.98 * h, 0.98 * h),
            (-0.8 * half, 0.8 * half),
            (0.1 * height, low),
            label,
            Material.TRIM,
        ),
        _plate(label, -0.90 * h, (-0.2, 0.2), (0.565 * height, 0.60 * height), Material.TAIL_LAMP),
    ]
    return merge(parts)


def _van(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a van within its box in m."""
    h, half = length / 2, width / 2
    e = 0.004
    hull = _hull(
        label,
        [
            (-h + e, 0.98, 0.16 * height, height),
            (0.45 * h, 1.0, 0.12 * height, height),
            (0.52 * h, 1.0, 0.12 * height, 0.98 * height),
            (0.80 * h, 0.98, 0.12 * height, 0.55 * height),
            (h - e, 0.88, 0.16 * height, 0.45 * height),
        ],
        half,
    )
    glass = [
        _plate(
            label,
            -h + 0.5 * e,
            (-0.6 * half, 0.6 * half),
            (0.6 * height, 0.88 * height),
            Material.GLASS,
        ),
        _windscreen(label, (0.56 * h, 0.93 * height), (0.79 * h, 0.585 * height), 0.74 * half),
        *_side_windows(label, (0.42 * h, 0.60 * h), (0.60 * height, 0.80 * height), half),
    ]
    return merge(
        [
            hull,
            *glass,
            _wheels(label, (-0.60 * h, 0.66 * h), half, 0.145 * height, 0.24),
            _lamps(label, length, width, 0.27 * height, (0.28, 0.16)),
        ]
    )


def _windscreen(
    label: int, top: tuple[float, float], bottom: tuple[float, float], half: float
) -> Mesh:
    """Returns a sloped pane from (x, z) to (x, z) and `half` m to either side, 2 cm in front of the body."""
    left = np.array([[top[0] + 0.02, half, top[1]], [bottom[0] + 0.02, half, bottom[1] + 0.01]])
    return patches(left, left * (1, -1, 1), np.array([[0, 1]]), label, Material.GLASS)


def _side_windows(
    label: int, x: tuple[float, float], z: tuple[float, float], half: float
) -> list[Mesh]:
    """Returns one pane on either side, `half` m from the middle; x, z: limits in m."""
    panes = []
    for s in (-1.0, 1.0):
        left: Points = np.array([[x[0], s * half, z[0]], [x[1], s * half, z[0]]])
        panes.append(
            patches(
                left, np.add(left, (0, 0, z[1] - z[0])), np.array([[0, 1]]), label, Material.GLASS
            )
        )
    return panes


def _truck(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a truck with cab and cargo box, within its box in m."""
    h, half = length / 2, width / 2
    cab = h - min(2.2, 0.35 * length)
    floor, wheel = 0.30 * height, min(0.5, 0.14 * height)
    parts = [
        box((-h + 0.01, cab - 0.35), (-half, half), (floor, height), label, Material.CARGO),
        box(
            (cab, h - 0.01),
            (-0.97 * half, 0.97 * half),
            (0.16 * height, 0.86 * height),
            label,
            Material.PAINT,
        ),
        box(
            (-h + 0.3, h - 0.3),
            (-0.45 * half, 0.45 * half),
            (0.15 * height, floor),
            label,
            Material.TRIM,
        ),
        _plate(
            label,
            h - 0.005,
            (-0.85 * half, 0.85 * half),
            (0.52 * height, 0.80 * height),
            Material.GLASS,
        ),
        *_side_windows(label, (cab + 0.5, h - 0.2), (0.54 * height, 0.76 * height), 0.98 * half),
        _wheels(label, (-0.72 * h, -0.55 * h, 0.5 * (cab + h)), half, wheel, 0.3),
        _lamps(label, length, width, 0.20 * height, (0.30, 0.16)),
    ]
    return merge(parts)


def _bus(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a bus within its box in m."""
    h, half = length / 2, width / 2
    parts = [
        box(
            (-h + 0.01, h - 0.01),
            (-half + 0.01, half - 0.01),
            (0.11 * height, height),
            label,
            Material.PAINT,
        ),
        _plate(
            label,
            h - 0.005,
            (-0.9 * half, 0.9 * half),
            (0.38 * height, 0.86 * height),
            Material.GLASS,
        ),
        _plate(
            label,
            -h + 0.005,
            (-0.8 * half, 0.8 * half),
            (0.5 * height, 0.84 * height),
            Material.GLASS,
        ),
        *_side_windows(label, (-0.95 * h, 0.93 * h), (0.42 * height, 0.82 * height), half - 0.005),
        _wheels(label, (-0.5 * h, 0.62 * h), half - 0.004, 0.16 * height, 0.3),
        _lamps(label, length, width, 0.19 * height, (0.34, 0.18)),
    ]
    return merge(parts)


def _rider(half: float, seat: float, height: float) -> Mesh:
    """Returns the mesh of a rider from the seat up to `height` in m, `half` in m to either side."""
    label = int(SemanticClass.RIDER)
    shoulder = height - 0.30
    return merge(
        [
            box((-0.28, 0.12), (-half, half), (seat, shoulder), label, Material.CLOTH),
            box((-0.12, 0.12), (-0.11, 0.11), (shoulder, height), label, Material.TRIM),
            box(
                (-0.1, 0.3), (-0.8 * half, 0.8 * half), (0.5 * seat, seat), label, Material.TROUSERS
            ),
        ]
    )


def _two_wheeler(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a motorcycle or bicycle with its rider, within its box in m."""
    h = length / 2
    wheel = min(0.34, 0.4 * h)
    motorcycle = label == SemanticClass.MOTORCYCLE
    breadth = 0.16 if motorcycle else 0.05
    body = (0.16, 0.45, 0.9) if motorcycle else (0.03, 0.45, 0.62)
    parts = [
        cylinder_y((s * (h - wheel), 0.0, wheel), wheel, breadth, WHEEL_SIDES, label, Material.TYRE)
        for s in (-1.0, 1.0)
    ]
    parts += [
        box((-0.55 * h, 0.5 * h), (-body[0], body[0]), (body[1], body[2]), label, Material.PAINT),
        box((0.35 * h, 0.42 * h), (-width / 2, width / 2), (0.95, 1.0), label, Material.TRIM),
        _plate(label, -h + 0.02, (-0.06, 0.06), (0.62, 0.74), Material.TAIL_LAMP),
        _plate(label, h - wheel, (-0.08, 0.08), (0.8, 0.92), Material.HEADLAMP),
        _rider(0.40 * width, 0.8, height),
    ]
    return merge(parts)


def _pedestrian(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a standing pedestrian within its box in m."""
    a, b = length / 2, width / 2
    hip, neck = 0.48 * height, 0.83 * height
    return merge(
        [
            box((-0.5 * a, 0.5 * a), (0.05 * b, 0.6 * b), (0.0, hip), label, Material.TROUSERS),
            box((-0.5 * a, 0.5 * a), (-0.6 * b, -0.05 * b), (0.0, hip), label, Material.TROUSERS),
            box((-0.7 * a, 0.7 * a), (-0.7 * b, 0.7 * b), (hip, neck), label, Material.CLOTH),
            box((-a, a), (0.72 * b, b), (0.45 * height, 0.8 * height), label, Material.CLOTH),
            box((-a, a), (-b, -0.72 * b), (0.45 * height, 0.8 * height), label, Material.CLOTH),
            box((-0.1, 0.1), (-0.09, 0.09), (0.85 * height, height), label, Material.SKIN),
            box((-0.05, 0.05), (-0.05, 0.05), (neck, 0.85 * height), label, Material.SKIN),
        ]
    )


def _prop(label: int, length: float, width: float, height: float) -> Mesh:
    """Returns the mesh of a plain box in m, standing on the ground."""
    half = (length / 2, width / 2)
    return box((-half[0], half[0]), (-half[1], half[1]), (0.0, height), label, Material.PAINT)
