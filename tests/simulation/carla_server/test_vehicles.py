"""Vehicles at rest: they stay there until something sets them going, as CARLA's do."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import ActorKind, GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import grip_params
from skidpad.roads.bundled import load_map
from skidpad.simulation.carla_server.actors.catalogue import load_catalogue
from skidpad.simulation.carla_server.vehicles.control import Control
from skidpad.simulation.carla_server.vehicles.vehicles import LEAN_SHARE, STICKY_SPEED, Vehicles
from skidpad.simulation.world.conditions import Conditions
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.world import World

CAR = 7
DT = 0.05  # s
SLOPE = 0.05  # rad, uphill


@pytest.fixture
def vehicles() -> Vehicles:
    """One car at rest."""
    map = load_map("figure8")
    grip = grip_params(Weather(), GripModel.NONE, 1.0)
    made = Vehicles(World(map, Lights(map), Conditions(grip=grip, dt=DT, road_noise=0.0)))
    made.add(CAR, load_catalogue()["vehicle.tesla.model3"], Pose(0.0, 0.0))
    return made


def speed_of(vehicles: Vehicles) -> float:
    """m/s, never negative."""
    return abs(vehicles.moving.fleet.speed(0))


def drive(vehicles: Vehicles, seconds: float) -> tuple[float, float]:
    """Way and speed after some time on the slope."""
    moving = vehicles.moving
    for _ in range(round(seconds / DT)):
        vehicles.command(DT)
        grade = np.full(1, SLOPE)
        moving.feel_grip()
        moving.fleet.step(moving.commands, moving.on_wheels.road_mu, grade, np.zeros(1))
    return float(moving.states.x[0]), speed_of(vehicles)


def test_it_stays_on_a_slope_without_brake(vehicles: Vehicles) -> None:
    vehicles.set_velocity(CAR, (0.0, 0.0, 0.0))
    way, speed = drive(vehicles, 5.0)
    assert abs(way) < 0.01
    assert speed < 0.01


def test_throttle_sets_it_going(vehicles: Vehicles) -> None:
    vehicles.of(CAR).control.throttle = 0.6
    way, speed = drive(vehicles, 3.0)
    assert way > 2.0
    assert speed > 2.0


def test_a_push_lets_it_roll_back(vehicles: Vehicles) -> None:
    vehicles.push(CAR, (-0.05 * vehicles.of(CAR).type.mass, 0.0, 0.0))
    way, speed = drive(vehicles, 5.0)
    assert way < -1.0
    assert speed > STICKY_SPEED


def test_it_comes_to_rest_when_it_hardly_rolls(vehicles: Vehicles) -> None:
    vehicles.of(CAR).control.brake = 1.0
    vehicles.set_velocity(CAR, (3.0, 0.0, 0.0))
    stopped, _ = drive(vehicles, 2.0)
    vehicles.of(CAR).control.brake = 0.0
    way, speed = drive(vehicles, 3.0)
    assert way == pytest.approx(stopped, abs=0.02)
    assert speed < 0.01


def turned_wheels(name: str, ticks: int) -> float:
    """deg of the front wheels of a vehicle at rest, some ticks after full steering is asked for."""
    map = load_map("figure8")
    grip = grip_params(Weather(), GripModel.NONE, 1.0)
    made = Vehicles(World(map, Lights(map), Conditions(grip=grip, dt=DT, road_noise=0.0)))
    made.add(CAR, load_catalogue()[name], Pose(0.0, 0.0)).control.steer = 1.0
    for _ in range(ticks):
        made.command(DT)
        made.moving.step()
    return float(np.degrees(made.moving.fleet.wheels.steer[0]))


@pytest.mark.parametrize(
    "name",
    [
        "vehicle.tesla.model3",
        "vehicle.carlamotors.firetruck",
        "vehicle.carlamotors.european_hgv",
        "vehicle.mitsubishi.fusorosa",
    ],
)
def test_whatever_drives_steers_as_fast_as_clients_controllers_expect(name):
    """Lorries that steered at 35 deg/s left their lane by up to 33 m under the Traffic Manager."""
    assert turned_wheels(name, 5) > 25.0  # after 0.25 s
    assert turned_wheels(name, 30) == pytest.approx(70.0, abs=1.0)


RIDDEN = [
    id for id, b in load_catalogue().items() if b.kind in (ActorKind.MOTORCYCLE, ActorKind.BICYCLE)
]


@pytest.mark.parametrize("mu", [0.9, 1.5])
@pytest.mark.parametrize("speed", [8.0, 15.0])
@pytest.mark.parametrize("id", RIDDEN)
def test_a_two_wheeler_leans_into_a_bend_and_does_not_spin(
    id: str, speed: float, mu: float
) -> None:
    """Full steering, as a Traffic Manager asks for it, needs most of the tyres' grip and no more."""
    map = load_map("figure8")
    grip = grip_params(Weather(), GripModel.NONE, mu)
    made = Vehicles(World(map, Lights(map), Conditions(grip=grip, dt=DT, road_noise=0.0)))
    made.add(CAR, load_catalogue()[id], Pose(0.0, 0.0))
    made.set_velocity(CAR, (speed, 0.0, 0.0))
    made.of(CAR).control = Control(throttle=0.2, steer=1.0)
    states, across, slips = made.moving.states, [], []
    for _ in range(60):
        made.command(DT)
        made.moving.feel_grip()
        made.moving.fleet.step(
            made.moving.commands, made.moving.on_wheels.road_mu, np.zeros(1), np.zeros(1)
        )
        v = np.hypot(states.vx[0], states.vy[0])
        across.append(v * states.yaw_rate[0])
        course = np.arctan2(states.vy[0], states.vx[0])
        slips.append(abs((course - states.yaw[0] + np.pi) % (2.0 * np.pi) - np.pi))
    assert np.degrees(max(slips)) < 25.0
    most = LEAN_SHARE * float(made.moving.mu[0].mean()) * G
    assert 0.5 * most < max(across) < 1.35 * most
