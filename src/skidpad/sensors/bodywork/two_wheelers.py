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
    frame = _motorcycle if style.motor else _bicycle
    parts = frame(label, style, front, rear, seat, bars, radius, width)
    pedals = (0.02 * length, 0.0, 0.55 * radius if style.motor else 0.78 * radius)
    rider = _rider(style, seat, bars, pedals, width, height)
    return assemble([*parts, rider], _choose_steered(wheels))


def _choose_steered(wheels: list[Part]) -> list[Part]:
    """Returns copies of all the wheels, of which the foremost alone is `steered`."""
    front = max(w.hub[0] for w in wheels)
    return [w._replace(steered=w.hub[0] == front) for w in wheels]


def _bicycle(
    label: int,
    style: TwoWheelerStyle,
    front: Point,
    rear: Point,
    seat: Point,
    bars: Point,
    radius: float,
    width: float,
) -> list[Mesh]:
    """Frame, fork, handlebar, saddle, crank and lamps."""
    crank = (0.5 * (front[0] + rear[0]) - 0.08, 0.0, 0.82 * radius)
    head = (bars[0] + 0.03, 0.0, bars[2] - 0.10)
    low = (head[0] + 0.05, 0.0, head[2] - 0.16)
    saddle = (seat[0], 0.0, seat[2] - 0.02)
    pairs = [(crank, saddle), (crank, low), (rear, crank)]
    pairs += [(rear, (saddle[0] + 0.04, 0.0, saddle[2] - 0.22))]
    pairs += [] if style.skirt else [(head, (saddle[0] + 0.02, 0.0, saddle[2] - 0.12))]
    parts = [tube(p, (0.020, 0.020), label, Material.PAINT, 5) for p in pairs]
    for s in (1.0, -1.0):
        parts.append(
            tube(
                ((front[0], 0.05 * s, front[2]), (low[0], 0.02 * s, low[2])),
                (0.012, 0.016),
                label,
                Material.PAINT,
                4,
            )
        )
        foot = (crank[0] + 0.12 * s, 0.10 * s, crank[2] - 0.11 * s)
        parts.append(
            tube(((crank[0], 0.06 * s, crank[2]), foot), (0.012, 0.012), label, Material.STEEL, 4)
        )
        parts.append(
            box(
                (foot[0] - 0.05, foot[0] + 0.05),
                span(foot[1], foot[1] + 0.08 * s),
                (foot[2] - 0.015, foot[2] + 0.015),
                label,
                Material.TRIM,
            )
        )
    parts += [
        tube((low, bars), (0.018, 0.018), label, Material.PAINT, 5),
        box(
            (bars[0] - 0.02, bars[0] + 0.02),
            (-0.5 * width, 0.5 * width),
            (bars[2] - 0.02, bars[2] + 0.02),
            label,
            Material.TRIM,
        ),
        box(
            (seat[0] - 0.14, seat[0] + 0.12),
            (-0.07, 0.07),
            (seat[2] - 0.06, seat[2] - 0.01),
            label,
            Material.TRIM,
        ),
        upright(
            label,
            bars[0] + 0.09,
            (-0.04, 0.04),
            (bars[2] - 0.14, bars[2] - 0.06),
            Material.LAMP_GLASS,
        ),
        upright(
            label,
            rear[0] - 0.5 * radius,
            (-0.035, 0.035),
            (2.0 * radius, 2.0 * radius + 0.06),
            Material.TAIL_LAMP,
        ),
    ]
    if style.skirt:  # mudguards and a rack
        parts.append(
            box(
                (rear[0] - 0.6 * radius, rear[0] + 0.5 * radius),
                (-0.07, 0.07),
                (2.0 * radius + 0.06, 2.0 * radius + 0.08),
                label,
                Material.TRIM,
            )
        )
        parts.append(tube((front, (low[0], 0.0, low[2])), (0.012, 0.012), label, Material.TRIM, 4))
    return parts


def _motorcycle(
    label: int,
    style: TwoWheelerStyle,
    front: Point,
    rear: Point,
    seat: Point,
    bars: Point,
    radius: float,
    width: float,
) -> list[Mesh]:
    """Engine, tank, seat, fork, mudguards, exhaust, lamps, plate and what the style adds."""
    top = seat[2] - 0.03
    head = (bars[0] + 0.10, 0.0, bars[2] - 0.06)
    parts = [
        ball((0.04, 0.0, 1.25 * radius), (0.27, 0.15, 0.21), label, Material.TRIM),
        tube(
            ((bars[0] - 0.08, 0.0, top + 0.10), (seat[0] + 0.16, 0.0, top + 0.02)),
            (0.15, 0.12),
            label,
            Material.PAINT,
            8,
        ),
        tube(
            ((seat[0] + 0.18, 0.0, top - 0.02), (rear[0] + 0.02, 0.0, top + 0.02)),
            (0.11, 0.07),
            label,
            Material.TRIM,
            8,
        ),
        tube(
            ((seat[0] + 0.10, 0.0, top - 0.10), (rear[0] - 0.55 * radius, 0.0, top - 0.03)),
            (0.11, 0.05),
            label,
            Material.PAINT,
            8,
        ),
        tube((rear, (0.0, 0.0, 1.1 * radius)), (0.04, 0.05), label, Material.STEEL, 5),
        tube(
            ((0.1, -0.13, 0.8 * radius), (rear[0] - 0.2 * radius, -0.16, 1.15 * radius)),
            (0.035, 0.06),
            label,
            Material.STEEL,
            6,
        ),
        box(
            (front[0] - 0.8 * radius, front[0] + 0.6 * radius),
            (-0.07, 0.07),
            (2.03 * radius, 2.03 * radius + 0.03),
            label,
            Material.PAINT,
        ),
        box(
            (bars[0] - 0.02, bars[0] + 0.02),
            (-0.5 * width, 0.5 * width),
            (bars[2] - 0.02, bars[2] + 0.02),
            label,
            Material.TRIM,
        ),
        ball(head, (0.09, 0.10, 0.10), label, Material.PAINT, 8),
        upright(
            label,
            head[0] + 0.088,
            (-0.065, 0.065),
            (head[2] - 0.05, head[2] + 0.05),
            Material.LAMP_GLASS,
        ),
        upright(
            label,
            rear[0] - 0.58 * radius,
            (-0.08, 0.08),
            (top - 0.05, top + 0.01),
            Material.TAIL_LAMP,
        ),
        upright(
            label,
            rear[0] - 0.59 * radius,
            (-0.05, 0.05),
            (top - 0.07, top - 0.052),
            Material.BRAKE_LAMP,
        ),
        plate_of(label, rear[0] - 0.75 * radius, top - 0.22, 0.22),
    ]
    for s, turn in ((1.0, Material.INDICATOR_LEFT), (-1.0, Material.INDICATOR_RIGHT)):
        parts.append(
            tube(
                ((front[0], 0.10 * s, front[2]), (bars[0] + 0.02, 0.08 * s, bars[2])),
                (0.025, 0.03),
                label,
                Material.STEEL,
                5,
            )
        )
        for x, z in ((head[0] - 0.02, head[2] - 0.09), (rear[0] - 0.5 * radius, top - 0.07)):
            parts.append(ball((x, 0.15 * s, z), (0.03, 0.04, 0.03), label, turn, 6))
        y = span(0.36 * width * s, 0.44 * width * s)
        parts.append(
            box(
                (bars[0] + 0.02, bars[0] + 0.04),
                y,
                (bars[2] + 0.05, bars[2] + 0.13),
                label,
                Material.TRIM,
            )
        )
        if style.cases:
            y = span(0.15 * s, 0.28 * s)
            parts.append(
                box(
                    (rear[0] - 0.2, rear[0] + 0.26),
                    y,
                    (1.3 * radius, 1.3 * radius + 0.28),
                    label,
                    Material.TRIM,
                )
            )
    if style.fairing:
        parts += [
            tube(
                ((head[0] + 0.05, 0.0, head[2] - 0.02), (0.05, 0.0, 1.1 * radius)),
                (0.11, 0.21),
                label,
                Material.PAINT,
                8,
            ),
            tube(
                ((head[0] + 0.02, 0.0, head[2] + 0.05), (head[0] - 0.14, 0.0, head[2] + 0.19)),
                (0.10, 0.06),
                label,
                Material.GLASS,
                6,
            ),
        ]
    if style.shield:
        x = bars[0] + 0.02
        parts += [
            tube(
                ((x + 0.06, 0.0, bars[2] - 0.08), (x - 0.02, 0.0, 0.9 * radius)),
                (0.12, 0.22),
                label,
                Material.PAINT,
                8,
            ),
            box((seat[0], x), (-0.16, 0.16), (0.85 * radius, 1.1 * radius), label, Material.PAINT),
            ball((rear[0] + 0.08, 0.0, 1.75 * radius), (0.30, 0.19, 0.26), label, Material.PAINT),
        ]
    return parts


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
