"""The folder of a monitored drive: its summary and the times, beside indicators and hazards."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl

from skidpad.core.reading import decode_json, read_bytes
from skidpad.recording.files import read_parquet, write_bytes, write_parquet

SUMMARY = "monitor.json"
TIMING = "timing.parquet"


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write the summary of a drive."""
    write_bytes(folder / SUMMARY, json.dumps(summary, indent=1, allow_nan=False).encode())


def read_summary(folder: Path) -> dict[str, Any]:
    """The summary in a monitor's output folder."""
    path = folder / SUMMARY
    data = read_bytes(path, "`skidpad monitor` writes the summary")
    summary: dict[str, Any] = decode_json(data, str(path), dict[str, Any])
    return summary


def write_timing(folder: Path, times: pl.DataFrame) -> None:
    """Write the times of a drive's cycles."""
    write_parquet(folder / TIMING, times)


def read_timing(folder: Path) -> pl.DataFrame | None:
    """The times of a drive's cycles; None where they were not measured."""
    return read_parquet(folder / TIMING)[0] if (folder / TIMING).exists() else None
