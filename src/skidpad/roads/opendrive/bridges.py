"""Bridges that a file names: `<bridge>` of OpenDRIVE (1.9.0, section 13.12, table 106)."""

from __future__ import annotations

from collections.abc import Iterator

from skidpad.roads.opendrive.document import Node, Reader, RoadRecord
from skidpad.roads.roadside import Bridge


def bridges_of(read: Reader, road: RoadRecord) -> Iterator[Bridge]:
    """Yields the bridges of a road, one for each `<validity>` that restricts it to some lanes.

    FileError without s and length, or for one of them below 0; what lies beyond the road is cut off.
    """
    for node in road.bridges:
        s, length = (_place(read, node, name) for name in ("s", "length"))
        end = round(min(s + length, road.length), 5)
        valid = node.findall("validity")
        lanes = [(read.integer(v, "fromLane"), read.integer(v, "toLane")) for v in valid]
        if s < end:
            for span in lanes or [None]:
                ends = None if span is None else (min(span), max(span))
                yield Bridge(road.id, round(s, 5), end, ends)


def _place(read: Reader, node: Node, name: str) -> float:
    """Returns a number of a node that must be 0 or more, m."""
    value = read.number(node, name)
    if value < 0.0:
        raise read.fail(node, f"needs {name} of 0 or more, got {value:g}")
    return value
