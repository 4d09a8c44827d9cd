"""Friction of lanes as a file says it: `<material friction>` of OpenDRIVE."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import NamedTuple

from skidpad.core.errors import FileError
from skidpad.core.files.reading import read_bytes
from skidpad.roads.map_files import map_file
from skidpad.roads.opendrive.reader import SIZE_MAX, Node, Reader, parse_root

FRICTION_MOST = 3.0  # as of `mu_ref`


class LaneMaterial(NamedTuple):
    """One lane between two places of its road, and the friction of its surface when dry."""

    road: int
    lane: int
    s_from: float  # m along the road
    s_to: float
    friction: float


def read_materials(map: str | Path) -> tuple[LaneMaterial, ...]:
    """Returns the frictions that a map's OpenDRIVE file says; () where it says none.

    map: as in `map_file`. FileError for a baked map, which keeps none, and for a faulty file.
    """
    path = map_file(map)
    if path.suffix == ".npz":
        raise FileError(f"map {path.name}: a baked map keeps no materials; give the .xodr file")
    root = parse_root(read_bytes(path, "map", SIZE_MAX), str(path))
    read = Reader(str(path))
    return tuple(m for road in root.findall("road") for m in _of_road(read, road))


def _of_road(read: Reader, road: Node) -> Iterator[LaneMaterial]:
    """Yields stretch (s in m, inf at the road's end) and friction of each lane material that names one."""
    sections = sorted(road.findall("lanes/laneSection"), key=lambda n: read.number(n, "s"))
    for section, after in pairwise([*sections, None]):
        start = read.number(section, "s")
        end = inf if after is None else read.number(after, "s")
        for lane in section.iterfind("*/lane"):
            found = [m for m in lane.findall("material") if m.get("friction") is not None]
            found.sort(key=lambda n: read.number(n, "sOffset"))
            for material, following in pairwise([*found, None]):
                low = start + read.number(material, "sOffset")
                high = end if following is None else start + read.number(following, "sOffset")
                yield LaneMaterial(
                    read.id(road), read.integer(lane, "id"), low, high, _friction(read, material)
                )


def _friction(read: Reader, material: Node) -> float:
    """Returns the friction of a material; FileError outside of (0, FRICTION_MOST]."""
    friction = read.number(material, "friction")
    if not 0.0 < friction <= FRICTION_MOST:
        raise read.fail(
            material, f"needs friction above 0 and up to {FRICTION_MOST:g}, got {friction:g}"
        )
    return friction
