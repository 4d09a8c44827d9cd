"""Actors that come and go, and the lights of their world."""

import msgspec
import numpy as np
import pytest

from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import LightState
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.interventions import (
    set_collides,
    set_tyres,
    set_velocity,
    teleport,
)
from skidpad.simulation.world.lights import Lights
from support.empty_world import CAR, POST, START, empty, motion


def test_an_empty_world_passes_time():
    world = empty()
    for _ in range(20):
        world.step()
    assert world.tick == 20
    assert world.touches == 0


def test_coming_and_going_of_others_changes_nothing_far_away():
    alone, busy = empty(), empty()
    ids = [w.add(CAR, START, 10.0) for w in (alone, busy)]
    for w, id in zip((alone, busy), ids, strict=True):
        w.command(id, VehicleCommand(throttle=0.4, steer=0.01))
    other = -1
    for k in range(100):
        if k == 20:
            other = busy.add(CAR, START.moved(forward=-200.0), 3.0)
            busy.add(POST, START.moved(left=-30.0))
        if k == 60:
            busy.remove(other)
        alone.step()
        busy.step()
        assert np.array_equal(motion(alone, ids[0]), motion(busy, ids[0]))
    assert [m.is_wheeled for m in busy.members] == [True, False]


def test_ids_are_kept_and_vehicles_come_before_bodies_without_wheels():
    world = empty()
    post, car = world.add(POST, START.moved(forward=50.0)), world.add(CAR, START)
    assert (world.row(car), world.row(post)) == (0, 1)
    world.remove(car)
    assert world.row(post) == 0
    assert world.states.x[0] == pytest.approx(START.moved(forward=50.0).x)
    with pytest.raises(KeyError):
        world.row(car)


def test_a_post_stops_a_car_and_both_stay_what_they_are():
    world = empty()
    car = world.add(CAR, START, 8.0)
    post = world.add(POST, START.moved(forward=12.0))
    before = motion(world, post)
    touched = 0
    for _ in range(60):
        world.step()
        touched += world.touches
        if world.touches:
            assert (world.touching.i[0], world.touching.j[0]) == (world.row(car), world.row(post))
    assert touched > 0
    assert np.array_equal(motion(world, post), before)
    set_collides(world, post, False)
    teleport(world, car, START)
    set_velocity(world, car, 8.0 * np.cos(START.yaw), 8.0 * np.sin(START.yaw))
    for _ in range(60):
        world.step()
        assert world.touches == 0


def test_other_physics_and_other_tyres_act_at_once():
    light, heavy, slippery = empty(), empty(), empty()
    for world in (light, heavy, slippery):
        car = world.add(CAR, START)
        world.command(car, VehicleCommand(throttle=1.0))
        if world is heavy:
            world.reshape(car, msgspec.structs.replace(CAR.body, mass=4000.0))
        if world is slippery:
            set_tyres(world, car, (0.35,) * 4)
        for _ in range(40):
            world.step()
    assert heavy.fleet.speed(0) < 0.6 * light.fleet.speed(0)
    assert slippery.fleet.speed(0) < 0.6 * light.fleet.speed(0)


def test_a_shorter_step_gives_nearly_the_same_drive():
    ends = []
    for dt in (0.05, 0.02):
        world = empty()
        car = world.add(CAR, START, 10.0)
        world.command(car, VehicleCommand(throttle=0.3, steer=0.02))
        world.set_step(dt)
        for _ in range(round(4.0 / dt)):
            world.step()
        ends.append(motion(world, car)[:2])
    assert np.hypot(*(ends[0] - ends[1])) < 0.1


def test_lights_take_turns_stand_still_and_can_be_set():
    lights = Lights(load_map("town"))
    group = next(g for g in lights.groups.values() if len(g.phases) > 1)
    first, second = group.phases[0][0], group.phases[1][0]
    assert (first.state, second.state) == (LightState.GREEN, LightState.RED)
    first.green = 1.0
    for _ in range(20):
        lights.advance(0.05)
    assert first.state is LightState.YELLOW
    group.frozen = True
    for _ in range(200):
        lights.advance(0.05)
    assert first.state is LightState.YELLOW
    group.frozen = False
    lights.set_state(second, LightState.GREEN)
    assert lights.by_id[second.signal] is LightState.GREEN
    assert all(lights.by_row[row] == LightState.GREEN for row in second.rows)
