"""Our own stack, and a class of users, at the wheel of an actor other than the ego."""

from __future__ import annotations

from math import hypot
from pathlib import Path

import pytest

import skidpad
from skidpad.campaign.driving.course_file import check_scenario
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.states import VehicleCommand
from skidpad.scenarios.registry import REGISTERED, Names
from skidpad.scenarios.scenario import check
from support.scenarios.files import (
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
    with_controller,
    write,
)

NAME = "SkidpadStack"


def switch(lateral: bool | None = True, longitudinal: bool | None = True) -> str:
    says = {"lateral": lateral, "longitudinal": longitudinal}
    flags = "".join(f' {k}="{str(v).lower()}"' for k, v in says.items() if v is not None)
    return f"<ControllerAction><ActivateControllerAction{flags}/></ControllerAction>"


def file_of(folder: Path, controller: str, *, lead=(-1, 180, 8), switches=None, **parts) -> Path:
    """`other` begins at 15 m/s under its controller, `third` is 80 m ahead at 8 m/s."""
    begins = init(
        "other",
        teleport(on_lane(-1, 100)),
        speed(to(15)),
        switch() if switches is None else switches,
    )
    values = {
        "entities": vehicle("ego") + controller + vehicle("third"),
        "init": at("ego", -3, 100, 0) + begins + at("third", *lead),
        "end": 20.0,
    }
    return write(folder, **values | parts)


def states_of(file: Path, *names: str, **how):
    """States of actors by time."""
    scenario = skidpad.Scenario(file, stack="ideal", **how)
    rows = []
    while scenario.step():
        rows.append((scenario.t, *(scenario.states[name] for name in names)))
    return rows, scenario


@pytest.mark.osc("ActivateControllerAction", "AssignControllerAction")
@pytest.mark.parametrize("actors", ["physical", "ideal"])
def test_our_stack_sees_the_car_ahead_and_follows_it(tmp_path, actors):
    """It slows down from 15 to the 8 m/s ahead, by its own sensors, and keeps to its lane."""
    file = file_of(tmp_path, with_controller(NAME, configuration=2))
    rows, _ = states_of(file, "other", "third", actors=actors)
    gaps = [third.x - other.x - 4.2 for _, other, third in rows]
    assert rows[60][1].vx > 13.0
    assert min(gaps) > 2.0
    assert rows[-1][1].vx == pytest.approx(8.0, abs=1.5)
    assert gaps[-1] < 40.0
    assert max(abs(other.y - rows[0][1].y) for _, other, _ in rows) < 0.3


def test_what_no_sensor_sees_is_run_into(tmp_path):
    """So it is not the truth that it follows."""
    hide = '<VisibilityAction graphics="true" traffic="true" sensors="false"/>'
    lead = init("third", teleport(on_lane(-1, 150)), speed(to(3)), hide)
    begins = init("other", teleport(on_lane(-1, 100)), speed(to(15)), switch())
    parts = {"init": at("ego", -3, 100, 0) + begins + lead, "end": 6.0}
    rows, _ = states_of(file_of(tmp_path, with_controller(NAME), **parts), "other", "third")
    assert min(third.x - other.x for _, other, third in rows) < 4.7


def test_pedals_by_the_stack_and_steer_by_the_file(tmp_path):
    """Cruise alone: the stack drives at its set speed, the file leads it into the next lane."""
    change = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="cubic"
value="4" dynamicsDimension="time"/><LaneChangeTarget><AbsoluteTargetLane value="-2"/>
</LaneChangeTarget></LaneChangeAction></LateralAction>"""
    file = file_of(
        tmp_path,
        with_controller(NAME, configuration=1, cruiseSpeed=18),
        lead=(-3, 300, 0),
        switches=switch(False, True),
        stories=story(event("e", private(change), time(2))),
        end=14.0,
    )
    rows, _ = states_of(file, "other")
    assert rows[-1][1].vx == pytest.approx(18.0, abs=1.5)
    assert abs(rows[-1][1].y - rows[0][1].y) == pytest.approx(3.5, abs=0.3)


def test_given_back_it_goes_on_as_the_file_says(tmp_path):
    off = event("off", private(switch(False, False)), time(4))
    slow = event("slow", private(speed(to(10), "linear", 2)), time(4.5))
    file = file_of(
        tmp_path, with_controller(NAME, cruiseSpeed=20), lead=(-3, 300, 0),
        stories=story(off, slow), end=12.0,
    )  # fmt: skip
    rows, _ = states_of(file, "other")
    assert rows[78][1].vx > 15.5
    assert hypot(rows[-1][1].vx, rows[-1][1].vy) == pytest.approx(10.0, abs=0.1)


def test_the_same_file_gives_the_same_run(tmp_path):
    file = file_of(tmp_path, with_controller(NAME, configuration=5), end=2.0)
    one, again = (states_of(file, "other", "ego")[0] for _ in range(2))
    assert len(one) > 30
    assert one == again


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"configuration": 0}, "configuration must be a whole number from 1 to 6, got '0'"),
        ({"configuration": 2.5}, "configuration must be a whole number from 1 to 6, got '2.5'"),
        ({"configuration": "six"}, "configuration must be a whole number from 1 to 6, got 'six'"),
        ({"cruiseSpeed": 200}, "cruiseSpeed must be a number from 0.277778 to 111.111, got '200'"),
    ],
)
def test_a_property_out_of_its_range_is_one_sentence(tmp_path, given, told):
    file = file_of(tmp_path, with_controller(NAME, **given))
    found = check_scenario(Scenario(file=str(file)))
    assert found.scenario is None
    (text,) = [str(f) for f in found.findings if told in str(f)]
    assert "x.xosc" in text
    assert f"controller '{NAME}'" in text


def test_its_sensors_see_through_the_weather_that_events_set(tmp_path):
    fog = """<GlobalAction><EnvironmentAction><Environment name="fog"><Weather><Fog visualRange="30"/>
</Weather></Environment></EnvironmentAction></GlobalAction>"""
    file = file_of(
        tmp_path, with_controller(NAME), stories=story(event("fog", fog, time(0.475))), end=1.0
    )
    scenario = skidpad.Scenario(file, stack="ideal")
    limits = []
    while scenario.step():
        limits.append(scenario.player.actors["other"].controller.inner._view.suite.limit)
    assert limits[2] > 100.0
    assert limits[-1] < 40.0


class Coaster:
    """Brakes gently, whatever comes."""

    def __init__(self, properties):
        self.brake = float(properties["brake"])

    def drive(self, scene, name):
        return VehicleCommand(brake=self.brake)


class Mute(Coaster):
    """Says nothing."""

    def drive(self, scene, name):
        return None


def test_a_class_of_users_may_drive(tmp_path, monkeypatch):
    monkeypatch.setitem(REGISTERED, "coaster", Coaster)
    file = file_of(tmp_path, with_controller("coaster", brake=0.2), lead=(-3, 300, 0), end=2.0)
    rows, _ = states_of(file, "other")
    assert rows[-1][1].vx < 13.0
    monkeypatch.setitem(REGISTERED, "coaster", Mute)
    with pytest.raises(ConfigError, match="'coaster' must return a VehicleCommand"):
        states_of(file, "other")


def test_without_the_drivers_of_a_campaign_the_name_is_unknown(tmp_path):
    """A name that nothing has registered does nothing, and is an error when strict."""
    file = file_of(tmp_path, with_controller(NAME))
    assert check(file).scenario is not None
    assert check(file, names=Names(strict=True)).scenario is None
