"""Motorcycles and bicycles with their riders, within their boxes in m."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.bodywork.body import (
    Body,
    Part,
    Point,
    assemble,
    ball,
    plate_of,
    span,
    tube,
    upright,
)
from skidpad.sensors.bodywork.wheels import spoked_wheel
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, box, merge

Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoWheelerStyle:
    """What one kind of two-wheeler looks like."""

    motor: bool = True
    lean: float = 0.30  # rad by which the rider leans ahead
    wheel: float = 0.31  # radius, m, at most
    breadth: float = 0.14  # of the tyres, m
    seat: float = 0.47  # share of the height of bicycle and rider
    fairing: bool = False
    shield: bool = False  # before the legs, as a scooter has
    cases: bool = False
    low_bars: bool = False
    skirt: bool = False
    tank: float = 0.60


TWO_WHEELERS = {
    "sports motorcycle": TwoWheelerStyle(lean=0.62, fairing=True, low_bars=True, seat=0.50),
    "cruiser": TwoWheelerStyle(lean=-0.02, seat=0.42, cases=True, breadth=0.16, wheel=0.34),
    "scooter": TwoWheelerStyle(lean=0.05, seat=0.46, shield=True, wheel=0.24, breadth=0.11),
    "trekking bicycle": TwoWheelerStyle(
        motor=False, lean=0.42, seat=0.52, wheel=0.35, breadth=0.05
    ),
    "racing bicycle": TwoWheelerStyle(
        motor=False, lean=0.80, seat=0.54, wheel=0.34, breadth=0.03, low_bars=True
    ),
    "city bicycle": TwoWheelerStyle(
        motor=False, lean=0.08, seat=0.50, wheel=0.36, breadth=0.05, skirt=True
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Frame:
    """The points in m that all parts of a two-wheeler hang on, and the shapes they are made of."""

    label: int
    style: TwoWheelerStyle
    front: Point  # hub of the front wheel
    rear: Point
    seat: Point
    bars: Point  # middle of the handlebar
    radius: float  # of the wheels
    width: float  # of the handlebar

    def bar(
        self, a: Point, b: Point, radii: tuple[float, float], material: int, sides: int = 6
    ) -> Mesh:
        """Returns a round bar from a to b."""
        return tube((a, b), radii, self.label, material, sides)

    def block(self, x: Span, y: Span, z: Span, material: int) -> Mesh:
        """Returns a block between two x, two y and two z."""
        return box(x, y, z, self.label, material)

    def lump(self, centre: Point, radii: Point, material: int, sides: int = 8) -> Mesh:
        """Returns an ellipsoid about a centre."""
        return ball(centre, radii, self.label, material, sides)

    def pane(self, x: float, y: Span, z: Span, material: int) -> Mesh:
        """Returns an upright rectangle that looks along x."""
        return upright(self.label, x, y, z, material)

    def handlebar(self) -> Mesh:
        """Returns the handlebar, as wide as the box."""
        x, _, z = self.bars
        half = 0.5 * self.width
        return self.block((x - 0.02, x + 0.02), (-half, half), (z - 0.02, z + 0.02), Material.TRIM)


def make_two_wheeler(
    label: int, style: TwoWheelerStyle, length: float, width: float, height: float
) -> Body:
    """Returns the body of a two-wheeler with its rider."""
    h = 0.5 * length
    radius = min(style.wheel, 0.235 * length, 0.24 * height)
    front, rear = (h - radius, 0.0, radius), (-h + radius, 0.0, radius)
    wheels = [
        spoked_wheel(label, hub, radius, style.breadth, hub is front) for hub in (front, rear)
    ]
    seat = (-0.10 * length, 0.0, style.seat * height)
    high = (0.60 if style.motor else 0.585) * height - (0.04 * height if style.low_bars else 0.0)
    bars = (0.5 * h if style.motor else 0.44 * h, 0.0, high)
    frame = _Frame(
        label=label, style=style, front=front, rear=rear, seat=seat, bars=bars, radius=radius,
        width=width,
    )  # fmt: skip
    parts = _motorcycle(frame) if style.motor else _bicycle(frame)
    pedals = (0.02 * length, 0.0, 0.55 * radius if style.motor else 0.78 * radius)
    rider = _rider(style, seat, bars, pedals, width, height)
    return assemble([*parts, rider], _choose_steered(wheels))


def _choose_steered(wheels: list[Part]) -> list[Part]:
    """Returns copies of all the wheels, of which the foremost alone is `steered`."""
    front = max(w.hub[0] for w in wheels)
    return [w._replace(steered=w.hub[0] == front) for w in wheels]


def _bicycle(f: _Frame) -> list[Mesh]:
    """Frame, fork, handlebar, saddle, crank and lamps."""
    crank = (0.5 * (f.front[0] + f.rear[0]) - 0.08, 0.0, 0.82 * f.radius)
    head = (f.bars[0] + 0.03, 0.0, f.bars[2] - 0.10)
    low = (head[0] + 0.05, 0.0, head[2] - 0.16)
    parts = _bicycle_tubes(f, crank, head, low)
    for s in (1.0, -1.0):
        parts += _bicycle_side(f, s, crank, low)
    parts += [
        f.bar(low, f.bars, (0.018, 0.018), Material.PAINT, 5),
        f.handlebar(),
        *_saddle_and_lamps(f),
    ]
    if f.style.skirt:
        parts += _mudguards(f, low)
    return parts


def _bicycle_tubes(f: _Frame, crank: Point, head: Point, low: Point) -> list[Mesh]:
    """The tubes between crank, saddle, rear wheel and head; one for a skirt has no upper one."""
    saddle = (f.seat[0], 0.0, f.seat[2] - 0.02)
    pairs = [(crank, saddle), (crank, low), (f.rear, crank)]
    pairs += [(f.rear, (saddle[0] + 0.04, 0.0, saddle[2] - 0.22))]
    pairs += [] if f.style.skirt else [(head, (saddle[0] + 0.02, 0.0, saddle[2] - 0.12))]
    return [f.bar(a, b, (0.020, 0.020), Material.PAINT, 5) for a, b in pairs]


def _bicycle_side(f: _Frame, s: float, crank: Point, low: Point) -> list[Mesh]:
    """Fork blade, crank and pedal of the left (s = 1) or right (-1) side."""
    foot = (crank[0] + 0.12 * s, 0.10 * s, crank[2] - 0.11 * s)
    blade = (f.front[0], 0.05 * s, f.front[2]), (low[0], 0.02 * s, low[2])
    return [
        f.bar(*blade, (0.012, 0.016), Material.PAINT, 4),
        f.bar((crank[0], 0.06 * s, crank[2]), foot, (0.012, 0.012), Material.STEEL, 4),
        f.block(
            (foot[0] - 0.05, foot[0] + 0.05),
            span(foot[1], foot[1] + 0.08 * s),
            (foot[2] - 0.015, foot[2] + 0.015),
            Material.TRIM,
        ),
    ]


def _saddle_and_lamps(f: _Frame) -> list[Mesh]:
    """Saddle, head lamp and tail lamp of a bicycle."""
    (x, _, z), (front, _, high), tall = f.seat, f.bars, 2.0 * f.radius
    return [
        f.block((x - 0.14, x + 0.12), (-0.07, 0.07), (z - 0.06, z - 0.01), Material.TRIM),
        f.pane(front + 0.09, (-0.04, 0.04), (high - 0.14, high - 0.06), Material.LAMP_GLASS),
        f.pane(
            f.rear[0] - 0.5 * f.radius, (-0.035, 0.035), (tall, tall + 0.06), Material.TAIL_LAMP
        ),
    ]


def _mudguards(f: _Frame, low: Point) -> list[Mesh]:
    """A rack, and the stay of a mudguard."""
    x, tall = f.rear[0], 2.0 * f.radius
    rack = (x - 0.6 * f.radius, x + 0.5 * f.radius)
    return [
        f.block(rack, (-0.07, 0.07), (tall + 0.06, tall + 0.08), Material.TRIM),
        f.bar(f.front, (low[0], 0.0, low[2]), (0.012, 0.012), Material.TRIM, 4),
    ]


def _motorcycle(f: _Frame) -> list[Mesh]:
    """Engine, tank, seat, fork, mudguards, exhaust, lamps, plate and what the style adds."""
    top = f.seat[2] - 0.03
    head = (f.bars[0] + 0.10, 0.0, f.bars[2] - 0.06)
    x, r = f.front[0], f.radius
    parts = [
        *_engine_and_seat(f, top),
        f.block(
            (x - 0.8 * r, x + 0.6 * r), (-0.07, 0.07), (2.03 * r, 2.03 * r + 0.03), Material.PAINT
        ),
        f.handlebar(),
        *_motorcycle_lamps(f, top, head),
    ]
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        parts += _motorcycle_side(f, s, turn, top, head)
    if f.style.fairing:
        parts += _fairing(f, head)
    if f.style.shield:
        parts += _shield(f)
    return parts


def _engine_and_seat(f: _Frame, top: float) -> list[Mesh]:
    """Engine, tank, seat, tail, swinging arm and exhaust; top: m, of the seat."""
    bars, seat, rear, r = f.bars[0], f.seat[0], f.rear[0], f.radius
    tank = (bars - 0.08, 0.0, top + 0.10), (seat + 0.16, 0.0, top + 0.02)
    cushion = (seat + 0.18, 0.0, top - 0.02), (rear + 0.02, 0.0, top + 0.02)
    tail = (seat + 0.10, 0.0, top - 0.10), (rear - 0.55 * r, 0.0, top - 0.03)
    exhaust = (0.1, -0.13, 0.8 * r), (rear - 0.2 * r, -0.16, 1.15 * r)
    return [
        f.lump((0.04, 0.0, 1.25 * r), (0.27, 0.15, 0.21), Material.TRIM),
        f.bar(*tank, (0.15, 0.12), Material.PAINT, 8),
        f.bar(*cushion, (0.11, 0.07), Material.TRIM, 8),
        f.bar(*tail, (0.11, 0.05), Material.PAINT, 8),
        f.bar(f.rear, (0.0, 0.0, 1.1 * r), (0.04, 0.05), Material.STEEL, 5),
        f.bar(*exhaust, (0.035, 0.06), Material.STEEL, 6),
    ]


def _motorcycle_lamps(f: _Frame, top: float, head: Point) -> list[Mesh]:
    """Housing and glass of the head lamp at `head`, tail and brake lamp, plate."""
    rear, r = f.rear[0], f.radius
    glass = (head[2] - 0.05, head[2] + 0.05)
    return [
        f.lump(head, (0.09, 0.10, 0.10), Material.PAINT, 8),
        f.pane(head[0] + 0.088, (-0.065, 0.065), glass, Material.LAMP_GLASS),
        f.pane(rear - 0.58 * r, (-0.08, 0.08), (top - 0.05, top + 0.01), Material.TAIL_LAMP),
        f.pane(rear - 0.59 * r, (-0.05, 0.05), (top - 0.07, top - 0.052), Material.BRAKE_LAMP),
        plate_of(f.label, rear - 0.75 * r, top - 0.22, 0.22),
    ]


def _motorcycle_side(f: _Frame, s: float, turn: Material, top: float, head: Point) -> list[Mesh]:
    """Fork, indicators, mirror and case of the left (s = 1) or right (-1) side."""
    (x, _, z), rear, r = f.bars, f.rear[0], f.radius
    fork = (f.front[0], 0.10 * s, f.front[2]), (x + 0.02, 0.08 * s, z)
    parts = [f.bar(*fork, (0.025, 0.03), Material.STEEL, 5)]
    for at, high in ((head[0] - 0.02, head[2] - 0.09), (rear - 0.5 * r, top - 0.07)):
        parts.append(f.lump((at, 0.15 * s, high), (0.03, 0.04, 0.03), turn, 6))
    mirror = span(0.36 * f.width * s, 0.44 * f.width * s)
    parts.append(f.block((x + 0.02, x + 0.04), mirror, (z + 0.05, z + 0.13), Material.TRIM))
    if f.style.cases:
        low = 1.3 * r
        case = span(0.15 * s, 0.28 * s)
        parts.append(f.block((rear - 0.2, rear + 0.26), case, (low, low + 0.28), Material.TRIM))
    return parts


def _fairing(f: _Frame, head: Point) -> list[Mesh]:
    """A fairing around the head lamp at `head`, with a screen over it."""
    x, _, z = head
    screen = (x + 0.02, 0.0, z + 0.05), (x - 0.14, 0.0, z + 0.19)
    return [
        f.bar(
            (x + 0.05, 0.0, z - 0.02),
            (0.05, 0.0, 1.1 * f.radius),
            (0.11, 0.21),
            Material.PAINT,
            8,
        ),
        f.bar(*screen, (0.10, 0.06), Material.GLASS, 6),
    ]


def _shield(f: _Frame) -> list[Mesh]:
    """What a scooter has: a shield before the legs, a floor, and a case over the engine."""
    x, r = f.bars[0] + 0.02, f.radius
    shield = (x + 0.06, 0.0, f.bars[2] - 0.08), (x - 0.02, 0.0, 0.9 * r)
    return [
        f.bar(*shield, (0.12, 0.22), Material.PAINT, 8),
        f.block((f.seat[0], x), (-0.16, 0.16), (0.85 * r, 1.1 * r), Material.PAINT),
        f.lump((f.rear[0] + 0.08, 0.0, 1.75 * r), (0.30, 0.19, 0.26), Material.PAINT),
    ]


def _rider(
    style: TwoWheelerStyle, seat: Point, bars: Point, pedals: Point, width: float, height: float
) -> Mesh:
    """A rider from the seat up to the height of the box, hands on the bar and feet on the pedals."""
    label = int(SemanticClass.RIDER)
    head = 0.125
    tall = height - seat[2] - 2.0 * head
    lean = np.array([np.sin(style.lean), 0.0, np.cos(style.lean)])
    reach = tall / lean[2]
    neck = np.array(seat) + lean * reach
    shoulder = np.array(seat) + lean * (reach - 0.10)
    covered = Material.TRIM if style.motor else Material.CLOTH
    helmet = Material.PAINT if style.motor else Material.CARGO
    waist = np.array(seat) + lean * 0.45 * reach
    parts = [
        _limb(seat, waist, (0.15, 0.15), label, Material.CLOTH, 8),
        _limb(waist, shoulder, (0.15, 0.19), label, Material.CLOTH, 8),
        _limb(shoulder, neck, (0.16, 0.06), label, Material.CLOTH, 8),
        ball((neck[0] + 0.02, 0.0, height - head), (0.12, 0.10, head), label, Material.SKIN),
        ball(
            (neck[0] + 0.005, 0.0, height - 0.8 * head), (0.135, 0.115, 0.8 * head), label, helmet
        ),
    ]
    if style.motor:
        parts[3] = ball(
            (neck[0] + 0.03, 0.0, height - head), (0.125, 0.105, 0.9 * head), label, Material.GLASS
        )
    half = min(0.17, 0.42 * width)
    for s in (1.0, -1.0):
        grip = (bars[0], s * min(0.40 * width, 0.30), bars[2] + 0.03)
        top = (shoulder[0], s * half, shoulder[2])
        elbow = (
            0.5 * (top[0] + grip[0]) - 0.04,
            s * min(0.5 * width - 0.052, 0.31),
            0.5 * (top[2] + grip[2]) - 0.06,
        )
        crank = 0.0 if style.motor else 0.10 * s
        foot = (pedals[0] + crank, pedals[1] + 0.13 * s, pedals[2] - crank + 0.06)
        hip = (seat[0] + 0.02, s * 0.10, seat[2] + 0.03)
        knee = (hip[0] + 0.36, s * 0.17, 0.5 * (hip[2] + foot[2]) + 0.16)
        parts += [
            _limb(top, elbow, (0.065, 0.05), label, Material.CLOTH),
            _limb(elbow, grip, (0.05, 0.04), label, covered if not style.motor else Material.CLOTH),
            _limb(hip, knee, (0.095, 0.065), label, Material.TROUSERS),
            _limb(knee, foot, (0.062, 0.045), label, Material.TROUSERS),
            box(
                (foot[0] - 0.07, foot[0] + 0.16),
                (foot[1] - 0.045, foot[1] + 0.045),
                (foot[2] - 0.06, foot[2] + 0.03),
                label,
                Material.TYRE,
            ),
        ]
    return merge(parts)


def _limb(
    a: Sequence[float],
    b: Sequence[float],
    radii: tuple[float, float],
    label: int,
    material: int,
    sides: int = 6,
) -> Mesh:
    """A round limb between two points."""
    return tube(((a[0], a[1], a[2]), (b[0], b[1], b[2])), radii, label, material, sides)
