"""Air beside a lorry: one point by hand, the laws of the flow, and a car that overtakes."""

from dataclasses import replace
from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.states import ActorStates, VehicleCommand
from skidpad.physics.types import traffic_types, vehicle_type
from skidpad.physics.wakes import FRONTAL_LEAST, displacing, fill_air
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run

LORRY, CAR = vehicle_type("truck"), vehicle_type("hatchback")
AREA = 2.5 * 3.6  # m^2


@kernel
def air_at(states, large, wind_x, wind_y, air):
    fill_air(states, large, wind_x, wind_y, air)


def air(x, y, v=25.0, yaw=0.0, wind=(0.0, 0.0), on=True):
    """Velocity of the air at a car, from the middle of a lorry that drives along yaw."""
    states = ActorStates.empty(2)
    states.x[1], states.y[1] = x, y
    states.yaw[0] = yaw
    states.vx[0], states.vy[0] = v * np.cos(yaw), v * np.sin(yaw)
    states.present[:] = True
    found = np.zeros((2, 2))
    air_at(states, displacing([LORRY, CAR], on), *wind, found)
    assert found[0].tolist() == list(wind)  # none by itself
    return found[1]


def test_beside_the_front_by_hand():
    """3.5 m left of the front: the source is 3.5 m away, the sink at the rear hypot(8.6, 3.5)."""
    m = 25.0 * 2.0 * AREA
    far = hypot(8.6, 3.5)
    across = m / (4 * pi) * (1 / 3.5**2 - 3.5 / far**3)
    along = -m / (4 * pi) * 8.6 / far**3
    assert air(4.3, 3.5) == pytest.approx([along, across])
    assert across == pytest.approx(2.77, abs=0.01)


def test_it_blows_away_from_the_front_and_towards_the_rear_and_is_mirrored():
    assert air(4.3, 3.5)[1] == -air(4.3, -3.5)[1] > 0.0
    assert air(-4.3, 3.5) == pytest.approx([air(4.3, 3.5)[0], -air(4.3, 3.5)[1]])
    assert air(0.0, 3.5)[1] == pytest.approx(0.0, abs=1e-12)
    assert air(0.0, 3.5)[0] < 0.0  # what is pushed aside flows back along it


def test_what_leaves_the_source_passes_every_sphere_about_it():
    """By 2 A U, conservation of mass: half of it above the road. Here a sphere of 3 m about the front."""
    z, turn = np.meshgrid(np.linspace(-1, 1, 401), np.linspace(0, 2 * pi, 400, endpoint=False))
    strength = displacing([LORRY], True).strength[0] * 25.0
    normal = np.array([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    front, rear = 3.0 * normal, 3.0 * normal + np.array([8.6, 0.0, 0.0])[:, None, None]
    flow = strength * (
        front / np.linalg.norm(front, axis=0) ** 3 - rear / np.linalg.norm(rear, axis=0) ** 3
    )
    through = 4 * pi * 9.0 * np.mean((flow * normal).sum(axis=0))
    assert through == pytest.approx(2 * AREA * 25.0, rel=0.01)


def test_it_turns_with_the_lorry_and_moves_with_the_wind():
    ahead = air(4.3, 3.5)
    turned = air(-3.5, 4.3, yaw=pi / 2)
    assert turned == pytest.approx([-ahead[1], ahead[0]])
    carried = air(4.3, 3.5, v=20.0, wind=(-5.0, 0.0))
    assert carried == pytest.approx(ahead + np.array([-5.0, 0.0]))


def test_it_fades_and_ends_and_is_off_where_it_is_off():
    strength = [float(np.hypot(*air(4.3, y))) for y in (3.0, 5.0, 10.0, 20.0, 40.0)]
    assert all(a > b > 0.0 for a, b in pairwise(strength))
    assert air(4.3, 70.0).tolist() == [0.0, 0.0]
    assert air(4.3, 3.5, on=False).tolist() == [0.0, 0.0]
    assert np.isfinite(air(4.3, 0.0)).all()


def test_cars_push_nothing_and_vans_buses_and_lorries_do():
    cars = [vehicle_type(name) for name in traffic_types()]
    assert max(t.width * t.height for t in cars) < FRONTAL_LEAST
    large = [vehicle_type(name) for name in ("van", "truck", "bus")]
    assert displacing([*cars, *large], True).row.tolist() == [len(cars) + k for k in range(3)]


def overtake(wakes):
    """Yaw rates of a car that passes a lorry on its left, 3.5 m aside, at 30 against 22 m/s, hands off."""
    setup = stage_of(adas_run(2)).setup
    begin = Pose(200.0, -5.25, 0.0)
    ego = replace(setup.ego, type="hatchback", place=begin, speed=30.0)
    lorry = replace(ego, name="lorry", type="truck", speed=22.0, place=Pose(225.0, -8.75, 0.0))
    backend = EmbeddedBackend()
    chosen = replace(setup, map="straight", ego=ego, actors=(lorry,), traffic=None, wakes=wakes)
    backend.reset(chosen, 1)
    rates = []
    for _ in range(100):
        backend.step(VehicleCommand(throttle=0.35))
        rates.append(float(backend.truth().states.yaw_rate[0]))
    ahead = float(backend.truth().states.x[0] - backend.truth().states.x[1])
    backend.close()
    return np.array(rates), ahead


def test_a_car_that_overtakes_a_lorry_is_pushed_off_and_drawn_in():
    """It comes from behind: the rear draws it in, to the right, then the front pushes it off, to the left."""
    (rates, ahead), (calm, _) = overtake(True), overtake(False)
    assert ahead > 10.0
    moved = rates - calm
    right, left = int(moved.argmin()), int(moved.argmax())
    assert right < left
    assert moved[right] < -0.002
    assert moved[left] > 0.002
