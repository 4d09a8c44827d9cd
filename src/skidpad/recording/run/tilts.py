"""Pitch and roll that trajectories of a scenario file give: one row per moment and entity (`tilts.csv`)."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from skidpad.core.errors import FileError
from skidpad.recording.files import write_bytes

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
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((f"{x.t:.3f}", x.entity, f"{x.pitch:.6g}", f"{x.roll:.6g}") for x in tilts)
    write_bytes(folder / FILE, text.getvalue().encode())


def read_tilts(folder: Path) -> Mapping[tuple[int, str], tuple[float, float]]:
    """Returns roll and pitch by ms and entity, of a run's folder; nothing where the road alone tilts."""
    file = folder / FILE
    if not file.is_file():
        return {}
    try:
        with file.open(encoding="utf-8", newline="") as lines:
            return {
                (round(1000.0 * float(r["time"])), r["entity"]): (
                    float(r["roll"]),
                    float(r["pitch"]),
                )
                for r in csv.DictReader(lines)
            }
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise FileError(f"{file}: not as this version writes it: {error}") from None
