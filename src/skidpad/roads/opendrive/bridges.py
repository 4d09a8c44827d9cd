"""Bridges that a file names: `<bridge>` of OpenDRIVE (1.9.0, section 13.12, table 106)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from skidpad.roads.opendrive.document import Node, Reader, RoadRecord
from skidpad.roads.roadside import Bridge


def bridges_of(read: Reader, road: RoadRecord) -> Iterator[Bridge]:
    """Yields the bridges of a road, one for each `<validity>` that restricts it to some lanes.

    FileError without s and length, or for one of them below 0; what lies beyond the road is cut off.
    """
    for node in road.bridges:
        s, length = (_place(read, node, name) for name in ("s", "length"))
        end = round(min(s + length, road.length), 5)
        whole = Bridge(road.id, round(s, 5), end)
        if s >= end:
            continue
        spans = [
            sorted(read.integer(valid, name) for name in ("fromLane", "toLane"))
            for valid in node.findall("validity")
        ]
        yield from [replace(whole, lanes=(low, high)) for low, high in spans] or [whole]


def _place(read: Reader, node: Node, name: str) -> float:
    """Returns a number of a node that must be 0 or more, m."""
    value = read.number(node, name)
    if value < 0.0:
        raise read.fail(node, f"needs {name} of 0 or more, got {value:g}")
    return value
