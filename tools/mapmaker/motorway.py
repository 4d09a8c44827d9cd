"""The map motorway: a closed ring of 7.5 km, three lanes and a hard shoulder in each direction.

Sizes follow the German guideline for motorways, RAA 2008 (limits as listed by bauformeln.de, "Grenz-
und Richtwerte, Autobahnen"): radius at least 900 m in class EKA 1 A (130 km/h), 470 m in EKA 2
(100 km/h), 280 m in EKA 3 (at most 100 km/h; here 80); clothoid parameter 300, 160, 90 m; crests of
radius 13 000, 5 000, 3 000 m; bank at most 6 %; grade at most 4 %; clothoids have parameters of 190
to 330 m. AASHTO 2018, table 3-7, asks with 6 % bank for 951, 437 and 252 m. A carriageway is 14.5 m
wide as in RQ 36, of which lanes have 3.5, 3.5 and 3.75 m. Assumptions: how wide the rest is (edge
strip 0.75 m within the median, shoulder 3 m), banks between 4.5 and 6 %, ramps, and the work zone.

The axis lies in the middle of the median, right lanes run counter-clockwise.
"""

from __future__ import annotations

from itertools import pairwise
from math import atan, radians

from scenariogeneration import xodr

from mapmaker.furniture import Numbers, barrier, box, gantry, guardrail, sign
from mapmaker.interchange import Interchange, furnish_ramps, interchange, rails_of
from mapmaker.network import LaneSpec, Mark, Network, RoadSpec, stretch
from mapmaker.paths import (
    Banks,
    Bend,
    Heights,
    Piece,
    Start,
    Straight,
    elements,
    fitted,
    length,
)

ORIGIN = Start(0.0, 0.0, 0.0)
MEDIAN = 2.75  # m, half of it: 2.0 of grass and an edge strip of 0.75
LANES = (3.5, 3.5, 3.75)  # m
SHOULDER = 3.0
EDGE = MEDIAN + sum(LANES) + SHOULDER
RAIL = EDGE + 0.3
WALL_HEIGHT = 0.9  # m, of the concrete barrier in the median
BANKS = {400.0: 0.06, 500.0: 0.06, 600.0: 0.055, 900.0: 0.045}  # by radius
LIMITS = {400.0: 80.0, 500.0: 100.0, 600.0: 100.0, 900.0: 130.0}  # km/h, by radius
FAST, MIDDLE, SLOW = 130.0, 100.0, 80.0
BEFORE = 150.0  # m before a bend and behind it that its limit holds
FUNNEL = 250.0  # m of the middle limit before and behind a slow stretch
WORKS = (200.0, 560.0)  # m along the second straight: where the shoulder is dug up
DRIVEN = (-2, -4)
START = 400.0  # m into the first bend: three lanes from 400 m behind to 2 km ahead

SIDE = (
    LaneSpec(MEDIAN, xodr.LaneType.median, Mark.solid),
    *(LaneSpec(w, mark=Mark.broken) for w in LANES[:-1]),
    LaneSpec(LANES[-1], mark=Mark.solid),
    LaneSpec(SHOULDER, xodr.LaneType.shoulder),
)
WORKED = (*SIDE[:-1], LaneSpec(SHOULDER, xodr.LaneType.roadWorks))


def axis_pieces() -> list[Piece]:
    """The ring; the straights between bends 1 and 2 and behind bend 2 are fitted to close it."""
    pieces: list[Piece] = [
        Straight(750.0),  # first interchange
        Bend(radians(90.0), 500.0, 100.0),
        Straight(0.0),  # work zone
        Bend(radians(100.0), 600.0, 110.0),
        Straight(0.0),
        Bend(radians(-40.0), 900.0, 120.0),
        Bend(radians(120.0), 400.0, 90.0),
        Straight(750.0),  # second interchange
        Bend(radians(90.0), 900.0, 120.0),
    ]
    return fitted(ORIGIN, pieces, (2, 4), (0.0, 0.0))


def heights(starts: list[float]) -> Heights:
    """Level at the interchanges, and three crests."""
    crest = starts[2] + 60.0
    return Heights(
        (
            (0.0, 0.0),
            (starts[1] - 20.0, 0.0),
            (crest, 12.0),
            (crest + 960.0, 0.0),
            (starts[5] - 60.0, 0.0),
            (starts[6] + 60.0, 7.5),
            (starts[7] - 20.0, 0.0),
            (starts[8], 0.0),
            (0.5 * (starts[8] + starts[9]), 7.5),
            (starts[9], 0.0),
        )
    )


def banks(pieces: list[Piece], starts: list[float]) -> Banks:
    """Level on straights, rising with the curvature: the inner side lies low."""
    knots = [(0.0, 0.0)]
    for piece, (a, b) in zip(pieces, pairwise(starts), strict=True):
        if isinstance(piece, Bend):
            roll = -atan(BANKS[piece.radius]) * (1.0 if piece.angle > 0.0 else -1.0)
            knots += [(a, 0.0), (a + piece.spiral, roll), (b - piece.spiral, roll), (b, 0.0)]
    return Banks(tuple(dict.fromkeys(knots)))


def zones(pieces: list[Piece], starts: list[float]) -> list[tuple[float, float, float]]:
    """(from, to, km/h): bends and the work zone; elsewhere 130."""
    out = [(starts[2] + WORKS[0] - 100.0, starts[2] + WORKS[1] + 100.0, SLOW)]
    for piece, (a, b) in zip(pieces, pairwise(starts), strict=True):
        if isinstance(piece, Bend):
            out.append((max(a - BEFORE, 0.0), min(b + BEFORE, starts[-1]), LIMITS[piece.radius]))
    return out + [(a - FUNNEL, b + FUNNEL, MIDDLE) for a, b, limit in out if limit == SLOW]


def limit_at(zones: list[tuple[float, float, float]], s: float) -> float:
    """The lowest limit that holds there."""
    return min((limit for a, b, limit in zones if a <= s < b), default=FAST)


def changes(zones: list[tuple[float, float, float]], total: float) -> list[tuple[float, float]]:
    """(s, km/h) wherever the limit changes along the axis, first at 0."""
    places = sorted({0.0, *(s for a, b, _ in zones for s in (a, b) if 0.0 < s < total)})
    out: list[tuple[float, float]] = []
    for s in places:
        limit = limit_at(zones, s)
        if not out or out[-1][1] != limit:
            out.append((round(s, 6), limit))
    return out


def network() -> Network:
    """The whole map."""
    pieces = axis_pieces()
    starts = [length(pieces[:i]) for i in range(len(pieces) + 1)]
    total = starts[-1]
    axis = elements(ORIGIN, pieces)
    crossings = [
        interchange(axis, starts[i], number, inner=MEDIAN + sum(LANES[:-1]), lane=LANES[-1])
        for number, i in ((0, 0), (1, 7))
    ]
    works = (starts[2] + WORKS[0], starts[2] + WORKS[1])
    joints = [*starts[:7], *starts[8:], *works, *(s for c in crossings for s in c.cuts)]
    cuts = sorted({round(s, 6) for s in joints})
    limits = changes(zones(pieces, starts), total)
    profile, rolls = heights(starts), banks(pieces, starts)
    main = [
        stretch(
            i + 1,
            axis,
            profile,
            a,
            b,
            banks=rolls,
            left=SIDE,
            right=WORKED if works[0] - 1.0 < a < works[1] - 1.0 else SIDE,
            limits_kmh=_limits(limits, a, b),
            predecessor=(i or len(cuts) - 1, "end"),
            successor=((i + 1) % (len(cuts) - 1) + 1, "start"),
        )
        for i, (a, b) in enumerate(pairwise(cuts))
    ]
    road, s = _on(main, cuts, starts[1] + START)
    net = Network("motorway", roads=list(main), ego_start=(road.id, -3, round(s, 3)))
    for crossing in crossings:
        crossing.join(net, main, cuts)
    _furnish(net, main, cuts, crossings, limits, works)
    return net


def _limits(limits: list[tuple[float, float]], a: float, b: float) -> list[tuple[float, float]]:
    """The same from a to b, each from its place relative to a."""
    first = max(limit for limit in limits if limit[0] <= a + 1e-6)[1]
    later = [(round(s - a, 6), value) for s, value in limits if a + 1e-6 < s < b - 1e-6]
    return [(0.0, first), *later]


def _on(roads: list[RoadSpec], cuts: list[float], s: float) -> tuple[RoadSpec, float]:
    i = max(k for k in range(len(roads)) if cuts[k] <= s)
    return roads[i], round(s - cuts[i], 6)


def _furnish(
    net: Network,
    main: list[RoadSpec],
    cuts: list[float],
    crossings: list[Interchange],
    limits: list[tuple[float, float]],
    works: tuple[float, float],
) -> None:
    ids = Numbers(20000)
    for road in main:
        barrier(road, ids, (0.0, 0.0), 0.0, road.length, subtype="wall", height=WALL_HEIGHT)
        if road.junction < 0:
            beside = sum(lane.width for lane in road.right) + 0.3
            guardrail(road, ids, beside, 0.0, road.length)
            guardrail(road, ids, -beside, 0.0, road.length)
    furnish_ramps(net, ids)
    _signs(main, cuts, limits, ids)
    _works(main, cuts, works, ids)
    for crossing in crossings:
        for s in (crossing.cuts[0] - 30.0, crossing.cuts[-1] + 30.0):
            road, s_road = _on(main, cuts, s)
            gantry(road, ids, s_road, RAIL + 0.6, -RAIL - 0.6)
    for k, (s, t) in enumerate(
        ((250.0, 110.0), (420.0, -120.0), (1500.0, 70.0), (2900.0, 60.0), (4300.0, -60.0))
    ):
        road, s_road = _on(main, cuts, s)
        box(road, ids, xodr.ObjectType.building, s_road, t, (40.0 + 5.0 * k, 18.0, 7.0 + 2.0 * k))


def _signs(
    main: list[RoadSpec], cuts: list[float], limits: list[tuple[float, float]], ids: Numbers
) -> None:
    """A sign for either direction where its limit begins."""
    values = [limit for _, limit in limits]
    for (s, here), before in zip(limits[1:], values[:-1], strict=True):
        for value, side in ((here, -1.0), (before, 1.0)):
            road, s_road = _on(main, cuts, s)
            lanes = DRIVEN if side < 0.0 else (-DRIVEN[0], -DRIVEN[1])
            if rails_of(road):
                sign(road, ids, s_road, side * (RAIL + 0.6), type_="274", lanes=lanes, value=value)


def _works(
    main: list[RoadSpec], cuts: list[float], works: tuple[float, float], ids: Numbers
) -> None:
    """The shoulder dug up: a barrier half a metre beside the lane, vans and heaps behind it."""
    road, s = _on(main, cuts, works[0])
    near, far = -(EDGE - SHOULDER + 0.5), -(EDGE - 0.2)
    taper = 60.0
    guardrail(road, ids, near, taper, road.length - taper)
    for a, b in (((far, near), 0.0), ((near, far), road.length - taper)):
        barrier(road, ids, a, b, taper)
    for k in range(4):
        place = s + 90.0 + 60.0 * k
        box(
            road, ids, xodr.ObjectType.obstacle, place, -(EDGE - 0.9), (6.0, 1.4, 2.4), name="works"
        )
