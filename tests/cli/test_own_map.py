"""A map of one's own through every command: the campaign's folder keeps what it needs (R-6)."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.log_files import log_hash, read_log
from support.stadium import written

RUNNER = CliRunner()
DRIVEN = "--configs 0 --weather clear-noon --seeds 1 --duration 17 --sensors objects --workers 1"


def run(*words: str | Path) -> str:
    done = RUNNER.invoke(app, [str(w) for w in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign on a file that is gone since, its folder moved elsewhere."""
    folder = tmp_path_factory.mktemp("own")
    file = written(folder, "My town.xodr", start=False)
    run("adas", "--out", folder / "out", "--map", file, "--vehicles", "3", *DRIVEN.split())
    file.unlink()
    return Path(shutil.move(folder / "out", folder / "elsewhere"))


def test_the_report_needs_no_file_but_the_campaigns_own(moved: Path) -> None:
    run("report", moved)
    page = (moved / "report.html").read_text()
    assert "Off the road at" in page
    assert "My town" in page
    (row,) = pl.read_parquet(moved / "results.parquet").to_dicts()
    assert row["map"] == "My town"
    assert row["fatal_collisions"] >= row["road_departures"] >= row["off_road"] >= 1
    assert row["off_lanes_pct"] == 0.0


def test_rerun_drives_the_same_drive_and_show_knows_its_lanes(moved: Path) -> None:
    (folder,) = (moved / "runs").iterdir()
    assert "the same drive as the stored one" in run(
        "rerun", folder, "--from", "13.5", "--to", "14"
    )
    told = run("show", folder)
    assert "Off the road" in told
    assert "map has changed" not in told
    assert log_hash(read_log(folder)) in told


def test_resume_finds_the_file_that_the_campaign_kept(moved: Path) -> None:
    words = ["--map", moved.parent / "My town.xodr", "--vehicles", "3", "--resume"]
    before = (moved / "ledger.jsonl").read_bytes()
    run("adas", "--out", moved, *words, *DRIVEN.split())
    assert (moved / "ledger.jsonl").read_bytes() == before


def test_a_segment_of_channels_is_driven_again_without_its_file(tmp_path: Path) -> None:
    file = written(tmp_path)
    words = "--route route-4 --hours 0.0006 --workers 1"
    run("channels", "drive", "--out", tmp_path / "out", "--map", file, *words.split())
    file.unlink()
    (recording,) = (tmp_path / "out").rglob("*.mcap")
    assert "the same drive as the stored one" in run("rerun", recording)
