"""Friction of parts of the road on the CARLA server: triggers by wheel, `--surface` in a client's weather."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import Road, mu_at, road_surface
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import MU_REF, ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.weather import PACKED

CAR = "vehicle.tesla.model3"
SPEED = 20.0  # m/s


def serve(**options) -> tuple[Served, Actor]:
    """A server without clients, with a standing car."""
    served = Served(ServerOptions(**options), StreamHub())
    episode = served.episode
    return served, episode.spawn(Wanted(CAR, {}), episode.map.spawn_points[0])


def trigger(friction: float, x: float, y: float) -> Wanted:
    extent = {"extent_x": f"{100 * x}", "extent_y": f"{100 * y}", "extent_z": "300"}
    return Wanted("static.trigger.friction", {"friction": f"{friction}", **extent})


def tyres(served: Served) -> list[float]:
    served.episode.moving.feel_grip()
    return list(served.episode.moving.fleet.tire_friction[0])


def test_triggers_act_on_the_wheels_inside_and_the_slippery_one_counts():
    """One covers the left side, another the front; a vehicle's own tyres come back behind them."""
    served, car = serve()
    episode = served.episode
    at = episode.actors.pose(car)
    left = episode.spawn(trigger(0.5, 4.0, 1.0), at @ Pose(0.0, 1.0))
    assert tyres(served) == [0.5, 3.5, 0.5, 3.5]
    front = episode.spawn(trigger(0.2, 1.0, 4.0), at @ Pose(1.5, 0.0))
    assert tyres(served) == [0.2, 0.2, 0.5, 3.5]
    mild = episode.spawn(trigger(0.9, 9.0, 9.0), at)
    assert tyres(served) == [0.2, 0.2, 0.5, 0.9]
    episode.destroy(mild.id)
    episode.place(front, at @ Pose(60.0, 0.0))
    assert tyres(served) == [0.5, 3.5, 0.5, 3.5]
    (vehicle,) = episode.vehicles
    worn = replace(vehicle.physics, tire_friction=np.full(4, 2.0))
    episode.vehicles.reshape(vehicle.actor, worn, vehicle.type)
    assert tyres(served) == [0.5, 2.0, 0.5, 2.0]
    episode.destroy(left.id)
    assert tyres(served) == [2.0] * 4


def wet(served: Served, deposits: float) -> np.ndarray:
    """Friction at the car's wheels at SPEED with these deposits in the weather of a client, (4,)."""
    episode, weather = served.episode, {"precipitation_deposits": deposits}
    episode.sky.apply([*(weather.get(name, 0.0) for name in PACKED), 0.0])
    episode.move(0.05)
    episode.moving.fleet.states.vx[:], episode.moving.fleet.states.vy[:] = SPEED, 0.0
    episode.moving.feel_grip()
    return np.array(episode.moving.on_wheels.road_mu[0])


def write(folder: Path, patch: str) -> Path:
    file = folder / "surface.yaml"
    file.write_text(f"patches:\n  - {{{patch}}}\n", encoding="utf-8")
    return file


def test_deposits_of_a_clients_weather_fill_the_puddles_of_the_surface(tmp_path):
    """A puddle of 8 mm when full: nothing at 0 %, 4 mm at 50 % where weather alone leaves a film."""
    served, car = serve()
    at = served.episode.actors.pose(car)
    dry, film = wet(served, 0.0), wet(served, 50.0)
    puddle = f"water_mm: 8, by_deposits: true, circle: [{at.x}, {at.y}, 9]"
    served, car = serve(surface=write(tmp_path, puddle))
    assert wet(served, 0.0) == pytest.approx(dry)
    found = wet(served, 50.0)
    road = Road(served.episode.sky.weather, GripModel.PHYSICAL, MU_REF)
    filled = road.params("winter", replace(road_surface(road.weather), film_mm=4.0))
    assert found == pytest.approx([mu_at(filled, SPEED)] * 4, rel=1e-6)
    assert (found < 0.9 * film).all()


def test_a_surface_lies_on_the_first_map_alone(tmp_path):
    served, _ = serve(surface=write(tmp_path, "ice_mm: 3, road: 1"), map="straight")
    assert served.episode.moving.wheel_grip.patches is not None
    served.load("figure8", reset_settings=True)
    assert served.episode.moving.wheel_grip.patches is None
    served.load("straight", reset_settings=True)
    assert served.episode.moving.wheel_grip.patches is not None


def test_a_surface_that_does_not_fit_is_refused_with_its_file(tmp_path):
    with pytest.raises(ConfigError, match=r"surface\.yaml: patches\[0\]: .* has no road 999"):
        serve(surface=write(tmp_path, "ice_mm: 3, road: 999"))
