"""Reference lines and piecewise cubics of OpenDRIVE, evaluated for whole arrays of s."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats

STRAIGHTEST = 1e-12  # 1/m^2, slower change of curvature than this is an arc
TABLE_STEP = 0.25  # m, spacing of the table that turns arc length into a cubic's parameter
HALVINGS = 60  # at most, of the interval in which a poly3 ends
ARC_EXACT = 1e-11  # share of the length to which the end of a poly3 is found
TABLE_MAX = 4096  # steps; an element of more than a kilometre has longer ones


@dataclass(frozen=True, slots=True)
class Cubics:
    """Piecewise cubic: a + b ds + c ds^2 + d ds^3 with ds = s - start[i] from start[i] on."""

    start: Floats  # (m,) ascending
    coefficients: Floats  # (m, 4)

    @classmethod
    def none(cls) -> Cubics:
        """Returns the function that is zero everywhere."""
        return cls(np.zeros(1), np.zeros((1, 4)))

    def at(self, s: Floats, select: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """Returns value and first two derivatives at `s` (n,); before the first piece that one goes on.

        select: places that choose the pieces instead of `s`: at the end of a lane section the piece
        before the joint is wanted, not the one that begins there.
        """
        piece = np.searchsorted(self.start, s if select is None else select, side="right") - 1
        piece = np.maximum(piece, 0)
        ds = s - self.start[piece]
        a, b, c, d = self.coefficients[piece].T
        return (
            a + ds * (b + ds * (c + ds * d)),
            b + ds * (2.0 * c + ds * 3.0 * d),
            2.0 * c + 6.0 * d * ds,
        )


@dataclass(frozen=True, slots=True)
class Clothoid:
    """Curvature linear in length; a line and an arc are special cases."""

    curvature_start: float
    curvature_end: float


@dataclass(frozen=True, slots=True)
class Parametric:
    """A cubic in the element's own axes: u(p), v(p), p from 0 to p_end (paramPoly3, poly3)."""

    u: tuple[float, float, float, float]
    v: tuple[float, float, float, float]
    p_end: float


@dataclass(frozen=True, slots=True)
class Element:
    """One geometry record of a plan view."""

    s: float
    x: float
    y: float
    heading: float
    length: float
    shape: Clothoid | Parametric


class LinePoints(NamedTuple):
    """Points of a reference line; arrays (n,)."""

    x: Floats
    y: Floats
    heading: Floats  # rad, along increasing s
    curvature: Floats  # 1/m, left positive
    d_curvature: Floats  # 1/m^2


class ReferenceLine:
    """The plan view of one road."""

    def __init__(self, elements: Sequence[Element]) -> None:
        self.elements = tuple(elements)
        self.starts = np.array([e.s for e in elements])

    def at(self, s: Floats) -> LinePoints:
        """Returns points at `s` (n,), in any order; beyond the ends the first or last element goes on."""
        out = LinePoints(*(np.empty(len(s)) for _ in LinePoints._fields))
        which = np.maximum(np.searchsorted(self.starts, s, side="right") - 1, 0)
        for i in np.unique(which):
            chosen = which == i
            element = self.elements[i]
            for column, values in zip(out, _evaluate(element, s[chosen] - element.s), strict=True):
                column[chosen] = values
        return out


def _evaluate(e: Element, ds: Floats) -> LinePoints:
    """Returns the points of an element at the arc lengths ds in m from its begin."""
    if isinstance(e.shape, Clothoid):
        return _clothoid(e, e.shape, ds)
    return _parametric(e, e.shape, ds)


def _clothoid(e: Element, shape: Clothoid, ds: Floats) -> LinePoints:
    """Returns the points of an arc in closed form, of a spiral by Fresnel integrals.

    With k(s) = k0 + k' s and u = k(s) / sqrt(pi |k'|) the heading is phi + sign(k') pi/2 u^2, so the
    position is an integral of cos and sin of pi/2 u^2.
    """
    k0 = shape.curvature_start
    rate = (shape.curvature_end - k0) / e.length
    heading = e.heading + ds * (k0 + 0.5 * rate * ds)
    if abs(rate) < STRAIGHTEST:
        half = 0.5 * k0 * ds
        chord = ds * np.sinc(half / np.pi)
        x = e.x + chord * np.cos(e.heading + half)
        y = e.y + chord * np.sin(e.heading + half)
        return LinePoints(x, y, heading, np.full_like(ds, k0), np.zeros_like(ds))
    from scipy.special import fresnel  # few maps have clothoids, and it is 10 MB of a worker

    sign = np.sign(rate)
    scale = np.sqrt(np.pi / abs(rate))
    root = np.sqrt(np.pi * abs(rate))
    phi = e.heading - k0**2 / (2.0 * rate)
    sine, cosine = fresnel((k0 + rate * ds) / root)
    sine_0, cosine_0 = fresnel(k0 / root)
    along, across = sign * scale * (cosine - cosine_0), scale * (sine - sine_0)
    x = e.x + np.cos(phi) * along - np.sin(phi) * across
    y = e.y + np.sin(phi) * along + np.cos(phi) * across
    return LinePoints(x, y, heading, k0 + rate * ds, np.full_like(ds, rate))


def _parametric(e: Element, shape: Parametric, ds: Floats) -> LinePoints:
    """Returns the points of a cubic: its parameter from arc length by a table, then its derivatives.

    Its arc length is scaled to the length that the file says.
    """
    from scipy.interpolate import CubicHermiteSpline  # likewise

    p_table, length_table, speed = _arc_table(shape, e.length)
    # The file's length decides, so that the element ends where the next one begins.
    inverse = CubicHermiteSpline(length_table, p_table, 1.0 / np.maximum(speed, 1e-9))
    p = inverse(ds * (length_table[-1] / e.length))
    u, v, du, dv, ddu, ddv, dddu, dddv = _derivatives(shape, p)
    v_norm = np.maximum(np.hypot(du, dv), 1e-9)
    cross = du * ddv - dv * ddu
    curvature = cross / v_norm**3
    d_curvature = (
        (du * dddv - dv * dddu) / v_norm**3 - 3.0 * cross * (du * ddu + dv * ddv) / v_norm**5
    ) / v_norm
    c, s = np.cos(e.heading), np.sin(e.heading)
    return LinePoints(
        e.x + c * u - s * v,
        e.y + s * u + c * v,
        e.heading + np.arctan2(dv, du),
        curvature,
        d_curvature,
    )


def _arc_table(shape: Parametric, length: float) -> tuple[Floats, Floats, Floats]:
    """Returns parameters from 0 to p_end, the arc lengths in m up to them, and their m per parameter.

    length: m, decides how many there are.
    """
    steps = int(np.clip(length / TABLE_STEP, 8, TABLE_MAX))
    p_table = np.linspace(0.0, shape.p_end, steps + 1)
    middle = 0.5 * (p_table[1:] + p_table[:-1])
    speed, speed_middle = (np.hypot(*_derivatives(shape, p)[2:4]) for p in (p_table, middle))
    simpson = (speed[:-1] + 4.0 * speed_middle + speed[1:]) / 6.0 * np.diff(p_table)
    return p_table, np.concatenate(([0.0], np.cumsum(simpson))), speed


def poly3_shape(v: tuple[float, float, float, float], length: float) -> Parametric:
    """Returns the curve v(u) from u = 0 to the u at which its arc is `length` m long (Newton's method)."""
    low, high, u = 0.0, length, length
    for _ in range(HALVINGS):
        shape = Parametric((0.0, 1.0, 0.0, 0.0), v, u)
        _, arcs, speeds = _arc_table(shape, length)
        over = float(arcs[-1]) - length
        if abs(over) <= ARC_EXACT * length:
            break
        low, high = (low, u) if over > 0.0 else (u, high)
        u -= over / float(speeds[-1])
        if not low < u < high:
            u = 0.5 * (low + high)
    return shape


def _derivatives(shape: Parametric, p: Floats) -> tuple[Floats, ...]:
    """Returns u, v and their first, second and third derivatives by p: u, v, du, dv and so on."""
    return tuple(
        value
        for derivatives in zip(_cubic(shape.u, p), _cubic(shape.v, p), strict=True)
        for value in derivatives
    )


def _cubic(coefficients: tuple[float, float, float, float], p: Floats) -> tuple[Floats, ...]:
    """Returns value and first three derivatives of a + b p + c p^2 + d p^3."""
    a, b, c, d = coefficients
    return (
        a + p * (b + p * (c + p * d)),
        b + p * (2.0 * c + p * (3.0 * d)),
        2.0 * c + p * (6.0 * d),
        6.0 * d + 0.0 * p,
    )
