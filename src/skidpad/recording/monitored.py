"""The folder of a monitored drive: its summary and the times, beside indicators and hazards."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl

from skidpad.core.errors import FileError
from skidpad.recording.files import read_parquet, write_bytes, write_parquet

SUMMARY = "monitor.json"
TIMING = "timing.parquet"


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write the summary of a drive."""
    write_bytes(folder / SUMMARY, json.dumps(summary, indent=1, allow_nan=False).encode())


def read_summary(folder: Path) -> dict[str, Any]:
    """The summary in a monitor's output folder."""
    path = folder / SUMMARY
    try:
        summary: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(
            f"{path}: cannot be read ({error.strerror}); `skidpad monitor` writes it"
        ) from error
    except ValueError as error:
        raise FileError(f"{path}: is not JSON ({error})") from error
    return summary


def write_timing(folder: Path, times: pl.DataFrame) -> None:
    """Write the times of a drive's cycles."""
    write_parquet(folder / TIMING, times)


def read_timing(folder: Path) -> pl.DataFrame | None:
    """The times of a drive's cycles; None where they were not measured."""
    return read_parquet(folder / TIMING)[0] if (folder / TIMING).exists() else None
