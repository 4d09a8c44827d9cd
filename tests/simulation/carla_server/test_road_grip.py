"""K-2: weather acts once, and at each wheel it does not matter who lets it act."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import friction_ratio
from skidpad.physics.types import TIRE_FRICTION_REFERENCE
from skidpad.simulation.carla.grip import V_RATIO
from skidpad.simulation.carla_server.spawning import spawn
from skidpad.simulation.carla_server.streams import StreamHub
from skidpad.simulation.carla_server.weather import PACKED
from skidpad.simulation.carla_server.world import ServerOptions, World

MU_REF = 0.9
CARS = ("vehicle.mini.cooper_s", "vehicle.tesla.model3", "vehicle.carlamotors.firetruck")
WEATHERS = {
    "dry": ({}, 0.0),
    "rain": ({"precipitation": 60.0, "precipitation_deposits": 60.0, "wetness": 80.0}, 0.0),
    "ice": ({}, 50.0),
}


def world_with(grip: GripModel, weather: str) -> World:
    """Three cars at the speed at which the adapter takes its ratio; one wheel is worn."""
    world = World(ServerOptions(weather_grip=grip, mu_ref=MU_REF), StreamHub())
    values, ice = WEATHERS[weather]
    world.sky.apply([*(values.get(name, 0.0) for name in PACKED), 0.0])
    world.sky.set_ice(ice)
    for id, place in zip(CARS, world.map.spawn_points[::4], strict=False):
        spawn(world, [0, id, []], place)
    world.vehicles.fleet.states.vx[:] = V_RATIO
    for vehicle in world.vehicles.members:
        worn = [*vehicle.physics.tire_friction[:3], 2.0]
        vehicle.physics = replace(vehicle.physics, tire_friction=np.array(worn))
    return world


def effective(world: World) -> np.ndarray:
    """(n, 4) what the tyres get."""
    mu = world.grip.per_wheel(world).copy()
    return mu * world.vehicles.fleet.tire_friction / TIRE_FRICTION_REFERENCE


@pytest.mark.req("K-2")
@pytest.mark.parametrize("model", [GripModel.STATISTICAL, GripModel.PHYSICAL])
@pytest.mark.parametrize("weather", list(WEATHERS))
def test_served_grip_and_scaled_wheels_agree_at_every_wheel(model: GripModel, weather: str) -> None:
    served = world_with(model, weather)
    scaled = world_with(GripModel.NONE, weather)
    ratio = friction_ratio(served.sky.weather, model, V_RATIO)  # what the adapter multiplies by
    for vehicle in scaled.vehicles.members:
        friction = np.asarray(vehicle.physics.tire_friction) * ratio
        vehicle.physics = replace(vehicle.physics, tire_friction=friction)
    one, two = effective(served), effective(scaled)
    assert one.shape == (3, 4)
    assert one == pytest.approx(two, rel=1e-6)
    assert one[:, 3] == pytest.approx(one[:, 2] * 2.0 / 3.5)
    if weather == "dry":
        assert one[:, 0] == pytest.approx(MU_REF)
    else:
        assert (one[:, 0] < 0.95 * MU_REF).all()
