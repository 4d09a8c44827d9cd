"""Interchanges of the motorway: on either side the outermost lane leaves, runs along, and comes back.

So the ramp is a lane that ends at the exit and begins again at the entry (RAA 2008 calls it
subtraction and addition of a lane): nobody has to squeeze in, and two lanes go through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, pi, sin

import numpy as np
from scenariogeneration import xodr

from mapmaker.furniture import Numbers, guardrail
from mapmaker.network import Connection, LaneSpec, Mark, Network, RoadSpec, stretch
from mapmaker.paths import Bend, Heights, Piece, Start, Straight, elements, end, length
from skidpad.roads.opendrive.reference_line import Element, ReferenceLine

FROM = 80.0  # m along the straight where the first ramp begins
MOUTH = 90.0  # m along which a ramp leaves or joins the outermost lane
OFFSET = 22.0  # m between the axes of ramp and outermost lane
ANGLE = pi / 18
BEND = (300.0, 25.0)  # radius, spiral; AASHTO 2018, table 3-7: 252 m at 80 km/h
ALONG = 120.0  # m parallel to the main road
SHOULDER = 2.5  # m
LIMIT = 80.0  # km/h
RIGHT, LEFT = 0, 1  # carriageways
AGAINST = 100  # added to the id of a road for its other direction
OUTER = 4  # number of the outermost lane


def ramp_pieces() -> list[Piece]:
    """Away from the main road, parallel to it, and back."""
    away, back = Bend(-ANGLE, *BEND), Bend(ANGLE, *BEND)
    shift = end(Start(0.0, 0.0, 0.0), [away, back]).y
    slope = Straight((OFFSET + shift) / sin(ANGLE))
    return [away, slope, back, Straight(ALONG), back, slope, away]


@dataclass(frozen=True, slots=True)
class Interchange:
    """Where the mouths lie along the main axis, and the ramps of both carriageways."""

    number: int
    cuts: tuple[float, float, float, float]
    ramps: tuple[list[RoadSpec], list[RoadSpec]]  # exit, between, entry of each carriageway

    @property
    def junctions(self) -> tuple[int, int]:
        """The first and the second along the axis."""
        return 9000 + 2 * self.number, 9001 + 2 * self.number

    def join(self, net: Network, main: list[RoadSpec], cuts: Sequence[float]) -> None:
        """Make junctions of the two pieces of main road at the mouths, and link the ramps."""
        first = list(cuts).index(round(self.cuts[0], 6))
        second = first + 2
        full = main[first].right
        through = tuple(full[: OUTER - 1])
        main[first + 1].right = main[first + 1].left = (
            *through[:-1],
            replace(through[-1], mark=Mark.solid),
            replace(full[-1], linked=(None, None)),
        )
        out = {RIGHT: first, LEFT: second}  # where each carriageway's ramp leaves
        for at, junction in zip((first, second), self.junctions, strict=True):
            before, piece, after = main[at - 1], main[at], main[at + 1]
            piece.junction = junction
            before.successor = after.predecessor = (junction, "")
            piece.right = piece.left = through
            back = replace(
                piece, id=AGAINST + piece.id, right=(), objects=[], signals=[]
            )  # one road for each direction
            piece.left = ()
            net.roads.append(back)
            lanes = tuple(range(1, len(through) + 1))
            net.junctions[junction] = [
                Connection(before.id, piece.id, tuple((-k, -k) for k in lanes)),
                Connection(after.id, back.id, tuple((k, k) for k in lanes), at_end=True),
            ]
        for side, (exit_, between, entry) in enumerate(self.ramps):
            sign = -1 if side == RIGHT else 1
            leaves, joins = out[side], out[1 - side]
            come, go = main[leaves + sign * 1], main[joins - sign * 1]
            exit_.junction = self.junctions[leaves != first]
            entry.junction = self.junctions[joins != first]
            exit_.predecessor = (come.id, "end" if side == RIGHT else "start")
            entry.successor = (go.id, "start" if side == RIGHT else "end")
            between.successor = (entry.junction, "")
            outer = sign * OUTER
            net.junctions[exit_.junction].append(Connection(come.id, exit_.id, ((outer, -1),)))
            net.junctions[entry.junction].append(Connection(between.id, entry.id, ((-1, -1),)))
            net.roads += [exit_, between, entry]


def interchange(
    axis: tuple[Element, ...], straight: float, number: int, *, inner: float, lane: float
) -> Interchange:
    """On the level straight that begins at `straight`; inner: m from the axis to the outermost lane."""
    pieces = ramp_pieces()
    reach = end(Start(0.0, 0.0, 0.0), pieces).x
    a, d = straight + FROM, straight + FROM + reach
    cuts = (a, a + MOUTH, d - MOUTH, d)
    starts = (_beside(axis, a, -inner, 0.0), _beside(axis, d, inner, pi))
    first = 200 + 10 * number
    ramps = [_ramp(start, pieces, first + 3 * k, k, lane) for k, start in enumerate(starts)]
    return Interchange(number, cuts, (ramps[RIGHT], ramps[LEFT]))


def _beside(axis: tuple[Element, ...], s: float, t: float, turn: float) -> Start:
    at = ReferenceLine(axis).at(np.array([s]))
    x, y, h = float(at.x[0]), float(at.y[0]), float(at.heading[0])
    return Start(x - t * sin(h), y + t * cos(h), h + turn)


def _ramp(start: Start, pieces: list[Piece], id: int, side: int, lane: float) -> list[RoadSpec]:
    """Exit, the road between, entry; each with one lane and a shoulder on its right."""
    axis, total = elements(start, pieces), length(pieces)
    level = Heights(((0.0, 0.0), (total, 0.0)))
    cuts = [0.0, MOUTH, total - MOUTH, total]
    outer = -OUTER if side == RIGHT else OUTER

    def lanes(before: int | None = 0, after: int | None = 0) -> tuple[LaneSpec, LaneSpec]:
        ends = (None if before else 0, None if after else 0)
        return (
            LaneSpec(lane, mark=Mark.solid, linked=(before, after)),
            LaneSpec(SHOULDER, xodr.LaneType.shoulder, linked=ends),
        )

    rest = {"limits_kmh": [(0.0, LIMIT)], "kind": xodr.RoadType.motorway}
    return [
        stretch(
            id, axis, level, *cuts[0:2], right=lanes(before=outer), junction=0,
            centre_mark=Mark.broken, successor=(id + 1, "start"), **rest,
        ),
        stretch(id + 1, axis, level, *cuts[1:3], right=lanes(), predecessor=(id, "end"), **rest),
        stretch(
            id + 2, axis, level, *cuts[2:4], right=lanes(after=outer), junction=0,
            centre_mark=Mark.broken, predecessor=(id + 1, "end"), **rest,
        ),
    ]  # fmt: skip


def rails_of(road: RoadSpec) -> bool:
    """Rails stand on both sides of it: in a mouth a ramp would run through them."""
    return road.junction < 0


def furnish_ramps(net: Network, ids: Numbers) -> None:
    """Rails along the ramps, on both sides where they run alone."""
    for road in net.roads:
        if road.id >= 200:
            guardrail(road, ids, -road.right[0].width - SHOULDER - 0.3, 0.0, road.length)
            if road.junction < 0:
                guardrail(road, ids, 0.5, 0.0, road.length)
