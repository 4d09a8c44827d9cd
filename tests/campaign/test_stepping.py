"""A scenario that is stepped from Python is the one that `play` drives, and can be steered on its way."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

import skidpad
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand
from skidpad.core.states import VehicleCommand
from skidpad.recording.run.log_files import log_hash, read_log
from support.scenarios.files import at, event, private, speed, story, time, to, write


@pytest.fixture
def file(tmp_path):
    stop = event("stops", private(speed(to(0), "linear", 5, "rate")), time(0.5))
    begin = at("ego", -1, 100, 10) + at("other", -1, 140, 10)
    return write(tmp_path, init=begin, stories=story(stop), end=2.0)


@pytest.mark.parametrize("n", [1, 7])
def test_a_stepped_run_has_the_hash_of_play(file, tmp_path, n):
    CliRunner().invoke(app, ["play", str(file), "--out", str(tmp_path / "out")])
    scenario = skidpad.Scenario(file)
    while scenario.step(n):
        pass
    assert log_hash(scenario.finish().log) == log_hash(read_log(tmp_path / "out"))


def test_states_elements_and_conditions_are_those_of_the_tick(file):
    scenario = skidpad.Scenario(file, stack="ideal", actors="ideal")
    path = "story::story_act::story_group::story_manoeuvre::stops"
    assert scenario.step()
    assert scenario.t == 0.0
    assert scenario.states["other"].vx == pytest.approx(10.0)
    assert path not in scenario.elements
    assert scenario.step(10)
    assert scenario.t == pytest.approx(0.5)
    assert scenario.elements[path] == "runningState"
    assert scenario.conditions[path, "c"] is True
    assert scenario.states["ego"].x == pytest.approx(scenario.states["other"].x - 40.0, abs=0.1)
    while scenario.step():
        pass
    assert scenario.t == pytest.approx(2.0)
    assert scenario.elements[path] == "runningState", "10 m/s at 5 m/s2 take 2 s"
    assert len(scenario.finish().log) == 41


def test_commands_in_place_of_the_stack_and_of_the_file(file):
    scenario = skidpad.Scenario(file, actors="ideal")
    scenario.step(5)
    scenario.send(ActorCommand("other", place=Pose(300.0, -1.75), speed=3.0))
    scenario.step(15, VehicleCommand(brake=1.0))
    assert scenario.states["ego"].vx < 5.0
    log = scenario.finish().log
    assert log.actors.x[5, 1] == pytest.approx(300.0)
    assert log.actors.x[6, 1] < 200.0, "one step only"
    assert log.applied.brake[10] == pytest.approx(1.0)
    with pytest.raises(ConfigError, match="there is no actor 'nobody'; the file has ego, other"):
        scenario.send(ActorCommand("nobody"))
    with pytest.raises(ConfigError, match="at least 1 tick"):
        scenario.step(0)
