"""A baked map as plain data: hashing, saving, loading."""

from __future__ import annotations

import hashlib
import json
from dataclasses import astuple, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import FileError
from skidpad.core.files.reading import UNUSABLE, read_arrays, read_bytes, unusable
from skidpad.core.setup import LanePosition
from skidpad.core.text.told import describe_value
from skidpad.roads.checked import EXTENT, check_arrays
from skidpad.roads.lanes import LaneSamples, LaneTable, SignalTable
from skidpad.roads.roadside import (
    Barrier,
    BarrierKind,
    Box,
    Bridge,
    ParkingSpace,
    Roadside,
    SignalHead,
)

SIZE_MAX = 512 * 1024**2  # bytes of a baked file
BAKED = "a baked map"
FORMAT = 2  # of the baked file; raise it when columns change


@dataclass(frozen=True, slots=True)
class BakedMap:
    """Everything that the importer makes of one file."""

    name: str
    samples: LaneSamples
    lanes: LaneTable
    signals: SignalTable
    roadside: Roadside = field(default_factory=Roadside)
    geo_reference: str = ""
    ego_start: LanePosition | None = None

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Returns all content as named arrays, in a fixed order: what is hashed and saved.

        Names are "samples.x" and alike. Shape and variant of boxes are left out.
        """
        out: dict[str, Any] = {}
        for prefix, table in (
            ("samples", self.samples),
            ("lanes", self.lanes),
            ("signals", self.signals),
        ):
            for column, values in zip(table._fields, table, strict=True):
                out[f"{prefix}.{column}"] = values
        return out | _roadside_arrays(self.roadside)

    def content_hash(self) -> str:
        """Returns the SHA-256 in hex over names, types, shapes and values of all arrays (X-1, L-6).

        Name, projection, ego's start and bridges are not part of it; -0.0 is 0.0 and every NaN the same.
        """
        digest = hashlib.sha256()
        for name, values in self.arrays().items():
            kind = values.dtype.newbyteorder("<")
            digest.update(f"{name} {kind.str} {values.shape};".encode())
            canonical = values.astype(kind) + 0 if values.dtype.kind == "f" else values.astype(kind)
            digest.update(
                np.where(canonical != canonical, np.nan, canonical).astype(kind).tobytes()
            )
        return digest.hexdigest()

    def save(self, path: Path) -> None:
        """Writes the map as compressed npz to exactly this path."""
        start = self.ego_start
        about = {
            "format": FORMAT,
            "name": self.name,
            "geo_reference": self.geo_reference,
            "ego_start": None if start is None else [start.road, start.lane, start.s],
            "bridges": [astuple(bridge) for bridge in self.roadside.bridges],
        }
        buffer = BytesIO()
        content: dict[str, Any] = {"about": np.array(json.dumps(about)), **self.arrays()}
        np.savez_compressed(buffer, **content)
        path.write_bytes(buffer.getvalue())


def load_baked(path: Path) -> BakedMap:
    """Returns what `BakedMap.save` wrote; FileError for anything else, another FORMAT included."""
    where = f"baked map {path}"
    arrays = read_arrays(read_bytes(path, "baked map", SIZE_MAX), where, BAKED)
    try:
        about = json.loads(str(arrays.pop("about")))
        if about["format"] != FORMAT:
            raise FileError(
                f"{where}: baked in format {describe_value(about['format'], 100)}, need {FORMAT}"
            )
        start = about["ego_start"]
        baked = BakedMap(
            name=str(about["name"]),
            samples=LaneSamples(*(arrays[f"samples.{c}"] for c in LaneSamples._fields)),
            lanes=LaneTable(*(arrays[f"lanes.{c}"] for c in LaneTable._fields)),
            signals=SignalTable(*(arrays[f"signals.{c}"] for c in SignalTable._fields)),
            roadside=replace(
                _roadside(arrays), bridges=tuple(_bridge(*b) for b in about.get("bridges", []))
            ),
            geo_reference=str(about["geo_reference"]),
            ego_start=None if start is None else _start(*start),
        )
        check_arrays(baked.samples, baked.lanes, baked.signals, where)
    except FileError:
        raise
    except UNUSABLE as error:
        raise unusable(where, BAKED, error) from None
    return baked


def _start(road: int, lane: int, s: float) -> LanePosition:
    """Returns the lane position of a road id, a lane id and an s in m."""
    return LanePosition(int(road), int(lane), float(s))


def _bridge(road: int, s_from: float, s_to: float, lanes: list[int] | None) -> Bridge:
    """Returns the bridge of a road id, s from and to in m, and the least and greatest lane id or None."""
    low_high = None if lanes is None else (int(lanes[0]), int(lanes[1]))
    return Bridge(int(road), float(s_from), float(s_to), low_high)


def _roadside_arrays(roadside: Roadside) -> dict[str, NDArray[Any]]:
    """Returns the roadside as named arrays, one row for each thing; `_roadside` reads them back."""
    barriers, boxes = roadside.barriers, roadside.boxes
    lines = [b.points for b in barriers]
    areas = list(roadside.crosswalks)
    return {
        "barriers.about": np.array([[b.kind, b.height] for b in barriers]).reshape(-1, 2),
        "barriers.points": np.concatenate([np.empty((0, 3)), *lines]),
        "barriers.sizes": np.array([len(p) for p in lines], dtype=np.int32),
        "boxes": np.array(
            [
                [b.label, b.x, b.y, b.z, b.yaw, b.length, b.width, b.height, b.solid, *b.rgb]
                for b in boxes
            ],
            dtype=np.float64,
        ).reshape(-1, 12),
        "heads": np.array(
            [[h.signal, h.x, h.y, h.z, h.heading, h.lamp_diameter] for h in roadside.heads],
            dtype=np.float64,
        ).reshape(-1, 6),
        "crosswalks.points": np.concatenate([np.empty((0, 3)), *areas]),
        "crosswalks.sizes": np.array([len(p) for p in areas], dtype=np.int32),
        "parking": np.array(
            [[p.x, p.y, p.z, p.yaw, p.length, p.width] for p in roadside.parking], dtype=np.float64
        ).reshape(-1, 6),
    }


def _split_arrays(arrays: dict[str, NDArray[Any]], name: str) -> list[NDArray[np.float64]]:
    """Returns the point arrays (n, 3) that `name.points` holds one after the other, split by `name.sizes`.

    [] for none. ValueError where sizes are no numbers of points or do not add up.
    """
    points, sizes = _rows(arrays, f"{name}.points", 3), arrays[f"{name}.sizes"]
    if sizes.dtype.kind not in "iu" or sizes.ndim != 1 or (sizes < 0).any():
        raise ValueError(f"{name}.sizes must hold numbers of points")
    if int(sizes.sum(dtype=np.int64)) != len(points):
        raise ValueError(f"{name}.sizes must add up to {len(points)} points")
    return np.split(points, np.cumsum(sizes)[:-1]) if len(sizes) else []


def _rows(arrays: dict[str, NDArray[Any]], name: str, width: int) -> NDArray[np.float64]:
    """Returns a table (n, width) as float64; ValueError for another shape or numbers beyond EXTENT."""
    table = arrays[name]
    if table.dtype.kind not in "iuf" or table.ndim != 2 or table.shape[1] != width:
        raise ValueError(f"{name} must hold rows of {width} numbers")
    if not (np.abs(table) <= EXTENT).all():
        raise ValueError(f"{name} holds what is no number of use")
    return np.asarray(table, dtype=np.float64)


def _roadside(arrays: dict[str, NDArray[Any]]) -> Roadside:
    """Returns the roadside that the named arrays of `_roadside_arrays` describe."""
    return Roadside(
        barriers=tuple(
            Barrier(BarrierKind(int(kind)), points, float(height))
            for (kind, height), points in zip(
                _rows(arrays, "barriers.about", 2), _split_arrays(arrays, "barriers"), strict=True
            )
        ),
        boxes=tuple(_box(*row) for row in _rows(arrays, "boxes", 12).tolist()),
        heads=tuple(
            SignalHead(int(signal), x, y, z, heading, diameter)
            for signal, x, y, z, heading, diameter in _rows(arrays, "heads", 6).tolist()
        ),
        crosswalks=tuple(_split_arrays(arrays, "crosswalks")),
        parking=tuple(ParkingSpace(*row) for row in _rows(arrays, "parking", 6).tolist()),
    )


def _box(label: float, x: float, y: float, z: float, yaw: float, *rest: float) -> Box:
    """Returns the box of a row of 12 numbers: label, x, y, z (m), yaw (rad), sizes (m), solid, r, g, b."""
    length, width, height, solid, r, g, b = rest
    rgb = (int(r), int(g), int(b))
    return Box(int(label), x, y, z, yaw, length, width, height, bool(solid), rgb)
