"""A person at the desk: what is done while driving is part of the run, and gives it again."""

import random
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from typer.testing import CliRunner

from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.runs.run import run
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.takeover.desk import (
    HOLD_TO_REVERSE,
    LOW_VISIBILITY,
    Desk,
    Hands,
    Recorded,
    beam_of,
)
from skidpad.cli.main import app
from skidpad.core.errors import FileError, OutputError
from skidpad.core.inputs import (
    Beam,
    Functions,
    Lamps,
    LampSwitch,
    Method,
    Pedals,
    Sky,
    Timed,
    Wheel,
)
from skidpad.core.run import Function
from skidpad.core.setup import DT
from skidpad.core.vocabulary import GripModel, RangeModel, SensorLevel, Supervision
from skidpad.core.weather import Weather
from skidpad.physics.optics import visibility
from skidpad.physics.presets import preset
from skidpad.recording.run.inputs import INPUTS, decode_inputs, encode_inputs, read_inputs
from skidpad.recording.run.log_files import log_hash, read_log
from support.runs import adas_run


def spec(sensors=SensorLevel.OBJECTS, duration=12.0, **changes):
    return adas_run(4, "clear-noon", sensors=sensors, duration=duration, seed=3, **changes)


def physical(weather):
    return Sky(weather, GripModel.PHYSICAL, RangeModel.PHYSICAL)


def wild(seed, ticks):
    """What somebody does who tries everything."""
    draw = random.Random(seed)
    names = ("clear-noon", "rain-night", "rain-sunrise", "snow", "clear-night")
    kinds = (
        lambda: Wheel(draw.random() < 0.6),
        lambda: Pedals(
            draw.choice((0.0, 0.4, 1.0)),
            draw.choice((0.0, 0.0, 1.0)),
            draw.uniform(-0.3, 0.3),
            draw.random() < 0.1,
            draw.choice(list(Method)),
        ),
        lambda: Functions(tuple(f for f in Function if draw.random() < 0.5)),
        lambda: Sky(
            preset(draw.choice(names)),
            draw.choice(list(GripModel)[::2]),
            draw.choice(list(RangeModel)),
        ),
        lambda: Lamps(draw.choice(list(LampSwitch))),
    )
    return [
        Timed(k, draw.choice(kinds)()) for k in range(ticks) for _ in range(draw.random() < 0.3)
    ]


def driven(inputs, wanted):
    return run(wanted, desk=Desk(Recorded(inputs), wanted)).log


@pytest.mark.req("A-273", "A-274")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_same_inputs_give_the_same_bytes(seed):
    inputs = wild(seed, 240)
    first = driven(inputs, spec())
    again = driven(decode_inputs(encode_inputs(inputs)), spec())
    assert log_hash(again) == log_hash(first)
    later = [replace(i, tick=i.tick + 1) for i in inputs]
    assert log_hash(driven(later, spec())) != log_hash(first)


def test_nobody_at_the_desk_changes_nothing():
    wanted = spec(duration=3.0)
    assert log_hash(driven([], wanted)) == log_hash(run(wanted).log)


def test_a_folder_of_a_person_is_driven_again(tmp_path):
    wanted, folder = spec(SensorLevel.PIXELS, 2.0), tmp_path / "run"
    desk = Desk(Recorded(wild(5, 40)), wanted)
    driven = drive_at_desk(wanted, desk, folder)
    assert read_run(folder) == structs.replace(wanted, inputs=read_run(folder).inputs)
    assert log_hash(read_log(folder)) == log_hash(driven.log)
    for stretch in (("0", "2"), ("0.5", "1")):
        call = ["rerun", str(folder), "--from", stretch[0], "--to", stretch[1]]
        done = CliRunner().invoke(app, [*call, "--video", str(tmp_path / "film.mp4")])
        assert done.exit_code == 0, done.output
        assert "the same drive" in done.output
    lines = (folder / INPUTS).read_bytes().splitlines(keepends=True)
    (folder / INPUTS).write_bytes(b"".join(lines[:-1]))
    done = CliRunner().invoke(app, ["rerun", str(folder), "--from", "0", "--to", "1"])
    assert isinstance(done.exception, FileError)
    assert "hash" in str(done.exception)
    with pytest.raises(OutputError, match="exists already"):
        drive_at_desk(wanted, desk, folder)


@pytest.mark.parametrize(
    "text",
    [
        b"{",
        b'{"tick":1}\n',
        b'{"tick":1,"input":{"type":"pedals","throttle":2.0}}\n',
        b'{"tick":1,"input":{"type":"wheel","manual":true}}\n{"tick":0,"input":{"type":"wheel","manual":true}}\n',
    ],
)
def test_lines_that_are_no_inputs_are_named(text):
    with pytest.raises(FileError, match=r"inputs.jsonl, line \d"):
        decode_inputs(text)


def test_inputs_that_are_not_there(tmp_path):
    assert read_inputs(tmp_path, "") == ()
    with pytest.raises(FileError, match="cannot read"):
        read_inputs(tmp_path, "abc")


def test_a_person_takes_over_and_hands_back():
    inputs = [Timed(20, Wheel(True)), Timed(21, Pedals(0.0, 0.4, 0.1, method=Method.GAMEPAD)),
              Timed(60, Wheel(False))]  # fmt: skip
    log = driven(inputs, spec(duration=5.0))
    manual = slice(22, 60)
    assert np.all(log.applied.brake[manual] == 0.4)
    assert np.all(log.applied.steer[manual] == 0.1)
    assert np.all(np.isnan(log.report.tier[20:60]))
    assert not np.isnan(log.report.tier[[19, 60]]).any()
    assert log.applied.brake[70] != 0.4


def test_nobody_puts_a_person_back_on_the_road():
    # 20 s of standing: the supervisor would move an ego that stands for 10 s without a reason
    still = [Timed(0, Wheel(True)), Timed(0, Pedals(0.0, 0.0, handbrake=True))]
    wanted = spec(duration=26.0)
    assert driven(still, wanted).relocations == ()
    back = driven([*still, Timed(260, Wheel(False))], wanted)
    assert np.all(back.supervision[:260] == Supervision.NONE)
    assert back.v_ego[-1] > 3.0


@pytest.mark.req("A-217")
def test_weather_acts_at_once_and_is_written_down():
    icy = replace(preset("snow"), name="snow-custom")
    log = driven([Timed(40, physical(icy))], spec(duration=4.0))
    mu = log.mu[:, 0]
    assert mu[40].min() > 0.8
    assert mu[41].max() < 0.6
    assert [log.weathers[k] for k in log.weather[[40, 41]]] == ["clear-noon", "snow-custom"]


def test_functions_are_switched():
    inputs = [Timed(40, Functions((Function.ACC,)))]
    log, plain = driven(inputs, spec(duration=6.0)), driven([], spec(duration=6.0))
    assert np.array_equal(log.requested.steer[:40], plain.requested.steer[:40])
    assert not np.array_equal(log.requested.steer[41:], plain.requested.steer[41:])


# --- hands


def moved(pedals, v=0.0, ticks=1, hands=None):
    hands = Hands(DT) if hands is None else hands
    for _ in range(ticks):
        command = hands.update(pedals, v)
    return hands, command


@pytest.mark.req("A-274")
def test_reverse_is_engaged_by_holding_the_brake_at_standstill():
    brake, gas = Pedals(brake=1.0), Pedals(throttle=1.0)
    n = round(HOLD_TO_REVERSE / DT)
    hands, command = moved(brake, 0.1, n - 1)
    assert (command.brake, command.reverse) == (1.0, False)
    assert hands.pressed == pytest.approx(HOLD_TO_REVERSE - DT)
    _, command = moved(brake, 0.1, 1, hands)
    assert (command.throttle, command.brake, command.reverse) == (1.0, 0.0, True)
    _, command = moved(gas, -3.0, 1, hands)
    assert (command.brake, command.reverse) == (1.0, True)  # first it stops
    _, command = moved(gas, -0.1, 1, hands)
    assert (command.throttle, command.reverse) == (1.0, False)


def test_a_brake_in_motion_or_released_between_engages_nothing():
    brake = Pedals(brake=1.0)
    assert not moved(brake, 5.0, 100)[1].reverse
    hands, _ = moved(brake, 0.0, 9)
    moved(Pedals(), 0.0, 1, hands)
    assert not moved(brake, 0.0, 9, hands)[1].reverse


def test_keys_turn_the_wheel_by_and_by_and_less_at_speed():
    left = Pedals(steer=1.0)
    assert moved(left, 0.0)[1].steer == pytest.approx(0.08)
    assert moved(left, 0.0, 100)[1].steer == 1.0
    fast = moved(left, 40.0, 100)[1].steer
    assert 0.0 < fast < 0.02
    mirrored = moved(Pedals(steer=-1.0), 40.0, 100)[1].steer
    assert mirrored == -fast
    assert moved(Pedals(steer=0.5, method=Method.GAMEPAD), 40.0)[1].steer == 0.5


@pytest.mark.req("A-219", "A-220")
def test_headlights_are_automatic_until_the_switch_is_moved():
    fog = Weather(fog_density=90.0)
    assert visibility(preset("clear-noon")) == 1000.0  # what the estimate begins with
    assert visibility(fog) < LOW_VISIBILITY == 200.0
    assert beam_of(LampSwitch.AUTO, preset("clear-noon")) is Beam.OFF
    assert beam_of(LampSwitch.AUTO, preset("clear-night")) is Beam.LOW
    assert beam_of(LampSwitch.AUTO, fog) is Beam.LOW
    for weather in (fog, preset("clear-noon")):
        assert beam_of(LampSwitch.HIGH, weather) is Beam.HIGH
        assert beam_of(LampSwitch.OFF, weather) is Beam.OFF
