"""Grip from own signals: made-up signals of a brush tyre, and drives on roads whose grip is known."""

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.states import EgoEstimate, VehicleCommand
from skidpad.envelope.grip import (
    FADE_HIGH,
    GripEstimator,
    brush_grip,
    prior_grip,
)

G = 9.81
DT = 0.05


def brush_force(mu, slip, stiffness=22.0):
    """The tyre itself, force over load: 1 - (1 - sigma)^3 of its limit."""
    sigma = min(stiffness * slip / (3.0 * mu), 1.0)
    return mu * (1.0 - (1.0 - sigma) ** 3)


def ego(v, ax, slip=0.0):
    rim = v * (1.0 - slip)
    return EgoEstimate(Pose(0.0, 0.0), v, 0.0, ax, 0.0, (rim,) * 4, 1)


def braked(estimator, mu, slip, v=20.0, ticks=40, brake=None):
    """Brakes at steady slip; the pedal asks for what comes, unless told otherwise."""
    force = brush_force(mu, slip) * G
    drag = estimator.car.drag * v * v
    pedal = force / estimator.car.a_brake if brake is None else brake
    for _ in range(ticks):
        grip = estimator.update(ego(v, -force - drag, slip), VehicleCommand(brake=pedal), 0, 15.0)
    return grip


@pytest.mark.parametrize("mu", [0.1, 0.34, 0.6, 0.9])
@pytest.mark.parametrize("use", [0.5, 0.7, 0.9])
def test_the_brush_gives_back_the_grip_that_it_was_made_with(mu, use):
    slip = 3.0 * mu / 22.0 * use
    grip, sigma = brush_grip(brush_force(mu, slip), slip)
    assert grip == pytest.approx(mu, rel=1e-6)
    assert sigma == pytest.approx(use, rel=1e-6)


@pytest.mark.parametrize("mu", [0.12, 0.34, 0.6])
def test_braking_shows_grip_before_the_limit(mu):
    estimator = GripEstimator(DT)
    grip = braked(estimator, mu, 3.0 * mu / 22.0 * 0.6)
    assert grip.value == pytest.approx(mu, rel=0.12)
    assert grip.confidence > 0.9


def test_full_brake_on_ice_shows_its_grip_within_a_second():
    estimator = GripEstimator(DT)
    grip = braked(estimator, 0.12, 3.0 * 0.12 / 22.0 * 0.9, ticks=20, brake=1.0)
    assert grip.value == pytest.approx(0.12, rel=0.15)


def test_no_information_is_not_high_grip():
    estimator = GripEstimator(DT)
    for _ in range(100):  # rolls without pedals
        grip = estimator.update(ego(20.0, -0.1), VehicleCommand(), 0, 15.0)
    assert grip.confidence == 0.0
    assert grip.shown is None
    assert grip.value == grip.prior == prior_grip(0, 15.0)


def test_confidence_falls_with_the_distance_and_the_prior_comes_back():
    estimator = GripEstimator(DT)
    before = braked(estimator, 0.95, 3.0 * 0.95 / 22.0 * 0.9)
    for _ in range(round(FADE_HIGH / (20.0 * DT))):
        after = estimator.update(ego(20.0, -0.1), VehicleCommand(), 0, -5.0)
    assert after.confidence == pytest.approx(before.confidence * np.exp(-1.0), rel=0.02)
    assert after.value < 0.55 < before.value


def test_the_prior_falls_with_the_rain_and_in_the_cold():
    assert prior_grip(0, 15.0) > prior_grip(1, 15.0) > prior_grip(2, 15.0) > prior_grip(3, 15.0)
    assert prior_grip(0, 1.0) < prior_grip(2, 15.0)


def test_water_counts_for_more_at_a_higher_speed_than_the_one_of_the_evidence():
    estimator = GripEstimator(DT)
    braked(estimator, 0.6, 3.0 * 0.6 / 22.0 * 0.9, v=10.0)
    slow = estimator.update(ego(10.0, -0.1), VehicleCommand(), 3, 15.0)
    fast = estimator.update(ego(25.0, -0.1), VehicleCommand(), 3, 15.0)
    assert slow.value > 0.5
    assert fast.value <= prior_grip(3, 15.0)


@pytest.mark.parametrize(("weather", "low", "high"), [("icy_100", 0.09, 0.15), ("snow", 0.2, 0.45)])
def test_a_drive_on_a_slippery_road_finds_its_grip(weather, low, high):
    from skidpad.campaign.runs.run import drive

    run = drive(5, weather=weather, sensors="objects", duration=25.0, seed=900_001)
    rows = run.readings.table
    last = rows["envelope.grip"].to_numpy()[-100:]
    assert low < np.median(last) < high
    assert not isnan(rows["envelope.binding"][0])


def test_what_only_the_truth_knows_of_the_weather_changes_no_limit():
    """Frames of a drive on ice, shown again with the record of weather and friction scrambled."""
    from msgspec import structs

    from skidpad.campaign.driving.loop import Sink
    from skidpad.campaign.driving.run_setup import driver_of, stage_of
    from skidpad.campaign.runs.run import run as drive_run
    from skidpad.core.run import Roads, RunSpec
    from skidpad.core.vocabulary import SensorLevel
    from skidpad.physics.presets import preset
    from skidpad.stack.configurations import numbered_driver

    spec = RunSpec(
        driver=numbered_driver(5), course=Roads(), weather=preset("icy_100"), duration=8.0,
        sensors=SensorLevel.OBJECTS,
    )  # fmt: skip
    frames, commands = [], []

    class Keep(Sink):
        def see(self, moment):
            frame = moment.frame
            extra = dict(frame.extra)
            radar = type(frame.radar)._make(a.copy() for a in frame.radar)
            segments = {k: type(s)._make(a.copy() for a in s) for k, s in frame.segments.items()}
            frames.append(replace(frame, extra=extra, radar=radar, segments=segments))
            commands.append(moment.command)

    drive_run(spec, sinks=(Keep(),))
    other = structs.replace(spec, weather=preset("clear-noon"), seed=7)
    wheel = driver_of(other, stage_of(other))
    assert [wheel.act(frame) for frame in frames] == commands
