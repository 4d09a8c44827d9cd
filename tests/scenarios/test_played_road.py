"""A played run is read back with its own road, also when the scenario and its road have moved."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import FileError
from support.scenarios.files import BRIDGE, init, on_lane, speed, teleport, to, write

RIDE = ["--stack", "ideal", "--actors", "ideal"]
ROAD = '<LogicFile filepath="roads/lane.xodr"/>'


def run(*words: object) -> str:
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Folder of a run on a road of its user's, which is at no place that the run names any more."""
    folder = tmp_path_factory.mktemp("asked")
    (folder / "roads").mkdir()
    (folder / "roads" / "lane.xodr").write_text(BRIDGE, encoding="utf-8")
    lane = [teleport(on_lane(-1, 20)), speed(to(10))]
    other = [teleport(on_lane(-1, 60)), speed(to(10))]
    file = write(
        folder, road=ROAD, init=init("ego", *lane) + init("other", *other), stories="", end=1.0
    )
    run("play", file, "--out", folder / "out", *RIDE)
    run("play", folder, "--out", folder / "all", "--workers", "1", *RIDE)
    shutil.rmtree(folder / "roads")
    file.unlink()
    return Path(shutil.move(folder / "out", folder / "moved")), folder / "all"


def runs(played) -> list[Path]:
    one, campaign = played
    return [one, *(campaign / "runs").iterdir()]


def test_show_and_compare_find_the_road(played):
    for folder in runs(played):
        told = run("show", folder)
        assert "on lane" in told
        assert "map has changed" not in told
        rows = [line for line in told.splitlines() if line.startswith("fatal_collisions ")]
        assert (
            rows[0].rstrip().endswith("recoveries, wrong ways and departures")
        )  # one line in a pipe
    run("compare", *runs(played))


def test_the_export_has_the_same_road_under_it(played, tmp_path):
    for k, folder in enumerate(runs(played)):
        assert "straight" not in run("export", folder, "--out", tmp_path / str(k))
        (road,) = (tmp_path / str(k)).glob("*.xodr")
        assert etree.parse(str(road)).find(".//elevation[@a='6']") is not None


def test_a_report_of_one_run_or_of_a_folder(played):
    one, campaign = played
    assert "The run was not judged." in run("report", one)
    assert "The run was not judged." in run("report", campaign)


def test_a_road_that_is_nowhere_is_asked_for(played, tmp_path):
    bare = tmp_path / "bare"
    shutil.copytree(played[0], bare)
    shutil.rmtree(bare / "maps")
    done = CliRunner().invoke(app, ["show", str(bare)])
    assert isinstance(done.exception, FileError)
    assert "its road 'lane' is not there any more; copy" in str(done.exception)
    (bare / "maps" / "road").mkdir(parents=True)
    (bare / "maps" / "road" / "lane.xodr").write_text(BRIDGE, encoding="utf-8")
    assert "map has changed" not in run("show", bare)


def test_a_folder_without_results_says_what_to_do(tmp_path):
    done = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert isinstance(done.exception, FileError)
    assert "skidpad adas --out" in str(done.exception)
    assert "parquet" not in str(done.exception)
