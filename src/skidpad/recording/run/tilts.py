"""Pitch and roll that trajectories of a scenario file give: one row per moment and entity (`tilts.csv`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from skidpad.recording.files import csv_text, read_rows, write_bytes

FILE = "tilts.csv"
COLUMNS = {
    "time": "s, since the start",
    "entity": "name of what is tilted",
    "pitch": "rad in the world, nose down",
    "roll": "rad in the world, left side up",
}


@dataclass(frozen=True, slots=True)
class Tilted:
    """An entity is tilted at time t, s, as its trajectory says and not as the road is."""

    t: float
    entity: str
    pitch: float
    roll: float


def write_tilts(folder: Path, tilts: Sequence[Tilted]) -> None:
    """Writes the tilts of a run to `tilts.csv` in its folder; no file where there are none."""
    if not tilts:
        return
    rows = ((f"{x.t:.3f}", x.entity, f"{x.pitch:.6g}", f"{x.roll:.6g}") for x in tilts)
    write_bytes(folder / FILE, csv_text(COLUMNS, rows).encode())


def read_tilts(folder: Path) -> Mapping[tuple[int, str], tuple[float, float]]:
    """Returns roll and pitch by ms and entity, of a run's folder; nothing where the road alone tilts."""
    return dict(read_rows(folder / FILE, _tilt))


def _tilt(row: Mapping[str, str]) -> tuple[tuple[int, str], tuple[float, float]]:
    """Returns ms and entity, and roll and pitch, of a row of CSV."""
    key = round(1000.0 * float(row["time"])), row["entity"]
    return key, (float(row["roll"]), float(row["pitch"]))
