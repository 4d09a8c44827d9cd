"""Numbers that a stack's further sensors measured in each tick: readings.parquet in a run's folder.

The file says itself what its sensors are, so it is read without the packages that added them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec
import polars as pl

from skidpad.core.files.reading import decode_json
from skidpad.recording.files import read_parquet, require_columns, write_parquet

READINGS = "readings.parquet"
KEY = "sensors"  # of the footer


class RecordedSensor(msgspec.Struct, frozen=True):
    """A sensor whose readings were recorded, as its type described it."""

    id: str
    type: str
    title: str
    units: str
    quantities: tuple[str, ...] = ()  # columns "<id>.<quantity>"


@dataclass(frozen=True, slots=True)
class SensorReadings:
    """One row per tick with `tick` and a column per sensor and quantity; null: not measured."""

    sensors: tuple[RecordedSensor, ...]
    table: pl.DataFrame


@dataclass(frozen=True, slots=True)
class ReadingSummary:
    """One quantity of one sensor over a run."""

    sensor: RecordedSensor
    quantity: str
    mean: float | None
    least: float | None
    most: float | None


def tabulate_readings(
    sensors: Mapping[str, RecordedSensor], rows: list[dict[str, float]]
) -> SensorReadings:
    """Makes the table of rows with "tick" and "<id>.<quantity>"; absent or NaN values are null."""
    names = list(dict.fromkeys(name for row in rows for name in row if name != "tick"))
    columns = {"tick": pl.Series("tick", [int(row["tick"]) for row in rows], dtype=pl.Int64)}
    for name in names:
        values = pl.Series(name, [row.get(name) for row in rows], dtype=pl.Float64)
        columns[name] = values.fill_nan(None)
    described = [
        msgspec.structs.replace(
            sensor, quantities=tuple(n[len(id) + 1 :] for n in names if n.startswith(f"{id}."))
        )
        for id, sensor in sensors.items()
    ]
    return SensorReadings(tuple(described), pl.DataFrame(columns))


def describe_row(
    sensors: Mapping[str, RecordedSensor], row: Mapping[str, float | None]
) -> list[tuple[str, str]]:
    """Returns what a tick's row says, as words and a number for people."""
    told = []
    for name, value in row.items():
        id, _, quantity = name.rpartition(".")
        if id in sensors and value is not None:
            words = name_values(sensors[id], quantity)
            text = words.get(round(value)) or f"{value:.4g}"
            told.append((f"{sensors[id].title}, {quantity.replace('_', ' ')}", text))
    return told


def name_values(sensor: RecordedSensor, quantity: str) -> dict[int, str]:
    """Returns the words for the values of a quantity, where the units name them.

    They stand there as "...; quantity: 0 word, 1 other word".
    """
    _, _, words = sensor.units.partition(f"{quantity}: ")
    pairs = (word.split(" ", 1) for word in words.split(";")[0].split(", ") if word)
    return {int(number): name for number, name in pairs}


def write_readings(folder: Path, readings: SensorReadings) -> None:
    """Writes the readings of a run into its folder."""
    about = msgspec.json.encode(readings.sensors).decode()
    write_parquet(folder / READINGS, readings.table, {KEY: about})


def read_readings(folder: Path) -> SensorReadings | None:
    """Returns the readings of a run; None where its sensors recorded nothing."""
    path = folder / READINGS
    if not path.is_file():
        return None
    table, about = read_parquet(path)
    sensors = decode_json(about.get(KEY, "[]").encode(), str(path), tuple[RecordedSensor, ...])
    columns = {f"{s.id}.{quantity}": pl.Float64 for s in sensors for quantity in s.quantities}
    return SensorReadings(sensors, require_columns(table, {"tick": pl.Int64, **columns}, path))


def summarise_readings(readings: SensorReadings) -> list[ReadingSummary]:
    """Returns mean, least and largest value of each quantity over the run."""
    found = []
    for sensor in readings.sensors:
        for quantity in sensor.quantities:
            values = readings.table[f"{sensor.id}.{quantity}"]
            mean, least, most = (_number(v) for v in (values.mean(), values.min(), values.max()))
            found.append(ReadingSummary(sensor, quantity, mean, least, most))
    return found


def _number(value: object) -> float | None:
    """Returns a number as a float; None for anything else."""
    return float(value) if isinstance(value, (int, float)) else None
