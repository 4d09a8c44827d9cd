"""Wind: the drift of a car against the single-track model by hand, signs, gusts, and what it leaves alone."""

from dataclasses import replace
from math import cos, exp, pi, sin

import numpy as np
import pytest

from skidpad.campaign.driving.run_setup import stage_of, wind_of
from skidpad.campaign.runs.run import run
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.settings.parts import Settings
from skidpad.core.setup import Wind
from skidpad.core.states import VehicleCommand
from skidpad.physics.car import THROTTLE
from skidpad.physics.fleet import Fleet
from skidpad.physics.presets import find_weather
from skidpad.physics.types import vehicle_type
from skidpad.physics.wind import GUST_LENGTH, Gusts, side_coefficients, wind_of_intensity
from skidpad.recording.run.log_files import log_hash
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run

CAR = vehicle_type("hatchback")


def settled(wind, v=30.0, seconds=6.0, kind=CAR):
    """A car with its wheel held straight, its speed kept, after some time in a wind (x, y) that turns
    with it; side speed and yaw rate."""
    fleet = Fleet([kind], 0.01)
    fleet.place(0, Pose(0.0, 0.0), v)
    commands = np.zeros((1, 5))
    for _ in range(round(seconds / 0.01)):
        yaw = fleet.states.yaw[0]
        c, s = cos(yaw), sin(yaw)
        fleet.wind = (wind[0] * c - wind[1] * s, wind[0] * s + wind[1] * c)
        commands[0, THROTTLE] = np.clip(v - fleet.speed(0) + 0.35, 0.0, 1.0)
        fleet.step(commands, np.full((1, 4), 0.9))
    s = fleet.states
    side = s.vy[0] * cos(s.yaw[0]) - s.vx[0] * sin(s.yaw[0]) + s.yaw_rate[0] * fleet.params.x_cog[0]
    return float(side), float(s.yaw_rate[0]), fleet


def by_hand(wind_y, v, kind=CAR):
    """Side speed and yaw rate of the linear single-track model in a side wind, wheel straight."""
    fleet = Fleet([kind], 0.01)
    p = fleet.params
    m, a, b = p.mass[0], p.a[0], p.b[0]
    wheelbase = a + b
    front = p.stiffness[0, 0] * m * 9.80665 * b / wheelbase  # N/rad of an axle
    rear = p.stiffness[0, 1] * m * 9.80665 * a / wheelbase
    k, n = side_coefficients([kind])[0]
    air = np.hypot(v, wind_y)
    # forces and moments are linear in side speed and yaw rate, the air's included
    left = np.array(
        [
            [-(front + rear) / v - k * air, -(a * front - b * rear) / v - m * v],
            [
                -(a * front - b * rear) / v - n * v - 0.5 * (a - b) * k * air,
                -(a * a * front + b * b * rear) / v,
            ],
        ]
    )
    right = -np.array([k * air * wind_y, n * v * wind_y + 0.5 * (a - b) * k * air * wind_y])
    return np.linalg.solve(left, right)


@pytest.mark.parametrize(("wind", "v"), [(5.0, 30.0), (10.0, 30.0), (10.0, 20.0)])
def test_a_car_drifts_in_side_wind_as_the_single_track_model_does(wind, v):
    side, turn, _ = settled((0.0, wind), v)
    expected = by_hand(wind, v)
    assert turn == pytest.approx(expected[1], rel=0.06)
    assert side == pytest.approx(expected[0], rel=0.10)
    assert turn > 0.0  # wind from the right turns the car to the left, with the wind


def test_wind_from_the_other_side_is_the_mirror_image():
    one, other = settled((0.0, 8.0))[:2], settled((0.0, -8.0))[:2]
    assert np.array(one) == pytest.approx(-np.array(other), abs=1e-9)


def test_head_wind_takes_what_the_drag_area_says():
    fleet = Fleet([CAR], 0.01)
    slower = []
    for wind in (0.0, -15.0):
        fleet.place(0, Pose(0.0, 0.0), 30.0)
        fleet.wind = (wind, 0.0)
        fleet.step(np.zeros((1, 5)), np.full((1, 4), 0.9))
        slower.append(30.0 - fleet.speed(0))
    expected = 0.01 * fleet.params.drag[0] * (45.0**2 - 30.0**2) / fleet.params.mass[0]
    assert slower[1] - slower[0] == pytest.approx(expected, rel=0.02)


def test_larger_sides_are_pushed_more():
    van, car = side_coefficients([vehicle_type("van"), CAR])
    assert np.all(van > 1.5 * car)


def test_gusts_have_the_variance_and_memory_of_their_filter():
    mean = 12.0
    gusts = Gusts(Wind(mean, pi / 2.0, 0.2), seed=3)
    found = np.array([gusts.advance(0.05) for _ in range(40_000)])
    along, across = found[:, 1], -found[:, 0]
    assert along.mean() == pytest.approx(mean, abs=0.15)
    assert along.std() == pytest.approx(0.2 * mean, rel=0.06)
    assert across.std() == pytest.approx(0.2 * mean, rel=0.06)
    lag = 40  # 2 s
    rest = np.corrcoef(along[:-lag], along[lag:])[0, 1]
    assert rest == pytest.approx(exp(-0.05 * lag * mean / GUST_LENGTH), abs=0.06)
    assert Gusts(Wind(mean, 0.0, 0.2), 3).advance(0.05) == Gusts(Wind(mean, 0.0, 0.2), 3).advance(
        0.05
    )
    assert Gusts(Wind(mean, 0.0), 3).advance(0.05) == pytest.approx((mean, 0.0))


def spec_with(weather="clear-noon", **settings):
    return adas_run(2, weather, settings=settings, seed=3, duration=3.0)


def test_which_word_decides_the_wind():
    rain = find_weather("rain-noon")
    assert wind_of(spec_with()) is None
    carla = wind_of(spec_with("rain-noon", wind=True))
    assert carla.speed == pytest.approx(wind_of_intensity(rain.wind_intensity))
    assert wind_of_intensity(100.0) == 32.7  # Beaufort 12 begins
    assert carla.towards == pytest.approx(pi / 2.0)
    assert wind_of(spec_with(wind=True), (7.0, 1.0)) == Wind(7.0, 1.0, 0.0)
    own = spec_with(wind=True, wind_speed=9.0, wind_direction_deg=0.0, wind_gusts=0.1)
    assert wind_of(own, (7.0, 1.0)) == Wind(9.0, 0.0, 0.1)


def test_bad_values_get_one_sentence_with_field_and_range():
    for name, value in {"wind_speed": 31, "wind_gusts": 0.6, "wind_direction_deg": 400}.items():
        with pytest.raises(ConfigError, match=rf"{name}.*\[|{name}.*between"):
            Settings().with_values({name: value})


def test_a_run_in_wind_drifts_repeats_and_a_run_without_is_as_ever():
    calm, windy, again, off = (
        log_hash(run(spec_with(**s)).log)
        for s in (
            {},
            {"wind": True, "wind_speed": 12.0, "wind_gusts": 0.2},
            {"wind": True, "wind_speed": 12.0, "wind_gusts": 0.2},
            {"wind": False, "wind_speed": 12.0},
        )
    )
    assert windy == again
    assert windy != calm
    assert off == calm


def test_the_wind_of_a_scenario_may_change():
    ready = spec_with(wind=True, wind_speed=0.0)
    backend = EmbeddedBackend()
    setup = stage_of(ready).setup
    backend.reset(replace(setup, wind=Wind(0.0)), 3)
    backend.step(VehicleCommand())
    assert backend.world.air == (0.0, 0.0)
    backend.world.blow(10.0, 0.0)
    backend.step(VehicleCommand())
    assert backend.world.air == pytest.approx((10.0, 0.0))
    backend.close()
