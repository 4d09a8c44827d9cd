"""Driving functions that a package adds to our stack's configurations."""

from dataclasses import replace
from functools import partial

import pytest

from skidpad.campaign.driving.loop import Sink
from skidpad.campaign.runs.run import run
from skidpad.core.errors import ConfigError
from skidpad.core.objects.registry import Source
from skidpad.core.run import AdasDriver, Function, run_from_plain
from skidpad.core.specs import PointSensorSpec
from skidpad.core.vocabulary import Outcome
from skidpad.stack.configurations import parse_functions
from skidpad.stack.functions import FUNCTIONS, AddedFunctions, FunctionType
from support.runs import template

OWN = frozenset({Function.ACC, Function.LCA})


class Limp:
    """Halves the throttle, and counts its ticks."""

    mode = "limps"

    def __init__(self, map, dt):
        self.ticks = 0

    def update(self, frame, command):
        """Half of the throttle."""
        self.ticks += 1
        return replace(command, throttle=0.5 * command.throttle)

    def numbers(self):
        """How often it was asked."""
        return {"ticks": self.ticks}


class Cautious(Limp):
    """Asks for a sensor of its own and takes the throttle away above 1 m/s."""

    def __init__(self, map, dt):
        self.v = 0.0

    def sensors(self):
        """A speedometer, which the stack itself has not."""
        return (PointSensorSpec("speed", "speedometer"),)

    def update(self, frame, command):
        """No throttle above 1 m/s."""
        self.v = frame.extra["speed"]
        return replace(command, throttle=0.0) if self.v > 1.0 else command

    def numbers(self):
        """What the sensor said."""
        return {"v_mps": self.v}


class Raises(Limp):
    """Fails in its first tick."""

    def update(self, frame, command):
        """A fault of its author's."""
        raise KeyError("thermometer")


class Wrong(Limp):
    """Gives no command."""

    def update(self, frame, command):
        """Nothing."""


KINDS = {"limp": Limp, "cautious": Cautious, "careful": Cautious, "raises": Raises, "wrong": Wrong}


@pytest.fixture(autouse=True)
def _registered(monkeypatch):
    found = dict(FUNCTIONS.sources())
    for name, kind in KINDS.items():
        entry = FunctionType(name, f"To {name}", "ticks", kind)
        found[name] = Source(name, "a package", partial(lambda entry: entry, entry))
    monkeypatch.setattr(FUNCTIONS, "_sources", found)


class Follower(Sink):
    """Keeps commands, modes and what the functions said in each tick."""

    def __init__(self):
        self.told, self.seen = list, []

    def follow_readings(self, latest):
        """As the cockpit does."""
        self.told = latest

    def see(self, moment):
        """One moment."""
        self.seen.append((moment.command.throttle, moment.driver.mode, self.told()))


def driven(*added):
    sink = Follower()
    spec = template(driver=AdasDriver(functions=OWN, added=added), duration=1.0)
    return run(spec, sinks=(sink,)), sink.seen


def test_it_changes_what_the_stack_asks_for_and_is_shown_and_recorded():
    plain, before = driven()
    changed, after = driven("limp")
    assert before[0][0] > 0.0
    assert after[0][0] == pytest.approx(0.5 * before[0][0])
    assert "limps" in after[0][1]
    assert "limps" not in before[0][1]
    assert [told for *_, told in after[:3]] == [[("To limp, ticks", str(n))] for n in (1, 2, 3)]
    assert before[0][2] == []
    assert plain.readings is None
    assert changed.readings.table["limp.ticks"].to_list() == list(range(1, len(after) + 1))


def test_functions_read_the_sensors_that_they_ask_for():
    ended, seen = driven("cautious", "careful")  # both ask for the same
    v = ended.readings.table["cautious.v_mps"].to_numpy()
    assert v.max() > 1.0
    assert all(throttle == 0.0 for (throttle, *_), v in zip(seen, v, strict=True) if v > 1.0)


def test_a_function_that_raises_is_named_with_its_package():
    ended, _ = driven("limp", "raises")
    assert ended.outcome is Outcome.AGENT_ERROR
    assert "function raises (package a package) raised in tick 0: " in ended.error
    assert "KeyError" in ended.error
    assert "AdasStack" not in ended.error


def test_one_that_gives_no_command_ends_the_run_as_the_stack_would():
    ended, _ = driven("wrong")
    assert ended.outcome is Outcome.AGENT_ERROR
    assert "must return a VehicleCommand" in ended.error


def test_words_are_parted_and_a_wrong_one_is_refused():
    assert parse_functions("limp,acc") == (frozenset({Function.ACC}), ("limp",))
    with pytest.raises(ConfigError, match="unknown function 'lipm'.*did you mean 'limp'"):
        parse_functions("acc,lipm")


def test_a_run_without_added_functions_is_described_as_before():
    plain = template(driver=AdasDriver(functions=OWN)).to_plain()
    assert "added" not in plain["driver"]
    spec = template(driver=AdasDriver(functions=OWN, added=("limp",)))
    assert run_from_plain(spec.to_plain(), "a run") == spec


def test_a_package_without_a_factory_is_refused_before_the_run(monkeypatch):
    entry = FunctionType("idle", "To idle")
    found = {**FUNCTIONS.sources(), "idle": Source("idle", "a package", lambda: entry)}
    monkeypatch.setattr(FUNCTIONS, "_sources", found)
    for ask in (lambda: parse_functions("acc,idle"), lambda: AddedFunctions(["idle"], None, 0.01)):
        with pytest.raises(
            ConfigError, match="function 'idle' of the package a package: .*factory"
        ):
            ask()
