"""`skidpad export`: what any run was, played again within a centimetre."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.campaign.runs.play import run_to
from skidpad.cli.main import app
from skidpad.core.courses import Roads
from skidpad.core.run import Passenger
from skidpad.recording.run.log_files import read_log
from skidpad.scenarios.export.run_export import log_tracks, road_of
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import compile_scenario
from support.asam import asam_verdicts, require_asam_python
from support.runs import adas_run, scenario_run
from support.scenarios.merging_player import led, place


def exported(folder: Path, *options: str) -> Path:
    done = CliRunner().invoke(app, ["export", str(folder), *options])
    assert done.exit_code == 0, done.output
    (file,) = (folder / "scenario").glob("*.xosc")
    return file


def distances(log, told):
    """m between the log and a replay, all actors at equal times."""
    found = []
    a, names = log.actors, log.table.names
    for row in told.rows:
        k, i = round(row.time / log.header.dt), names.index(row.name)
        if log.present[k, i]:
            found.append(np.hypot(row.x - a.x[k, i], row.y - a.y[k, i]))
    assert len(found) >= log.present.sum() - 2 * len(names)  # who comes is seen a tick later
    return np.array(found)


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """Traffic on a map, and a scenario in which somebody is hit."""
    out = tmp_path_factory.mktemp("runs")
    roads = Roads(map="figure8", vehicles=8)
    run_to(adas_run(course=roads, duration=20.0), out / "traffic")
    run_to(scenario_run("front_accident", driver=Passenger()), out / "scenario")
    return out


@pytest.mark.parametrize("name", ["traffic", "scenario"])
def test_a_run_is_played_again_within_1_cm(drives, name):
    log = read_log(drives / name)
    file = exported(drives / name)
    scenario = compile_scenario(file)
    assert scenario.ego == log.table.names[0]
    assert scenario.map.content_hash == log.header.map_hash  # of the road beside it
    assert distances(log, play_ideal(scenario, 60.0)).max() < 0.01
    follows = led(file)
    for track in log_tracks(log):  # and by players that merge vertices within 5 mm
        for t, x, y in list(zip(track.t, track.x, track.y, strict=True))[1:]:
            at = place(follows[track.name], t)
            assert np.hypot(at[0] - x, at[1] - y) < 0.005, (track.name, t)


def test_the_command_play_moves_the_ego_as_it_was_driven(drives, tmp_path):
    log = read_log(drives / "traffic")
    file = exported(drives / "traffic")
    words = ["play", str(file), "--stack", "ideal", "--actors", "ideal", "--out"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "again")])
    assert done.exit_code == 0, done.output
    again = read_log(tmp_path / "again")
    n = min(len(log), len(again))
    assert n >= len(log) - 1
    for i, name in enumerate(log.table.names):
        j = again.table.names.index(name)
        both = log.present[:n, i] & again.present[:n, j]
        dx, dy = (
            (getattr(log.actors, k)[:n, i] - getattr(again.actors, k)[:n, j])[both] for k in "xy"
        )
        assert np.hypot(dx, dy).max() < 0.01, name


def test_a_road_that_is_not_there_is_replaced_and_said(drives, tmp_path):
    log = read_log(drives / "traffic")
    other = tmp_path / "figure8.xodr"
    other.write_bytes((Path(exported(drives / "scenario")).with_suffix(".xodr")).read_bytes())
    assert road_of(log, [other]) is not None  # the bundled one: a name alone is not believed
    assert road_of(log, [other]) != other


def test_a_folder_without_a_run_is_one_sentence(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "skidpad", "export", str(tmp_path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


def test_the_asam_checkers_accept_exported_runs(drives, tmp_path):
    require_asam_python()
    new = exported(drives / "scenario")
    done = CliRunner().invoke(
        app, ["export", str(drives / "scenario"), "--osc", "1.0", "--out", str(tmp_path)]
    )
    assert done.exit_code == 0, done.output
    (old,) = tmp_path.glob("*.xosc")
    assert etree.parse(str(old)).getroot().find("FileHeader").get("revMinor") == "0"
    verdict = asam_verdicts(new, old)
    for file in (new, old):
        assert verdict[str(file)]["issues"] == []
        assert any("valid_schema" in c for c in verdict[str(file)]["completed"])
    assert verdict[str(new)]["skipped"] == []
