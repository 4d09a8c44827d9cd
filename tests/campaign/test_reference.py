"""The reference driver is chosen by name, drives on every bundled map, and is a row of the matrix."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad import drive
from skidpad.campaign.cells.matrix import cross, matrix_drivers
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import driver_of
from skidpad.cli.options.asked import Drivers, EgoStack
from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, ReferenceDriver, RunSpec, run_from_plain
from skidpad.core.weather import Weather
from skidpad.report.matrix.data import config_title
from skidpad.stack.reference.person import person_of
from support.runs import scenario_run


def test_it_is_named_wherever_a_driver_is_chosen():
    assert matrix_drivers("all")[-1] == ReferenceDriver()
    assert [d.label for d in matrix_drivers("reference,4")] == ["reference", "4"]
    assert Drivers(stack="reference").find_drivers() == [ReferenceDriver()]
    assert Drivers(configs="reference").find_drivers() == [ReferenceDriver()]
    assert EgoStack(stack="reference").find_driver() == ReferenceDriver()
    with pytest.raises(ConfigError, match="0, 1, 2, 3, 4, 5, 6, reference"):
        matrix_drivers("refrence")
    assert all(isinstance(d, AdasDriver) for d in Drivers(cruise="80").find_drivers())


def test_its_run_is_a_value_and_its_cell_a_row():
    run = RunSpec(driver=ReferenceDriver(), seed=3)
    assert run_from_plain(run.to_plain(), "here") == run
    assert run.cell == "reference_clear-noon"
    assert not run.foreign_code
    assert len(cross(matrix_drivers("all"), [Weather(name="a")], 2, RunSpec())) == 12
    assert config_title("reference") != "reference"


def test_the_seed_says_who_drives():
    run = RunSpec(driver=ReferenceDriver(), seed=11)
    seated = driver_of(run, stage_of(run))
    assert seated.stack.stack.person == person_of(11)


def test_in_a_scenario_it_wants_the_speed_of_the_file():
    run = scenario_run("lead_slowdown", driver=ReferenceDriver())
    stage = stage_of(run)
    cruise = driver_of(run, stage).stack.stack.driver.cruise
    assert cruise is not None
    assert cruise == pytest.approx(stage.cruise_kmh / 3.6)
    on_roads = RunSpec(driver=ReferenceDriver())
    assert driver_of(on_roads, stage_of(on_roads)).stack.stack.driver.cruise is None


@pytest.mark.parametrize(
    ("map", "weather", "traffic"),
    [
        ("figure8", "rain-night", "pack"),
        ("motorway", "snow", "random"),
        ("town", "clear-noon", "random"),
        ("straight", "icy_30", "random"),
    ],
)
def test_it_drives_on_every_map(map, weather, traffic):
    run = drive("reference", map=map, weather=weather, duration=30.0, seed=2, sensors="objects",
                traffic=traffic, vehicles=12)  # fmt: skip
    assert not run.error
    a = run.log.actors
    assert np.hypot(a.vx[:, 0], a.vy[:, 0]).max() > 4.0
    assert not len(run.log.contacts)
    assert run.off_road is not None
    assert not run.off_road.any()
    again = drive("reference", map=map, weather=weather, duration=2.0, seed=2, sensors="objects",
                  traffic=traffic, vehicles=12)  # fmt: skip
    assert np.array_equal(again.log.actors.x[:40], a.x[:40])


def test_it_takes_the_roundabout_on_ice_as_slowly_as_it_must():
    """Who brakes late for it leaves the road: before, 4 times in 300 s."""
    run = drive("reference", map="town", weather="icy_30", duration=190.0, seed=3,
                sensors="objects", vehicles=0)  # fmt: skip
    assert not run.log.relocations
    a = run.log.actors
    assert np.hypot(a.x[:, 0] - 200.0, a.y[:, 0] - 150.0).min() < 40.0, "it got there"
