"""Drives as data: what is written is what was seen, what the truth was, and what was done."""

from __future__ import annotations

import json

import cv2
import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.campaign.cells.grip import template
from skidpad.campaign.dataset import COLUMNS, export_drive
from skidpad.campaign.runs.stored import read_run
from skidpad.cli.main import app
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.run import RunSpec, StackDriver


def test_images_labels_and_controls_of_a_drive(tmp_path):
    out = tmp_path / "data"
    asked = [
        "export-dataset", "--out", str(out), "--course", "lead_slowdown", "--duration", "2",
        "--every", "10",
    ]  # fmt: skip
    done = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert done.exit_code == 0
    (drive,) = [p for p in out.iterdir() if p.is_dir()]
    table = pl.read_parquet(drive / "frames.parquet")
    assert set(table.columns) == set(COLUMNS)
    assert table["tick"].to_list() == [0, 10, 20, 30, 40]
    assert table["gap"].null_count() == 0  # the lead is ahead from the start
    assert table["speed"].min() > 10.0
    assert table["left_12m"].abs().max() < 0.5
    for camera, size in (("centre", (64, 128, 3)), ("left", (32, 64, 3)), ("right", (32, 64, 3))):
        files = sorted((drive / "images" / camera).glob("*.png"))
        assert [f.stem for f in files] == ["000000", "000010", "000020", "000030", "000040"]
        assert cv2.imread(str(files[0])).shape == size
        assert cv2.imread(str(files[0])).std() > 10.0  # something is on it
    card = json.loads((out / "dataset.json").read_text(encoding="utf-8"))
    assert set(card["cameras"]) == {"centre", "left", "right"}
    assert set(card["columns"]) == set(COLUMNS)
    assert read_run(drive).duration == 2.0
    again = CliRunner().invoke(app, asked)
    assert isinstance(again.exception, OutputError)


def test_wrong_input_is_one_sentence(tmp_path):
    with pytest.raises(ConfigError, match="--sensors pixels"):
        export_drive(template(), tmp_path, 2)
    other = CliRunner().invoke(app, ["export-dataset", "--out", str(tmp_path), "--stack", "ideal"])
    assert isinstance(other.exception, ConfigError)
    with pytest.raises(ConfigError, match="stack or camera"):
        export_drive(RunSpec(driver=StackDriver("a:b"), course=Roads()), tmp_path, 2)
