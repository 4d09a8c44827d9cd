"""Controllers, actions and values of users: reached by registered names only, never by an import."""

from __future__ import annotations

import sys
from math import sqrt
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skidpad.campaign.driving.course_file import load_scenario
from skidpad.cli.main import app
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError
from skidpad.core.run import RunSpec
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.reading.findings import ScenarioError
from skidpad.scenarios.registry import Acc, Names
from skidpad.scenarios.scenario import check
from skidpad.simulation.world.traffic.idm import GAP_MIN, Character
from support.scenarios.files import (
    ACTIVATE,
    at,
    by_value,
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


class Ramp:
    """Accelerates as its property says."""

    def __init__(self, properties):
        self.a = float(properties["a"])

    def update(self, scene, name):
        return self.a


class Counter:
    """An action that counts its calls, and the count as a value."""

    def __init__(self):
        self.texts = []

    def act(self, scene, text):
        self.texts.append((scene.t, text))

    def value(self, scene):
        return len(self.texts)


def file_of(folder: Path, controller: str, **parts: object) -> Path:
    """`other` begins at 10 m/s and activates its controller at once, `third` is ahead of it."""
    begins = init("other", teleport(on_lane(-1, 100)), speed(to(10)), ACTIVATE)
    values = {
        "entities": vehicle("ego") + controller + vehicle("third"),
        "init": at("ego", -3, 100) + begins + at("third", -1, 150, 8),
        "end": 60.0,
    }
    return write(folder, **values | parts)


def test_acc_settles_at_the_gap_of_the_intelligent_driver_model(tmp_path):
    """Where it follows at constant speed v, the gap is (s0 + v T) / sqrt(1 - (v / v0)^4)."""
    file = file_of(tmp_path, with_controller("ACC", setSpeed=20, timeGap=1.8))
    scenario = check(file).playable()
    found = play_ideal(scenario, 60.0)
    other, third = found.of("other")[-1], found.of("third")[-1]
    assert other.speed == pytest.approx(8.0, abs=0.02)
    gap = third.x - other.x - 4.2  # two boxes of 4.2 m with their reference point in the middle
    expected = (GAP_MIN + 8.0 * 1.8) / sqrt(1.0 - (8.0 / 20.0) ** 4)
    assert gap == pytest.approx(expected, abs=0.1)
    assert Character().headway != 1.8


def test_a_registered_controller_moves_its_actor_by_what_it_returns(tmp_path):
    """0.5 m/s2 from 10 m/s: 11.5 m/s and 32.25 m after 3 s."""
    file = file_of(tmp_path, with_controller("ramp", a=0.5), end=3.0)
    scenario = check(file, names=Names({"ramp": Ramp})).playable()
    found = play_ideal(scenario, 3.0).of("other")
    assert found[-1].speed == pytest.approx(11.5, abs=0.03)
    assert found[-1].x - found[0].x == pytest.approx(32.25, abs=0.1)


def test_an_action_of_the_file_upon_the_speed_goes_before_the_controller(tmp_path):
    slow = event("slow", private(speed(to(4), "linear", 2)), time(1))
    file = file_of(tmp_path, with_controller("ramp", a=0.5), stories=story(slow), end=3.0)
    found = play_ideal(check(file, names=Names({"ramp": Ramp})).playable(), 3.0).of("other")
    assert found[-1].speed == pytest.approx(4.0, abs=0.05)


@pytest.mark.osc("UserDefinedAction", "CustomCommandAction", "UserDefinedValueCondition")
def test_an_action_and_a_value_of_users_are_reached_by_their_names(tmp_path):
    custom = """<UserDefinedAction><CustomCommandAction type="count">ping</CustomCommandAction>
</UserDefinedAction>"""
    value = by_value('<UserDefinedValueCondition name="count" value="1" rule="equalTo"/>')
    ping = event("ping", custom, time(1))
    stops = event("stops", private(speed(to(0))), value)
    file = write(tmp_path, stories=story(ping, stops), end=2.0)
    made = []

    def make():
        made.append(Counter())
        return made[-1]

    found = play_ideal(check(file, names=Names({"count": make})).playable(), 5.0)
    assert [c.texts for c in made] == [[(1.0, "ping")]]
    speeds = {round(row.time, 2): row.speed for row in found.of("other")}
    assert speeds[0.95] == pytest.approx(10.0)
    assert speeds[1.2] == pytest.approx(0.0)


@pytest.mark.parametrize(
    "part",
    [
        {"controller": with_controller("os:system")},
        {"controller": with_controller("nobody")},
        {
            "controller": vehicle("other"),
            "stories": story(event("e", """<UserDefinedAction><CustomCommandAction
type="os:system">ls</CustomCommandAction></UserDefinedAction>""", time(0))),
        },
        {
            "controller": vehicle("other"),
            "stories": story(event("e", private(speed(to(1))), by_value(
                '<UserDefinedValueCondition name="os:getcwd" value="1" rule="equalTo"/>'))),
        },
    ],
)  # fmt: skip
def test_a_name_that_is_not_registered_is_a_note_and_an_error_when_strict(tmp_path, part):
    file = file_of(tmp_path, **part)
    found = check(file)
    assert any("is not registered: it does nothing" in str(f) for f in found.findings)
    assert found.scenario is not None
    strict = check(file, names=Names(strict=True))
    assert strict.scenario is None
    with pytest.raises(ScenarioError, match="is not registered"):
        strict.playable()


def test_a_file_never_imports_what_it_names(tmp_path, monkeypatch):
    """A module of that name lies in the way of imports, and is not touched."""
    (tmp_path / "evil_by_name.py").write_text("raise SystemExit('imported')", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("evil_by_name", "evil_by_name:Evil", f"{tmp_path}/evil_by_name.py:Evil"):
        found = check(file_of(tmp_path, with_controller(name), end=0.2))
        play_ideal(found.playable(), 0.2)
    assert "evil_by_name" not in sys.modules


def test_names_are_given_on_the_command_line_and_a_rerun_would_ask(tmp_path, monkeypatch):
    file = file_of(tmp_path, with_controller("ramp", a=0.5), end=0.5)
    course = Scenario(file=str(file), register=("ramp=tests.scenarios.test_registered_names:Ramp",))
    load_scenario(course)
    assert RunSpec(course=course).foreign_code == (
        "the class 'ramp=tests.scenarios.test_registered_names:Ramp'",
    )
    for wrong in ("ramp", "=x:Y", "ramp=nowhere"):
        with pytest.raises(ConfigError):
            load_scenario(Scenario(file=str(file), register=(wrong,)))
    done = CliRunner().invoke(app, ["play", str(file), "--check", "--strict"])
    assert done.exit_code == 2
    assert "controller 'ramp' is not registered" in done.output


class Broken:
    def __init__(self, properties):
        pass

    def update(self, scene, name):
        return scene.nothing_of_this_name


def test_what_a_users_code_does_wrong_is_one_sentence(tmp_path):
    file = file_of(tmp_path, with_controller("broken"), end=1.0)
    scenario = check(file, names=Names({"broken": Broken})).playable()
    with pytest.raises(ConfigError, match="'broken', as it is registered, failed: .*nothing_of"):
        play_ideal(scenario, 1.0)
    with pytest.raises(ConfigError, match="setSpeed of a controller must be a number"):
        Acc({"setSpeed": "fast"})
