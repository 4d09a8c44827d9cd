"""What further sensors and functions recorded, a row per weather, sensor and quantity."""

from __future__ import annotations

from skidpad.recording.run.readings import read_readings, summarise_readings
from skidpad.report.elements.page import Block, Cell, Table
from skidpad.report.matrix.data import Matrix

COLUMNS = (
    ("configuration", ""),
    ("weather", ""),
    ("sensor", "id that the stack gave it"),
    ("type", ""),
    ("quantity", "the unit stands in its name"),
    ("mean", ""),
    ("least", ""),
    ("most", ""),
)


def reading_blocks(matrix: Matrix) -> list[Block]:
    """Returns one table from the first run of each cell; nothing where no sensor was recorded."""
    rows: list[list[Cell]] = []
    first = matrix.results.sort("seed").unique(["config", "weather"], keep="first")
    first = first.sort("config", "weather")
    for run, name in zip(first.iter_rows(named=True), matrix.names(first), strict=True):
        folder = None if name is None else matrix.folder.log(name)
        readings = None if folder is None else read_readings(folder)
        for s in () if readings is None else summarise_readings(readings):
            words = (run["config"], run["weather"], s.sensor.id, s.sensor.title, s.quantity)
            numbers = (Cell("-" if v is None else f"{v:.4g}", v) for v in (s.mean, s.least, s.most))
            rows.append([*(Cell(word) for word in words), *numbers])
    return [
        Table(
            COLUMNS, rows, "Readings of further sensors and functions, first seed of each weather"
        )
    ] * bool(rows)
