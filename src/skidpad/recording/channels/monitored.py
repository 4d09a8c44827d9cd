"""The folder of a monitored drive: its summary and the times, beside indicators and hazards."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import polars as pl

from skidpad.core.errors import FileError
from skidpad.core.files.reading import decode_json, read_bytes
from skidpad.recording.files import read_parquet, require_columns, write_bytes, write_parquet

SUMMARY = "monitor.json"
TIMING = "timing.parquet"
MOST = 1e9  # of cycles, and of ms in one: 12 days


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Writes the summary of a drive."""
    write_bytes(folder / SUMMARY, json.dumps(summary, indent=1, allow_nan=False).encode())


def read_summary(folder: Path) -> dict[str, Any]:
    """Returns the summary in a monitor's output folder; FileError without one."""
    path = folder / SUMMARY
    data = read_bytes(path, "`skidpad monitor` writes the summary")
    summary: dict[str, Any] = decode_json(data, str(path), dict[str, Any])
    return summary


def write_timing(folder: Path, times: pl.DataFrame) -> None:
    """Writes the times of a drive's cycles."""
    write_parquet(folder / TIMING, times)


def read_timing(folder: Path, columns: Mapping[str, Any]) -> pl.DataFrame | None:
    """Returns the times of a drive's cycles; None where none was measured.

    columns: Polars types of those that are asked for. FileError when one of them is missing, of another
    type or holds what is no time, and for cycles out of order.
    """
    path = folder / TIMING
    if not path.exists():
        return None
    times = require_columns(read_parquet(path)[0], columns, path)
    for name in columns:
        if not times[name].is_between(0.0, MOST).fill_null(False).all():
            raise FileError(f"{path}: column {name!r} holds what is not between 0 and {MOST:g}")
    if not times["cycle"].is_sorted():
        raise FileError(f"{path}: the cycles are out of order")
    return times if len(times) else None
