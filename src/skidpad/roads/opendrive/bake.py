"""OpenDRIVE text to a baked map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import FileError, NoLaneError
from skidpad.core.setup import LanePosition
from skidpad.roads.baked import BakedMap
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.opendrive.document import Document, parse
from skidpad.roads.opendrive.lane_shapes import LaneShape, lane_shapes
from skidpad.roads.opendrive.links import compress_pairs, neighbours, successions
from skidpad.roads.opendrive.roadside import roadside
from skidpad.roads.opendrive.signals import signal_table

EGO_START = "skidpad.ego_start"  # our maps name a good start: road, lane, s

# Stored digits. Mathematical functions differ between processors in the last place; rounding far
# above that gives the same content hash everywhere.
DIGITS = {
    "x": 5,
    "y": 5,
    "z": 5,
    "s": 5,
    "s_road": 5,
    "width": 5,
    "heading": 7,
    "curvature": 8,
    "grade": 7,
    "bank": 7,
    "limit": 6,
}


def bake(text: bytes, name: str, file: str = "") -> BakedMap:
    """Returns the baked map of OpenDRIVE text; `file` is named in errors.

    FileError for a faulty file, NoLaneError for one without lanes.
    """
    document = parse(text, file or name)
    shapes = list(lane_shapes(document))
    if not shapes:
        raise NoLaneError(f"{document.file}: has no lane")
    index = {shape.key: i for i, shape in enumerate(shapes)}
    signals = signal_table(document, shapes, index)
    return BakedMap(
        name=name,
        samples=_samples(shapes),
        lanes=_table(document, shapes),
        signals=signals._replace(
            **{k: np.round(getattr(signals, k), DIGITS[k]) for k in ("x", "y", "z", "s", "heading")}
        ),
        roadside=roadside(document, signals, shapes),
        geo_reference=document.geo_reference,
        ego_start=_ego_start(document),
    )


def _samples(shapes: Sequence[LaneShape]) -> LaneSamples:
    """Returns the samples of all lanes one after the other, rounded, with headings in (-pi, pi]."""

    def column(name: str) -> NDArray[Any]:
        values = np.concatenate([getattr(shape, name) for shape in shapes])
        if name == "heading":
            values = np.pi - np.remainder(np.pi - values, 2.0 * np.pi)
        return np.round(values, DIGITS[name]) + 0.0 if name in DIGITS else values

    sizes = [len(shape.s) for shape in shapes]
    columns = {f: column(f) for f in LaneSamples._fields if f != "lane"}
    return LaneSamples(**columns, lane=np.repeat(np.arange(len(shapes), dtype=np.int32), sizes))


def _table(document: Document, shapes: Sequence[LaneShape]) -> LaneTable:
    """Returns the table of lanes with their neighbours, successors and predecessors as indices."""
    index = {shape.key: i for i, shape in enumerate(shapes)}
    pairs = successions(document, shapes, index)
    next_start, next_lane = compress_pairs(pairs, len(shapes))
    prev_start, prev_lane = compress_pairs({(b, a) for a, b in pairs}, len(shapes))
    beside = neighbours(shapes, index)
    size = np.array([len(shape.s) for shape in shapes], dtype=np.int32)
    return LaneTable(
        road=np.array([shape.key.road for shape in shapes], dtype=np.int32),
        lane_id=np.array([shape.key.lane for shape in shapes], dtype=np.int32),
        section=np.array([shape.key.section for shape in shapes], dtype=np.int32),
        first=(np.cumsum(size) - size).astype(np.int32),
        size=size,
        length=np.round([shape.s[-1] for shape in shapes], DIGITS["s"]),
        kind=np.array([shape.kind for shape in shapes], dtype=np.uint8),
        junction=np.array(
            [document.roads[shape.key.road].junction for shape in shapes], dtype=np.int32
        ),
        **beside._asdict(),
        next_start=next_start,
        next_lane=next_lane,
        prev_start=prev_start,
        prev_lane=prev_lane,
    )


def _ego_start(document: Document) -> LanePosition | None:
    """Returns the ego's start that the header's userData EGO_START names; None where it names none.

    FileError where it is not a road, a lane and s.
    """
    text = document.user_data.get(EGO_START)
    if text is None:
        return None
    try:
        road, lane, s = text.split()
        return LanePosition(int(road), int(lane), float(s))
    except ValueError:
        raise FileError(
            f"{document.file}: userData {EGO_START} needs road, lane and s, got {text!r}"
        ) from None
