"""What a drive left behind as named columns, and the comparison of two such records."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.recording.channels.mcap_files import McapRecording

Columns = dict[str, NDArray[Any]]  # first axis: rows, in the order of time
STRIDE = 19  # rows between stored values; prime, so that it meets all rows of a cycle
EVERY_ROW = 1000  # integers of fewer rows are stored whole: they say when something switches
ABSENT = -(2**31)  # an integer that was not logged
DOUBLE, SINGLE = 1e-9, 2.4e-7  # relative tolerances; the second is two steps of a 32 bit float
ZERO = {8: 1e-9, 4: 1e-6}  # absolute tolerances by size of the float, in the column's SI unit
UNREPEATABLE = ("cpu_s", "content_hash", "plan")  # of a segment's outcome: clock, hash, its input


@dataclass(frozen=True)
class Change:
    """One column that is no longer the stored one."""

    column: str
    first: int  # row
    largest: float  # in the column's unit; inf where values cannot be subtracted

    def __str__(self) -> str:
        return f"{self.column} from row {self.first} on by at most {self.largest:.3g}"


def of_table(table: pl.DataFrame) -> Columns:
    """Each column of a table; absent floats are NaN, absent integers ABSENT."""
    columns = {}
    for name in table.columns:
        column = table[name]
        if column.dtype.is_integer() or column.dtype == pl.Boolean:
            column = column.cast(pl.Int64).fill_null(ABSENT)
        elif column.dtype == pl.String:
            column = column.fill_null("")
        values = column.to_numpy()
        columns[name] = values.astype(str) if values.dtype == object else values
    return columns


def of_lines(file: Path) -> Columns:
    """The values of a JSONL file by kind of line and path within it."""
    found: dict[str, list[Any]] = {}
    for line in file.read_text().splitlines():
        record = json.loads(line)
        _gather(found, record.pop("event", "line"), record)
    return {name: _array(values) for name, values in found.items()}


def of_recording(file: Path) -> Columns:
    """The fields of all messages of a channel recording, one after the other."""
    found: dict[str, list[Any]] = {}
    for message in McapRecording(file).messages():
        prefix = f"{message.channel} {type(message.item).__name__}"
        for field, value in zip(message.item._fields, message.item, strict=True):
            _gather(found, f"{prefix} {field}", value)
    return {name: _array(values) for name, values in found.items()}


def _gather(found: dict[str, list[Any]], name: str, value: Any) -> None:
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in UNREPEATABLE:
                _gather(found, f"{name}.{key}", inner)
    elif isinstance(value, (list, tuple)):
        found.setdefault(f"{name} count", []).append(len(value))
        for inner in value:
            _gather(found, name, inner)
    else:
        found.setdefault(name, []).append(value)


def _array(values: list[Any]) -> NDArray[Any]:
    if any(isinstance(v, np.ndarray) for v in values):
        return np.concatenate([np.ravel(v) for v in values])
    if any(isinstance(v, str) for v in values):
        return np.array([str(v) for v in values])
    return np.array([np.nan if v is None else v for v in values])


def joined(parts: Iterable[tuple[str, Columns]]) -> Columns:
    """One record of several, each under its name."""
    return {f"{name}/{k}": v for name, part in parts for k, v in part.items()}


def digest(columns: Columns) -> str:
    """SHA-256 over all rows; NaN and -0.0 normalised."""
    total = hashlib.sha256()
    for name, values in sorted(columns.items()):
        if values.dtype.kind == "f":
            values = np.where(np.isnan(values), np.nan, values + 0.0)
        total.update(f"{name} {values.dtype} {values.shape}".encode())
        total.update(np.ascontiguousarray(values).tobytes())
    return total.hexdigest()


def sampled(columns: Columns) -> Columns:
    """What is stored of a record."""
    return {name: values[:: stride(values)] for name, values in columns.items()}


def stride(values: NDArray[Any]) -> int:
    """Rows between the stored ones."""
    return 1 if values.dtype.kind in "iub" and len(values) < EVERY_ROW else STRIDE


def first_contact(columns: Columns) -> float:
    """Row of the tick at which something was first touched; inf where nothing was."""
    ticks = columns.get("events/contact.tick")
    return float(ticks.min()) if ticks is not None and ticks.size else np.inf


def changes(stored: Columns, now: Columns, contact: float = np.inf) -> Iterator[Change]:
    """Columns of `now` outside the tolerances of `stored`, up to the tick of the first contact."""
    for name in sorted(stored.keys() | now.keys()):
        if contact < np.inf and not name.startswith("ticks/"):
            continue
        if name not in stored or name not in now:
            yield Change(f"{name} ({'new' if name in now else 'gone'})", 0, np.inf)
            continue
        step = stride(now[name])
        a, b = stored[name], now[name][::step]
        if contact < np.inf:
            n = ceil(contact / step)
            a, b = a[:n], b[:n]
        if a.shape[1:] != b.shape[1:]:
            yield Change(f"{name} (shape {a.shape} -> {b.shape})", 0, np.inf)
            continue
        n = min(len(a), len(b))
        change = _excess(a[:n], b[:n])
        if change.any():
            yield Change(name, step * int(np.argmax(change > 0.0)), float(change.max()))
        elif len(a) != len(b):
            yield Change(f"{name} ({len(a)} -> {len(b)} stored rows)", step * n, np.inf)


def _excess(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float64]:
    """Per row, the largest change outside the tolerance; 0 where there is none."""
    if a.dtype.kind != "f" or b.dtype.kind != "f":
        if a.dtype.kind in "iub" and b.dtype.kind in "iub":
            return _per_row(np.abs(a.astype(float) - b.astype(float)))
        return _per_row(np.where(a != b, np.inf, 0.0))
    relative, zero = (DOUBLE if a.dtype.itemsize == 8 else SINGLE), ZERO[a.dtype.itemsize]
    x, y = a.astype(float), b.astype(float)
    change = np.where(x == y, 0.0, np.abs(x - y))
    change = np.where(np.isnan(x) & np.isnan(y), 0.0, change)
    change = np.where(np.isnan(x) ^ np.isnan(y), np.inf, change)
    return _per_row(np.where(change > zero + relative * np.abs(x), change, 0.0))


def _per_row(change: NDArray[np.float64]) -> NDArray[np.float64]:
    return change.reshape(len(change), -1).max(axis=1) if change.size else np.zeros(len(change))
