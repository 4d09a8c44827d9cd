"""Engines and gears: what a fresh vehicle says of itself, and what a client's own come to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.physics.types import vehicle_type
from skidpad.simulation.carla_server.actors.catalogue import load_catalogue
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods.vehicles import get_telemetry_data
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.protocol.wire import WireError
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.engine import (
    RPM,
    Traction,
    at_wheels,
    engine_of,
    gear_at,
    parse_engine,
    revolutions,
    shift_speeds,
)
from skidpad.simulation.carla_server.vehicles.physics_control import (
    PhysicsControl,
    apply_control,
    parse_physics,
    with_engine,
)
from skidpad.simulation.carla_server.vehicles.vehicles import model_of

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
        was.force, pytest.approx(0.75 * was.power, rel=1e-3), pytest.approx(0.5 * was.speed)
    )
    assert at_wheels(replace(engine, gears=()), 0.3) == Traction(0.0, 0.0, 0.0)
    assert at_wheels(replace(engine, max_rpm=0.0), 0.3) == Traction(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("curve", "max_rpm"),
    [
        ([(0, 500), (6000, 0)], 6000),
        ([(20, 400), (1300, 600), (10000, 0)], 10000),
        ([(0, 400), (1500, 600), (6000, 0)], 6000),
        ([(0, 400), (1500, 600), (6000, 0)], 2000),
        ([(0, 0), (5000, 300)], 4000),
        ([(3000, 200)], 9000),
    ],
)
def test_force_and_power_are_the_greatest_anywhere_on_the_curve(curve, max_rpm):
    engine = replace(engine_of(MINI), torque_curve=tuple(curve), max_rpm=float(max_rpm))
    rpm = np.linspace(0.0, max_rpm, 200_001)
    torque = np.interp(rpm, *np.array(curve).T)
    came = at_wheels(engine, 0.3)
    assert came.power == pytest.approx((rpm * torque).max() * RPM, rel=1e-6)
    first = engine.gears[0][0] * engine.final_ratio
    assert came.force == pytest.approx(torque.max() * first / 0.3, rel=1e-6)


def single(value):
    """As it travels: every number in single precision."""
    if isinstance(value, list | tuple):
        return [single(v) for v in value]
    return float(np.float32(value)) if isinstance(value, float) else value


def test_what_is_given_back_as_it_was_changes_nothing():
    fresh = PhysicsControl.of(MINI)
    sent = fresh.pack([[0.0, 0.0, 0.0]] * 4)
    assert apply_control(MINI, fresh, parse_physics(single(sent))) is MINI
    untold = parse_physics([*sent[:10], [], *sent[11:]])  # no gears, as a client's fresh object
    kept = with_engine(untold, fresh)
    assert kept.engine == fresh.engine
    assert apply_control(MINI, fresh, kept) is MINI


def test_a_limit_of_revolutions_limits_the_speed_and_goes_with_them():
    mini = next(m for m in MODELS if m.title == "vehicle.mini.cooper_s")
    fresh = PhysicsControl.of(mini)
    sent = fresh.pack([[0.0, 0.0, 0.0]] * 4)
    slower = parse_physics([sent[0], 0.5 * sent[1], *sent[2:]])
    model = apply_control(mini, fresh, slower)
    assert model.speed_max == pytest.approx(0.5 * mini.speed_max)
    changed = {"power": 0.0, "speed_max": 0.0, "force_max": 0.0}
    assert structs.replace(model, **changed) == structs.replace(mini, **changed)
    back = apply_control(model, slower, fresh)
    assert [back.power, back.force_max, back.speed_max] == pytest.approx(
        [mini.power, mini.force_max, mini.speed_max]
    )


def test_wheels_without_a_radius_are_refused():
    fresh = PhysicsControl.of(MINI)
    sent = fresh.pack([[0.0, 0.0, 0.0]] * 4)
    for wheel in sent[15]:
        wheel[3] = 0.0
    with pytest.raises(WireError, match="radius must be >= 10 cm"):
        apply_control(MINI, fresh, parse_physics(sent))


def test_larger_wheels_are_a_longer_gear():
    fresh = PhysicsControl.of(MINI)
    sent = fresh.pack([[0.0, 0.0, 0.0]] * 4)
    for wheel in sent[15]:
        wheel[3] *= 2.0
    model = apply_control(MINI, fresh, parse_physics(sent))
    assert model.force_max == pytest.approx(0.5 * MINI.force_max)
    assert model.power == pytest.approx(MINI.power)


def test_revolutions_follow_the_gear():
    engine = engine_of(MINI)
    first = engine.gears[0][0] * engine.final_ratio
    assert revolutions(engine, 1, 3.0, 0.3) == pytest.approx(10.0 * first / RPM)
    assert revolutions(engine, -1, -3.0, 0.3) == revolutions(engine, 1, 3.0, 0.3)
    assert revolutions(engine, 99, 3.0, 0.3) == revolutions(engine, len(engine.gears), 3.0, 0.3)
    assert revolutions(engine, 0, 3.0, 0.3) == 0.0
    assert revolutions(engine, 1, 300.0, 0.3) == engine.max_rpm


def test_a_box_shifts_up_once_and_for_all_as_it_gets_faster():
    engine = engine_of(MINI)
    shifts = shift_speeds(engine, 0.3)
    gears = [gear_at(shifts, v) for v in np.linspace(0.0, 90.0, 500)]
    assert gears == sorted(gears)
    assert set(gears) == set(range(1, len(engine.gears) + 1))
    shift = 0.65 * engine.max_rpm * RPM * 0.3 / (engine.gears[0][0] * engine.final_ratio)
    assert [gear_at(shifts, f * shift) for f in (0.999, 1.001)] == [1, 2]
    assert gear_at(shift_speeds(replace(engine, gears=()), 0.3), 50.0) == 1


def test_gears_in_no_order_are_left_at_the_revolutions_that_they_say():
    """The lowest gear that does not shift up yet: a second gear shorter than the first is never in."""
    engine = replace(engine_of(MINI), gears=((2.0, 0.5, 0.65), (3.0, 0.5, 0.65), (1.0, 0.5, 0.65)))
    first = 0.65 * engine.max_rpm * RPM * 0.3 / (2.0 * engine.final_ratio)
    shifts = shift_speeds(engine, 0.3)
    assert [gear_at(shifts, f * first) for f in (0.99, 1.01)] == [1, 3]
    never = replace(engine, gears=((2.0, 0.5, 1.0), (1.0, 0.5, 0.65)))
    assert gear_at(shift_speeds(never, 0.3), 90.0) == 1


def test_the_snapshot_shows_the_gear_that_telemetry_tells():
    served = Served(ServerOptions(map="straight"), StreamHub())
    episode = served.episode
    shown = []
    for k, name in enumerate(("vehicle.carlamotors.carlacola", "vehicle.tesla.model3")):
        actor = episode.spawn(Wanted(name, {}), episode.map.spawn_points[0] @ Pose(40.0 * k, 0.0))
        yaw = episode.map.spawn_points[0].yaw
        episode.vehicles.set_velocity(actor.id, (14.0 * np.cos(yaw), 14.0 * np.sin(yaw), 0.0))
        vehicle = episode.vehicles.of(actor.id)
        episode.fill_rows(0.05)
        told = get_telemetry_data(served, actor.id)[5]
        assert episode.rows.vehicles["gear"][actor.row] == told == vehicle.gear(14.0)
        shown.append(told)
    assert shown[0] != shown[1]  # a truck's gears are not a car's


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (0, [[0.0, -1.0]], "torques must not be negative"),
        (0, [[3000.0, 1.0], [10.0, 1.0]], "revolutions must ascend"),
        (0, [[0.0, float("nan")]], "torque_curve"),
        (1, -5.0, "max_rpm"),
        (2, "x", "physics control.moi"),
        (10, [[-1.0, 0.5, 0.6]], "ratios of gears"),
        (10, [[1.0, 0.5]], "forward_gears"),
    ],
)
def test_engines_that_cannot_be_are_refused(at, value, said):
    sent = engine_of(MINI).pack()
    sent[at] = value
    with pytest.raises(WireError, match=said):
        parse_engine(sent)
