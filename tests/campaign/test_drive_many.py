"""Many runs by one call: in order, each with the hash that it has alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec import structs

import skidpad
from skidpad.campaign.driving import sharing
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.sharing import share_setups
from skidpad.campaign.runs.checkpoints import FIXED
from skidpad.campaign.runs.run import run as drive
from skidpad.core.errors import BackendError, ConfigError, FileError
from skidpad.core.objects.statefile import Ground
from skidpad.recording.run.log_files import log_hash
from skidpad.scenarios.shipped import FOLDER
from support.cut_runs import SCRIPTS

ROAD = {"sensors": "objects", "duration": 4.0}


def played(name, seed=1, weather="icy_30"):
    spec = skidpad.Scenario(name, weather=weather, duration=6.0).spec
    return structs.replace(spec, seed=seed)


def mixed():
    return [
        played("front_accident", 1),
        {"stack": 2, "seed": 4, **ROAD},
        played("front_accident", 2),
        played("ghost_cut_in", 1, "clear-noon"),
        {"stack": 0, "seed": 4, "weather": "icy_100", **ROAD},
        played("front_accident", 1),
    ]


def hash_of(run):
    return log_hash(run.log)


@pytest.mark.parametrize("workers", [1, 2])
def test_each_run_has_the_hash_that_it_has_alone(workers):
    alone = [
        hash_of(skidpad.drive(**one) if isinstance(one, dict) else drive(one)) for one in mixed()
    ]
    assert skidpad.drive_many(mixed(), workers=workers, judge=hash_of) == alone
    assert alone[0] == alone[-1]
    assert len(set(alone)) == 5


def test_runs_come_back_whole():
    (run,) = skidpad.drive_many([{"stack": 2, **ROAD}])
    assert len(run.log) == 80
    assert run.outcome.value == "completed"
    assert skidpad.drive_many([]) == []


def compiled(spec):
    return stage_of(spec).player.scenario


def test_a_file_is_compiled_once_for_runs_that_differ_in_other_things():
    with share_setups():
        first = compiled(played("front_accident", 1))
        assert compiled(played("front_accident", 2, "clear-noon")) is first
        assert compiled(played("ghost_cut_in", 1)) is not first
    assert compiled(played("front_accident", 1)) is not first


def test_a_file_that_was_edited_or_that_names_code_is_compiled_again(tmp_path):
    text = (FOLDER / "front_accident.xosc").read_text()
    file = tmp_path / "mine.xosc"
    for road in FOLDER.glob("*.xodr"):
        (tmp_path / road.name).write_bytes(road.read_bytes())
    file.write_text(text)
    with share_setups():
        first = compiled(played(file))
        assert compiled(played(file)) is first
        file.write_text(text + "<!-- edited -->")
        assert compiled(played(file)) is not first
        spec = played(file)
        named = structs.replace(spec.course, register=("mine=pathlib:Path",))
        again = [compiled(structs.replace(spec, course=named)) for _ in range(2)]
        assert again[0] is not again[1]


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_compiled_file_does_not_change_while_it_is_played(name):
    with share_setups():
        ground = Ground([compiled(played(name))], FIXED)
        before = ground.write()
        drive(played(name))
        assert compiled(played(name)) is ground.root[0]
        assert ground.write() == before


def test_the_oldest_file_is_forgotten(monkeypatch):
    monkeypatch.setattr(sharing, "MOST", 1)
    with share_setups():
        first = compiled(played("front_accident"))
        compiled(played("ghost_cut_in"))
        assert compiled(played("front_accident")) is not first


def judge_badly(run):
    raise ValueError("not this one")


def test_what_cannot_be_is_said_in_a_sentence():
    one = {"stack": 2, **ROAD}
    with pytest.raises(ConfigError, match="device must be 'cpu' or 'cuda', got 'tpu'"):
        skidpad.drive_many([one], device="tpu")
    with pytest.raises(ConfigError, match="workers must be at least 1, got 0"):
        skidpad.drive_many([one], workers=0)
    with pytest.raises(ConfigError, match="unknown weather 'icy'"):
        skidpad.drive_many([one, {**one, "weather": "icy"}])
    with pytest.raises(FileError, match="gone"):
        skidpad.drive_many([structs.replace(played("front_accident"), course=structs.replace(
            played("front_accident").course, file=str(Path("gone.xosc"))))])  # fmt: skip
    with pytest.raises(BackendError, match=r"run 0 \(2_clear-noon-001\): .*not this one"):
        skidpad.drive_many([one], workers=2, judge=judge_badly)
