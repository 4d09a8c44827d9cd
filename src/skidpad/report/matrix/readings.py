"""What further sensors and functions recorded, a row per weather, sensor and quantity."""

from __future__ import annotations

import polars as pl

from skidpad.recording.run.readings import name_values, read_readings
from skidpad.report.elements.page import Block, Cell, Table
from skidpad.report.elements.readings import READING_COLUMNS, reading_rows
from skidpad.report.matrix.data import Matrix

TYPE = "envelope"  # of the recorded "sensor" that holds the envelope's columns
UNKNOWN = 0.3  # confidence below which the prior alone speaks
COLUMNS = (("configuration", ""), ("weather", ""), *READING_COLUMNS)


def reading_blocks(matrix: Matrix) -> list[Block]:
    """Returns a table of mean, least and most per reading, of the first seed of each cell; or nothing."""
    rows: list[list[Cell]] = []
    first = matrix.results.sort("seed").unique(["config", "weather"], keep="first")
    first = first.sort("config", "weather")
    for run, name in zip(first.iter_rows(named=True), matrix.names(first), strict=True):
        folder = matrix.folder.log(name)
        cell = [Cell(run["config"]), Cell(run["weather"])]
        rows += [[*cell, *row] for row in ([] if folder is None else reading_rows(folder))]
    return [
        Table(
            COLUMNS, rows, "Readings of further sensors and functions, first seed of each weather"
        )
    ] * bool(rows)


# What bound the speed of governed stacks: the share of time of each limit, a row per cell.


def envelope_blocks(matrix: Matrix) -> list[Block]:
    """Returns a table of what limits governed stacks, over all seeds; empty where none was governed."""
    found: dict[tuple[str, str], list[pl.DataFrame]] = {}
    names: dict[int, str] = {}
    runs = matrix.results.sort("config", "weather", "seed")
    for run, name in zip(runs.iter_rows(named=True), matrix.names(runs), strict=True):
        folder = matrix.folder.log(name)
        readings = None if folder is None else read_readings(folder)
        for sensor in () if readings is None else readings.sensors:
            if sensor.type == TYPE and readings is not None:
                names |= name_values(sensor, "binding")
                own = pl.col(f"^{sensor.id}\\..*$").name.map(lambda name: name.rpartition(".")[2])
                table = readings.table.select(own)
                found.setdefault((run["config"], run["weather"]), []).append(table)
    rows = [[*map(Cell, cell), *_row(pl.concat(tables), names)] for cell, tables in found.items()]
    columns = [
        ("configuration", ""),
        ("weather", ""),
        ("allowed, km/h", "mean of the lowest limit"),
    ]
    columns += [
        (f"{name}, %", "share of time that this limit is the lowest") for name in names.values()
    ]
    columns += [
        ("grip, median", "estimated"),
        ("prior alone, %", "share of the distance without information from own signals"),
    ]
    title = "What limits the speed of governed stacks, all seeds"
    return [Table(tuple(columns), rows, title)] * bool(rows)


def _row(ticks: pl.DataFrame, names: dict[int, str]) -> list[Cell]:
    """Returns cells: speed in km/h, % of time per limit, median grip, % of way of low confidence."""
    shares = [_number((ticks["binding"] == number).mean()) * 100.0 for number in names]
    speed = _number(ticks["speed_mps"].mean()) * 3.6
    way = _number(ticks["ego_mps"].sum())
    blind = ticks.filter(pl.col("confidence") < UNKNOWN)
    alone = 100.0 * _number(blind["ego_mps"].sum()) / way if way > 0.0 else 0.0
    grip = _number(ticks["grip"].median())
    cells = [Cell(f"{speed:.0f}", speed), *(Cell(f"{s:.0f}", s) for s in shares)]
    return [*cells, Cell(f"{grip:.2f}", grip), Cell(f"{alone:.0f}", alone)]


def _number(value: object) -> float:
    """Returns a number as a float, 0.0 for anything else."""
    return float(value) if isinstance(value, (int, float)) else 0.0
