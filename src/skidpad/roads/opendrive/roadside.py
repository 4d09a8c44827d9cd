"""Barriers, boxes, signal heads and crosswalks from the objects and signals of a file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import cos, sin

import numpy as np
import shapely

from skidpad.core.arrays import Floats
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import SignalTable
from skidpad.roads.opendrive.document import Document, RoadRecord
from skidpad.roads.opendrive.lane_shapes import LaneShape
from skidpad.roads.opendrive.reader import Node, Reader
from skidpad.roads.opendrive.signals import node_place, road_place, signal_heads, valid_lanes
from skidpad.roads.roadside import (
    UNPAINTED,
    Barrier,
    BarrierKind,
    Box,
    Bridge,
    ParkingSpace,
    Roadside,
)

BARRIER_STEP = 2.0  # m between the points of a barrier; 7 mm of chord at R 70
REPEATS_MAX = 1_000_000  # of one object
OBJECTS_MAX = (
    200_000  # boxes, corners and points of barriers of one map, which take 0.3 GB when drawn
)
CONTINUOUS = 2.0  # m between the pieces of an object that is repeated without a gap
THICKNESS = 0.3  # m, of an object for which the file gives no size

BARRIERS = {
    "guardrail": BarrierKind.GUARDRAIL,
    "barrier": BarrierKind.GUARDRAIL,
    "railing": BarrierKind.FENCE,
    "fence": BarrierKind.FENCE,
    "wall": BarrierKind.WALL,
    "soundbarrier": BarrierKind.WALL,
    "kerb": BarrierKind.KERB,
    "curb": BarrierKind.KERB,
}
BARRIER_HEIGHTS = {
    BarrierKind.GUARDRAIL: 0.75,
    BarrierKind.WALL: 2.0,
    BarrierKind.KERB: 0.12,
    BarrierKind.FENCE: 1.2,
}
LABELS = {
    "building": (SemanticClass.BUILDING, UNPAINTED),
    "pole": (SemanticClass.POLE, (120, 120, 125)),
    "streetLamp": (SemanticClass.POLE, (120, 120, 125)),
    "gantry": (SemanticClass.STATIC, (110, 112, 118)),
    "bridge": (SemanticClass.BRIDGE, (140, 140, 140)),
    "tree": (SemanticClass.VEGETATION, (60, 95, 45)),
    "vegetation": (SemanticClass.VEGETATION, (60, 95, 45)),
    "sign": (SemanticClass.TRAFFIC_SIGN, (200, 200, 205)),
    "obstacle": (SemanticClass.STATIC, (130, 130, 130)),
}


def roadside(document: Document, signals: SignalTable, shapes: Sequence[LaneShape]) -> Roadside:
    """Returns what stands beside the roads; nothing is made up for files without objects.

    FileError beyond OBJECTS_MAX objects and corners. Objects of types without a meaning here are left out.
    """
    read = Reader(document.file)
    barriers: list[Barrier] = []
    boxes: list[Box] = []
    crosswalks: list[Floats] = []
    parking: list[ParkingSpace] = []
    count = 0.0
    for road in document.roads.values():
        for node in road.objects:
            type_ = node.get("type", "none")
            barrier = _barrier_kind(node)
            count += _amount(read, road, node, barrier is not None)
            if count > OBJECTS_MAX:
                raise read.fail(
                    node,
                    f"brings the map beyond {OBJECTS_MAX} objects and corners beside its roads",
                )
            if barrier is not None:
                barriers += _barriers(read, road, node, barrier)
            elif type_ == "crosswalk":
                crosswalks += [np.round(p, 5) for p in _outlines(read, road, node)]
            elif type_ == "parkingSpace":
                parking.append(_parking(read, road, node))
            elif type_ in LABELS:
                boxes += _boxes(read, road, node, type_)
    heads, posts = signal_heads(document, signals, shapes)
    return Roadside(
        tuple(barriers),
        (*boxes, *posts),
        heads,
        tuple(crosswalks),
        tuple(parking),
        tuple(b for road in document.roads.values() for b in bridges_of(read, road)),
    )


def _amount(read: Reader, road: RoadRecord, node: Node, barrier: bool) -> float:
    """Returns about how many boxes and points an object will make, before any is made."""
    count = 1.0 + len(node.findall(".//cornerLocal")) + len(node.findall(".//cornerRoad"))
    for repeat in node.findall("repeat"):
        length = read.number(repeat, "length", 0.0)
        if barrier:
            count += min(length, road.length) / BARRIER_STEP
        else:
            count += length / max(read.number(repeat, "distance", 0.0) or CONTINUOUS, 1e-9)
    return count


def _barrier_kind(node: Node) -> BarrierKind | None:
    """Returns the kind of an object whose type is one of BARRIERS, by subtype or name before type.

    None for any other type, whatever subtype and name say.
    """
    type_ = node.get("type", "").lower()
    if type_ not in BARRIERS:
        return None
    for text in (node.get("subtype"), node.get("name")):
        if text and text.lower() in BARRIERS:
            return BARRIERS[text.lower()]
    return BARRIERS[type_]


def _barriers(read: Reader, road: RoadRecord, node: Node, kind: BarrierKind) -> list[Barrier]:
    """Returns the barriers of an object: along its repeats, else its outlines, else a straight line."""
    height = read.number(node, "height", 0.0) or BARRIER_HEIGHTS[kind]
    lines = [_repeated_line(read, road, node, r) for r in node.findall("repeat")]
    if not lines:
        lines = [*_outlines(read, road, node)] or [_straight_line(read, road, node)]
    return [Barrier(kind, np.round(line, 5), height) for line in lines if len(line) >= 2]


def _aside(read: Reader, node: Node, repeat: Node) -> tuple[float, float]:
    """Returns t in m where a repetition starts and ends; where the file leaves them out, the object's."""
    start = read.number(repeat, "tStart", read.number(node, "t", 0.0))
    return start, read.number(repeat, "tEnd", start)


def _repeated_line(read: Reader, road: RoadRecord, node: Node, repeat: Node) -> Floats:
    """Returns the points (n, 3) in m of a continuous object along the road, up to the road's end."""
    s = read.number(repeat, "s", read.number(node, "s"))
    length = min(read.number(repeat, "length", 0.0), road.length - s)
    n = max(int(np.ceil(length / BARRIER_STEP)), 1) + 1
    t = np.linspace(*_aside(read, node, repeat), n)
    up = np.linspace(
        read.number(repeat, "zOffsetStart", 0.0), read.number(repeat, "zOffsetEnd", 0.0), n
    )
    return _points(road, np.linspace(s, s + length, n), t, up)


def _points(road: RoadRecord, s: Floats, t: Floats, up: Floats) -> Floats:
    """Returns world points (n, 3) in m for road coordinates s, t and heights above the road."""
    line = road.line.at(s)
    roll = road.superelevation.at(s)[0]
    across = t * np.cos(roll)  # seen from above
    return np.column_stack(
        [
            line.x - across * np.sin(line.heading),
            line.y + across * np.cos(line.heading),
            road.elevation.at(s)[0] + t * np.sin(roll) + up,
        ]
    )


def _straight_line(read: Reader, road: RoadRecord, node: Node) -> Floats:
    """Returns the two ends (2, 3) of an object with a length only, centred on its place; (0, 3) without."""
    place = node_place(read, road, node)
    yaw = place.heading + read.number(node, "hdg", 0.0)
    half = 0.5 * read.number(node, "length", 0.0)
    if half <= 0.0:
        return np.empty((0, 3))
    step = np.array([cos(yaw), sin(yaw), 0.0]) * half
    line: Floats = np.array(place[:3]) + np.array([-step, step])
    return line


def _outlines(read: Reader, road: RoadRecord, node: Node) -> Iterator[Floats]:
    """Yields corner polygons (n, 3) in world coordinates; a rectangle when only a size is given."""
    place = node_place(read, road, node)
    yaw = place.heading + read.number(node, "hdg", 0.0)
    outlines = _outline_nodes(node)
    for outline in outlines:
        local = [
            [read.number(c, "u"), read.number(c, "v"), read.number(c, "z", 0.0)]
            for c in outline.findall("cornerLocal")
        ]
        on_road = [
            [read.number(c, "s"), read.number(c, "t"), read.number(c, "dz", 0.0)]
            for c in outline.findall("cornerRoad")
        ]
        if local:
            yield _turn_points(np.array(local), place[:3], yaw)
        elif on_road:
            s, t, up = np.array(on_road).T
            yield _points(road, s, t, up)
    length, width = read.number(node, "length", 0.0), read.number(node, "width", 0.0)
    if not outlines and length > 0.0 and width > 0.0:
        corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=np.float64)
        yield _turn_points(corners * (length / 2, width / 2, 1.0), place[:3], yaw)


def _outline_nodes(node: Node) -> list[Node]:
    """Returns the outline nodes of an object, in the old and the new place."""
    return [*node.findall("outline"), *node.findall("outlines/outline")]


def _turn_points(points: Floats, origin: tuple[float, ...], yaw: float) -> Floats:
    """Returns the points (n, 3) turned about z by yaw in rad and then moved by the origin."""
    c, s = cos(yaw), sin(yaw)
    out: Floats = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + np.array(origin)
    return out


def _boxes(read: Reader, road: RoadRecord, node: Node, type_: str) -> list[Box]:
    """Returns the boxes of an object: one around each outline, or one at each of its places."""
    label, rgb = LABELS[type_]
    if "sign" in (node.get("subtype"), node.get("name")):
        label, rgb = LABELS["sign"]
    radius = read.number(node, "radius", 0.0)
    length = read.number(node, "length", 0.0) or 2.0 * radius or THICKNESS
    width = read.number(node, "width", 0.0) or 2.0 * radius or THICKNESS
    height = read.number(node, "height", 0.0) or 1.0
    if _is_outlined(node):
        height = read.number(node, "height", 0.0) or max(_heights(read, node), default=1.0)
        return [_around(o, height, int(label), rgb) for o in _outlines(read, road, node)]
    boxes = []
    for s, t, up in _places(read, node):
        place = road_place(road, s, t, up)
        yaw = place.heading + read.number(node, "hdg", 0.0)
        x, y, z, yaw = (round(v, 5) for v in (place.x, place.y, place.z, yaw))
        boxes.append(Box(int(label), x, y, z, yaw, length, width, height, rgb=rgb))
    return boxes


def _is_outlined(node: Node) -> bool:
    """Returns whether corners alone say how large an object is, as editors write buildings."""
    sized = any(node.get(name) for name in ("length", "width", "radius"))
    return not sized and not node.findall("repeat") and len(_outline_nodes(node)) > 0


def _heights(read: Reader, node: Node) -> list[float]:
    """Returns the heights in m of corners above their feet, where these are given."""
    corners = [
        c
        for o in _outline_nodes(node)
        for c in [*o.findall("cornerLocal"), *o.findall("cornerRoad")]
    ]
    return [h for c in corners if (h := read.number(c, "height", 0.0)) > 0.0]


def _around(corners: Floats, height: float, label: int, rgb: tuple[int, int, int]) -> Box:
    """Returns the smallest upright box around an outline (n, 3) in m, THICKNESS wide at least."""
    turned = shapely.oriented_envelope(shapely.MultiPoint(corners[:, :2]))
    ring = shapely.get_coordinates(turned)
    if len(ring) < 4:  # all corners on a line
        ring = shapely.get_coordinates(
            shapely.MultiPoint(corners[:, :2]).buffer(THICKNESS / 2.0).envelope
        )
    along, across = ring[1] - ring[0], ring[2] - ring[1]
    x, y = ring[:4].mean(axis=0)
    numbers = (x, y, corners[:, 2].min(), np.arctan2(along[1], along[0]))
    x, y, z, yaw = (round(float(v), 5) for v in numbers)
    length, width = (max(float(np.hypot(*side)), THICKNESS) for side in (along, across))
    return Box(label, x, y, z, yaw, length, width, height, rgb=rgb)


def _parking(read: Reader, road: RoadRecord, node: Node) -> ParkingSpace:
    """Returns the parking space of an object; 5 m by 2 m where the file gives no size."""
    place = node_place(read, road, node)
    yaw = place.heading + read.number(node, "hdg", 0.0)
    numbers = (place.x, place.y, place.z, yaw)
    x, y, z, yaw = (round(v, 5) for v in numbers)
    return ParkingSpace(
        x, y, z, yaw, read.number(node, "length", 5.0), read.number(node, "width", 2.0)
    )


def _places(read: Reader, node: Node) -> Iterator[tuple[float, float, float]]:
    """Yields (s, t, zOffset) in m of an object: its own place, or those of its repetitions instead.

    FileError where a repetition has no positive step or more than REPEATS_MAX places.
    """
    repeats = node.findall("repeat")
    if not repeats:
        yield read.number(node, "s"), read.number(node, "t"), read.number(node, "zOffset", 0.0)
    for repeat in repeats:
        step, length = (
            read.number(repeat, "distance", 0.0) or CONTINUOUS,
            read.number(repeat, "length", 0.0),
        )
        if step <= 0.0 or length / step > REPEATS_MAX:
            raise read.fail(
                node, f"needs a repeat distance that gives at most {REPEATS_MAX} objects"
            )
        for k in range(int(length / step) + 1):
            share = k * step / length if length > 0.0 else 0.0
            t0, t1 = _aside(read, node, repeat)
            z0 = read.number(repeat, "zOffsetStart", 0.0)
            z1 = read.number(repeat, "zOffsetEnd", 0.0)
            yield (
                read.number(repeat, "s", read.number(node, "s")) + k * step,
                t0 + share * (t1 - t0),
                z0 + share * (z1 - z0),
            )


def bridges_of(read: Reader, road: RoadRecord) -> Iterator[Bridge]:
    """Yields the bridges of a road (OpenDRIVE 1.9.0, section 13.12), one for each `<validity>` of some lanes.

    FileError without s and length, or for one of them below 0; what lies beyond the road is cut off.
    """
    for node in road.bridges:
        s, length = (_place(read, node, name) for name in ("s", "length"))
        end = round(min(s + length, road.length), 5)
        whole = Bridge(road.id, round(s, 5), end)
        if s >= end:
            continue
        yield from [replace(whole, lanes=span) for span in valid_lanes(read, node)] or [whole]


def _place(read: Reader, node: Node, name: str) -> float:
    """Returns a number of a node that must be 0 or more, m."""
    value = read.number(node, name)
    if value < 0.0:
        raise read.fail(node, f"needs {name} of 0 or more, got {value:g}")
    return value
