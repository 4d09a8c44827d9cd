"""A map that holds fewer vehicles than were asked for says so, in the terminal and in its row."""

from __future__ import annotations

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.log_files import read_log
from support.stadium import stadium


def driven(folder, *words: str):
    file = folder / "short.xodr"
    file.write_text(stadium(closed=False), encoding="utf-8")
    out = folder / "out"
    asked = ["--map", file, "--out", out, "--workers", 1, "--sensors", "objects", "--configs", 0]
    asked += ["--weather", "clear-noon", "--duration", 1, *words]
    done = CliRunner().invoke(app, ["adas", *map(str, asked)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    (row,) = pl.read_parquet(out / "results.parquet").to_dicts()
    (run,) = (out / "runs").iterdir()
    return done.output, row, len(read_log(run).table) - 1


@pytest.mark.req("A-204")
def test_vehicles_without_a_place_are_said_and_counted(tmp_path):
    told, row, vehicles = driven(tmp_path)
    missing = row["vehicles_missing"]
    assert 0 < missing < 20
    assert missing == 20 - vehicles, "those that the log does not hold"
    assert f"short has places for {20 - missing} of 20 vehicles around the ego" in told


def test_a_map_with_room_says_nothing(tmp_path):
    told, row, vehicles = driven(tmp_path, "--vehicles", "1", "--traffic", "random")
    assert (row["vehicles_missing"], vehicles) == (0, 1)
    assert "has places for" not in told
