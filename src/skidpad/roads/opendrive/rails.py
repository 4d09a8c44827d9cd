"""Guard rails along the edges of roads, for files that draw nothing beside them (`--edges rail`).

They are written into the file, as objects of the road that they stand beside, so that every
simulator, sensor and report has the same ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.roads.edge import ROAD, RoadEdge
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.opendrive.document import Document, RoadRecord, parse
from skidpad.roads.opendrive.lane_shapes import LaneShape, lane_shapes
from skidpad.roads.opendrive.reader import Node, id_number

ASIDE = 0.3  # m from the edge to the rail, as on the bundled maps
FREE = 0.2  # m that a rail keeps from every road: in mouths and merges there is none
STRIDE = 2  # samples from corner to corner, about 2 m
SHORTEST = 3  # corners; a shorter piece guards nothing
HEIGHT = 0.75  # m, as on the bundled maps
VERSION = 1  # of what is made here; raise it when the same file gets other rails
FIRST_ID = 90_000_001  # of the objects, beyond all usual ones


class Corners(NamedTuple):
    """Foot line of one rail on the surface of its road, arrays (k,)."""

    s: Floats
    t: Floats


def add_rails(text: bytes, name: str) -> bytes:
    """Returns an OpenDRIVE text with guardrails added; unchanged where it has barriers of its own."""
    baked = bake(text, name)
    if baked.roadside.barriers:
        return text
    document = parse(text, name)
    root = etree.fromstring(text, etree.XMLParser(resolve_entities=False, no_network=True))
    nodes = {id_number(node.get("id", "")): node for node in root.findall("road")}
    edge = RoadEdge(baked.samples, baked.lanes)
    number = FIRST_ID
    for road, rails in _rails(document, edge):
        objects = _objects(nodes[road.id])
        for corners in rails:
            objects.append(_write_rail(number, corners))
            number += 1
    return bytes(etree.tostring(root, xml_declaration=True, encoding="UTF-8"))


def _rails(document: Document, edge: RoadEdge) -> Iterator[tuple[RoadRecord, list[Corners]]]:
    """Yields each road with the rails beside it."""
    outer: dict[tuple[int, int, bool], LaneShape] = {}
    for shape in lane_shapes(document):
        key = (shape.key.road, shape.key.section, shape.key.lane > 0)
        before = outer.get(key)
        if shape.kind in ROAD and (before is None or abs(shape.key.lane) > abs(before.key.lane)):
            outer[key] = shape
    for road in document.roads.values():
        beside = [shape for key, shape in outer.items() if key[0] == road.id]
        yield road, [c for shape in beside for c in _beside(road, shape, edge)]


def _beside(road: RoadRecord, shape: LaneShape, edge: RoadEdge) -> Iterator[Corners]:
    """Yields the pieces of rail along a lane's outer border to which no road comes nearer than FREE m."""
    order = np.argsort(shape.s_road)
    along = order[np.unique(np.append(np.arange(0, len(order), STRIDE), len(order) - 1))]
    s = shape.s_road[along]
    line = road.line.at(s)
    side = 1.0 if shape.key.lane > 0 else -1.0
    across = np.column_stack([-np.sin(line.heading), np.cos(line.heading)])
    middle = (shape.x[along] - line.x) * across[:, 0] + (shape.y[along] - line.y) * across[:, 1]
    roll = road.superelevation.at(s)[0]
    t = middle / np.cos(roll) + side * (0.5 * shape.width[along] + ASIDE)
    x = line.x + t * np.cos(roll) * across[:, 0]
    y = line.y + t * np.cos(roll) * across[:, 1]
    free = edge.beyond(x, y, road.elevation.at(s)[0] + t * np.sin(roll)) > FREE
    for begin, end in _stretches(free):
        piece = slice(begin, end)
        if end - begin >= SHORTEST:
            yield Corners(s[piece], t[piece])


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Returns (begin, end) of each run of True, the end excluded."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _objects(road: Node) -> Node:
    """Returns the road's node of objects; adds one behind its lanes where there is none."""
    found = road.find("objects")
    if found is None:
        found = etree.Element("objects")
        road.find("lanes").addnext(found)
    return found


def _write_rail(number: int, corners: Corners) -> Node:
    """Returns the OpenDRIVE object of a guard rail along the given corners."""
    rail = _element(
        "object",
        id=number,
        type="barrier",
        subtype="guardRail",
        name="guardRail",
        s=f"{corners.s[0]:.4f}",
        t=f"{corners.t[0]:.4f}",
        zOffset=0,
        hdg=0,
        height=HEIGHT,
        orientation="none",
    )
    outlines, outline = _element("outlines"), _element("outline", id=0, closed="false")
    rail.append(outlines)
    outlines.append(outline)
    for k, (s, t) in enumerate(zip(*corners, strict=True)):
        outline.append(
            _element("cornerRoad", id=k, s=f"{s:.4f}", t=f"{t:.4f}", dz=0, height=HEIGHT)
        )
    return rail


def _element(tag: str, **attributes: object) -> Node:
    """Returns an XML element with its attributes as text."""
    return etree.Element(tag, {name: str(value) for name, value in attributes.items()})
