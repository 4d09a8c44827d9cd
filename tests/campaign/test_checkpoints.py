"""A run that goes back to a checkpoint and on has the content hash of one that was not cut (T-13)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

import skidpad
from skidpad.campaign.runs.checkpoints import FIXED
from skidpad.campaign.runs.run import OpenRun
from skidpad.campaign.runs.run import run as drive
from skidpad.core.errors import CheckpointError
from skidpad.core.objects.checkpoint import Checkpoint
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.run.log_files import log_hash
from support.cut_runs import SCRIPTS, STACKS, go_on, spec_of


@pytest.mark.parametrize(
    ("map", "configuration", "weather"),
    [
        ("figure8", 0, "icy_100"),
        ("figure8", 2, "clear-noon"),
        ("figure8", 4, "rain-night"),
        ("town", 1, "icy_100"),
        ("town", 4, "clear-noon"),
        ("motorway", 3, "rain-night"),
    ],
)
def test_a_restored_run_goes_on_as_the_one_that_was_not_cut(map, configuration, weather):
    spec = spec_of(map, configuration, weather=weather)
    whole = log_hash(drive(spec).log)
    rng = np.random.default_rng(configuration)
    at = sorted(int(k) for k in rng.choice(700, 3, replace=False) + 1)
    run, saved = OpenRun(spec), []
    for k in at:
        go_on(run, k - len(run.log.log) if saved else k)
        saved.append(run.save())
        assert saved[-1].tick == k - 1
    go_on(run)
    assert log_hash(run.finish().log) == whole, "saving changes nothing"
    for checkpoint in (saved[0], saved[2], saved[1]):
        run.restore(checkpoint)
        assert len(run.log.log) == checkpoint.tick + 1
        go_on(run)
        assert log_hash(run.finish().log) == whole, f"from tick {checkpoint.tick}"


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_restored_scenario_goes_on_as_the_one_that_was_not_cut(script):
    def begin():
        return skidpad.Scenario(script, stack=2, weather="icy_30", seed=5, duration=20.0)

    def end(scenario):
        while scenario.step():
            pass
        return log_hash(scenario.finish().log), scenario.elements, scenario.conditions

    whole = end(begin())
    scenario = begin()
    scenario.step(int(np.random.default_rng(len(script)).integers(1, 200)))
    early = scenario.save()
    scenario.step(37)
    late = scenario.save()
    scenario.step(20, VehicleCommand(brake=1.0))  # another future
    other = end(scenario)
    assert other != whole
    for checkpoint in (early, late, early):
        scenario.restore(checkpoint)
        assert scenario.t == pytest.approx(checkpoint.tick * 0.05)
        assert end(scenario) == whole


def test_pixels_go_on_too():
    spec = spec_of("figure8", 4, level=SensorLevel.PIXELS, duration=3.0)
    run = OpenRun(spec)
    go_on(run, 21)
    there = run.save()
    go_on(run)
    whole = log_hash(run.finish().log)
    run.restore(there)
    go_on(run)
    assert log_hash(run.finish().log) == whole == log_hash(drive(spec).log)


def test_a_checkpoint_of_another_run_or_of_none_is_refused():
    runs = [OpenRun(spec_of("figure8", 0)) for _ in range(2)]
    with pytest.raises(CheckpointError, match="at least one step"):
        runs[0].save()
    for run in runs:
        run.step()
    with pytest.raises(CheckpointError, match="only in the run that it was taken of"):
        runs[1].restore(runs[0].save())


@pytest.mark.parametrize("name", ["Counting", "Giving"])
def test_a_stack_of_the_user_goes_on_too(tmp_path, name):
    spec = spec_of("figure8", _stacks(tmp_path, name), duration=4.0)
    run = OpenRun(spec)
    go_on(run, 30)
    there = run.save()
    go_on(run)
    whole = log_hash(run.finish().log)
    run.restore(there)
    go_on(run)
    assert log_hash(run.finish().log) == whole


def test_a_stack_whose_state_python_does_not_show_is_refused(tmp_path):
    run = OpenRun(spec_of("figure8", _stacks(tmp_path, "Reading")))
    run.step()
    with pytest.raises(CheckpointError, match=r"_io\.TextIOWrapper.*__getstate__"):
        run.save()


def _stacks(folder: Path, name: str) -> str:
    file = folder / "stacks.py"
    file.write_text(STACKS)
    return f"{file}:{name}"


def test_a_branch_draws_from_streams_of_its_own():
    run = OpenRun(spec_of("figure8", 4, duration=12.0))
    go_on(run, 60)
    there = run.save()
    hashes = {}
    for branch in ("", "a", "b", "a", ""):
        run.restore(there, branch)
        go_on(run)
        log = run.finish().log
        assert np.array_equal(log.actors.x[:60], run.log.log.finish().actors.x[:60])
        hashes.setdefault(branch, set()).add(log_hash(log))
    assert [len(found) for found in hashes.values()] == [1, 1, 1], "each is reproducible"
    assert len(set.union(*hashes.values())) == 3, "each is another future"
    assert hashes[""] == {log_hash(drive(spec_of("figure8", 4, duration=12.0)).log)}


def test_every_kind_of_state_counts(monkeypatch):
    """What is left out of a checkpoint shows in the hash: the tests above would find it."""
    from skidpad.core.objects import checkpoint

    spec = spec_of("figure8", 4, duration=15.0)
    whole = log_hash(drive(spec).log)
    kinds = ("put_array", "put_object", "put_by_itself")
    for kind in kinds:
        run = OpenRun(spec)
        go_on(run, 100)
        saved = run.save()
        go_on(run, 150)
        state = saved._state
        kept = [one for one in state._restoring if one[0] is not getattr(checkpoint, kind)]
        assert len(kept) < len(state), f"there is state of this kind: {kind}"
        monkeypatch.setattr(state, "_restoring", kept)
        run.restore(saved)
        go_on(run)
        assert log_hash(run.finish().log) != whole, kind


def test_an_element_of_a_file_is_no_state_of_a_run():
    held = {"of": etree.Element("Action"), "at": [1]}
    with pytest.raises(CheckpointError, match="_Element cannot be saved"):
        Checkpoint(held)
    checkpoint = Checkpoint(held, FIXED)
    held["at"].append(2)
    checkpoint.restore()
    assert held["at"] == [1]
