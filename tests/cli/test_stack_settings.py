"""Settings of a user's stack: from the command line, from Python, and from a scenario."""

from __future__ import annotations

import inspect

import pytest
from typer.testing import CliRunner

import skidpad
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import driver_of
from skidpad.campaign.runs.stored import read_run
from skidpad.cli.main import app
from skidpad.cli.options.asked import Drivers, EgoStack, read_stack_settings
from skidpad.core.courses import Roads, Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.run import RunSpec, StackDriver
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.scenarios.shipped import FOLDER

WHERE = f"{__name__}:Cruiser"


class Cruiser:
    """Keeps the settings that it is given."""

    def __init__(self, specs, map, settings):
        self.settings = dict(settings)

    def tick(self, frame):
        return VehicleCommand()


def settings_under(course, options):
    spec = RunSpec(driver=StackDriver(WHERE, options), course=course, sensors=SensorLevel.OBJECTS)
    return driver_of(spec, stage_of(spec), Cruiser).stack.stack.settings


def test_values_have_the_type_that_they_look_like():
    words = ("cruise_kmh=90", "gain=0.5", "careful=true", "mode=night ride", "limit=none", "e=")
    assert read_stack_settings(words) == {
        "cruise_kmh": 90,
        "gain": 0.5,
        "careful": True,
        "mode": "night ride",
        "limit": None,
        "e": "",
    }


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("cruise",), "--stack-set takes name=value, got 'cruise'"),
        (("=3",), "--stack-set takes name=value, got '=3'"),
        (("a=1", "a=2"), "--stack-set gives 'a' twice"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(words, told):
    with pytest.raises(ConfigError, match=told):
        read_stack_settings(words)


def test_they_reach_the_driver_of_a_campaign_and_of_a_scenario():
    given = {"cruise_kmh": 60}
    assert Drivers(stack=WHERE, stack_set=("cruise_kmh=60",)).find_drivers() == [
        StackDriver(WHERE, given)
    ]
    chosen = EgoStack(stack=WHERE, stack_set=("cruise_kmh=60",)).find_driver()
    assert chosen == StackDriver(WHERE, given)
    with pytest.raises(ConfigError, match="--stack-set is for your own stack"):
        Drivers(stack_set=("a=1",)).find_drivers()
    with pytest.raises(ConfigError, match="--stack-set is for your own stack"):
        EgoStack(stack_set=("a=1",)).find_driver()


def test_a_scenarios_speed_reaches_a_users_stack_unless_it_is_told_another():
    course = Scenario(file=str(FOLDER / "lead_slowdown.xosc"))
    spec = RunSpec(driver=StackDriver(WHERE), course=course, sensors=SensorLevel.OBJECTS)
    speed = stage_of(spec).cruise_kmh
    assert speed > 1.0
    assert settings_under(course, {}) == {"cruise_kmh": speed}
    assert settings_under(course, {"cruise_kmh": 33, "x": 1}) == {"cruise_kmh": 33, "x": 1}
    assert settings_under(Roads(vehicles=0), {}) == {}


def test_the_command_line_stores_them_with_the_run(tmp_path):
    words = ["play", str(FOLDER / "lead_slowdown.xosc"), "--stack", WHERE, "--duration", "0.2"]
    words += ["--out", str(tmp_path / "out"), "--stack-set", "gain=0.5"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 1, "0.2 s are too short: void"
    assert read_run(tmp_path / "out").driver.options == {"gain": 0.5}


def test_the_function_and_the_command_have_the_same_defaults():
    taken = inspect.signature(skidpad.drive).parameters
    run, roads = RunSpec(), Roads()
    for name in ("seed", "duration"):
        assert taken[name].default == getattr(run, name), name
    assert taken["profile"].default == run.settings.profile
    assert taken["sensors"].default == run.sensors.value
    assert taken["map"].default == roads.map
    assert taken["vehicles"].default == roads.vehicles
    assert taken["traffic"].default == roads.traffic.value
    assert taken["weather"].default == run.weather.name


def test_every_argument_and_every_field_of_the_result_is_described():
    from skidpad.campaign.runs.run import Run

    about = inspect.getdoc(skidpad.drive)
    for section in ("Args:", "Returns:", "Raises:", "Example:"):
        assert section in about
    for name in inspect.signature(skidpad.drive).parameters:
        assert f"\n    {name}: " in about, name
    for name in Run.__slots__:
        assert f"\n    {name}: " in inspect.getdoc(Run), name
