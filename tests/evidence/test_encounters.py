"""Encounters: constant velocities carried on step by step, and scenes worked out by hand."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import floats

from skidpad.evidence.bodies import Body
from skidpad.evidence.encounters import box_distance, encounter, time_to_meet
from support.examples import examples
from support.makelog import drive

STEP = 0.005


def body(x, y, yaw, v, length=4.0, width=2.0):
    x, y, yaw, v = (np.atleast_1d(np.asarray(q, float)) for q in (x, y, yaw, v))
    zero = np.zeros_like(x)
    return Body(x, y, yaw, v * np.cos(yaw), v * np.sin(yaw), zero, zero, length, width)


def moved(one: Body, t: float) -> Body:
    return one._replace(x=one.x + one.vx * t, y=one.y + one.vy * t)


def edge_points(one: Body) -> np.ndarray:
    """Points all around a box, (n, 2), by its definition."""
    u = np.linspace(-0.5, 0.5, 41)
    side = np.full_like(u, 0.5)
    local = np.concatenate([np.c_[u, side], np.c_[u, -side], np.c_[side, u], np.c_[-side, u]])
    local = local * [one.length, one.width]
    c, s = cos(one.yaw[0]), sin(one.yaw[0])
    turned = np.c_[local[:, 0] * c - local[:, 1] * s, local[:, 0] * s + local[:, 1] * c]
    return turned + np.array([one.x[0], one.y[0]])


@settings(max_examples=examples(40))
@given(
    floats(-40.0, 40.0), floats(-40.0, 40.0), floats(-pi, pi), floats(0.0, 20.0), floats(0.0, 20.0)
)
def test_the_time_to_meet_is_when_the_boxes_first_touch_if_both_go_on(x, y, yaw, v, w):
    one, other = body(0.0, 0.0, 0.3, v), body(x, y, yaw, w, 1.0, 0.6)
    time = float(time_to_meet(one, other)[0])
    if time > 5.0:
        steps = np.arange(0.0, 5.0, 0.1)
        least = min(box_distance(moved(one, t), moved(other, t))[0] for t in steps)
        assert least > 0.0
    else:
        assert box_distance(moved(one, time), moved(other, time))[0] < 1e-6
        if time > STEP:
            before = time - STEP
            assert box_distance(moved(one, before), moved(other, before))[0] > 0.0


@settings(max_examples=examples(40))
@given(floats(-9.0, 9.0), floats(-9.0, 9.0), floats(-pi, pi))
def test_the_distance_of_boxes_is_that_of_their_nearest_points(x, y, yaw):
    one, other = body(0.0, 0.0, -0.4, 0.0), body(x, y, yaw, 0.0, 2.0, 1.0)
    a, b = edge_points(one), edge_points(other)
    sampled = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)).min()
    found = float(box_distance(one, other)[0])
    if found > 0.0:
        assert found <= sampled + 1e-9
        assert sampled - found < 0.06  # half of the spacing of points
    else:
        assert time_to_meet(one, other)[0] == 0.0


def log_of(ego, other, ticks=400):
    """ego, other: functions of the time to (x, y, yaw, v)."""

    def rows(k):
        told = []
        for x, y, yaw, v in (ego(k * 0.05), other(k * 0.05)):
            told.append({"x": x, "y": y, "yaw": yaw, "vx": v * cos(yaw), "vy": v * sin(yaw)})
        return told

    return drive(ticks, rows)


def car(t):
    return 10.0 * t, 0.0, 0.0, 10.0  # at x = 100 m at 10 s


def walker(begin, at_x=100.0):
    """Walks at 2 m/s from y = -6 m over the ego's way to y = 6 m, from `begin` s on."""

    def place(t):
        y = min(max(-6.0 + 2.0 * (t - begin), -6.0), 6.0)
        return at_x, y, pi / 2.0, 2.0 if -6.0 < y < 6.0 else 0.0

    return place


@pytest.mark.parametrize(
    ("begin", "since", "met"),
    [
        (7.0, 7.0, True),  # in the middle of the lane when the car is there
        (1.0, 1.0, False),  # over and gone 5 s before the car comes, then stands 5 m beside it
        (12.0, 12.0, False),  # steps out when the car has been gone for a second
        (12.0, 0.0, False),  # its way crosses the ego's, so that standing near counts for nothing
    ],
)
def test_a_walker_is_in_play_when_it_crosses_with_the_car_and_not_before_or_after(
    begin, since, met
):
    found = encounter(log_of(car, walker(begin)), 0, 1, since)
    assert found.met is met
    assert found.distance < 20.0
    # boxes 4 m x 2 m both: the way is shared while |y| < 3 and the car within 3 m of x = 100
    if begin == 1.0:
        assert found.crossed_after == pytest.approx(9.7 - (begin + 4.5), abs=0.35)
    if begin == 12.0:
        assert found.crossed_after == pytest.approx(10.3 - (begin + 1.5), abs=0.35)


@pytest.mark.parametrize(
    ("other", "met"),
    [
        (lambda t: (30.0 + 10.0 * t, 0.0, 0.0, 10.0), True),  # 2.6 s ahead in the lane
        (lambda t: (50.0 + 10.0 * t, 0.0, 0.0, 10.0), False),  # 4.6 s ahead, never nearer
        (lambda t: (10.0 * t, 3.5, 0.0, 10.0), True),  # beside the ego
        (lambda t: (200.0 - 10.0 * t, -3.5, pi, 10.0), True),  # oncoming in the next lane
        (lambda t: (200.0 - 10.0 * t, -40.0, pi, 10.0), False),  # on another road
        (lambda t: (120.0, 4.0, 0.0, 0.0), True),  # parked beside the lane
    ],
)
def test_others_are_in_play_within_3_s_or_20_m(other, met):
    assert encounter(log_of(car, other), 0, 1).met is met
