"""The limits by a second route: a car that brakes step by step, without the formulas."""

from math import inf

import numpy as np
import pytest

from skidpad.envelope.limits import (
    Binding,
    RssParameters,
    bend_speed,
    bends_speed,
    floating_speed,
    following_speed,
    lowest,
    rss_speed,
    sight_speed,
    speed_before_bend,
)
from skidpad.physics.grip import GripParams
from skidpad.physics.stopping import stops

STEP = 1e-3  # s
GRIPS = [0.08, 0.15, 0.34, 0.6, 0.9]
G = 9.81


def has_contact(gap, v, v_lead, brake, lead_brake, delay):
    """Two cars move in small steps until both stand: does the rear one reach the front one?"""
    t, apart = 0.0, gap
    while (v > 0.0 or v_lead > 0.0) and apart > 0.0:
        v_next = max(v - (brake * STEP if t >= delay - STEP / 2 else 0.0), 0.0)
        lead_next = max(v_lead - lead_brake * STEP, 0.0)
        apart += 0.5 * STEP * (v_lead + lead_next - v - v_next)
        t, v, v_lead = t + STEP, v_next, lead_next
    return apart <= 0.0


@pytest.mark.parametrize("mu", GRIPS)
@pytest.mark.parametrize("distance", [20.0, 60.0, 150.0])
@pytest.mark.parametrize("delay", [0.1, 0.5])
def test_a_car_stops_within_sight_from_2_percent_below_and_not_from_15_percent_above(
    mu, distance, delay
):
    limit = sight_speed(distance, mu * G, delay)
    assert not has_contact(distance, 0.98 * limit, 0.0, mu * G, mu * G, delay)
    assert has_contact(distance, 1.15 * limit, 0.0, mu * G, mu * G, delay)


@pytest.mark.parametrize("mu", GRIPS)
@pytest.mark.parametrize("v_lead", [5.0, 15.0, 25.0])
def test_a_follower_misses_a_braking_lead_from_2_percent_below_and_not_from_15_percent_above(
    mu, v_lead
):
    gap, delay = 12.0, 0.5
    limit = following_speed(gap, v_lead, mu * G, mu * G, delay)
    assert not has_contact(gap, 0.98 * limit, v_lead, mu * G, mu * G, delay)
    assert has_contact(gap, 1.15 * limit, v_lead, mu * G, mu * G, delay)
    own, lead = limit * delay + limit * limit / (2.0 * mu * G), v_lead * v_lead / (2.0 * mu * G)
    assert own - lead == pytest.approx(gap)


def test_a_lead_that_brakes_harder_needs_a_larger_gap():
    assert following_speed(20.0, 20.0, 3.0, 9.0, 0.5) < following_speed(20.0, 20.0, 3.0, 3.0, 0.5)


def test_a_bend_takes_the_grip_that_it_was_given():
    v = bend_speed(1.0 / 80.0, 0.5 * G)
    assert v * v / 80.0 == pytest.approx(0.5 * G)
    assert bend_speed(0.0, 3.0) == inf


def test_a_car_that_slows_from_before_a_bend_has_its_speed_there():
    v, x = speed_before_bend(15.0, 100.0, 2.0), 0.0
    while x < 100.0:
        x, v = x + v * STEP, v - 2.0 * STEP
    assert v == pytest.approx(15.0, abs=0.02)
    ahead, curvature = np.array([0.0, 100.0, 200.0]), np.array([0.0, 1 / 80, 1 / 50])
    assert bends_speed(ahead, curvature, 2.0, 2.0, 0.0, 0.0) < 24.0


def test_water_floats_tyres_at_97_and_81_km_h_on_1_and_2_mm():
    assert 3.6 * floating_speed(1.0) == pytest.approx(96.9, abs=0.2)
    assert 3.6 * floating_speed(2.0) == pytest.approx(81.0, abs=0.2)
    assert floating_speed(0.1) == inf
    assert floating_speed(9.0) == floating_speed(2.54)


def test_the_lowest_limit_wins_and_is_named():
    limits = np.full(len(Binding), inf)
    limits[Binding.SIGHT], limits[Binding.BEND] = 30.0, 20.0
    every = (1 << len(Binding)) - 1
    assert lowest(limits, every, 50.0) == (20.0, Binding.BEND)
    assert lowest(limits, every, 10.0) == (10.0, Binding.NONE)
    assert lowest(limits, 1 << Binding.SIGHT, 50.0) == (30.0, Binding.SIGHT)
    assert lowest(limits, 0, 10.0) == (10.0, Binding.NONE)


@pytest.mark.parametrize("mu", [0.1, 0.34, 0.9])
def test_the_whole_vehicle_model_stops_within_sight_below_the_limit_and_not_above(mu):
    """Tyres, load transfer, anti-lock brakes and the pedal's delay, on a road of known grip."""
    limit = sight_speed(60.0, mu * G, 0.1)
    below, above = stops([GripParams(mu, 1.0, 0.0)] * 2, [0.98 * limit, 1.15 * limit])
    assert below.distance < 60.0 < above.distance


def rss_gap(v, v_lead, c):
    t, a = c.response, c.acceleration
    own = v * t + 0.5 * a * t * t + (v + a * t) ** 2 / (2.0 * c.brake_least)
    return max(own - v_lead * v_lead / (2.0 * c.brake_most), 0.0)


@pytest.mark.parametrize("v_lead", [0.0, 10.0, 25.0])
@pytest.mark.parametrize("gap", [10.0, 40.0, 120.0])
def test_rss_speed_is_the_one_whose_distance_the_gap_is(v_lead, gap):
    constants = RssParameters()
    v = rss_speed(gap, v_lead, constants)
    assert rss_gap(v, v_lead, constants) == pytest.approx(gap) or v == 0.0


@pytest.mark.parametrize("v_lead", [5.0, 20.0])
def test_at_the_rss_distance_a_follower_that_still_accelerates_just_stops_behind_the_lead(v_lead):
    """Step by step: full throttle in the response time, as the rule allows, then its least braking."""
    c = RssParameters()
    v, apart = 20.0, rss_gap(20.0, v_lead, c)
    t, lead = 0.0, v_lead
    while v > 0.0 or lead > 0.0:
        v_next = v + c.acceleration * STEP if t < c.response else max(v - c.brake_least * STEP, 0.0)
        lead_next = max(lead - c.brake_most * STEP, 0.0)
        apart += 0.5 * STEP * (lead + lead_next - v - v_next)
        t, v, lead = t + STEP, v_next, lead_next
    assert apart == pytest.approx(0.0, abs=0.1)
