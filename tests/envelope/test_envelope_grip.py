"""Grip from own signals: made-up signals of a brush tyre, and drives on roads whose grip is known."""

from dataclasses import replace
from math import inf, isnan

import numpy as np
import pytest

from grip_judging import Estimates, judge_estimates
from skidpad.envelope.belief import (
    CHANGE,
    forget,
    measure_confidence,
    new_belief,
    prior_grip,
    prior_of,
    quantile,
    see_limit,
    sum_grips,
)
from skidpad.envelope.grip import GripEstimator, leave_place
from skidpad.envelope.signals import BRAKE_BAR, CarSignals

G = 9.81
DT = 0.05


def brush_force(mu, slip, stiffness=22.0):
    """The tyre itself, force over load: 1 - (1 - sigma)^3 of its limit."""
    sigma = min(stiffness * slip / (3.0 * mu), 1.0)
    return mu * (1.0 - (1.0 - sigma) ** 3)


def message(v, ax, front=None, rear=None, brake=0.0, drive=0.0):
    front, rear = v if front is None else front, v if rear is None else rear
    return CarSignals((front, front, rear, rear), ax, 0.0, 0.0, 0.0, brake, drive)


def drive_off(estimator, mu, stiffness=22.0, use=0.7, air_c=15.0, drive=None, ticks=120, v=8.0):
    """Accelerates, rolls and accelerates again: front wheels slip as the tyre's curve says."""
    car = estimator.car
    for tick in range(ticks):
        share = use if tick // 12 % 2 else 0.0
        slip = 3.0 * mu / stiffness * share
        a = brush_force(mu, slip, stiffness) * (car.front_share) * G / (1.0 + car.height_ratio * mu)
        a -= car.drag * v * v + car.rolling * G * (1.0 - car.front_share)
        asked = max(a if drive is None else drive, 0.0) if share else 0.0
        v += a * DT
        grip = estimator.update(message(v, a, v * (1.0 + slip), drive=asked), 0, air_c)
    return grip


@pytest.mark.parametrize("mu", [0.12, 0.34])
@pytest.mark.parametrize("share", [0.7, 1.0, 1.3])
def test_slip_shows_low_grip_before_the_limit_whatever_the_stiffness_of_the_tyre(mu, share):
    estimator = GripEstimator(DT)
    grip = drive_off(estimator, mu, 22.0 * share, use=0.85, air_c=0.0, ticks=400)
    assert grip.value == pytest.approx(mu, rel=0.3)
    assert grip.shown is not None


def test_a_car_that_gets_an_eighth_of_what_its_throttle_asks_for_is_at_its_limit():
    estimator = GripEstimator(DT)
    grip = drive_off(estimator, 0.12, use=0.95, air_c=0.0, drive=4.5, ticks=60)
    assert grip.value == pytest.approx(0.12, rel=0.25)
    assert grip.confidence > 0.3


def test_an_engine_that_gives_a_third_less_than_its_data_sheet_is_no_ice():
    """On a dry road wheels slip with the force, too, and no more than the force needs."""
    estimator = GripEstimator(DT)
    grip = drive_off(estimator, 0.9, use=0.08, drive=1.5, ticks=400, v=15.0)
    assert grip.value > 0.6


def test_full_brake_on_ice_shows_its_grip_within_a_second():
    estimator, v, mu = GripEstimator(DT), 20.0, 0.12
    for _ in range(40):
        estimator.update(message(v, 0.0, v, v), 0, 0.0)
    for _ in range(20):
        a = -mu * G
        v += a * DT
        rim = v * (1.0 - 3.0 * mu / 22.0)
        grip = estimator.update(message(v, a, rim, rim, brake=BRAKE_BAR), 0, 0.0)
    assert grip.value == pytest.approx(mu, rel=0.25)


def test_no_information_is_not_high_grip():
    estimator = GripEstimator(DT)
    for _ in range(100):  # rolls without pedals
        grip = estimator.update(message(20.0, -0.1), 0, 15.0)
    assert grip.value == pytest.approx(grip.prior, rel=0.02)
    assert grip.prior == pytest.approx(prior_grip(0, 15.0))


def test_belief_spreads_back_to_the_prior_with_the_distance():
    belief, prior = new_belief(), prior_of(0, True)
    forget(belief, 0.0, prior)
    for _ in range(20):
        see_limit(belief, 0.12, 0.1)
    sure, low = measure_confidence(belief), quantile(belief.grips, 0.5)
    forget(belief, CHANGE / 10.0, prior)
    less = measure_confidence(belief)
    forget(belief, 10.0 * CHANGE, prior)
    assert low == pytest.approx(0.12, rel=0.1)
    assert sure > 0.8 > less > measure_confidence(belief) == pytest.approx(0.0, abs=0.01)
    assert belief.grips == pytest.approx(prior, abs=1e-3)


def test_one_wild_reading_does_not_undo_what_many_have_shown():
    belief = new_belief()
    for _ in range(20):
        see_limit(belief, 0.9, 0.1)
    see_limit(belief, 0.1, 0.1)
    sum_grips(belief)
    assert quantile(belief.grips, 0.5) > 0.7


def test_the_prior_falls_with_the_rain_and_in_the_cold():
    assert prior_grip(0, 15.0) > prior_grip(1, 15.0) > prior_grip(2, 15.0) > prior_grip(3, 15.0)
    assert prior_grip(0, 1.0) < prior_grip(2, 15.0)


def test_water_counts_for_more_at_a_higher_speed_than_the_one_of_the_evidence():
    estimator = GripEstimator(DT)
    estimator.update(message(10.0, 0.0), 3, 15.0)
    for _ in range(60):
        see_limit(estimator.arrays.belief, 0.6, 0.1)
    estimator.arrays.memory["v_shown"] = 10.0
    slow = estimator.update(message(10.0, 0.0), 3, 15.0)
    leave_place(estimator.arrays)
    for _ in range(40):
        fast = estimator.update(message(25.0, 0.0), 3, 15.0)
    assert slow.value > 0.5
    assert fast.value <= prior_grip(3, 15.0)


def estimates(truth, value, confidence=1.0, v=20.0):
    n = len(truth)
    return Estimates(np.array(truth), np.array(value), np.full(n, confidence), np.full(n, v))


def test_a_fall_of_the_grip_is_noticed_once_the_estimate_is_no_longer_a_third_too_high():
    truth = [0.9] * 40 + [0.1] * 100 + [0.9] * 40
    value = [0.9] * 60 + [0.1] * 80 + [0.9] * 40
    judged = judge_estimates([estimates(truth, value)])
    assert judged.notice == (pytest.approx(1.0),)
    never = judge_estimates([estimates(truth, [0.9] * 180)])
    assert never.notice == (inf,)
    assert judged.alarms == 0


def test_false_alarms_and_ways_on_the_prior_are_counted_apart():
    low = judge_estimates([estimates([0.9] * 100, [0.9] * 40 + [0.3] * 5 + [0.9] * 55)])
    assert (low.alarms, low.prior_share, low.too_high) == (1, 0.0, 0.0)
    blind = judge_estimates([estimates([0.9] * 100, [0.3] * 100, confidence=0.0)])
    assert (blind.alarms, blind.prior_share, blind.error) == (0, 1.0, None)


@pytest.mark.parametrize(("weather", "low", "high"), [("icy_100", 0.09, 0.15), ("snow", 0.2, 0.45)])
def test_a_drive_on_a_slippery_road_finds_its_grip(weather, low, high):
    from skidpad.campaign.runs.drive import drive

    run = drive(5, weather=weather, sensors="objects", duration=25.0, seed=900_001)
    rows = run.readings.table
    last = rows["envelope.grip"].to_numpy()[-100:]
    assert low < np.median(last) < high
    assert not isnan(rows["envelope.binding"][0])


def test_what_only_the_truth_knows_of_the_weather_changes_no_limit():
    """Frames of a drive on ice, shown again with the record of weather and friction scrambled."""
    from msgspec import structs

    from skidpad.campaign.driving.loop import Sink
    from skidpad.campaign.driving.run_setup import stage_of
    from skidpad.campaign.driving.stack_at_wheel import driver_of
    from skidpad.campaign.runs.run import run as drive_run
    from skidpad.core.courses import Roads
    from skidpad.core.run import RunSpec
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
    other = structs.replace(spec, weather=preset("clear-noon"))
    wheel = driver_of(other, stage_of(other))
    assert [wheel.act(frame) for frame in frames] == commands
