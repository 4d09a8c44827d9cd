"""Readings of further sensors and functions as rows of a table, the same in every report."""

from __future__ import annotations

from pathlib import Path

from skidpad.recording.run.readings import read_readings, summarise_readings
from skidpad.report.elements.page import Cell

READING_COLUMNS = (
    ("sensor", "id that the stack gave it"),
    ("type", ""),
    ("quantity", "the unit stands in its name"),
    ("mean", ""),
    ("least", ""),
    ("most", ""),
)


def reading_rows(folder: Path) -> list[list[Cell]]:
    """Returns a row of READING_COLUMNS per recorded quantity of a run; empty where nothing was recorded."""
    readings = read_readings(folder)
    rows = []
    for s in () if readings is None else summarise_readings(readings):
        numbers = (Cell("-" if v is None else f"{v:.4g}", v) for v in (s.mean, s.least, s.most))
        rows.append([Cell(s.sensor.id), Cell(s.sensor.title), Cell(s.quantity), *numbers])
    return rows
