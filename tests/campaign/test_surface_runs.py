"""`--surface`: a run on a surface is felt, stored and driven again; without one nothing moves."""

import re
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import yaml
from msgspec import structs
from typer.testing import CliRunner

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.run import run
from skidpad.cli.main import app
from skidpad.core.courses import Scenario
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import ConfigError
from skidpad.core.inputs import Outside
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.settings.parts import load_profile
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.surface_files import read_surface

EXAMPLE = Path(__file__).parents[2] / "examples" / "puddle.yaml"
SPEC = RunSpec(course=Scenario(file="lead_slowdown"), sensors=SensorLevel.OBJECTS, duration=12.0)


def brake(*surface):
    """Brake alone from 20 m/s for 2 s: the turn in rad, and friction at the wheels in the first tick."""
    stage = stage_of(structs.replace(SPEC, surface=surface))
    backend = EmbeddedBackend()
    backend.reset(replace(stage.setup, ego=replace(stage.setup.ego, speed=20.0), actors=()), 1)
    start, mu = float(backend.truth().states.yaw[0]), None
    for _ in range(40):
        backend.step(VehicleCommand(brake=0.6))
        mu = np.array(backend.truth().mu[0]) if mu is None else mu
    return float(backend.truth().states.yaw[0]) - start, mu


def test_split_friction_turns_a_braking_car_towards_the_grip():
    """Ice under the right wheels: the left ones brake harder, so the car turns left (counterclockwise)."""
    straight, dry = brake()
    turned, mu = brake(SurfacePatch(ice_mm=3.0, road=1, side="right"))
    assert abs(straight) < 0.005
    assert turned > 0.03
    assert mu[[0, 2]] == pytest.approx(dry[[0, 2]])
    assert (mu[[1, 3]] < 0.2 * mu[[0, 2]]).all()


def test_a_surface_reaches_the_log_and_the_description_of_the_run(tmp_path):
    out = tmp_path / "out"
    call = [
        "play",
        "lead_slowdown",
        "--surface",
        str(EXAMPLE),
        "--duration",
        "8",
        "--out",
        str(out),
    ]
    done = CliRunner().invoke(app, call, catch_exceptions=False)
    assert done.exit_code in (0, 1), done.output
    plain = yaml.safe_load((out / "config.yaml").read_text())
    spec = run_from_plain(plain, "config.yaml")
    assert spec.surface == read_surface(EXAMPLE)
    log = read_log(out)
    assert log_hash(run(spec).log) == log_hash(log)
    assert log_hash(run(structs.replace(spec, surface=())).log) != log_hash(log)


def test_a_run_without_a_surface_is_described_as_before():
    assert "surface" not in SPEC.to_plain()
    assert run_from_plain(SPEC.to_plain(), "here") == SPEC


def test_carla_has_no_surfaces():
    with pytest.raises(ConfigError, match="needs the embedded simulator"):
        structs.replace(
            SPEC,
            surface=read_surface(EXAMPLE),
            backend=BackendChoice(backend=BackendKind.CARLA),
        )


@pytest.mark.parametrize("command", [["adas", "--configs", "4"], ["drive", "--no-browser"]])
@pytest.mark.parametrize(
    ("patch", "sentence"),
    [
        ("{ice_mm: 4, bridges: true}", "map figure8 names no <bridge>"),
        ("{ice_mm: 4, road: 999}", "map figure8 has no road 999; it has 1, 3"),
    ],
)
def test_a_surface_that_does_not_fit_the_map_is_refused_before_anything_drives(
    tmp_path, command, patch, sentence
):
    file, out = tmp_path / "ice.yaml", tmp_path / "out"
    file.write_text(f"patches:\n  - {patch}\n", encoding="utf-8")
    done = CliRunner().invoke(app, [*command, "--surface", str(file), "--out", str(out)])
    with pytest.raises(ConfigError, match=re.escape(f"ice.yaml: patches[0]: {sentence}")):
        raise done.exception
    assert not out.exists()


def test_a_surface_that_does_not_fit_a_played_scenario_is_named_with_its_file(tmp_path):
    file = tmp_path / "ice.yaml"
    file.write_text("patches:\n  - {ice_mm: 4, road: 999}\n", encoding="utf-8")
    call = ["play", "lead_slowdown", "--sensors", "objects", "--surface", str(file), "--out"]
    done = CliRunner().invoke(app, [*call, str(tmp_path / "out")])
    sentence = "ice.yaml: patches[0]: map straight has no road 999; it has 1"
    with pytest.raises(ConfigError, match=re.escape(sentence)):
        raise done.exception
    assert not (tmp_path / "out").exists()


def coast(*surface, **settings):
    """Roll from 18 m/s for 2 s with hands off: the turn in rad, and the speed that is left."""
    stage = stage_of(
        structs.replace(SPEC, surface=surface, settings=load_profile("recommended", settings))
    )
    backend = EmbeddedBackend()
    backend.reset(replace(stage.setup, ego=replace(stage.setup.ego, speed=18.0), actors=()), 1)
    start = float(backend.truth().states.yaw[0])
    for _ in range(40):
        backend.step(VehicleCommand())
    s = backend.truth().states
    return float(s.yaw[0]) - start, float(np.hypot(s.vx[0], s.vy[0]))


def test_a_puddle_under_the_left_wheels_pulls_a_coasting_car_to_the_left():
    puddle = SurfacePatch(water_mm=2.0, road=1, side="left")
    turned, v = coast(puddle, water_drag=True)
    straight, v_dry = coast(water_drag=True)
    without, _ = coast(puddle)
    assert abs(straight) < 0.002
    assert turned > straight + 0.002
    assert abs(without - straight) < 0.2 * (turned - straight)
    assert v < v_dry - 0.05


def test_a_vehicle_has_tyres_of_its_own():
    stage = stage_of(
        structs.replace(SPEC, settings=load_profile("recommended", {"tyres": "summer"}))
    )
    assert stage.setup.tyres == "summer"
    icy = replace(stage.setup.weather, ice_thickness=30.0, road_temperature_c=-5.0)
    other = replace(stage.setup.actors[0], tyres="studded")
    backend = EmbeddedBackend()
    backend.reset(replace(stage.setup, weather=icy, actors=(other,)), 1)
    backend.step(VehicleCommand())
    mu = backend.truth().mu
    assert mu[0] == pytest.approx(0.077, abs=0.002)
    assert (mu[1] > 0.2).all()


def test_a_patch_is_felt_by_the_tyres_of_each_vehicle_and_by_the_weather_of_the_moment():
    """Ice under two kinds of tyres; then rain takes the road beside a puddle, and not the puddle."""
    stage = stage_of(structs.replace(SPEC, surface=(SurfacePatch(ice_mm=3.0, road=1),)))
    backend = EmbeddedBackend()
    other = replace(stage.setup.actors[0], tyres="studded")
    backend.reset(replace(stage.setup, actors=(other,)), 1)
    backend.step(VehicleCommand())
    mu = backend.truth().mu
    assert (mu[1] / mu[0]).min() > 1.8
    stage = stage_of(structs.replace(SPEC, surface=(SurfacePatch(water_mm=2.0, road=1),)))
    backend.reset(replace(stage.setup, ego=replace(stage.setup.ego, speed=20.0), actors=()), 1)
    backend.step(VehicleCommand())
    before = np.array(backend.truth().mu[0])
    outside = Outside(
        weather=replace(stage.setup.weather, precipitation=60.0, wetness=100.0),
        grip=stage.setup.grip, range_model=stage.setup.range_model,
    )  # fmt: skip
    backend.change(outside)
    backend.step(VehicleCommand())
    assert backend.truth().mu[0] == pytest.approx(before, rel=0.03)


def test_the_example_of_a_stop_on_split_friction_is_quick_and_shows_the_control(tmp_path):
    """30 s of processor time are asked for after the first compile; 3 s are needed."""
    where = Path(__file__).parents[2] / "examples"
    speeds = {}
    for control in ("ideal", "wheel_speeds"):
        begin, out = process_time(), tmp_path / control
        call = [
            "play", "lead_slowdown", "--stack", f"{where / 'split_brake.py'}:SplitBrake",
            "--surface", str(where / "split_mu.yaml"), "--set", f"anti_lock={control}",
            "--sensors", "objects", "--duration", "6", "--out", str(out),
        ]  # fmt: skip
        found = CliRunner().invoke(app, call)
        assert found.exit_code == 0, found.output
        speeds[control] = read_log(out).v_ego
    assert process_time() - begin < 30.0
    drop = {name: v[45] - v[-1] for name, v in speeds.items()}
    assert 3.0 < drop["wheel_speeds"] < drop["ideal"]


def test_the_example_with_a_puddle_is_quick(tmp_path):
    """The first call compiles; the second one is timed. Issue 30: within 30 s of processor time."""
    call = ["play", "lead_slowdown", "--surface", str(EXAMPLE), "--set", "tyre_stiffness=on"]
    call += ["--set", "water_drag=on", "--sensors", "objects", "--out"]
    CliRunner().invoke(app, [*call, str(tmp_path / "first"), "--duration", "1"])
    begin = process_time()
    done = CliRunner().invoke(app, [*call, str(tmp_path / "second")], catch_exceptions=False)
    assert done.exit_code in (0, 1), done.output
    assert process_time() - begin < 30.0
    assert len(read_log(tmp_path / "second")) > 200
