"""Readings of further sensors stand in the page of a played scenario, the worst runs first."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

from skidpad.recording.run.readings import RecordedSensor, tabulate_readings, write_readings
from skidpad.report.play.page import INLINE, _readings


def run_in(folder: Path, values: list[float]) -> SimpleNamespace:
    sensor = RecordedSensor("parking", "parking_sensor", "Parking sensor", "m")
    rows = [{"tick": k, "parking.distance_m": v} for k, v in enumerate(values)]
    write_readings(folder, tabulate_readings({"parking": sensor}, rows))
    return SimpleNamespace(scenario="yard", weather="icy_30", friction="reduced", folder=folder)


def test_a_row_per_quantity_of_each_run(tmp_path: Path) -> None:
    silent = SimpleNamespace(scenario="yard", weather="", friction="", folder=None)
    runs = [run_in(tmp_path / "a", [1.0, float("nan"), 0.5]), silent]
    (table,) = _readings(runs)
    (row,) = table.rows
    assert [cell.text for cell in row] == [
        "yard", "icy_30", "parking", "Parking sensor", "distance_m", "0.75", "0.5", "1",
    ]  # fmt: skip
    assert _readings([silent]) == []


def test_a_folder_of_many_runs_shows_the_first(tmp_path: Path) -> None:
    one = run_in(tmp_path / "a", [1.0])
    (table,) = _readings([one] * (INLINE + 3))
    assert len(table.rows) == INLINE
    assert str(INLINE) in table.caption
