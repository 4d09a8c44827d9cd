"""A square grid of two-lane streets with sidewalks, with a junction at each crossing."""

from __future__ import annotations

from math import atan2, cos, pi, sin

from scenariogeneration import xodr

from mapmaker.crossings import FLAT, Ids, Mouth, join, street_mouth
from mapmaker.network import Mark, Network, RoadSpec
from mapmaker.paths import Start, Straight, elements
from mapmaker.town import PLAIN, SET_BACK, TOWN_KMH

FIRST_JUNCTION = 1_000_000
Node = tuple[int, int]  # column and row of a crossing


def network(name: str, side: float, every: float) -> Network:
    """A grid that is `side` m wide, its streets `every` m apart."""
    size = range(round(side / every) + 1)
    net, mouths = Network(name, ego_start=(1, -1, 20.0)), dict[int, list[Mouth]]()
    nodes = {(i, j): FIRST_JUNCTION + i * len(size) + j for i in size for j in size}
    for i, j in nodes:
        for there in ((i + 1, j), (i, j + 1)):
            if there in nodes:
                add_street(net, mouths, nodes, ((i, j), there), every)
    ids = Ids(len(net.roads) + 1)
    for junction, ends in mouths.items():
        join(net, junction, ends, ids, TOWN_KMH)
    return net


def add_street(
    net: Network,
    mouths: dict[int, list[Mouth]],
    nodes: dict[Node, int],
    between: tuple[Node, Node],
    every: float,
) -> None:
    """Adds the straight street between two neighbouring crossings, and its mouths."""
    here, there = between
    heading = atan2(there[1] - here[1], there[0] - here[0])
    ends = []
    for (i, j), way in ((here, heading), (there, heading + pi)):
        ends.append(Start(i * every + SET_BACK * cos(way), j * every + SET_BACK * sin(way), way))
    road = RoadSpec(
        len(net.roads) + 1,
        elements(ends[0], [Straight(every - 2.0 * SET_BACK)]),
        left=PLAIN,
        right=PLAIN,
        heights=FLAT,
        centre_mark=Mark.broken,
        limits_kmh=[(0.0, TOWN_KMH)],
        predecessor=(nodes[here], ""),
        successor=(nodes[there], ""),
        kind=xodr.RoadType.town,
    )
    net.roads.append(road)
    for node, end, at in zip(between, ("start", "end"), ends, strict=True):
        mouths.setdefault(nodes[node], []).append(street_mouth(road, end, at))
