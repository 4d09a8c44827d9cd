"""What stands in and around town: signals, zebras, parked-car places, buildings, rails."""

from __future__ import annotations

from collections.abc import Sequence

from scenariogeneration import xodr

from mapmaker.furniture import (
    Numbers,
    box,
    crosswalk,
    guardrail,
    light,
    parking_space,
    sign,
    stop_line,
)
from mapmaker.network import Network, RoadSpec

CONTROLLERS = {5001: [1001, 1002], 5002: [1003, 1004]}  # west and east, north and south
LINE_BACK, ZEBRA_BACK, ZEBRA_WIDTH = 7.0, 3.0, 4.0  # m before the end of the street
CURB = 3.5  # m from the axis to the outer edge of a driving lane
STOPS = {1: "end", 2: "end", 3: "end", 4: "end"}  # ends of the cross at the rectangle
YIELDS = {8: "end", 9: "start", 30: "end"}  # ends at the roundabout
SPACES = 5  # per side and street of the two with parking lanes
SPACE = 6.5  # m

# Middle x, y and size of houses in the blocks; close to the corners, so that they hide who comes.
HOUSES = (
    (-30.0, 32.0, 34.0, 28.0, 12.0),
    (-95.0, 30.0, 50.0, 22.0, 9.0),
    (-165.0, 34.0, 36.0, 30.0, 10.0),
    (-28.0, 112.0, 30.0, 34.0, 14.0),
    (-120.0, 118.0, 60.0, 24.0, 8.0),
    (-30.0, -32.0, 34.0, 28.0, 10.0),
    (-110.0, -34.0, 60.0, 26.0, 12.0),
    (-165.0, -110.0, 30.0, 40.0, 9.0),
    (-30.0, -112.0, 32.0, 34.0, 11.0),
    (30.0, 32.0, 34.0, 28.0, 15.0),
    (100.0, 32.0, 60.0, 24.0, 9.0),
    (165.0, 34.0, 34.0, 28.0, 10.0),
    (40.0, 114.0, 50.0, 30.0, 8.0),
    (120.0, 116.0, 50.0, 26.0, 12.0),
    (30.0, -32.0, 34.0, 28.0, 9.0),
    (105.0, -36.0, 56.0, 30.0, 13.0),
    (165.0, -112.0, 30.0, 34.0, 10.0),
    (40.0, -114.0, 48.0, 30.0, 9.0),
)


def furnish_streets(net: Network, roads: dict[int, RoadSpec]) -> None:
    """Lights and zebras at the crossing, stop and yield signs, parking, houses."""
    ids = Numbers(20000)
    net.controllers = dict(CONTROLLERS)
    for number, street in enumerate((1, 2, 3, 4)):
        road = roads[street]
        # All four begin at the crossing, so traffic towards it drives on lane 1 to s = 0.
        edge = road_edge(road)
        stop_line(road, ids, LINE_BACK, (1, 1))
        light(road, 1001 + number, 0.5, edge + 0.5, (1, 1), 2.6)
        box(road, ids, xodr.ObjectType.pole, 0.5, edge + 0.5, (0.15, 0.15, 2.6), name="lightPost")
        crosswalk(road, ids, ZEBRA_BACK, 0.0, ZEBRA_WIDTH, 2.0 * edge)
    for street, end in STOPS.items():
        _sign_at(roads[street], ids, end, "206")
        stop_line(roads[street], ids, roads[street].length - 1.0, (-1, -1))
    for street, end in YIELDS.items():
        _sign_at(roads[street], ids, end, "205")
    for street in (1, 2):
        _parking(roads[street], ids)
    for x, y, length, width, height in HOUSES:
        _house(roads, ids, x, y, (length, width, height))
    for street in range(1, 10):
        road = roads[street]
        for s in range(25, int(road.length) - 20, 40):
            t = road_edge(road) + 2.2
            box(road, ids, xodr.ObjectType.streetLamp, float(s), t, (0.15, 0.15, 6.0))


def road_edge(road: RoadSpec) -> float:
    """m from the axis to the inner edge of the sidewalk."""
    return sum(lane.width for lane in road.right if lane.type is not xodr.LaneType.sidewalk)


def _sign_at(road: RoadSpec, ids: Numbers, end: str, type_: str) -> None:
    one_way = bool(road.lane_offset)
    edge = CURB / 2 + 1.5 if one_way else road_edge(road)
    if end == "end":
        sign(road, ids, road.length - 1.0, -edge - 0.6, type_=type_, lanes=(-1, -1))
    else:
        sign(road, ids, 1.0, edge + 0.6, type_=type_, lanes=(1, 1))


def _parking(road: RoadSpec, ids: Numbers) -> None:
    """Places along both sides, clear of the ends."""
    t = CURB + 2.3 / 2
    for k in range(SPACES):
        s = 45.0 + k * (SPACE + 8.0)
        for side in (-1.0, 1.0):
            parking_space(road, ids, s, side * t, SPACE, 2.3)


def _house(
    roads: dict[int, RoadSpec], ids: Numbers, x: float, y: float, size: tuple[float, float, float]
) -> None:
    """In coordinates of the straight street west or east of the crossing, which runs away from it."""
    road = roads[1] if x < 0.0 else roads[2]
    start = road.axis[0]
    s = abs(x - start.x)
    t = -y if x < 0.0 else y
    box(road, ids, xodr.ObjectType.building, round(s, 6), t, size)


def furnish_ring(ring: Sequence[RoadSpec], slip_out: RoadSpec, slip_in: RoadSpec) -> None:
    """Rails outside, and inside where no slip road leaves or joins; speed signs; lamps."""
    ids = Numbers(30000)
    right = -2 * CURB - 2.0
    for i, road in enumerate(ring):
        guardrail(road, ids, 1.3, 0.0, road.length)
        if i not in (1, 3):
            guardrail(road, ids, right - 0.3, 0.0, road.length)
    sign(ring[0], ids, 20.0, right - 0.9, type_="274", lanes=(-2, -1), value=80.0)
    sign(ring[4], ids, 20.0, right - 0.9, type_="274", lanes=(-2, -1), value=80.0)
    sign(slip_out, ids, 10.0, -CURB / 2 - 2.0, type_="274", lanes=(-1, -1), value=50.0)
    sign(slip_in, ids, 10.0, -CURB / 2 - 2.0, type_="274", lanes=(-1, -1), value=50.0)
