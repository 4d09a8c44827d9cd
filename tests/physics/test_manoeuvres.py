"""Manoeuvres of standards as a table: what the car does with and without stability control."""

from __future__ import annotations

from math import degrees

import numpy as np
import pytest

from manoeuvres import (
    Bench,
    lateral_limit,
    pedals_in_turn,
    sine_with_dwell,
    time_to_speed,
    understeer,
)
from skidpad.core.maths.constants import G
from skidpad.physics.types import EGO_TYPE, VehicleType, traffic_types, vehicle_type
from split_friction import split_stop

EGO = vehicle_type(EGO_TYPE)
CARS = [vehicle_type(name) for name in traffic_types()]
AMPLITUDES = (1.5, 3.0, 5.0, 6.5, 9.0)


def by_title(kind: VehicleType) -> str:
    return kind.title


@pytest.mark.parametrize("kind", CARS, ids=by_title)
def test_cars_understeer(kind):
    # Small accelerations show the axles' stiffness itself, larger ones the tyres' curve too.
    assert understeer(kind, 0.3, 0.8) == pytest.approx(kind.understeer, rel=0.15)
    assert 1.5 < degrees(understeer(kind)) * G < 2.6


@pytest.mark.parametrize("kind", CARS, ids=by_title)
def test_no_car_corners_harder_than_it_has_grip(kind):
    assert 0.8 * 0.9 * G < lateral_limit(kind) < 0.9 * G


@pytest.mark.parametrize("mu", [0.9, 0.3])
def test_the_circle_s_limit_is_below_friction_and_the_front_axle_s(mu):
    assert 0.8 * mu * G < lateral_limit(EGO, mu) < mu * G


@pytest.mark.parametrize("kind", CARS, ids=by_title)
@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_neither_lift_off_nor_brakes_in_a_turn_spin_a_car_with_stability_control(kind, share):
    for done in pedals_in_turn(kind, share * 0.9 * G, (0.0, 0.2, 0.5, 1.0), stability=True):
        assert degrees(done.slip) < 10.0, done
        assert done.ratio < 1.3, done


def test_without_it_lift_off_tightens_the_turn_and_light_braking_spins():
    gentle, light = pedals_in_turn(EGO, 0.8 * 0.9 * G, (0.0, 0.2), stability=False)
    assert 1.0 < gentle.ratio < 1.6
    assert 10.0 < degrees(gentle.slip) < degrees(light.slip)


@pytest.mark.parametrize("kind", CARS, ids=by_title)
def test_sine_with_dwell_is_passed_with_stability_control(kind):
    for done in sine_with_dwell(kind, AMPLITUDES, stability=True):
        assert done.stable, done
        assert done.responsive, done


def test_sine_with_dwell_is_failed_without():
    results = sine_with_dwell(EGO, AMPLITUDES, stability=False)
    assert results[0].stable
    assert not any(done.stable for done in results[2:])


def test_on_ice_it_helps_too():
    with_it = sine_with_dwell(EGO, (1.0, 2.0, 4.0), mu=0.3, stability=True)
    assert all(done.stable for done in with_it)


def test_traction_control_keeps_the_wheels_from_spinning():
    slides = []
    for stability in (True, False):
        bench = Bench([EGO], 0.5, 0.2, stability=stability)
        for _ in range(100):
            bench.step(0.0, 1.0)
        slides.append(float(bench.fleet.wheels.slide[0, 0]))
    assert slides[0] < 1.0 < slides[1]


def test_full_throttle():
    assert time_to_speed(EGO, 100 / 3.6) == pytest.approx(6.8, rel=0.10)


def test_brakes_on_split_friction_pull_less_with_stability_control():
    rates = []
    for stability in (True, False):
        bench = Bench([EGO], 20.0, np.array([[0.9, 0.2, 0.9, 0.2]]), stability=stability)
        for _ in range(50):
            bench.step(0.0, 0.0, 1.0)
        rates.append(float(bench.fleet.states.yaw_rate[0]))
    assert 0.0 < rates[0] < 0.6 * rates[1]


@pytest.mark.parametrize("kind", CARS, ids=by_title)
def test_a_driver_who_steers_stops_in_lane_on_split_friction(kind):
    stop = split_stop(kind, 100 / 3.6, steers=True)
    assert stop.aside < 0.6
    assert degrees(stop.heading) < 4.0
    assert degrees(stop.wheel) < 90.0
    assert 0.6 < stop.utilisation < 1.0
    assert split_stop(kind, 100 / 3.6, steers=False).aside > 5.0
    without = split_stop(kind, 100 / 3.6, steers=True, stability=False)
    assert without.wheel > 2.0 * stop.wheel
    assert without.aside > 2.0 * stop.aside


@pytest.mark.parametrize("stability", [True, False])
def test_mirrored_steer_mirrors_the_motion(stability):
    bench = Bench([EGO, EGO], 25.0, 0.5, stability=stability)
    for k in range(200):
        bench.step(np.array([0.1, -0.1]) * (1 if k < 100 else -1), 0.3, 0.1)
    t = bench.trace()
    assert t.y[:, 0] == pytest.approx(-t.y[:, 1], abs=1e-9)
    assert t.x[:, 0] == pytest.approx(t.x[:, 1], abs=1e-9)


def test_stability_control_leaves_calm_driving_alone():
    ends = []
    for stability in (True, False):
        bench = Bench([EGO], 25.0, stability=stability)
        for k in range(400):
            bench.step(0.02 * np.sin(0.02 * k), 0.2)
        ends.append(bench.trace().y[-1, 0])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
