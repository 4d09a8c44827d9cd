"""Friction zones and tyres act on the wheels, and stay what they are when others come."""

import numpy as np
import pytest

from skidpad.core.states import VehicleCommand
from skidpad.simulation.world.interventions import set_tyres
from skidpad.simulation.world.patches import FrictionZone
from support.empty_world import CAR, START, empty


def test_a_friction_zone_lengthens_stopping_and_ends_where_it_ends():
    def stop(zones):
        world = empty()
        car = world.add(CAR, START, 15.0)
        world.command(car, VehicleCommand(brake=1.0))
        world.wheel_grip.zones = zones
        for _ in range(400):
            world.step()
        return np.hypot(world.states.x[0] - START.x, world.states.y[0] - START.y), world

    everywhere = FrictionZone(START, (500.0, 500.0, 50.0), 3.5 / 2.0)
    elsewhere = FrictionZone(START.moved(left=300.0), (5.0, 5.0, 5.0), 0.35)
    dry, _ = stop(())
    slippery, world = stop((everywhere,))
    assert slippery == pytest.approx(2.0 * dry, rel=0.1)
    assert stop((elsewhere,))[0] == dry
    world.wheel_grip.zones = ()
    world.step()
    assert np.array_equal(world.fleet.tire_friction, world.wheel_grip.tyres)


def test_tyres_stay_what_they_are_when_others_come():
    world = empty()
    car = world.add(CAR, START)
    set_tyres(world, car, (1.0, 2.0, 3.0, 4.0))
    world.add(CAR, START.moved(forward=50.0))
    world.step()
    assert world.fleet.tire_friction[world.row(car)].tolist() == [1.0, 2.0, 3.0, 4.0]
