"""Engines and gears: what a fresh vehicle says of itself, and what a client's own come to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from skidpad.core.constants import G
from skidpad.physics.types import vehicle_type
from skidpad.simulation.carla_server.catalogue import load_catalogue
from skidpad.simulation.carla_server.engine import (
    RPM,
    Traction,
    at_wheels,
    engine_of,
    parse_engine,
    revolutions,
)
from skidpad.simulation.carla_server.physics_control import PhysicsControl, applied, parse_physics
from skidpad.simulation.carla_server.vehicles import model_of
from skidpad.simulation.carla_server.wire import WireError

MODELS = [model_of(b) for id, b in load_catalogue().items() if id.startswith("vehicle.")]
MINI = vehicle_type("mini_cooper_s")


def pulled(engine, radius, v):
    """N at the wheels in the best gear at v (k,) m/s: torque at the revolutions of each gear."""
    rpm, torque = np.array(engine.torque_curve).T
    best = np.zeros_like(v)
    for ratio, _, _ in engine.gears:
        turns = v / radius * ratio * engine.final_ratio / RPM
        force = np.interp(turns, rpm, torque) * ratio * engine.final_ratio / radius
        best = np.maximum(best, np.where(turns <= engine.max_rpm, force, 0.0))
    return best


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.title)
def test_a_blueprint_describes_the_drive_that_it_has(model):
    engine, radius = engine_of(model), model.wheel_radius
    came = at_wheels(engine, radius)
    assert (came.force, came.power) == (
        pytest.approx(model.force_max),
        pytest.approx(model.power),
    )
    v = np.linspace(0.5, came.speed / 1.05, 500)  # gear by gear
    assert pulled(engine, radius, v) == pytest.approx(
        np.minimum(model.force_max, model.power / v), rel=0.01
    )
    drag = 0.5 * 1.225 * model.drag_area * v**2 + model.rolling_resistance * model.mass * G
    assert model.power / v[-1] == pytest.approx(drag[-1], rel=1e-3)  # no faster on the level


def test_twice_the_torque_or_half_the_ratio_by_hand():
    engine = engine_of(MINI)
    was = at_wheels(engine, 0.3)
    twice = replace(engine, torque_curve=tuple((r, 2.0 * t) for r, t in engine.torque_curve))
    assert at_wheels(twice, 0.3) == Traction(
        pytest.approx(2.0 * was.force), pytest.approx(2.0 * was.power), was.speed
    )
    long = replace(engine, final_ratio=0.5 * engine.final_ratio)
    assert at_wheels(long, 0.3) == Traction(
        pytest.approx(0.5 * was.force), was.power, pytest.approx(2.0 * was.speed)
    )
    half = replace(engine, max_rpm=0.5 * engine.max_rpm)  # below the range of full power
    assert at_wheels(half, 0.3) == Traction(
        was.force, pytest.approx(0.75 * was.power), pytest.approx(0.5 * was.speed)
    )
    assert at_wheels(replace(engine, gears=()), 0.3) == Traction(0.0, 0.0, 0.0)
    assert at_wheels(replace(engine, max_rpm=0.0), 0.3) == Traction(0.0, 0.0, 0.0)


def test_what_is_given_back_as_it_was_changes_nothing():
    """Also in the single precision in which it travels."""
    fresh = PhysicsControl.of(MINI)
    sent = fresh.packed([[0.0, 0.0, 0.0]] * 4)
    single = [[[float(np.float32(x)) for x in p] for p in sent[0]], *sent[1:]]
    assert applied(MINI, fresh, parse_physics(single)) is MINI
    untold = [[], *sent[1:10], [], *sent[11:]]  # as a client's fresh object has it
    assert applied(MINI, fresh, parse_physics(untold)) is MINI
    slower = [*sent]
    slower[1] = 0.5 * sent[1]
    model = applied(MINI, fresh, parse_physics(slower))
    assert model.speed_max == pytest.approx(0.5 * at_wheels(fresh.engine, MINI.wheel_radius).speed)
    assert structs.replace(model, power=0.0, speed_max=0.0, force_max=0.0) == structs.replace(
        MINI, power=0.0, speed_max=0.0, force_max=0.0
    )


def test_revolutions_follow_the_gear():
    engine = engine_of(MINI)
    first = engine.gears[0][0] * engine.final_ratio
    assert revolutions(engine, 1, 3.0, 0.3) == pytest.approx(10.0 * first / RPM)
    assert revolutions(engine, -1, -3.0, 0.3) == revolutions(engine, 1, 3.0, 0.3)
    assert revolutions(engine, 99, 3.0, 0.3) == revolutions(engine, len(engine.gears), 3.0, 0.3)
    assert revolutions(engine, 0, 3.0, 0.3) == 0.0
    assert revolutions(engine, 1, 300.0, 0.3) == engine.max_rpm


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (0, [[0.0, -1.0]], "torques must not be negative"),
        (0, [[3000.0, 1.0], [10.0, 1.0]], "revolutions must ascend"),
        (0, [[0.0, float("nan")]], "torque_curve"),
        (1, -5.0, "max_rpm"),
        (10, [[-1.0, 0.5, 0.6]], "ratios of gears"),
        (10, [[1.0, 0.5]], "forward_gears"),
    ],
)
def test_engines_that_cannot_be_are_refused(at, value, said):
    sent = engine_of(MINI).packed()
    sent[at] = value
    with pytest.raises(WireError, match=said):
        parse_engine(sent)
