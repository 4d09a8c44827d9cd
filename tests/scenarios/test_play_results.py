"""What `play` leaves: trajectories, the story, pairs; expectations, JUnit, page and crash cards."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.log_files import read_log
from support.scenarios.files import (
    BRIDGE,
    at,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    vehicle,
    write,
)

RIDE = ["--stack", "ideal", "--actors", "ideal"]


def play(*words: object):
    return CliRunner().invoke(app, ["play", *map(str, words)])


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def a_braking_lead(folder: Path, gap: float) -> Path:
    """The ego at 15 m/s, one ahead at 10 m/s in the same lane that stops from 2 s on."""
    stop = event("stops", private(speed(to(0), "linear", 5, "rate")), time(2))
    return write(
        folder, init=at("ego", -1, 100, 15) + at("other", -1, 100 + gap, 10),
        stories=story(stop), end=5.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lead")
    done = play(a_braking_lead(folder, 60.0), "--out", folder / "out", *RIDE)
    assert done.exit_code == 0, done.output
    return folder / "out"


def test_trajectories_are_those_of_the_log_at_the_files_reference_points(out):
    log, found = read_log(out), rows(out / "trajectories.csv")
    assert list(found[0]) == ["time", "id", "name", "x", "y", "z", "h", "speed"]
    assert len(found) == log.present.sum()
    for row in found[:: len(found) // 20]:
        k, i = round(float(row["time"]) / 0.05), int(row["id"])
        assert row["name"] == log.table.names[i]
        place = float(row["x"]), float(row["y"])
        assert place == pytest.approx((log.actors.x[k, i], log.actors.y[k, i]), abs=2e-3)
        assert float(row["speed"]) == pytest.approx(
            np.hypot(log.actors.vx[k, i], log.actors.vy[k, i]), abs=2e-3
        )


def test_the_story_tells_conditions_and_transitions_with_their_times(out):
    found = [(float(r["time"]), r["element"], r["what"]) for r in rows(out / "storyboard.csv")]
    path = "story::story_act::story_group::story_manoeuvre::stops"
    assert (2.0, path, "condition c holds") in found
    assert (2.0, path, "startTransition") in found
    (end,) = [t for t, e, what in found if e == path and what == "endTransition"]
    assert end == pytest.approx(4.0, abs=0.051)  # 10 m/s at 5 m/s^2
    assert (5.0, "", "condition c holds") in found  # the stop trigger
    assert [t for t, _, _ in found] == sorted(t for t, _, _ in found)


def test_the_pair_is_told_by_the_closed_form(out):
    (pair,) = rows(out / "pairs.csv")
    assert pair["other"] == "other"
    length = read_log(out).table.length[:2].mean()
    # 10 m are lost in 2 s, then 0.5 * 5 * 4 + ... until 5 s: ego 75 m, lead 20 + 10 m
    assert float(pair["min_gap_m"]) == pytest.approx(60.0 + 30.0 - 75.0 - length, abs=0.8)
    assert float(pair["min_ttc_s"]) == pytest.approx(float(pair["min_gap_m"]) / 15.0, abs=0.06)


def test_two_others_are_a_pair_and_expectations_are_about_the_ego(tmp_path):
    """The ego far ahead; of two behind it the follower comes 3 m/s nearer for 4 s."""
    file = write(
        tmp_path, entities=vehicle("ego") + vehicle("follower") + vehicle("lead"), end=4.0,
        init=at("ego", -3, 400, 20) + at("follower", -1, 100, 13) + at("lead", -1, 140, 10),
    )  # fmt: skip
    done = play(file, "--out", tmp_path / "out", *RIDE, "--expect", "min_ttc_s > 100")
    assert "min_ttc_s is" not in done.output
    assert done.exit_code == 1, "the ego met nobody: void"
    found = {(r["one"], r["other"]): r for r in rows(tmp_path / "out" / "pairs.csv")}
    assert set(found) == {("ego", "follower"), ("ego", "lead"), ("follower", "lead")}
    pair = found["follower", "lead"]
    length = read_log(tmp_path / "out").table.length[1:3].mean()
    assert float(pair["min_gap_m"]) == pytest.approx(40.0 - 3.0 * 4.0 - length, abs=0.2)
    assert float(pair["min_ttc_s"]) == pytest.approx(float(pair["min_gap_m"]) / 3.0, abs=0.05)
    assert pair["min_pet_s"] == "", "2.4 s apart"
    assert found["ego", "lead"]["min_ttc_s"] == ""


@pytest.mark.parametrize("height", [6, 1])
def test_nobody_is_in_the_way_on_a_bridge_above(tmp_path, height):
    """Both reach the crossing at the same time; 1 m up the other one is in the way."""
    (tmp_path / "bridge.xodr").write_text(BRIDGE.replace('a="6"', f'a="{height}"'))
    begin = "".join(
        init(name, teleport(on_lane(-1, s, road=road)), speed(to(10)))
        for name, road, s in (("ego", 1, 40), ("other", 2, 40))
    )
    road = '<LogicFile filepath="bridge.xodr"/>'
    file = write(tmp_path, init=begin, road=road, end=8.0)
    done = play(file, "--out", tmp_path / "out", *RIDE, "--expect", "min_ttc_s > 1")
    found = rows(tmp_path / "out" / "pairs.csv")
    if height == 6:
        assert "min_ttc_s is" not in done.output
        assert [value for pair in found for value in list(pair.values())[2:] if value] == []
    else:
        assert done.exit_code == 1
        assert float(found[0]["min_gap_m"]) < 1.0


def test_expectations_decide_the_exit_code_and_fill_junit(tmp_path):
    file, junit = a_braking_lead(tmp_path, 60.0), tmp_path / "junit.xml"
    done = play(
        file, "--out", tmp_path / "out", *RIDE, "--junit", junit,
        "--expect", "no-collision", "--expect", "min_ttc_s > 5",
    )  # fmt: skip
    assert done.exit_code == 1
    assert "min_ttc_s is" in done.output
    root = etree.parse(str(junit)).getroot()
    assert (root.get("tests"), root.get("failures")) == ("2", "1")
    done = play(file, "--out", tmp_path / "never", *RIDE, "--expect", "ttc > 1")
    assert done.exit_code == 2 or done.exception is not None
    assert not (tmp_path / "never").exists()


def test_a_folder_has_crash_cards_and_a_verdict_for_each_run(tmp_path):
    for name, gap in (("near", 12.0), ("far", 60.0)):
        (tmp_path / "in" / name).mkdir(parents=True)
        a_braking_lead(tmp_path / "in" / name, gap).rename(tmp_path / "in" / name / f"{name}.xosc")
    junit = tmp_path / "junit.xml"
    done = play(
        tmp_path / "in", "--out", tmp_path / "out", "--workers", 1, "--stack",
        "support.scenarios.blind:Blind", "--expect", "no-collision", "--junit", junit,
    )  # fmt: skip
    assert done.exit_code == 1, done.output
    cases = {c.get("name"): len(c) for c in etree.parse(str(junit)).getroot()}
    assert {name.partition("_")[0]: failed for name, failed in cases.items()} == {
        "near": 1, "far": 0,
    }  # fmt: skip
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "One crash" in page
    for run in (tmp_path / "out" / "runs").iterdir():
        assert (run / "trajectories.csv").is_file()
        assert (run / "pairs.csv").is_file()


def test_a_single_run_has_crash_cards_too(tmp_path):
    (tmp_path / "in").mkdir()
    file = a_braking_lead(tmp_path / "in", 12.0)
    done = play(file, "--out", tmp_path / "out", "--stack", "support.scenarios.blind:Blind")
    assert done.exit_code == 1, done.output
    assert "skidpad rerun" in done.output
    assert "One crash" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_a_run_without_a_crash_has_no_crash_cards(out):
    assert 'id="crashes"' not in (out / "report.html").read_text(encoding="utf-8")
