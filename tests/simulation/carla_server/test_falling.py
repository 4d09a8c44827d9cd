"""Gravity: what is in the air falls freely, and stands where it lands."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods import motion
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.falling import ground_below
from skidpad.simulation.world.interventions import hold_velocity

CAR, WALKER = "vehicle.tesla.model3", "walker.pedestrian.0001"
DT = 0.05


@pytest.fixture
def straight(tmp_path) -> Served:
    return Served(ServerOptions(map="straight", data_dir=tmp_path), StreamHub())


def height(served: Served, actor) -> float:
    return served.episode.actors.pose(actor).z - actor.lift


@pytest.mark.parametrize("kind", [CAR, WALKER])
def test_what_is_put_into_the_air_falls_with_g(straight, kind):
    actor = straight.episode.spawn(Wanted(kind, {}), Pose(300.0, -1.75, 20.0))
    start = height(straight, actor)
    fall = round(sqrt(2.0 * start / G) / DT) - 1
    for k in range(1, fall):
        straight.tick()
        assert height(straight, actor) == pytest.approx(start - 0.5 * G * (k * DT) ** 2, abs=1e-6)
    told = straight.episode.rows.vehicles["velocity"][actor.row]
    assert told[2] == pytest.approx(-G * (fall - 1) * DT, rel=1e-5)
    for _ in range(5):
        straight.tick()
    assert height(straight, actor) == pytest.approx(0.0, abs=0.01)
    assert straight.episode.actors.velocity(actor)[2] == 0.0


def test_nothing_drives_in_the_air_and_it_drives_on_after_landing(straight):
    car = straight.episode.spawn(Wanted(CAR, {}), Pose(300.0, -1.75, 5.0))
    straight.episode.vehicles.set_velocity(car.id, (10.0, 0.0, 0.0))
    straight.episode.vehicles.of(car.id).control.brake = 1.0
    for _ in range(19):
        straight.tick()
        vx, vy, _ = straight.episode.actors.velocity(car)
        assert (vx, vy) == (pytest.approx(10.0, abs=0.1), pytest.approx(0.0, abs=1e-6))
        assert np.isfinite(straight.episode.moving.fleet.wheels.omega).all()
    for _ in range(60):
        straight.tick()
    assert straight.episode.actors.velocity(car)[0] == 0.0


def test_a_push_upwards_throws_a_car(straight):
    car = straight.episode.spawn(Wanted(CAR, {}), Pose(300.0, -1.75))
    straight.tick()
    mass = straight.episode.vehicles.of(car.id).type.mass
    motion.add_actor_impulse(straight, car.id, [0.0, 0.0, 5.0 * mass])
    highest = 0.0
    for _ in range(30):
        straight.tick()
        highest = max(highest, height(straight, car))
    assert highest == pytest.approx(25.0 / (2.0 * G), rel=0.01)
    assert height(straight, car) == pytest.approx(0.0, abs=0.01)


def test_without_gravity_or_physics_it_stays(straight):
    episode = straight.episode
    floating = episode.spawn(Wanted(CAR, {}), Pose(300.0, -1.75, 8.0))
    motion.set_actor_enable_gravity(straight, floating.id, False)
    fixed = episode.spawn(Wanted(CAR, {}), Pose(330.0, -1.75, 8.0))
    motion.set_actor_simulate_physics(straight, fixed.id, False)
    for _ in range(10):
        straight.tick()
    assert height(straight, floating) == height(straight, fixed) == 8.0
    motion.set_actor_enable_gravity(straight, floating.id, True)
    motion.set_actor_simulate_physics(straight, fixed.id, True)
    for _ in range(40):
        straight.tick()
    assert height(straight, floating) == pytest.approx(0.0, abs=0.01)
    assert height(straight, fixed) == pytest.approx(0.0, abs=0.01)


def test_a_car_driven_off_a_bridge_lands_on_the_road_below(tmp_path):
    """figure8 crosses itself 8 m above its lower road."""
    served = Served(ServerOptions(map="figure8", data_dir=tmp_path), StreamHub())
    episode, roads = served.episode, served.episode.map.roads
    top = bridge(roads)
    aside = top.pose.moved(left=top.offset)
    car = episode.spawn(Wanted(CAR, {}), aside)
    for wall in episode.landscape.present():
        episode.landscape.toggle([wall.id], False)  # no rail holds it
    episode.relandscape()
    assert height(served, car) == pytest.approx(top.z, abs=0.5)
    hold_velocity(episode.moving, car.body, (0.0, 12.0))  # sideways
    heights = []
    for _ in range(200):
        served.tick()
        heights.append(height(served, car))
        if heights[-1] < top.z - 1.0:
            hold_velocity(episode.moving, car.body, None)
    assert min(heights) < top.z - 6.0
    pose = episode.actors.pose(car)
    assert pose.z == pytest.approx(ground_below(roads, pose.x, pose.y, pose.z), abs=0.3)


def bridge(roads) -> Any:
    """The right edge of the upper road, right over the middle of the lower one."""
    table = roads.lanes
    for lane in range(len(table.road)):
        for s in np.arange(5.0, float(table.length[lane]) - 5.0, 2.0):
            place = roads.at(lane, float(s))
            under = roads.project(place.x, place.y, place.z - 8.0, driving=False)
            if under is not None and place.z - under.z > 6.0 and abs(under.offset) < 1.0:
                return place
    raise AssertionError("no bridge")


Serve = Callable[..., Any]


def test_the_client_sees_it_fall(serve: Serve) -> None:
    serve("--map", "straight").client(
        """
synchronous()
library = world.get_blueprint_library()
point = world.get_map().get_spawn_points()[0]
point.location.z += 10.0
car = world.spawn_actor(library.find("vehicle.tesla.model3"), point)
world.tick()
for k in range(2, 21):
    world.tick()
    fallen = point.location.z - car.get_location().z
    assert abs(fallen - 0.5 * 9.80665 * (0.05 * k) ** 2) < 1e-3, (k, fallen)
    assert abs(car.get_velocity().z + 9.80665 * 0.05 * k) < 1e-3, car.get_velocity()
for _ in range(40):
    world.tick()
assert abs(car.get_location().z) < 0.05 and car.get_velocity().length() < 0.01
"""
    )
