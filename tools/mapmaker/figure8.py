"""The map figure8: a motorway loop of 3 km that crosses itself, after decision M-6.

The axis is the left edge of four driving lanes of one direction. Left loop first, over itself on a
bridge, then the right loop. All bends have spirals; heights have level tangents at their knots.
"""

from __future__ import annotations

from itertools import pairwise
from math import pi, sin

from scenariogeneration import xodr

from mapmaker.furniture import (
    Numbers,
    box,
    gantry,
    guardrail,
    light,
    sign,
    stop_line,
)
from mapmaker.network import Connection, LaneSpec, Mark, Network, RoadSpec, stretch
from mapmaker.paths import (
    Bend,
    Heights,
    Piece,
    Start,
    Straight,
    elements,
    end,
    fitted,
    length,
)
from skidpad.roads.opendrive.reference_line import Element

LANE = 3.5
LANES = 4
SHOULDER = 2.5
MEDIAN = 1.0
RIGHT_EDGE = -LANES * LANE - SHOULDER
RAIL_LEFT, RAIL_RIGHT = MEDIAN + 0.3, RIGHT_EDGE - 0.3
QUARTER = pi / 2
ORIGIN = Start(0.0, 0.0, 0.0)

EXIT_FROM, EXIT_TO = 60.0, 150.0  # m along the axis
ENTRY_LENGTH = 90.0
RAMP_OFFSET = 22.0  # m between the axes of ramp and outermost lane
RAMP_ANGLE = pi / 18
RAMP_BEND = (250.0, 20.0)  # radius, spiral
RAMP_STRAIGHT = 150.0  # m parallel to the main road, under the bridge

EXIT_JUNCTION, ENTRY_JUNCTION = 9000, 9001
CONTROLLER = 5000
LIGHT_BEFORE_BEND = 60.0  # m from the first light's line to the tight bend's spiral
SLOW_BEFORE = 150.0  # m (decision M-6)
FAST, SLOW = 90.0, 60.0  # km/h
LIGHTS = (1001, 1002)
HEAD_BEYOND_LINE = 12.0  # m, so that the first car in line sees it

MAIN = (
    *(LaneSpec(LANE, mark=Mark.broken) for _ in range(LANES - 1)),
    LaneSpec(LANE, mark=Mark.solid),
    LaneSpec(SHOULDER, xodr.LaneType.shoulder),
)
VERGE = (LaneSpec(MEDIAN, xodr.LaneType.shoulder),)
ALL = (-1, -LANES)


def axis_pieces() -> list[Piece]:
    """The loop; the first straight and the one over the bridge are fitted to close it."""
    pieces: list[Piece] = [
        Straight(0.0),
        Bend(QUARTER, 82.0, 50.0),  # lane centres at R 84 to 94, the ego's at 87
        Straight(60.0),
        Bend(QUARTER, 180.0, 70.0),
        Straight(70.0),
        Bend(QUARTER, 185.0, 70.0),
        Straight(0.0),
        Bend(-QUARTER, 150.0, 70.0),
        Straight(70.0),
        Bend(-QUARTER, 150.0, 70.0),
        Straight(60.0),
        Bend(-QUARTER, 84.0, 50.0),  # innermost driving lane at R 71.75
    ]
    return fitted(ORIGIN, pieces, (0, 6), (0.0, 0.0))


def knots(starts: list[float], total: float) -> Heights:
    """A hill, the rise of 6 % to the bridge, the way down, and a dip."""
    bridge = 9.6
    up = starts[6] + 130.0  # the plateau begins
    down = up + 110.0
    foot = up - 1.5 * (bridge - 1.0) / 0.06  # steepest in the middle: 1.5 rise / length
    return Heights(
        (
            (0.0, 0.0),
            (starts[2], 0.0),
            (starts[3] + 150.0, 4.5),
            (foot - 30.0, 1.0),
            (foot, 1.0),
            (up, bridge),
            (down, bridge),
            (down + 300.0, 0.0),
            (down + 500.0, -3.0),
            (total - 250.0, 0.0),
            (total, 0.0),
        )
    )


def network() -> Network:
    """The whole map."""
    pieces = axis_pieces()
    starts = [length(pieces[:i]) for i in range(len(pieces) + 1)]
    total = starts[-1]
    axis = elements(ORIGIN, pieces)
    heights = knots(starts, total)
    ramp = _ramp_pieces()
    entry_from = EXIT_FROM + end(ORIGIN, ramp).x - ENTRY_LENGTH
    entry_to = entry_from + ENTRY_LENGTH
    cuts = [0.0, EXIT_FROM, EXIT_TO, entry_from, entry_to, *starts[2:7], *starts[8:11], total]
    lines = [starts[1] - LIGHT_BEFORE_BEND, starts[9] - 25.0]
    slow = [
        (lines[0] - SLOW_BEFORE, starts[2]),
        (lines[1] - SLOW_BEFORE, lines[1] + 15.0),
        (starts[11] - SLOW_BEFORE, total),
    ]
    main = _main_roads(axis, heights, cuts, slow)
    ramps = _ramps(ramp, main)
    net = Network("figure8", roads=[*main, *ramps], ego_start=(1, -2, 20.0))
    exit_, entry = main[1], main[3]
    all_lanes = tuple((-i, -i) for i in range(1, LANES + 2))
    net.junctions = {
        EXIT_JUNCTION: [
            Connection(main[0].id, exit_.id, all_lanes),
            Connection(main[0].id, ramps[0].id, ((-LANES, -1),)),
        ],
        ENTRY_JUNCTION: [
            Connection(main[2].id, entry.id, all_lanes),
            Connection(ramps[1].id, ramps[2].id, ((-1, -1),)),
        ],
    }
    net.controllers = {CONTROLLER: list(LIGHTS)}
    _furnish(main, ramps, cuts, lines, slow)
    return net


def _main_roads(
    axis: tuple[Element, ...],
    heights: Heights,
    cuts: list[float],
    slow: list[tuple[float, float]],
) -> list[RoadSpec]:
    spans = list(pairwise(cuts))
    ids = [101 if i == 1 else 103 if i == 3 else i + 1 for i in range(len(spans))]
    roads = []
    for i, (a, b) in enumerate(spans):
        road = stretch(
            ids[i],
            axis,
            heights,
            a,
            b,
            left=VERGE,
            right=MAIN,
            limits_kmh=_limits(a, b, slow),
            junction={1: EXIT_JUNCTION, 3: ENTRY_JUNCTION}.get(i, -1),
            predecessor=(ids[i - 1], "end"),
            successor=(ids[(i + 1) % len(ids)], "start"),
        )
        roads.append(road)
    roads[0].successor = (EXIT_JUNCTION, "")
    roads[2].successor = (ENTRY_JUNCTION, "")
    return roads


def _limits(a: float, b: float, slow: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Limits from a to b, each from its place relative to a."""
    changes = sorted({a, *(s for zone in slow for s in zone if a < s < b)})

    def limit(s: float) -> float:
        return SLOW if any(from_ <= s < to for from_, to in slow) else FAST

    return [(round(s - a, 6), limit(s)) for s in changes]


def _ramp_pieces() -> list[Piece]:
    """Away from the main road, parallel to it, and back."""
    away, back = Bend(-RAMP_ANGLE, *RAMP_BEND), Bend(RAMP_ANGLE, *RAMP_BEND)
    shift = end(ORIGIN, [away, back]).y
    slope = Straight((RAMP_OFFSET + shift) / sin(RAMP_ANGLE))
    return [away, slope, back, Straight(RAMP_STRAIGHT), back, slope, away]


def _ramps(pieces: list[Piece], main: list[RoadSpec]) -> list[RoadSpec]:
    axis = elements(Start(EXIT_FROM, -(LANES - 1) * LANE, 0.0), pieces)
    total = length(pieces)
    flat = Heights(((0.0, 0.0), (total, 0.0)))
    cuts = [0.0, EXIT_TO - EXIT_FROM, total - ENTRY_LENGTH, total]
    lanes = (LaneSpec(LANE, mark=Mark.solid), LaneSpec(SHOULDER, xodr.LaneType.shoulder))
    from_main = (
        LaneSpec(LANE, mark=Mark.solid, linked=(-LANES, 0)),
        LaneSpec(SHOULDER, xodr.LaneType.shoulder, linked=(None, 0)),
    )
    to_main = (
        LaneSpec(LANE, mark=Mark.solid, linked=(0, -LANES)),
        LaneSpec(SHOULDER, xodr.LaneType.shoulder, linked=(0, None)),
    )
    rest = {"limits_kmh": [(0.0, SLOW)], "kind": xodr.RoadType.motorway}
    exit_ = stretch(
        102, axis, flat, *cuts[0:2], right=from_main, junction=EXIT_JUNCTION,
        centre_mark=Mark.broken, predecessor=(main[0].id, "end"), successor=(50, "start"), **rest,
    )  # fmt: skip
    between = stretch(
        50, axis, flat, *cuts[1:3], right=lanes,
        predecessor=(102, "end"), successor=(ENTRY_JUNCTION, ""), **rest,
    )  # fmt: skip
    entry = stretch(
        104, axis, flat, *cuts[2:4], right=to_main, junction=ENTRY_JUNCTION,
        centre_mark=Mark.broken, predecessor=(50, "end"), successor=(main[4].id, "start"), **rest,
    )  # fmt: skip
    return [exit_, between, entry]


def _furnish(
    main: list[RoadSpec],
    ramps: list[RoadSpec],
    cuts: list[float],
    lines: list[float],
    slow: list[tuple[float, float]],
) -> None:
    ids = Numbers(20000)
    for i, road in enumerate(main):
        guardrail(road, ids, RAIL_LEFT, 0.0, road.length)
        if i not in (1, 3):
            guardrail(road, ids, RAIL_RIGHT, 0.0, road.length)
        for s in _every(48.0, cuts[i], cuts[i + 1]):
            box(road, ids, xodr.ObjectType.streetLamp, s, RAIL_LEFT + 0.7, (0.2, 0.2, 9.0))
    for road in ramps:
        guardrail(road, ids, -LANE - SHOULDER - 0.3, 0.0, road.length)
    guardrail(ramps[1], ids, 0.5, 0.0, ramps[1].length)
    for number, line in enumerate(lines):
        road, s = _on(main, cuts, line)
        stop_line(road, ids, s, ALL)
        light(road, LIGHTS[number], s + HEAD_BEYOND_LINE, -LANES * LANE / 2, ALL, 5.1)
        gantry(road, ids, s + HEAD_BEYOND_LINE + 0.6, RAIL_LEFT + 0.6, RAIL_RIGHT - 0.6)
    for from_, to in slow:
        for s, value in ((from_, SLOW), (to % cuts[-1], FAST)):
            road, s_road = _on(main, cuts, s)
            sides = [RAIL_LEFT + 0.5]
            if road.junction < 0:  # there the ramp runs where the right sign would stand
                sides.append(RAIL_RIGHT - 0.5)
            for t in sides:
                sign(road, ids, s_road, t, type_="274", lanes=ALL, value=value)
    for s in (EXIT_FROM - 40.0, cuts[5] + 150.0, cuts[8] + 20.0):
        road, s_road = _on(main, cuts, s)
        gantry(road, ids, s_road, RAIL_LEFT + 0.6, RAIL_RIGHT - 0.6)
    _buildings(main, cuts, ids)


def _every(step: float, a: float, b: float) -> list[float]:
    first = int(a // step) + 1
    return [round(k * step - a, 6) for k in range(first, int(b // step) + 1)]


def _on(roads: list[RoadSpec], cuts: list[float], s: float) -> tuple[RoadSpec, float]:
    i = max(k for k in range(len(roads)) if cuts[k] <= s)
    return roads[i], round(s - cuts[i], 6)


def _buildings(main: list[RoadSpec], cuts: list[float], ids: Numbers) -> None:
    """(s along the axis, t, size): halls and houses well clear of all roads."""
    for s, t, size in (
        (40.0, 40.0, (40.0, 18.0, 9.0)),
        (120.0, 45.0, (30.0, 22.0, 14.0)),
        (210.0, 38.0, (24.0, 14.0, 7.0)),
        (640.0, -60.0, (50.0, 24.0, 12.0)),
        (cuts[5] + 30.0, -45.0, (30.0, 20.0, 10.0)),
        (cuts[6] + 35.0, -50.0, (36.0, 20.0, 16.0)),
        (cuts[9] + 40.0, 40.0, (40.0, 20.0, 8.0)),
        (cuts[10] + 20.0, 42.0, (28.0, 18.0, 12.0)),
    ):
        road, s_road = _on(main, cuts, s)
        box(road, ids, xodr.ObjectType.building, s_road, t, size)
