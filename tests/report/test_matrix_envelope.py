"""The table of what bound the speed of governed stacks."""

from types import SimpleNamespace

import polars as pl

from skidpad.recording.run.readings import (
    RecordedSensor,
    describe_row,
    name_values,
    tabulate_readings,
    write_readings,
)
from skidpad.report.matrix.readings import envelope_blocks

SENSOR = RecordedSensor("envelope", "envelope", "Speed envelope", "m/s; binding: 0 none, 1 sight")
RAIN = RecordedSensor("rain", "rain_sensor", "Rain", "stage")


def matrix_of(tmp_path, sensor, bindings):
    rows = [
        {
            "tick": k, f"{sensor.id}.speed_mps": 10.0, f"{sensor.id}.binding": float(b),
            f"{sensor.id}.grip": 0.3, f"{sensor.id}.confidence": 0.0 if k else 1.0,
            f"{sensor.id}.ego_mps": 20.0 if k else 40.0,
        }
        for k, b in enumerate(bindings)
    ]  # fmt: skip
    write_readings(tmp_path, tabulate_readings({sensor.id: sensor}, rows))
    results = pl.DataFrame({"config": ["5"], "weather": ["snow"], "seed": [1]})
    return SimpleNamespace(
        results=results,
        names=lambda runs: ["5_snow-001"] * len(runs),
        folder=SimpleNamespace(log=lambda name: tmp_path),
    )


def test_the_share_of_time_of_each_limit_is_tabled(tmp_path):
    (table,) = envelope_blocks(matrix_of(tmp_path, SENSOR, [1, 1, 1, 0]))
    assert [name for name, _ in table.columns][3:5] == ["none, %", "sight, %"]
    assert [cell.sort for cell in table.rows[0]][2:] == [36.0, 25.0, 75.0, 0.3, 60.0]


def test_runs_without_an_envelope_have_no_table(tmp_path):
    assert envelope_blocks(matrix_of(tmp_path, RAIN, [1])) == []


def test_the_recording_names_its_limits_itself():
    assert name_values(SENSOR, "binding") == {0: "none", 1: "sight"}
    assert name_values(SENSOR, "speed_mps") == {}
    row = {"envelope.binding": 1.0, "envelope.speed_mps": 10.0}
    told = describe_row({"envelope": SENSOR}, row)
    assert told == [("Speed envelope, binding", "sight"), ("Speed envelope, speed mps", "10")]
