"""The lines of a car: style, size, the upper edge of the hull, how wide it is, the glasshouse.

Places along a car are shares of its length from the nose, heights are shares of its height.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from skidpad.sensors.bodywork.body import Point

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


class CarSize(NamedTuple):
    """Size of a car in m, and what follows from it."""

    length: float
    width: float
    height: float
    half: float  # of the hull
    axles: tuple[float, float]  # x
    wheel: float


SIDE = ((0.0, 0.90), (0.10, 0.972), (0.42, 1.0), (0.66, 0.995), (0.86, 0.978), (1.0, 0.935))


def curve_at(curve: Curve, t: float) -> float:
    """Returns the value of a curve at t."""
    return float(np.interp(t, [p[0] for p in curve], [p[1] for p in curve]))


def side_at(share: float) -> float:
    """Returns the share of the hull's half-width at a share of its height."""
    return float(np.interp(share, [p[0] for p in SIDE], [p[1] for p in SIDE]))


def half_width_at(style: CarStyle, size: CarSize, x: float) -> float:
    """Returns the half-width of the hull in m at x m ahead of its centre; less at nose and tail."""
    out = size.half
    for end, share, deep in ((1.0, style.nose, 0.62), (-1.0, style.tail, 0.42)):
        inside = 0.5 * size.length - end * x
        if inside < deep:
            out -= size.half * share * (1.0 - inside / deep) ** 2.4
    return out


def make_glass_ring(style: CarStyle, size: CarSize, t: float) -> list[Point]:
    """Returns the cross-section of the glasshouse at a share of the length.

    From one side to the other: sill, window, rail, roof, rail, window, sill.
    """
    x = (0.5 - t) * size.length
    h = size.height
    foot = curve_at(style.deck, t) * h - 0.004
    top = max(curve_at(style.roof, t) * h, foot + 0.006)
    tall = top - foot
    wide = 0.925 * half_width_at(style, size, x)
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
