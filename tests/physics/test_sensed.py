"""Stability and traction control from wheel speeds and yaw rate: what they measure and what they do."""

import inspect
from math import degrees

import numpy as np
import pytest

from manoeuvres import Bench, pedals_in_turn, sine_with_dwell
from skidpad.core.maths.constants import G
from skidpad.physics import sensed
from skidpad.physics.sensed import CUTS, DRIVE, SIDE, SPEED, TURN, TURN_MOST
from skidpad.physics.types import vehicle_type
from split_friction import split_stop

CARS = [vehicle_type(name) for name in ("mini_cooper_s", "saloon", "suv", "sports_car")]
EGO = CARS[0]


@pytest.mark.parametrize("name", ["note_motion", "sensed_correction", "limit_drive"])
def test_the_controls_are_given_no_friction(name):
    given = set(inspect.signature(getattr(sensed, name).py_func).parameters)
    assert not given & {"mu", "feel", "grip", "slide", "load"}


def test_speed_and_side_slip_follow_the_truth_in_a_turn_on_wet_road():
    bench = Bench([EGO], 22.0, 0.5, sensed=True)
    for k in range(400):
        bench.step(0.05 * np.sin(0.015 * k), 0.2)
        memory = bench.fleet.wheels.memory[0]
        if k > 50:
            assert memory[SPEED] == pytest.approx(bench.v[0], rel=0.02)
            assert memory[SIDE] == pytest.approx(float(bench.slip_angles()[0]), abs=0.03)


@pytest.mark.parametrize("mu", [0.9, 0.2])
def test_the_speed_survives_a_stop_with_cycling_wheels_and_a_start_with_spinning_ones(mu):
    bench = Bench([EGO], 25.0, mu, sensed=True, cycling=True)
    while bench.v[0] > 5.0:
        bench.step(0.0, 0.0, 1.0)
        assert bench.fleet.wheels.memory[0, SPEED] == pytest.approx(bench.v[0], rel=0.12)
    for _ in range(300):
        bench.step(0.0, 1.0)
    assert bench.fleet.wheels.memory[0, SPEED] == pytest.approx(bench.v[0], rel=0.15)


@pytest.mark.parametrize("kind", CARS, ids=lambda kind: kind.title)
def test_sine_with_dwell_is_passed_on_dry_and_slippery_road(kind):
    """49 CFR 571.126, which nothing of it was fitted to."""
    for done in sine_with_dwell(kind, (1.0, 3.0, 5.0, 9.0), stability=True, sensed=True):
        assert done.stable, done
        assert done.responsive, done
    for done in sine_with_dwell(kind, (1.0, 4.0), mu=0.3, stability=True, sensed=True):
        assert done.stable, done


@pytest.mark.parametrize("kind", CARS, ids=lambda kind: kind.title)
def test_pedals_in_a_turn_spin_no_car(kind):
    for done in pedals_in_turn(kind, 0.8 * 0.9 * G, (0.0, 0.2, 1.0), stability=True, sensed=True):
        assert degrees(done.slip) < 10.0, done
        assert done.ratio < 1.5, done


def test_the_moment_is_limited_and_rises_in_time():
    bench = Bench([EGO], 25.0, 0.3, sensed=True)
    turns = []
    for k in range(200):
        bench.step(0.15 if k < 60 else -0.15)
        turns.append(bench.fleet.wheels.memory[0, TURN])
    assert 1.0 < np.abs(turns).max() <= TURN_MOST
    assert np.abs(np.diff(turns)).max() <= sensed.FALL * 0.01 + 1e-9
    rises = np.diff(np.abs(turns))
    assert rises.max() <= sensed.RISE * 0.01 + 1e-9


def test_calm_driving_is_left_alone():
    ends = []
    for on in (True, False):
        bench = Bench([EGO], 25.0, stability=on, sensed=on)
        for k in range(400):
            bench.step(0.02 * np.sin(0.02 * k), 0.2)
        ends.append(bench.trace().y[-1, 0])
        assert bench.fleet.wheels.memory[0, TURN] == 0.0
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


@pytest.mark.parametrize("mu", [0.2, 0.1])
def test_traction_control_cycles_and_keeps_spin_small(mu):
    speeds, slides = [], []
    for on in (True, False):
        bench = Bench([EGO], 0.5, mu, stability=on, sensed=on)
        slide = []
        for _ in range(400):
            bench.step(0.0, 1.0)
            slide.append(bench.fleet.wheels.slide[0].max())
        speeds.append(float(bench.v[0]))
        slides.append(np.mean(slide))
        if on:
            assert bench.fleet.wheels.memory[0, CUTS] >= 2.0
            assert bench.fleet.wheels.memory[0, DRIVE] < 0.6
    assert slides[0] < 0.15 * slides[1]
    assert speeds[0] > 0.85 * speeds[1]


@pytest.mark.parametrize("cycling", [False, True])
@pytest.mark.parametrize("kind", CARS, ids=lambda kind: kind.title)
def test_a_stop_on_split_friction_stays_in_lane(kind, cycling):
    stop = split_stop(kind, 100 / 3.6, steers=True, cycling=cycling, sensed=True)
    assert stop.aside < 1.0
    assert degrees(stop.heading) < 6.0
    assert degrees(stop.wheel) < 90.0
    assert 0.5 < stop.utilisation < 0.9


def test_mirrored_steer_mirrors_the_motion():
    bench = Bench([EGO, EGO], 25.0, 0.5, sensed=True)
    for k in range(200):
        bench.step(np.array([0.1, -0.1]) * (1 if k < 100 else -1), 0.3, 0.1)
    t = bench.trace()
    assert t.y[:, 0] == pytest.approx(-t.y[:, 1], abs=1e-9)
