"""Settings, profiles, functions and stacks by name: what is accepted, and what errors say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app, main
from skidpad.core.errors import ConfigError, FileError, StackError
from skidpad.core.geometry import Pose
from skidpad.core.run import Function
from skidpad.core.settings.parts import (
    NAMES,
    PART_OF,
    PROFILES,
    Settings,
    differences,
    find_setting,
    load_profile,
    parse_assignments,
)
from skidpad.core.settings.stack import Lookahead
from skidpad.core.specs import LidarSpec, PointSensorSpec, RadarSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import GripModel
from skidpad.stack.adas import AdasConfig
from skidpad.stack.configurations import functions_of, parse_functions
from skidpad.stack.loading import GuardedStack, load_stack
from support.stackfakes import SPECS, ArcMap, frame

RUNNER = CliRunner()


def test_recommended_is_the_default():
    assert load_profile("recommended") == Settings()


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_survives_a_round_trip(name):
    profile = load_profile(name)
    assert replace(Settings(), profile=name).with_values(profile.to_plain()) == profile
    assert differences(profile, profile) == []


@pytest.mark.req("M-1")
@pytest.mark.parametrize("name", PROFILES[1:])
def test_published_profiles_know_no_weather_on_tyres_and_senses(name):
    p = load_profile(name)
    assert (p.world.grip, p.world.mu_ref) == (GripModel.NONE, 1.5)
    assert (p.sensors.range.value, p.sensors.camera) == ("none", False)
    assert (load_profile("recommended").world.mu_ref, p.traffic.initial_limit_kmh) == (0.9, 30.0)


@pytest.mark.req("M-14", "A-084")
def test_profiles_choose_the_published_readings():
    text, listing, first = (load_profile(name) for name in PROFILES[1:])
    assert (text.stack.lookahead, listing.stack.lookahead) == (Lookahead.FIXED, Lookahead.DYNAMIC)
    assert (text.sensors.bumper_depth_fov_deg, listing.sensors.bumper_depth_fov_deg) == (
        100.0,
        90.0,
    )
    assert not text.stack.safety_persist
    assert listing.stack.safety_persist
    changed = {name for name, _, _ in differences(listing, first)}
    assert changed == {"radar_corridor"}


def test_every_setting_says_where_it_comes_from_and_where_it_acts():
    for name in NAMES:
        one = find_setting(name)
        assert one.source[:2] in ("D-", "A-", "M-")
        assert one.text
    assert set(PART_OF.values()) == {"world", "sensors", "traffic", "stack", "metrics"}


def plain(value):
    return value.value if isinstance(value, Lookahead) else value


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("mu_ref=1.5", "mu_ref", 1.5),
        (" camera = off ", "camera", False),
        ("radar=YES", "radar", True),
        ("lookahead=fixed", "lookahead", Lookahead.FIXED),
        ("initial_limit_kmh=none", "initial_limit_kmh", None),
        ("initial_limit_kmh=30", "initial_limit_kmh", 30.0),
    ],
)
def test_assignments(text, name, value):
    assert parse_assignments([text]) == {name: value}
    assert load_profile("recommended", parse_assignments([text])).to_plain()[name] == plain(value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("mu_ref", r"--set takes name=value, got 'mu_ref'"),
        (
            "grib=none",
            r"unknown setting 'grib'; did you mean 'grip'.* listed by: skidpad profiles show",
        ),
        ("grip=ice", r"unknown grip 'ice'; choose one of: none, statistical, physical"),
        ("camera=maybe", r"setting camera must be on or off, got 'maybe'"),
        (
            "mu_ref=high",
            r"setting mu_ref must be a number between 0.05 and 3, winter or summer, got 'high'",
        ),
        ("initial_limit_kmh=x", r"between 5 and 250 or none, got 'x'"),
    ],
)
def test_wrong_assignments_say_what_is_allowed(text, says):
    with pytest.raises(ConfigError, match=says):
        parse_assignments([text])


@pytest.mark.parametrize(
    ("name", "value"), [("mu_ref", 0.0), ("mu_ref", float("nan")), ("lazy_gain", 2.1)]
)
def test_values_out_of_range_are_named(name, value):
    with pytest.raises(ConfigError, match=f"{name} must be between"):
        Settings().with_values({name: value})
    with pytest.raises(ConfigError, match="must be a number"):
        Settings().with_values({name: True})


def test_unknown_names_are_errors():
    for call, says in (
        (lambda: load_profile("best"), "unknown profile 'best'; choose one of: recommended"),
        (lambda: functions_of(5), "unknown configuration 5; choose one of: 0, 1, 2, 3, 4"),
        (lambda: parse_functions("acc,abs"), "unknown function 'abs'; choose one of: acc, lca"),
        (lambda: AdasConfig.from_mapping({"speed": 3}), "unknown stack option 'speed'"),
        (lambda: AdasConfig.from_mapping({"cruise_kmh": 0}), "cruise_kmh must be between 1"),
    ):
        with pytest.raises(ConfigError, match=says):
            call()


@pytest.mark.req("A-011")
def test_functions_by_name():
    assert parse_functions(" acc, lca ") == ({Function.ACC, Function.LCA}, ())
    assert parse_functions("") == (frozenset(), ())
    assert AdasConfig.from_mapping({"functions": ["tla"]}).functions == {Function.TLA}
    assert AdasConfig.from_mapping({}).functions == functions_of(4)


class Simple:
    """Does what it is told in its settings."""

    def __init__(self, specs, map, settings):
        if settings.get("refuse"):
            raise RuntimeError("not today")
        self.settings = settings

    def tick(self, frame):
        if "raises" in self.settings:
            raise KeyError("lidar")
        return self.settings.get("command", VehicleCommand())


class NoStack:
    """Has nothing."""


def guarded(**settings):
    return GuardedStack(Simple, SPECS, ArcMap(), settings)


def test_a_stack_is_found_in_a_module_or_a_file(tmp_path):
    assert load_stack(f"{__name__}:Simple") is Simple
    path = tmp_path / "mine.py"
    path.write_text("class Mine:\n    def tick(self, frame):\n        return None\n")
    assert load_stack(f"{path}:Mine").__name__ == "Mine"


@pytest.mark.parametrize(
    ("where", "error", "says"),
    [
        ("Simple", ConfigError, "given as module:Class or file.py:Class, got 'Simple'"),
        ("math:not a name", ConfigError, "given as module:Class"),
        ("no_such_module_here:A", ConfigError, "cannot be imported: ModuleNotFoundError"),
        ("math:Stack", ConfigError, "math has no class Stack"),
        ("math:pi", ConfigError, "math has no class pi"),
        ("collections:Counter", ConfigError, r"class Counter has no method tick\(frame\)"),
        ("nowhere/stack.py:A", FileError, "stack file 'nowhere/stack.py' does not exist"),
    ],
)
def test_what_is_no_stack_is_refused(where, error, says):
    with pytest.raises(error, match=says):
        load_stack(where)


def test_a_file_that_cannot_be_imported_is_named(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("import does_not_exist_anywhere\n")
    with pytest.raises(ConfigError, match=r"broken.py' cannot be imported: ModuleNotFound"):
        load_stack(f"{path}:A")


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"raises": 1}, r"Simple raised in tick 3: KeyError\('lidar'\)"),
        ({"command": None}, "Simple must return a VehicleCommand, got NoneType in tick 3"),
        (
            {"command": VehicleCommand(throttle=1.1)},
            "Simple: throttle must be between 0 and 1, got 1.1 in tick 3",
        ),
        ({"command": VehicleCommand(brake=-0.1)}, "brake must be between 0 and 1, got -0.1"),
        ({"command": VehicleCommand(steer=float("nan"))}, "steer must be between -1 and 1"),
    ],
)
def test_what_a_stack_does_wrong_is_its_outcome(settings, says):
    with pytest.raises(StackError, match=says):
        guarded(**settings).tick(frame(3))


def test_a_stack_that_cannot_be_built_is_an_outcome_too():
    with pytest.raises(StackError, match="Simple could not be built: RuntimeError"):
        guarded(refuse=True)


def test_optional_parts_of_a_stack_may_be_missing():
    plain = guarded()
    assert plain.tick(frame()) == VehicleCommand()
    assert plain.report == StackReport()
    assert plain.sensors() == ()
    plain.stack.report = "fine, thanks"
    assert plain.report == StackReport()
    more = (LidarSpec("l", Pose(0.0, 0.0)), PointSensorSpec("g", "gnss"))
    plain.stack.sensors = lambda: more
    assert plain.sensors() == more
    plain.stack.sensors = lambda: 1 / 0
    with pytest.raises(StackError, match=r"Simple.sensors\(\) raised: ZeroDivisionError"):
        plain.sensors()


@pytest.mark.parametrize(
    ("specs", "told"),
    [
        (SPECS[:1], "there is a sensor 'depth_roof' already"),
        ((PointSensorSpec("g", "gnss"),) * 2, "there is a sensor 'g' already"),
        ((PointSensorSpec("s", "sonar"),), "kind 'sonar'; choose one of: gnss, imu, speedometer"),
        ((RadarSpec("r", Pose(0.0, 0.0)),), r"specs of registered sensors \(camera, lidar, gnss"),
        (("lidar",), "eyes.*, got 'lidar'"),
    ],
)
def test_sensors_that_cannot_be_had_are_refused_before_the_run(specs, told):
    plain = guarded()
    plain.stack.sensors = lambda: specs
    with pytest.raises(StackError, match=told):
        plain.sensors()


def test_profiles_are_listed_with_their_distance_from_recommended():
    out = RUNNER.invoke(app, ["profiles"]).output
    assert out == RUNNER.invoke(app, ["profiles", "list"]).output
    lines = dict(line.split(maxsplit=1) for line in out.splitlines()[1:])
    assert set(lines) == set(PROFILES[1:])
    n = len(differences(load_profile("recommended"), load_profile("preliminary")))
    assert lines["preliminary"] == f"{n} settings differ from recommended"


def test_a_profile_is_shown_as_set_takes_it():
    out = RUNNER.invoke(app, ["profiles", "show", "thesis_listing"]).output
    shown = [line for line in out.splitlines() if not line.startswith("#")]
    pairs = parse_assignments(line.replace(": ", "=", 1) for line in shown)
    assert tuple(pairs) == NAMES
    assert Settings().with_values(pairs).to_plain() == load_profile("thesis_listing").to_plain()
    assert "D-023, stack: hold a lost near lead" in out


def test_profiles_are_compared():
    out = RUNNER.invoke(app, ["profiles", "diff", "thesis_listing", "preliminary"]).output
    assert [line.split() for line in out.splitlines()] == [
        ["setting", "thesis_listing", "preliminary"],
        ["radar_corridor", "lane_match", "parabola"],
    ]
    same = RUNNER.invoke(app, ["profiles", "diff", "preliminary", "preliminary"]).output
    assert same == "preliminary and preliminary are equal\n"


def test_an_unknown_profile_ends_with_one_sentence_and_code_2(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["skidpad", "profiles", "show", "best"])
    with pytest.raises(SystemExit) as caught:
        main()
    assert caught.value.code == 2
    assert "unknown profile 'best'; choose one of: recommended, thesis_text" in (
        capsys.readouterr().err
    )


EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "follow_lane.py"


def test_the_example_keeps_its_lane_for_twenty_seconds():
    """It stands in the README: it must drive as it is."""
    from skidpad import drive

    run = drive(f"{EXAMPLE}:FollowLane", duration=20.0, sensors="objects", seed=1)
    assert run.outcome.value == "completed"
    log = run.log
    assert len(log) == 400
    assert not log.contacts
    assert log.v_ego[-1] > 5.0
    assert abs(log.requested.steer).max() < 0.5
