"""Junctions of streets and roundabouts, from poses of lane centres."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, pi, sin

from scenariogeneration import xodr

from mapmaker.network import Connection, LaneSpec, Network, RoadSpec
from mapmaker.paths import Bend, Piece, Start, Straight, elements, fitted
from skidpad.core.geometry import wrap_angle

LANE = 3.5
FLAT = ((0.0, 0.0, 0.0, 0.0, 0.0),)


@dataclass(frozen=True, slots=True)
class Mouth:
    """One end of a road at a junction: lane centres where traffic comes in and goes out."""

    road: int
    end: str  # "start" or "end" of that road
    lane_in: int | None  # lane that enters the junction
    lane_out: int | None
    pose_in: Start | None
    pose_out: Start | None


def street_mouth(road: RoadSpec, end: str, at: Start) -> Mouth:
    """The mouth of a two-lane street; `at` is its axis there, heading away from the junction."""
    right, left = (Start(*_shifted(at, side * LANE / 2), at.heading) for side in (-1.0, 1.0))
    inbound = Start(left.x, left.y, at.heading + pi)
    # Away from the junction traffic keeps right of the axis, towards it left, seen outwards.
    lane_in, lane_out = (1, -1) if end == "start" else (-1, 1)
    return Mouth(road.id, end, lane_in, lane_out, inbound, right)


def _shifted(at: Start, left: float) -> tuple[float, float]:
    return at.x - left * sin(at.heading), at.y + left * cos(at.heading)


class Ids:
    """Ids of connecting roads, counted up."""

    def __init__(self, first: int) -> None:
        self.next = first

    def take(self) -> int:
        """The next free id."""
        self.next += 1
        return self.next - 1


def join(net: Network, junction: int, mouths: Sequence[Mouth], ids: Ids, limit_kmh: float) -> None:
    """All ways through a junction but U-turns."""
    for here in mouths:
        for there in mouths:
            if here is not there and here.pose_in is not None and there.pose_out is not None:
                connect(
                    net, junction, here, there, way(here.pose_in, there.pose_out), ids, limit_kmh
                )


def way(from_: Start, to: Start, radius: float = 10.0) -> list[Piece]:
    """Straight on, or a bend between two straights."""
    angle = wrap_angle(to.heading - from_.heading)
    if abs(angle) < 1e-6:
        distance = (to.x - from_.x) * cos(from_.heading) + (to.y - from_.y) * sin(from_.heading)
        return [Straight(distance)]
    chain: list[Piece] = [Straight(0.0), Bend(angle, radius, 2.0), Straight(0.0)]
    return fitted(from_, chain, (0, 2), (to.x, to.y))


def connect(
    net: Network,
    junction: int,
    here: Mouth,
    there: Mouth,
    pieces: Sequence[Piece],
    ids: Ids,
    limit_kmh: float,
) -> RoadSpec:
    """A connecting road whose axis is the centre of its only lane."""
    assert here.pose_in is not None
    road = RoadSpec(
        ids.take(),
        elements(here.pose_in, pieces),
        right=[LaneSpec(LANE, linked=(here.lane_in, there.lane_out))],
        heights=FLAT,
        lane_offset=LANE / 2,
        centre_mark=xodr.RoadMarkType.none,
        limits_kmh=[(0.0, limit_kmh)],
        junction=junction,
        predecessor=(here.road, here.end),
        successor=(there.road, there.end),
        kind=xodr.RoadType.town,
    )
    net.roads.append(road)
    assert here.lane_in is not None
    net.junctions.setdefault(junction, []).append(
        Connection(here.road, road.id, ((here.lane_in, -1),))
    )
    return road


@dataclass(frozen=True, slots=True)
class Leg:
    """A road that meets a roundabout."""

    angle: float  # rad, seen from the centre
    mouth: Mouth


def roundabout(
    net: Network,
    centre: tuple[float, float],
    radius: float,
    half_mouth: float,
    legs: Sequence[Leg],
    junctions: Sequence[int],
    ids: Ids,
    limit_kmh: float,
) -> None:
    """A one-lane roundabout, counter-clockwise, one junction per leg; legs in order of angle.

    Traffic leaves `half_mouth` rad before a leg and joins as much behind it.
    """
    rings = [
        _circulating(leg, following, centre, radius, half_mouth, ids.take(), limit_kmh)
        for leg, following in _pairs(legs)
    ]
    net.roads += rings
    for i, (leg, junction) in enumerate(zip(legs, junctions, strict=True)):
        before, after = rings[i - 1], rings[i]
        before.successor, after.predecessor = (junction, ""), (junction, "")
        off = _on_circle(centre, radius, leg.angle - half_mouth)
        on = _on_circle(centre, radius, leg.angle + half_mouth)
        source = Mouth(before.id, "end", -1, None, off, None)
        sink = Mouth(after.id, "start", None, -1, None, on)
        arc = [Bend(2.0 * half_mouth, radius, 0.0)]
        connect(net, junction, source, sink, arc, ids, limit_kmh)
        if leg.mouth.pose_out is not None:
            out = way(off, leg.mouth.pose_out)
            connect(net, junction, source, leg.mouth, out, ids, limit_kmh)
        if leg.mouth.pose_in is not None:
            in_ = way(leg.mouth.pose_in, on)
            connect(net, junction, leg.mouth, sink, in_, ids, limit_kmh)


def _pairs(legs: Sequence[Leg]) -> Iterator[tuple[Leg, Leg]]:
    yield from zip(legs, [*legs[1:], legs[0]], strict=True)


def _on_circle(centre: tuple[float, float], radius: float, angle: float) -> Start:
    x, y = centre[0] + radius * cos(angle), centre[1] + radius * sin(angle)
    return Start(x, y, wrap_angle(angle + pi / 2))


def _circulating(
    leg: Leg,
    following: Leg,
    centre: tuple[float, float],
    radius: float,
    half_mouth: float,
    id: int,
    limit_kmh: float,
) -> RoadSpec:
    span = (following.angle - leg.angle) % (2.0 * pi) - 2.0 * half_mouth
    start = _on_circle(centre, radius, leg.angle + half_mouth)
    return RoadSpec(
        id,
        elements(start, [Bend(span, radius, 0.0)]),
        right=[LaneSpec(LANE, mark=xodr.RoadMarkType.solid)],
        heights=FLAT,
        lane_offset=LANE / 2,
        limits_kmh=[(0.0, limit_kmh)],
        kind=xodr.RoadType.town,
    )
