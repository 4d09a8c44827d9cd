"""Which lane follows which, and which lies beside it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Ints32
from skidpad.roads.lanes import LaneKind
from skidpad.roads.opendrive.document import Document, Link, RoadRecord
from skidpad.roads.opendrive.lane_shapes import SHORTEST, LaneKey, LaneShape

DRIVABLE = (LaneKind.DRIVING, LaneKind.RAMP)


class Neighbours(NamedTuple):
    """Columns of the lane table, (L,)."""

    left: Ints32
    right: Ints32
    opposite: Ints32


def neighbours(shapes: Sequence[LaneShape], index: Mapping[LaneKey, int]) -> Neighbours:
    """Returns the adjacent drivable lanes of each lane, -1 for none; `left` and `right` of its own side."""
    out = Neighbours(*(np.full(len(shapes), -1, dtype=np.int32) for _ in Neighbours._fields))

    def drivable(key: LaneKey) -> int:
        i = index.get(key, -1)
        return i if i >= 0 and shapes[i].kind in DRIVABLE else -1

    for i, shape in enumerate(shapes):
        road, section, lane = shape.key
        side = 1 if lane > 0 else -1
        outer = drivable(LaneKey(road, section, lane + side))
        inner = drivable(LaneKey(road, section, lane - side)) if abs(lane) > 1 else -1
        # With right-hand traffic the centre of the road is on the left of both directions.
        inner_is_left = (side < 0) == shape.along
        out.left[i], out.right[i] = (inner, outer) if inner_is_left else (outer, inner)
        if abs(lane) == 1:
            out.opposite[i] = drivable(LaneKey(road, section, -side))
    return out


def successions(
    document: Document, shapes: Sequence[LaneShape], index: Mapping[LaneKey, int]
) -> set[tuple[int, int]]:
    """Returns pairs (lane, successor) of indices; ways that junctions list from both ends come once.

    Links that would lead against the traffic of a lane are left out.
    """
    pairs: set[tuple[int, int]] = set()
    for i, shape in enumerate(shapes):
        for at_exit in (True, False):
            for key, enters in _beyond(document, shape, at_exit):
                j = index.get(key)
                if j is not None and shapes[j].along == (enters == at_exit):
                    pairs.add((i, j) if at_exit else (j, i))
    return pairs


def compress_pairs(pairs: set[tuple[int, int]], lanes: int) -> tuple[Ints32, Ints32]:
    """Compresses pairs (a, b) to (start, b sorted by a): the b of lane i are b[start[i]:start[i + 1]]."""
    table = np.array(sorted(pairs), dtype=np.int32).reshape(-1, 2)
    start = np.searchsorted(table[:, 0], np.arange(lanes + 1)).astype(np.int32)
    return start, np.ascontiguousarray(table[:, 1])


def _beyond(document: Document, shape: LaneShape, at_exit: bool) -> Iterator[tuple[LaneKey, bool]]:
    """Yields lanes that touch one end of a lane, each with whether it is touched at its s = 0 side.

    at_exit: the end at which traffic leaves the lane.
    """
    road = document.roads[shape.key.road]
    at_high_s = shape.along == at_exit
    record = next(r for r in road.sections[shape.key.section].lanes if r.id == shape.key.lane)
    linked = record.successor if at_high_s else record.predecessor
    section = _next_section(road, shape.key.section, at_high_s)
    if section is not None:
        if linked is not None:
            yield LaneKey(road.id, section, linked), at_high_s
        return
    link = road.successor if at_high_s else road.predecessor
    if link is None:
        return
    if link.junction:
        yield from _through_junction(document, road, link, shape.key.lane)
    elif linked is not None and link.target in document.roads:
        yield _at_end(document.roads[link.target], link.at_start, linked), link.at_start


def _through_junction(
    document: Document, road: RoadRecord, link: Link, lane: int
) -> Iterator[tuple[LaneKey, bool]]:
    """Yields (lane key, enters at its start) for each lane that continues this one in the junction."""
    for connection in document.junctions.get(link.target, ()):
        connecting = document.roads.get(connection.connecting)
        if connection.incoming != road.id or connecting is None:
            continue
        for of_incoming, of_connecting in connection.lanes:
            if of_incoming == lane:
                yield (
                    _at_end(connecting, connection.at_start, of_connecting),
                    connection.at_start,
                )


def _next_section(road: RoadRecord, section: int, up: bool) -> int | None:
    """Returns the index of the adjacent section, those too short to be baked stepped over.

    None at the end.
    """
    step = 1 if up else -1
    section += step
    while 0 <= section < len(road.sections):
        record = road.sections[section]
        if record.s_end - record.s_start >= SHORTEST:
            return section
        section += step
    return None


def _at_end(road: RoadRecord, at_start: bool, lane: int) -> LaneKey:
    """Returns the key of a lane at the start or at the end of its road."""
    section = (
        _next_section(road, -1, True)
        if at_start
        else _next_section(road, len(road.sections), False)
    )
    return LaneKey(road.id, 0 if section is None else section, lane)
