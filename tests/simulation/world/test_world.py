"""Actors that come and go, and control from outside, as a server's clients ask for."""

import msgspec
import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import ActorKind, GripModel, LightState
from skidpad.core.weather import Weather
from skidpad.physics.grip import grip_params
from skidpad.physics.types import vehicle_type
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.patches import FrictionZone
from skidpad.simulation.world.rows import Newcomer, Shape
from skidpad.simulation.world.world import Conditions, World

MAP = load_map("figure8")
START = MAP.place(MAP.ego_start).pose
CAR = Newcomer(vehicle_type("mini_cooper_s"))
POST = Newcomer(Shape(ActorKind.PROP, 0.5, 0.5, 1.0, float("inf")))


def empty(**conditions):
    grip = grip_params(Weather(), GripModel.NONE, 0.9)
    return World(MAP, Lights(MAP), Conditions(grip=grip, road_noise=0.0, **conditions))


def motion(world, id):
    return np.array([column[world.row(id)] for column in world.states])


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
    world.set_collides(post, False)
    world.teleport(car, START)
    world.set_velocity(car, 8.0 * np.cos(START.yaw), 8.0 * np.sin(START.yaw))
    for _ in range(60):
        world.step()
        assert world.touches == 0


def test_what_is_not_simulated_stays_where_it_is_put():
    world = empty()
    car = world.add(CAR, START, 5.0)
    world.set_simulated(car, False)
    world.set_grounded(car, False)
    high = Pose(START.x, START.y, START.z + 5.0, yaw=START.yaw)
    world.teleport(car, high)
    for _ in range(10):
        world.step()
    assert world.states.pose(world.row(car)) == high
    rammer = world.add(CAR, START.moved(forward=-20.0), 15.0)
    world.teleport(car, START)
    for _ in range(60):
        world.step()
    i = world.row(car)
    assert (world.states.x[i], world.states.y[i]) == (START.x, START.y)
    assert world.fleet.speed(world.row(rammer)) < 5.0


def test_held_velocity_is_kept_against_brakes_and_let_go():
    world = empty()
    car = world.add(CAR, START)
    world.hold_velocity(car, (6.0, 0.0))
    world.command(car, VehicleCommand(brake=1.0))
    for _ in range(20):
        world.step()
    assert world.fleet.speed(world.row(car)) == pytest.approx(6.0)
    world.hold_velocity(car, None)
    for _ in range(40):
        world.step()
    assert world.fleet.speed(world.row(car)) == pytest.approx(0.0, abs=1e-6)


def test_a_friction_zone_lengthens_stopping_and_ends_where_it_ends():
    def stop(zones):
        world = empty()
        car = world.add(CAR, START, 15.0)
        world.command(car, VehicleCommand(brake=1.0))
        world.zones = zones
        for _ in range(400):
            world.step()
        return np.hypot(world.states.x[0] - START.x, world.states.y[0] - START.y), world

    everywhere = FrictionZone(START, (500.0, 500.0, 50.0), 3.5 / 2.0)
    elsewhere = FrictionZone(START.moved(left=300.0), (5.0, 5.0, 5.0), 0.35)
    dry, _ = stop(())
    slippery, world = stop((everywhere,))
    assert slippery == pytest.approx(2.0 * dry, rel=0.1)
    assert stop((elsewhere,))[0] == dry
    world.zones = ()
    world.step()
    assert np.array_equal(world.fleet.tire_friction, world.tyres)


def test_other_physics_and_other_tyres_act_at_once():
    light, heavy, slippery = empty(), empty(), empty()
    for world in (light, heavy, slippery):
        car = world.add(CAR, START)
        world.command(car, VehicleCommand(throttle=1.0))
        if world is heavy:
            world.reshape(car, msgspec.structs.replace(CAR.body, mass=4000.0))
        if world is slippery:
            world.set_tyres(car, (0.35,) * 4)
        for _ in range(40):
            world.step()
    assert heavy.fleet.speed(0) < 0.6 * light.fleet.speed(0)
    assert slippery.fleet.speed(0) < 0.6 * light.fleet.speed(0)


def test_tyres_stay_what_they_are_when_others_come():
    world = empty()
    car = world.add(CAR, START)
    world.set_tyres(car, (1.0, 2.0, 3.0, 4.0))
    world.add(CAR, START.moved(forward=50.0))
    world.step()
    assert world.fleet.tire_friction[world.row(car)].tolist() == [1.0, 2.0, 3.0, 4.0]


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


def test_a_walker_follows_the_ground_in_the_direction_it_is_told():
    world = empty(all_lanes=True)
    person = world.add(Newcomer(Shape(ActorKind.PEDESTRIAN, 0.4, 0.6, 1.75, 78.0)), START)
    world.walk(person, 0.0, 1.4)
    for _ in range(40):
        world.step()
    s = world.states
    assert s.y[0] == pytest.approx(START.y + 2.8)
    assert s.yaw[0] == pytest.approx(np.pi / 2)


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
