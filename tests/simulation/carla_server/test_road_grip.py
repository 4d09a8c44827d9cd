"""K-2: weather acts once, and at each wheel it does not matter who lets it act."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import grip_params, ratio_at
from skidpad.physics.types import TIRE_FRICTION_REFERENCE
from skidpad.simulation.carla.grip import V_RATIO
from skidpad.simulation.carla_server.episode import Episode, Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicle
from skidpad.simulation.carla_server.weather import PACKED

MU_REF = 0.9
CARS = ("vehicle.mini.cooper_s", "vehicle.tesla.model3", "vehicle.carlamotors.firetruck")
WEATHERS = {
    "dry": ({}, 0.0),
    "rain": ({"precipitation": 60.0, "precipitation_deposits": 60.0, "wetness": 80.0}, 0.0),
    "ice": ({}, 50.0),
}


def served_with(grip: GripModel, weather: str) -> Served:
    """Three cars at the speed at which the adapter takes its ratio; one wheel is worn."""
    served = Served(ServerOptions(weather_grip=grip, mu_ref=MU_REF), StreamHub())
    episode = served.episode
    values, ice = WEATHERS[weather]
    episode.sky.apply([*(values.get(name, 0.0) for name in PACKED), 0.0])
    episode.sky.set_ice(ice)
    for id, place in zip(CARS, episode.map.spawn_points[::4], strict=False):
        episode.spawn(Wanted(id, {}), place)
    episode.moving.fleet.states.vx[:] = V_RATIO
    for vehicle in episode.vehicles:
        worn = [*vehicle.physics.tire_friction[:3], 2.0]
        let_wear(episode, vehicle, np.array(worn))
    return served


def let_wear(episode: Episode, vehicle: Vehicle, friction: np.ndarray) -> None:
    """Other tyres."""
    physics = replace(vehicle.physics, tire_friction=friction)
    episode.vehicles.reshape(vehicle.actor, physics, vehicle.type)


def effective(served: Served) -> np.ndarray:
    """(n, 4) what the tyres get."""
    moving = served.episode.moving
    moving.wheel_grip.set_for_all(served.episode.sky.grip)
    moving.feel_grip()
    return moving.on_wheels.road_mu * moving.fleet.tire_friction / TIRE_FRICTION_REFERENCE


@pytest.mark.req("K-2")
@pytest.mark.parametrize("model", [GripModel.STATISTICAL, GripModel.PHYSICAL])
@pytest.mark.parametrize("weather", list(WEATHERS))
def test_served_grip_and_scaled_wheels_agree_at_every_wheel(model: GripModel, weather: str) -> None:
    served = served_with(model, weather)
    scaled = served_with(GripModel.NONE, weather)
    params = grip_params(served.episode.sky.weather, model)
    ratio = ratio_at(params, V_RATIO)  # what the adapter multiplies by
    for vehicle in scaled.episode.vehicles:
        let_wear(scaled.episode, vehicle, vehicle.physics.tire_friction * ratio)
    one, two = effective(served), effective(scaled)
    assert one.shape == (3, 4)
    assert one == pytest.approx(two, rel=1e-6)
    assert one[:, 3] == pytest.approx(one[:, 2] * 2.0 / 3.5)
    if weather == "dry":
        assert one[:, 0] == pytest.approx(MU_REF, rel=0.1)  # it falls with speed
    else:
        assert (one[:, 0] < 0.95 * MU_REF).all()
