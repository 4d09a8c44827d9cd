"""Road axes: straights and bends with spiral transitions, chained and closed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from skidpad.roads.opendrive.reference_line import Clothoid, Element, ReferenceLine

DIGITS = 9  # of written coordinates: a nanometre
SHORTEST = 1e-6  # m, of a record; CARLA's reader ends the process where none begins at s = 0


@dataclass(frozen=True, slots=True)
class Straight:
    """A straight of some length."""

    length: float


@dataclass(frozen=True, slots=True)
class Bend:
    """Spiral, arc, spiral: turns by `angle` (left positive) at `radius`."""

    angle: float  # rad
    radius: float  # m
    spiral: float  # m, length of each transition; 0 for a plain arc


Piece = Straight | Bend


@dataclass(frozen=True, slots=True)
class Start:
    """Where an axis begins."""

    x: float
    y: float
    heading: float


def elements(start: Start, pieces: Sequence[Piece]) -> tuple[Element, ...]:
    """Geometry records of a chain of pieces."""
    out: list[Element] = []
    x, y, heading, s = start.x, start.y, start.heading, 0.0
    for piece in pieces:
        for length, k0, k1 in _clothoids(piece):
            element = Element(
                round(s, DIGITS),
                round(x, DIGITS),
                round(y, DIGITS),
                round(heading, DIGITS),
                round(length, DIGITS),
                Clothoid(k0, k1),
            )
            out.append(element)
            end = ReferenceLine([element]).at(np.array([element.s + element.length]))
            x, y, heading = float(end.x[0]), float(end.y[0]), float(end.heading[0])
            s += element.length
    return tuple(out)


def add_up(values: Iterable[float]) -> float:
    """Add from left to right with plain roundings; `sum` of Python 3.12 and later adds otherwise."""
    total = 0.0
    for value in values:
        total += value
    return total


def length(pieces: Sequence[Piece]) -> float:
    """Length of a chain of pieces."""
    return add_up(part[0] for piece in pieces for part in _clothoids(piece))


def end(start: Start, pieces: Sequence[Piece]) -> Start:
    """Where a chain of pieces ends."""
    chain = elements(start, pieces)
    last = ReferenceLine(chain).at(np.array([chain[-1].s + chain[-1].length]))
    return Start(float(last.x[0]), float(last.y[0]), float(last.heading[0]))


def fitted(
    start: Start, pieces: Sequence[Piece], free: tuple[int, int], target: tuple[float, float]
) -> list[Piece]:
    """The chain with the two straights `free` made so long that it ends at `target`.

    Straights shift what follows along their heading, so their lengths solve two linear equations.
    """
    chain = list(pieces)
    for i in free:
        chain[i] = Straight(0.0)
    reached = end(start, [p for p in chain if p != Straight(0.0)])
    headings = [
        start.heading + add_up(p.angle for p in chain[:i] if isinstance(p, Bend)) for i in free
    ]
    directions = np.array([[cos(h) for h in headings], [sin(h) for h in headings]])
    lengths = np.linalg.solve(directions, np.array(target) - (reached.x, reached.y))
    if np.any(lengths <= 0.0):
        raise ValueError(f"the path cannot be closed: straights of {lengths} m")
    for i, l in zip(free, lengths, strict=True):
        chain[i] = Straight(float(l))
    return chain


def _clothoids(piece: Piece) -> list[tuple[float, float, float]]:
    """(length, first and last curvature) of the parts of a piece."""
    if isinstance(piece, Straight):
        return [(piece.length, 0.0, 0.0)]
    k = np.sign(piece.angle) / piece.radius
    arc = abs(piece.angle) * piece.radius - piece.spiral
    if arc < 0.0:
        raise ValueError(f"spirals of {piece} turn by more than the bend")
    parts = [(piece.spiral, 0.0, k), (arc, k, k), (piece.spiral, k, 0.0)]
    return [part for part in parts if part[0] > SHORTEST]


def cut(chain: Sequence[Element], s_from: float, s_to: float) -> tuple[Element, ...]:
    """The stretch of an axis between two places, as records of its own that begin at s = 0."""
    line = ReferenceLine(chain)
    out: list[Element] = []
    for element in chain:
        s0, s1 = max(element.s, s_from), min(element.s + element.length, s_to)
        if s1 - s0 < SHORTEST:
            continue
        assert isinstance(element.shape, Clothoid)
        at = line.at(np.array([s0]))
        rate = (element.shape.curvature_end - element.shape.curvature_start) / element.length
        k0, k1 = (element.shape.curvature_start + rate * (s - element.s) for s in (s0, s1))
        # The record's own start is exact; `at` would choose the record before the joint's.
        x, y, h = (
            (element.x, element.y, element.heading)
            if s0 == element.s
            else (float(at.x[0]), float(at.y[0]), float(at.heading[0]))
        )
        out.append(
            Element(
                round(s0 - s_from, DIGITS) if out else 0.0,
                round(x, DIGITS),
                round(y, DIGITS),
                round(h, DIGITS),
                round(s1 - s0, DIGITS),
                Clothoid(k0, k1),
            )
        )
    return tuple(out)


@dataclass(frozen=True, slots=True)
class Heights:
    """A height profile through knots (s, z) with level tangents, so that grades are continuous."""

    knots: tuple[tuple[float, float], ...]

    def records(self, s_from: float, s_to: float) -> list[tuple[float, ...]]:
        """Elevation records (s, a, b, c, d) of the stretch, s relative to its start."""
        out: list[tuple[float, ...]] = []
        for (s0, z0), (s1, z1) in zip(self.knots[:-1], self.knots[1:], strict=True):
            begin, stop = max(s0, s_from), min(s1, s_to)
            if stop - begin < SHORTEST:
                continue
            rise, span = z1 - z0, s1 - s0
            c, d = 3.0 * rise / span**2, -2.0 * rise / span**3
            u = begin - s0  # the cubic about another point
            shifted = (
                z0 + c * u**2 + d * u**3,
                2.0 * c * u + 3.0 * d * u**2,
                c + 3.0 * d * u,
                d,
            )
            s = round(begin - s_from, DIGITS) if out else 0.0
            out.append((s, *(round(v, 15) for v in shifted)))
        return out

    def at(self, s: float) -> float:
        """Height at s."""
        _, a, *_ = self.records(s, s + 1.0)[0]
        return a


@dataclass(frozen=True, slots=True)
class Banks:
    """Superelevation through knots (s, roll), straight between them; left side up positive."""

    knots: tuple[tuple[float, float], ...]

    def records(self, s_from: float, s_to: float) -> list[tuple[float, ...]]:
        """Superelevation records (s, a, b, c, d) of the stretch, s relative to its start."""
        out: list[tuple[float, ...]] = []
        for (s0, r0), (s1, r1) in zip(self.knots[:-1], self.knots[1:], strict=True):
            begin, stop = max(s0, s_from), min(s1, s_to)
            if stop - begin < SHORTEST:
                continue
            slope = (r1 - r0) / (s1 - s0)
            first = r0 + slope * (begin - s0)
            s = round(begin - s_from, DIGITS) if out else 0.0
            out.append((s, round(first, 15), round(slope, 15), 0.0, 0.0))
        return out
