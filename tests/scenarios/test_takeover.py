"""A file that works a vehicle's pedals itself, or hides a vehicle from sensors."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.courses import ActorMode
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log
from skidpad.scenarios.playing.player import Player
from skidpad.scenarios.playing.stage import IdealWorld
from support.scenarios.files import at, compiled, event, private, story, time, write

HIDE = private('<VisibilityAction graphics="true" sensors="{}" traffic="true"/>')


def override(inputs: str) -> str:
    return private(
        "<ControllerAction><OverrideControllerValueAction>"
        f"{inputs}</OverrideControllerValueAction></ControllerAction>"
    )


def driven(folder: Path, *events: str, actor: str, end: float, **parts: object) -> RunLog:
    file = write(folder, stories=story(*events, actor=actor), end=end, minor=3, **parts)
    done = CliRunner().invoke(app, ["play", str(file), "--out", str(folder / "out")])
    assert done.exit_code in (0, 1), done.output  # whatever the verdict
    return read_log(folder / "out")


def speed_of(log: RunLog, i: int, t: float) -> float:
    k = round(t / 0.05)
    return float(np.hypot(log.actors.vx[k, i], log.actors.vy[k, i]))


@pytest.mark.osc("OverrideControllerValueAction")
@pytest.mark.parametrize(("actor", "i"), [("ego", 0), ("other", 1)])
def test_a_brake_is_pressed_until_it_is_given_back(tmp_path, actor, i):
    """The ego under our stack, another one under the file's driver: 10 m/s, 1.5 s of full brake."""
    press = override('<Brake active="true"><BrakePercent value="1"/></Brake>')
    release = override('<Brake active="false"/>')
    events = event("press", press, time(2.0)), event("release", release, time(4.0))
    log = driven(tmp_path, *events, actor=actor, end=12.0)
    assert speed_of(log, i, 1.9) > 8.0
    assert speed_of(log, i, 3.9) < 0.3
    assert speed_of(log, i, 11.9) > 5.0


@pytest.mark.osc("OverrideControllerValueAction")
@pytest.mark.parametrize(
    ("inputs", "worked"),
    [
        ('<Throttle active="true" value="0.4"/><Brake active="true" value="2"/>',
         {"throttle": 0.4, "brake": 1.0}),
        (f'<SteeringWheel active="true" value="{1.5 * pi}"/>', {"steer": 0.5}),
        ('<ParkingBrake active="true"><BrakePercent value="0.2"/></ParkingBrake>', {"handbrake": True}),
        ('<Gear active="true"><AutomaticGear gear="r"/></Gear>', {"reverse": True}),
        ('<Gear active="true"><ManualGear number="2"/></Gear>', {"reverse": False}),
        ('<Throttle active="false" value="0.4"/>', {}),
    ],
)  # fmt: skip
def test_inputs_are_those_of_a_driver(tmp_path, inputs, worked):
    events = story(event("e", override(inputs), time(0.5)), actor="other")
    scenario = compiled(tmp_path, stories=events, minor=3)
    player, stage = Player(scenario, modes={"other": ActorMode.PHYSICAL}), IdealWorld(scenario)
    for _ in range(15):
        stage.step(player.step(stage.truth()))
    assert player.actors["other"].worked == pytest.approx(worked)


@pytest.mark.parametrize(
    "inputs",
    ['<Clutch active="true" value="1"/>', '<Brake active="true"><BrakeForce value="900"/></Brake>'],
)
def test_what_no_vehicle_here_has_is_noted(tmp_path, inputs):
    events = story(event("e", override(inputs), time(0.5)), actor="other")
    scenario = compiled(tmp_path, stories=events, minor=3)
    player, stage = Player(scenario), IdealWorld(scenario)
    for _ in range(15):
        stage.step(player.step(stage.truth()))
    assert any("Override" in notice for notice in player.scene.notices)


@pytest.mark.osc("VisibilityAction")
@pytest.mark.parametrize(("seen", "hits"), [("true", False), ("false", True)])
def test_a_car_that_no_sensor_sees_is_run_into(tmp_path, seen, hits):
    log = driven(
        tmp_path, event("e", HIDE.format(seen), time(0.0)), actor="other", end=14.0,
        init=at("ego", -1, 100, 15) + at("other", -1, 220, 0),
    )  # fmt: skip
    assert bool(log.contacts) is hits
