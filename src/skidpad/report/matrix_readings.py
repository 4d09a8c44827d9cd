"""What the further sensors of a user's stack measured, a row per weather, sensor and quantity."""

from __future__ import annotations

from skidpad.recording.readings import read_readings, summarise_readings
from skidpad.report.matrix_data import Matrix
from skidpad.report.page import Block, Table

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
    rows: list[tuple[str, ...]] = []
    first = matrix.results.sort("seed").unique(["config", "weather"], keep="first")
    first = first.sort("config", "weather")
    for run, name in zip(first.iter_rows(named=True), matrix.names(first), strict=True):
        folder = None if name is None else matrix.folder.log(name)
        readings = None if folder is None else read_readings(folder)
        for s in () if readings is None else summarise_readings(readings):
            numbers = ("-" if v is None else f"{v:.4g}" for v in (s.mean, s.least, s.most))
            sensor = (s.sensor.id, s.sensor.title, s.quantity)
            rows.append((run["config"], run["weather"], *sensor, *numbers))
    return [Table(COLUMNS, rows, "Readings of further sensors, first seed of each weather")] * bool(
        rows
    )
