"""The map town: streets of 400 m x 300 m inside a ring road of 2 km (decision C-11).

A rectangle of streets with a cross inside: four T-junctions where the cross meets the rectangle, a
signalised crossing in the middle, a roundabout in the north-east corner. The ring runs clockwise
with two lanes; a slip road leads from it to the roundabout and another one back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

from scenariogeneration import xodr

from mapmaker.crossings import (
    FLAT,
    LANE,
    Ids,
    Leg,
    Mouth,
    join,
    roundabout,
    street_mouth,
)
from mapmaker.network import Connection, LaneSpec, Mark, Network, RoadSpec
from mapmaker.paths import (
    Bend,
    Piece,
    Start,
    Straight,
    cut,
    elements,
    end,
    fitted,
    length,
)
from mapmaker.town_furniture import furnish_ring, furnish_streets
from skidpad.roads.opendrive.reference_line import Element

EAST, NORTH, WEST, SOUTH = 0.0, pi / 2, pi, -pi / 2
HALF_X, HALF_Y = 200.0, 150.0
SET_BACK = 18.0  # m from the middle of a junction to where its streets end
CORNER = 25.0  # m, radius of the rectangle's corners
TOWN_KMH, RING_KMH, SLIP_KMH, ROUNDABOUT_KMH = 50.0, 80.0, 50.0, 30.0

CROSSING, T_WEST, T_NORTH, T_EAST, T_SOUTH = 9000, 9001, 9002, 9003, 9004
ROUNDABOUT = (9010, 9011, 9012, 9013)
RING_EXIT, RING_ENTRY = 9020, 9021
ROUNDABOUT_CENTRE = (HALF_X, HALF_Y)
ROUNDABOUT_RADIUS, ROUNDABOUT_REACH = 18.0, 32.0
HALF_MOUTH = 0.62  # rad

RING_TOP, RING_START = 250.0, -150.0
RING_BEND = Bend(-pi / 2, 150.0, 40.0)  # 80 km/h ask for 0.35 g
RING_LANES = 2
SLIP_ANGLE = 0.2
SLIP_BEND = Bend(-SLIP_ANGLE, 200.0, 20.0)
EXIT_AT = 210.0  # m along the ring
SLIP_OUT, SLIP_IN = 30, 31

SIDEWALK = LaneSpec(2.5, xodr.LaneType.sidewalk)
PARKING = LaneSpec(2.3, xodr.LaneType.parking, Mark.solid)
PLAIN = (LaneSpec(LANE, mark=Mark.solid), SIDEWALK)
WITH_PARKING = (LaneSpec(LANE, mark=Mark.broken), PARKING, SIDEWALK)


@dataclass(frozen=True, slots=True)
class Street:
    """A two-lane street from one node's arm to another's."""

    id: int
    from_: int
    from_arm: float  # direction in which it leaves
    to: int
    to_arm: float  # direction in which the other end leaves its node
    parking: bool = False


NODES = {
    CROSSING: (0.0, 0.0),
    T_WEST: (-HALF_X, 0.0),
    T_NORTH: (0.0, HALF_Y),
    T_EAST: (HALF_X, 0.0),
    T_SOUTH: (0.0, -HALF_Y),
    ROUNDABOUT[0]: ROUNDABOUT_CENTRE,  # its junctions follow its legs
}
STREETS = (
    Street(1, CROSSING, WEST, T_WEST, EAST, parking=True),
    Street(2, CROSSING, EAST, T_EAST, WEST, parking=True),
    Street(3, CROSSING, NORTH, T_NORTH, SOUTH),
    Street(4, CROSSING, SOUTH, T_SOUTH, NORTH),
    Street(5, T_NORTH, WEST, T_WEST, NORTH),
    Street(6, T_WEST, SOUTH, T_SOUTH, WEST),
    Street(7, T_SOUTH, EAST, T_EAST, SOUTH),
    Street(8, T_NORTH, EAST, ROUNDABOUT[0], WEST),
    Street(9, ROUNDABOUT[0], SOUTH, T_EAST, NORTH),
)


def network() -> Network:
    """The whole map."""
    net = Network("town", ego_start=(1, -1, 20.0))
    ids = Ids(100)
    mouths: dict[int, list[tuple[float, Mouth]]] = {node: [] for node in NODES}
    for street in STREETS:
        _add_street(net, street, mouths)
    for node in (CROSSING, T_WEST, T_NORTH, T_EAST, T_SOUTH):
        join(net, node, [mouth for _, mouth in mouths[node]], ids, TOWN_KMH)
    ring, slip_in, slip_out = _ring(net)
    legs = [
        Leg(EAST, slip_out),
        Leg(NORTH, slip_in),
        *(Leg(arm % (2.0 * pi), mouth) for arm, mouth in mouths[ROUNDABOUT[0]]),
    ]
    roundabout(
        net,
        ROUNDABOUT_CENTRE,
        ROUNDABOUT_RADIUS,
        HALF_MOUTH,
        sorted(legs, key=lambda leg: leg.angle),
        ROUNDABOUT,
        ids,
        ROUNDABOUT_KMH,
    )
    streets = {road.id: road for road in net.roads}
    furnish_streets(net, streets)
    furnish_ring(ring, streets[SLIP_OUT], streets[SLIP_IN])
    return net


def _arm(node: int, direction: float) -> Start:
    x, y = NODES[node]
    reach = ROUNDABOUT_REACH if node == ROUNDABOUT[0] else SET_BACK
    return Start(x + reach * cos(direction), y + reach * sin(direction), direction)


def _junction(node: int, direction: float) -> int:
    if node != ROUNDABOUT[0]:
        return node
    return ROUNDABOUT[round((direction % (2.0 * pi)) / (pi / 2))]


def _add_street(net: Network, street: Street, mouths: dict[int, list[tuple[float, Mouth]]]) -> None:
    start, stop = _arm(street.from_, street.from_arm), _arm(street.to, street.to_arm)
    turn = (stop.heading + pi - start.heading + pi) % (2.0 * pi) - pi
    pieces: list[Piece]
    if abs(turn) < 1e-9:
        pieces = [Straight(abs(stop.x - start.x) + abs(stop.y - start.y))]
    else:
        chain: list[Piece] = [Straight(0.0), Bend(turn, CORNER, 10.0), Straight(0.0)]
        pieces = fitted(start, chain, (0, 2), (stop.x, stop.y))
    lanes = WITH_PARKING if street.parking else PLAIN
    road = RoadSpec(
        street.id,
        elements(start, pieces),
        left=lanes,
        right=lanes,
        heights=FLAT,
        centre_mark=Mark.broken,
        limits_kmh=[(0.0, TOWN_KMH)],
        predecessor=(_junction(street.from_, street.from_arm), ""),
        successor=(_junction(street.to, street.to_arm), ""),
        kind=xodr.RoadType.town,
    )
    net.roads.append(road)
    mouths[street.from_].append((street.from_arm, street_mouth(road, "start", start)))
    mouths[street.to].append((street.to_arm, street_mouth(road, "end", stop)))


def _ring(net: Network) -> tuple[list[RoadSpec], Mouth, Mouth]:
    """The ring with its slip roads; returns its roads and the slip roads' mouths at the roundabout."""
    side = Straight(160.0)
    chain: list[Piece] = [
        Straight(280.0), RING_BEND, side, RING_BEND, side, RING_BEND, side, RING_BEND, Straight(30.0),
    ]  # fmt: skip
    start = Start(RING_START, RING_TOP, EAST)
    pieces = fitted(start, chain, (4, 6), (start.x, start.y))
    axis, total = elements(start, pieces), length(pieces)
    corner = end(start, pieces[:2])  # where the eastern side begins, heading south
    shadow = end(Start(0.0, 0.0, 0.0), [SLIP_BEND]).x
    outer = (RING_LANES - 0.5) * LANE  # from the axis to the centre of the outermost lane

    out_start = Start(RING_START + EXIT_AT, RING_TOP - outer, EAST)
    slip_out = _slip_out(end(out_start, [SLIP_BEND]))
    slip_in_start = Start(HALF_X + ROUNDABOUT_REACH, HALF_Y - LANE / 2, EAST)
    slip_in = _slip_in(slip_in_start, corner.x - outer)
    merge = end(slip_in_start, slip_in)
    merge_at = length(pieces[:2]) + (corner.y - merge.y)

    cuts = [0.0, EXIT_AT, EXIT_AT + shadow, merge_at, merge_at + shadow, total]
    ring = _ring_roads(axis, cuts)
    connect_out = _slip_road(
        202, elements(out_start, [SLIP_BEND]), RING_EXIT, (20, "end"), (SLIP_OUT, "start"),
        linked=(-RING_LANES, -1),
    )  # fmt: skip
    road_out = _slip_road(
        SLIP_OUT, elements(end(out_start, [SLIP_BEND]), slip_out), -1, (202, "end"),
        (ROUNDABOUT[1], ""),
    )  # fmt: skip
    road_in = _slip_road(
        SLIP_IN, elements(slip_in_start, slip_in), -1, (ROUNDABOUT[0], ""), (RING_ENTRY, "")
    )
    connect_in = _slip_road(
        204, elements(merge, [SLIP_BEND]), RING_ENTRY, (SLIP_IN, "end"), (24, "start"),
        linked=(-1, -RING_LANES),
    )  # fmt: skip
    net.roads += [*ring, connect_out, road_out, road_in, connect_in]
    lanes = tuple((-i, -i) for i in range(1, RING_LANES + 1))
    net.junctions[RING_EXIT] = [
        Connection(20, 201, lanes),
        Connection(20, 202, ((-RING_LANES, -1),)),
    ]
    net.junctions[RING_ENTRY] = [Connection(22, 203, lanes), Connection(SLIP_IN, 204, ((-1, -1),))]
    arrival = end(end(out_start, [SLIP_BEND]), slip_out)
    return (
        ring,
        Mouth(SLIP_OUT, "end", -1, None, arrival, None),
        Mouth(SLIP_IN, "start", None, -1, None, slip_in_start),
    )


def _slip_out(start: Start) -> list[Piece]:
    """From the ring to the roundabout's northern leg, which it enters left of the leg's axis."""
    target = (HALF_X - LANE / 2, HALF_Y + ROUNDABOUT_REACH)
    chain: list[Piece] = [Straight(0.0), Bend(-(pi / 2 - SLIP_ANGLE), 40.0, 15.0), Straight(0.0)]
    return fitted(start, chain, (0, 2), target)


def _slip_in(start: Start, x_lane: float) -> list[Piece]:
    """From the roundabout's eastern leg to where the entry to the ring's outermost lane begins."""
    shape = end(Start(0.0, 0.0, SOUTH + SLIP_ANGLE), [SLIP_BEND])
    turn = Bend(-(pi / 2 - SLIP_ANGLE), 30.0, 15.0)
    bend = end(start, [Straight(5.0), turn])
    slope = (x_lane - shape.x - bend.x) / sin(SLIP_ANGLE)
    return [Straight(5.0), turn, Straight(slope)]


def _ring_roads(axis: tuple[Element, ...], cuts: list[float]) -> list[RoadSpec]:
    ids = (20, 201, 22, 203, 24)
    lanes = (
        LaneSpec(LANE, mark=Mark.broken),
        LaneSpec(LANE, mark=Mark.solid),
        LaneSpec(2.0, xodr.LaneType.shoulder),
    )
    roads = [
        RoadSpec(
            id,
            cut(axis, cuts[i], cuts[i + 1]),
            left=[LaneSpec(1.0, xodr.LaneType.shoulder)],
            right=lanes,
            heights=FLAT,
            limits_kmh=[(0.0, RING_KMH)],
            junction={201: RING_EXIT, 203: RING_ENTRY}.get(id, -1),
            predecessor=(ids[i - 1], "end"),
            successor=(ids[(i + 1) % len(ids)], "start"),
            kind=xodr.RoadType.rural,
        )
        for i, id in enumerate(ids)
    ]
    roads[0].successor, roads[2].successor = (RING_EXIT, ""), (RING_ENTRY, "")
    return roads


def _slip_road(
    id: int,
    axis: tuple[Element, ...],
    junction: int,
    predecessor: tuple[int, str],
    successor: tuple[int, str],
    linked: tuple[int, int] = (-1, -1),
) -> RoadSpec:
    return RoadSpec(
        id,
        axis,
        right=[
            LaneSpec(LANE, mark=Mark.solid, linked=linked),
            LaneSpec(1.5, xodr.LaneType.shoulder, linked=(None, None)),
        ],
        heights=FLAT,
        lane_offset=LANE / 2,
        centre_mark=Mark.solid if junction < 0 else Mark.broken,
        limits_kmh=[(0.0, SLIP_KMH)],
        junction=junction,
        predecessor=predecessor,
        successor=successor,
        kind=xodr.RoadType.rural,
    )
