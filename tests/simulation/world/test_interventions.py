"""Control of single actors from outside, as a server's clients ask for."""

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import ActorKind
from skidpad.simulation.world.interventions import (
    hold_velocity,
    set_grounded,
    set_simulated,
    teleport,
    walk,
)
from skidpad.simulation.world.rows import Newcomer, Shape
from support.empty_world import CAR, START, empty


def test_what_is_not_simulated_stays_where_it_is_put():
    world = empty()
    car = world.add(CAR, START, 5.0)
    set_simulated(world, car, False)
    set_grounded(world, car, False)
    high = Pose(START.x, START.y, START.z + 5.0, yaw=START.yaw)
    teleport(world, car, high)
    for _ in range(10):
        world.step()
    assert world.states.pose(world.row(car)) == high
    rammer = world.add(CAR, START.moved(forward=-20.0), 15.0)
    teleport(world, car, START)
    for _ in range(60):
        world.step()
    i = world.row(car)
    assert (world.states.x[i], world.states.y[i]) == (START.x, START.y)
    assert world.fleet.speed(world.row(rammer)) < 5.0


def test_held_velocity_is_kept_against_brakes_and_let_go():
    world = empty()
    car = world.add(CAR, START)
    hold_velocity(world, car, (6.0, 0.0))
    world.command(car, VehicleCommand(brake=1.0))
    for _ in range(20):
        world.step()
    assert world.fleet.speed(world.row(car)) == pytest.approx(6.0)
    hold_velocity(world, car, None)
    for _ in range(40):
        world.step()
    assert world.fleet.speed(world.row(car)) == pytest.approx(0.0, abs=1e-6)


def test_a_walker_follows_the_ground_in_the_direction_it_is_told():
    world = empty(all_lanes=True)
    person = world.add(Newcomer(Shape(ActorKind.PEDESTRIAN, 0.4, 0.6, 1.75, 78.0)), START)
    walk(world, person, 0.0, 1.4)
    for _ in range(40):
        world.step()
    s = world.states
    assert s.y[0] == pytest.approx(START.y + 2.8)
    assert s.yaw[0] == pytest.approx(np.pi / 2)
