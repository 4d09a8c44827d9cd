"""Signals of a file as they act on lanes, and the heads of its traffic lights."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from skidpad.core.geometry import wrap_angle
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.checked import kinds
from skidpad.roads.lanes import SignalKind, SignalTable
from skidpad.roads.opendrive.document import Document, RoadRecord
from skidpad.roads.opendrive.lane_shapes import LaneKey, LaneShape
from skidpad.roads.opendrive.links import DRIVABLE
from skidpad.roads.opendrive.reader import Node, Reader
from skidpad.roads.roadside import Box, SignalHead

LIGHTS = {"1000001", "1000007", "1000008", "1000009", "1000010", "1000011"}  # vehicle lights
KINDS = {
    "206": SignalKind.STOP,
    "205": SignalKind.YIELD,
    "274": SignalKind.SPEED_LIMIT,
    "293": SignalKind.CROSSWALK,
}
STOP_LINE = "294"  # German catalogue, as all numbers here
STOP_LINE_REACH = 40.0  # m between a head beyond a crossing and its stop line
HEAD_SIZE = 1.0  # m, height of a head whose file gives none
# A light whose lower edge the file puts lower than this is one whose zOffset is the foot of its post.
LOWEST_HEAD = 1.0  # m above the road (assumption; pedestrians must pass below a head)
# Lower edges of heads on posts beside and on arms above a road: MUTCD 2009, section 4D.15, asks for
# at least 8 ft and 15 ft, and 15 ft is 4.6 m.
ON_POST, ABOVE_ROAD = 2.4, 5.0  # m
POST_WIDTH = 0.15  # m
POST_RGB = (120, 120, 125)
STOREY = 3.0  # m of height between roads one above the other
BESIDE = 0.2  # m between a post and the lanes, below which it stands on the road


class Place(NamedTuple):
    """World position of a point given in road coordinates."""

    x: float
    y: float
    z: float
    heading: float  # of the reference line


class _Row(NamedTuple):
    """A row of the table, with its columns."""

    id: int
    kind: SignalKind
    x: float
    y: float
    z: float
    heading: float
    lane: int
    s: float
    value: float
    group: int


def road_place(road: RoadRecord, s: float, t: float, z_offset: float = 0.0) -> Place:
    """Returns the point at (s, t) in m of a road, `z_offset` m above its surface."""
    at = np.array([s])
    line = road.line.at(at)
    heading = float(line.heading[0])
    roll = float(road.superelevation.at(at)[0][0])
    across = t * np.cos(roll)  # seen from above
    return Place(
        float(line.x[0]) - across * np.sin(heading),
        float(line.y[0]) + across * np.cos(heading),
        float(road.elevation.at(at)[0][0]) + t * np.sin(roll) + z_offset,
        heading,
    )


def node_place(read: Reader, road: RoadRecord, node: Node) -> Place:
    """Returns where a <signal> or an <object> of a road stands."""
    s, t = read.number(node, "s"), read.number(node, "t")
    return road_place(road, s, t, read.number(node, "zOffset", 0.0))


def valid_lanes(read: Reader, node: Node) -> list[tuple[int, int]]:
    """Returns least and greatest lane id of each <validity> of a node."""
    found = node.findall("validity")
    ends = [sorted(read.integer(v, name) for name in ("fromLane", "toLane")) for v in found]
    return [(low, high) for low, high in ends]


def signal_kind(node: Node) -> SignalKind:
    """Returns what a <signal> demands, by its type's number in the German catalogue; OTHER for any else."""
    if node.get("type") in LIGHTS:
        return SignalKind.LIGHT
    return KINDS.get(node.get("type", ""), SignalKind.OTHER)


def signal_table(
    document: Document, shapes: Sequence[LaneShape], index: Mapping[LaneKey, int]
) -> SignalTable:
    """Returns one row per signal and lane, by lane, then s as the file has it.

    A stop line in reach moves `s` of the light or stop sign it belongs to.
    """
    read = Reader(document.file)
    rows: dict[tuple[int, int], _Row] = {}
    for row in _rows(read, document, shapes, index):
        rows.setdefault((row.id, row.lane), row)
    lines = list(_stop_lines(read, document, shapes, index))
    ordered = []
    for row in sorted(rows.values(), key=lambda r: (r.lane, r.s, r.id)):
        s = _nearest_line(row, lines)
        ordered.append(row._replace(s=s, heading=_heading(shapes[row.lane], s)))
    types = enumerate(kinds(SignalTable).values())
    return SignalTable(*(np.array([row[k] for row in ordered], dtype=t) for k, t in types))


def signal_heads(
    document: Document, table: SignalTable, shapes: Sequence[LaneShape]
) -> tuple[tuple[SignalHead, ...], tuple[Box, ...]]:
    """Returns a head for every light that governs some lane, and the posts that heads need.

    OpenDRIVE's zOffset is the lower edge of a head. Several editors write the foot of the post
    instead, so that the head would stand in the ground: such a head is put on a post of its own.
    """
    read = Reader(document.file)
    heads, posts = {}, []
    for _road, node in _signals(document):
        signal = read.id(node)
        governed = np.flatnonzero((table.id == signal) & (table.kind == SignalKind.LIGHT))
        if len(governed):
            i = governed[0]
            x, y, z, heading = (float(v[i]) for v in (table.x, table.y, table.z, table.heading))
            lower, middle = z, 0.5 * read.number(node, "height", HEAD_SIZE)
            above = read.number(node, "zOffset", 0.0)
            if above < LOWEST_HEAD:
                stands = not _is_on_lane(shapes, x, y, z)
                lower = round(z - above + (ON_POST if stands else ABOVE_ROAD), 5)
                if stands and signal not in heads:
                    posts.append(_post(x, y, min(z, z - above), heading, lower))
            heads[signal] = SignalHead(signal, x, y, lower + middle, heading)
    return tuple(heads[k] for k in sorted(heads)), tuple(posts)


def _post(x: float, y: float, z: float, heading: float, top: float) -> Box:
    """Returns the post from z up to `top`."""
    label, height = int(SemanticClass.POLE), round(top - z, 5)
    x, y, z, yaw = (round(v, 5) for v in (x, y, z, heading))
    return Box(label, x, y, z, yaw, POST_WIDTH, POST_WIDTH, height, rgb=POST_RGB)


def _is_on_lane(shapes: Sequence[LaneShape], x: float, y: float, z: float) -> bool:
    """Returns whether a post at this place would stand on a drivable lane, or nearer than BESIDE m to it."""
    for shape in shapes:
        if shape.kind not in DRIVABLE:
            continue
        away = np.hypot(shape.x - x, shape.y - y) - 0.5 * shape.width
        if ((away < BESIDE) & (np.abs(shape.z - z) < STOREY)).any():
            return True
    return False


def _signals(document: Document) -> Iterator[tuple[RoadRecord, Node]]:
    """Yields each signal node of the document with its road."""
    for road in document.roads.values():
        for node in road.signals:
            yield road, node


def _rows(
    read: Reader,
    document: Document,
    shapes: Sequence[LaneShape],
    index: Mapping[LaneKey, int],
) -> Iterator[_Row]:
    """Yields one row for each lane that a signal, or a reference to it, governs; stop lines are left out."""
    signals = {read.id(node): (road, node) for road, node in _signals(document)}
    places = [(id, road, node) for id, (road, node) in signals.items()]
    for road in document.roads.values():
        places += [(read.id(node), road, node) for node in road.references]
    for id, road, node in places:
        if id not in signals or signals[id][1].get("type") == STOP_LINE:
            continue
        home, signal = signals[id]
        head = node_place(read, home, signal)
        kind = signal_kind(signal)
        value = _limit(read, signal) if kind is SignalKind.SPEED_LIMIT else np.nan
        group = document.controllers.get(id, road.junction)
        for lane in _governed_lanes(read, node, road, shapes, index):
            s = _along(shapes[lane], read.number(node, "s"))
            if road.junction >= 0 and kind is not SignalKind.SPEED_LIMIT:
                s = 0.0  # one waits before the crossing, wherever the file puts the reference
            yield _Row(id, kind, *head[:3], np.nan, lane, s, value, group)


def _governed_lanes(
    read: Reader,
    node: Node,
    road: RoadRecord,
    shapes: Sequence[LaneShape],
    index: Mapping[LaneKey, int],
) -> list[int]:
    """Returns indices of drivable lanes on which a signal is valid: its validity, else its orientation."""
    s = read.number(node, "s")
    section = max((i for i, sec in enumerate(road.sections) if sec.s_start <= s + 1e-6), default=0)
    ranges = valid_lanes(read, node)
    orientation = node.get("orientation", "none")
    lanes = []
    for record in road.sections[section].lanes:
        i = index.get(LaneKey(road.id, section, record.id))
        if i is None or shapes[i].kind not in DRIVABLE:
            continue
        if ranges:
            valid = any(low <= record.id <= high for low, high in ranges)
        else:
            valid = orientation == "none" or shapes[i].along == (orientation == "+")
        if valid:
            lanes.append(i)
    return lanes


def _limit(read: Reader, signal: Node) -> float:
    """Returns the limit of a sign in m/s, given in km/h unless the file says mph or m/s; NaN for none.

    Where it has no value, its subtype is the number.
    """
    factor = (
        0.44704 if signal.get("unit") == "mph" else 1.0 if signal.get("unit") == "m/s" else 1 / 3.6
    )
    value = read.number(signal, "value", -1.0)
    if value < 0.0:
        value = read.number(signal, "subtype", np.nan) if signal.get("subtype") != "-1" else np.nan
    return value * factor


def _along(shape: LaneShape, s_road: float) -> float:
    """Returns the s in m along the lane that belongs to a road coordinate in m."""
    order = slice(None) if shape.along else slice(None, None, -1)
    return float(np.interp(s_road, shape.s_road[order], shape.s[order]))


def _heading(shape: LaneShape, s: float) -> float:
    """Returns the heading in rad of a lane at s in m, interpolated."""
    return wrap_angle(float(np.interp(s, shape.s, shape.heading)))


def _stop_lines(
    read: Reader,
    document: Document,
    shapes: Sequence[LaneShape],
    index: Mapping[LaneKey, int],
) -> Iterator[tuple[int, float]]:
    """Yields (lane index, s in m) of every stop line."""
    for road, node in _signals(document):
        if node.get("type") == STOP_LINE:
            for lane in _governed_lanes(read, node, road, shapes, index):
                yield lane, _along(shapes[lane], read.number(node, "s"))


def _nearest_line(row: _Row, lines: list[tuple[int, float]]) -> float:
    """Returns the s in m of the nearest stop line in reach for a light or stop sign, else the row's own.

    lines: (lane, s); in reach: on the same lane within STOP_LINE_REACH.
    """
    if row.kind not in (SignalKind.LIGHT, SignalKind.STOP):
        return row.s
    near = [s for lane, s in lines if lane == row.lane and abs(s - row.s) <= STOP_LINE_REACH]
    return min(near, key=lambda s: abs(s - row.s), default=row.s)
