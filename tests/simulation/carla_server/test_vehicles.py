"""Vehicles at rest: they stay there until something sets them going, as CARLA's do."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.catalogue import load_catalogue
from skidpad.simulation.carla_server.vehicles import STICKY_SPEED, Vehicles

CAR = 7
SLOPE = np.array([0.05])  # rad, uphill


@pytest.fixture
def vehicles() -> Vehicles:
    """One car at rest."""
    made = Vehicles()
    made.add(CAR, load_catalogue()["vehicle.tesla.model3"], Pose(0.0, 0.0))
    return made


def drive(vehicles: Vehicles, seconds: float) -> tuple[float, float]:
    """Way and speed after some time on the slope."""
    for _ in range(round(seconds / vehicles.dt)):
        vehicles.step(np.full((1, 4), 1.0), SLOPE, np.zeros(1))
    return float(vehicles.fleet.states.x[0]), vehicles.speed(CAR)


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
