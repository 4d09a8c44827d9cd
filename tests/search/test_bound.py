"""The bound by braking and steering, where the answer is known by hand: stopping ways and arcs."""

from math import acos, sin

import numpy as np
import pytest

from skidpad.core.maths.constants import G
from skidpad.search.bound import (
    Motion,
    Path,
    Start,
    Track,
    boxes_overlap,
    continue_track,
    find_avoidance,
    first_known_row,
    is_in_sight,
    predict_motion,
)

DT, ROWS = 0.05, 200
LONG, WIDE = 4.7, 1.8


def straight(length=400.0):
    ends = np.array([0.0, length])
    return Path(ends, ends, np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2))


def still(x, y=0.0, length=LONG, width=WIDE, yaw=0.0, rows=ROWS):
    return moving(x, y, 0.0, length, width, yaw, rows)


def moving(x, y, v, length=LONG, width=WIDE, yaw=0.0, rows=ROWS):
    t = np.arange(rows) * DT
    places = x + v * t * np.cos(yaw), y + v * t * np.sin(yaw), np.full(rows, yaw)
    return Track(*places, np.ones(rows, dtype=bool), length, width)


def road(right=-1.75, left=1.75):
    def beyond(x, y, z):
        return np.maximum(np.maximum(y - left, right - y), 0.0)

    return beyond


def avoid(start, others, mu=0.8, reaction=0.9, beyond=None, path=None, rows=ROWS):
    found = road() if beyond is None else beyond
    return find_avoidance(start, path or straight(), others, found, mu, DT, rows, reaction)


@pytest.mark.parametrize("mu", [0.1, 0.4, 0.8])
@pytest.mark.parametrize("v", [10.0, 20.0])
@pytest.mark.parametrize("reaction", [0.0, 0.9])
def test_braking_is_enough_from_the_stopping_way_on(v, mu, reaction):
    way = v * reaction + v**2 / (2.0 * mu * G)
    rows = round((reaction + v / (mu * G) + 1.0) / DT)
    for spare, answer in ((0.2, "braking"), (-0.2, "")):
        barrier = still(way + LONG + spare, width=3.5, rows=rows)
        assert avoid(Start(v), [barrier], mu, reaction, rows=rows) == answer


def test_steering_aside_is_enough_from_two_arcs_on():
    """2 m aside of a box as wide as the ego: two arcs of v^2 / (mu g), each half of the way."""
    v, mu, reaction = 20.0, 0.8, 0.9
    radius = v**2 / (mu * G)
    way = 2.0 * radius * sin(acos(1.0 - 2.0 / (2.0 * radius)))
    assert way == pytest.approx(20.0, abs=0.3)
    assert way < v**2 / (2.0 * mu * G) - 5.0, "so that braking alone is too late"
    near, far = (still(v * reaction + LONG + gap) for gap in (0.5 * way, way + 0.5))
    assert avoid(Start(v), [far], beyond=road(left=5.25)) == "steering left"
    assert avoid(Start(v), [far], beyond=road(right=-5.25)) == "steering right"
    assert avoid(Start(v), [far], beyond=road(left=2.5)) == "", "no room on the road"
    assert avoid(Start(v), [near], beyond=road(left=5.25)) == ""
    beside = moving(0.0, 3.5, v)
    assert avoid(Start(v), [far, beside], beyond=road(left=5.25)) == "", "the lane is taken"


def test_a_leader_at_equal_speed_that_brakes_as_hard_leaves_the_reaction_as_gap():
    v, a = 20.0, 0.8 * G
    t = np.minimum(np.arange(ROWS) * DT, v / a)
    for gap, answer in ((v * 0.9 + 0.3, "braking"), (v * 0.9 - 0.3, "")):
        leader = still(0.0, width=3.5)._replace(x=gap + LONG + v * t - 0.5 * a * t**2)
        assert avoid(Start(v), [leader]) == answer


def test_others_do_not_react_so_that_a_close_follower_forbids_braking():
    barrier, follower = still(60.0, width=3.5), moving(-LONG - 4.0, 0.0, 20.0, width=3.5)
    assert avoid(Start(20.0), [barrier]) == "braking"
    assert avoid(Start(20.0), [barrier, follower]) == ""


def test_a_bend_takes_grip_from_braking_and_too_fast_a_bend_ends_beside_the_road():
    """40 m radius, mu 0.4: 12.5 m/s at most; from 20 m/s the ego stops on a straight of 80 m only."""
    radius, mu = 40.0, 0.4
    for run_in, answer in ((90.0, "braking"), (10.0, "")):
        s = np.arange(0.0, 300.0, 0.5)
        turned = np.maximum(s - run_in, 0.0) / radius
        x = np.minimum(s, run_in) + radius * np.sin(turned)
        y = radius * (1.0 - np.cos(turned))
        bend = Path(s, x, y, 0.0 * s, turned, np.where(s > run_in, 1.0 / radius, 0.0))

        def beyond(px, py, pz, bend=bend):
            away = np.hypot(px[:, None] - bend.x, py[:, None] - bend.y).min(axis=1)
            return np.maximum(away - 2.0, 0.0)

        assert avoid(Start(20.0), [], mu, beyond=beyond, path=bend) == answer


def test_boxes_overlap_by_their_edges():
    a = still(0.0, length=4.0, width=2.0, rows=1)
    for x, y, yaw, touches in (
        (3.9, 0.0, 0.0, True), (4.1, 0.0, 0.0, False), (0.0, 2.1, 0.0, False),
        (2.9, 0.0, np.pi / 2, True), (3.1, 0.0, np.pi / 2, False),
        (3.9, 2.9, np.pi / 4, False),  # corners near each other, edges apart
    ):  # fmt: skip
        assert boxes_overlap(a, still(x, y, 4.0, 2.0, yaw, rows=1))[0] == touches


def test_constant_motion_is_an_arc():
    ego, rows = still(0.0, rows=1), np.array([0])
    found = predict_motion(ego, Motion(np.array([10.0]), np.array([0.5])), rows)
    assert np.hypot(found.x[0], found.y[0] - 20.0) == pytest.approx(20.0, abs=1e-9)
    assert found.yaw[0, -1] == pytest.approx(3.0)
    ahead = predict_motion(ego, Motion(np.array([10.0]), np.array([0.0])), rows)
    assert (ahead.x[0, -1], ahead.y[0, -1]) == pytest.approx((60.0, 0.0))


def test_a_danger_is_known_from_the_first_row_after_which_it_is_always_foreseen():
    assert first_known_row(np.array([1, 1, 0, 1, 1], dtype=bool)) == 3
    assert first_known_row(np.array([1, 1], dtype=bool)) == 0
    assert first_known_row(np.array([1, 0], dtype=bool)) == 1, "the last row at least"


def test_a_van_hides_a_person_and_not_a_lorry():
    ego, van = still(0.0), still(10.0, 0.0, 6.0, 2.0)
    person, lorry = still(20.0, 0.0, 0.5, 0.5), still(20.0, 0.0, 2.5, 12.0)
    assert is_in_sight(ego, person, [], 0)
    assert not is_in_sight(ego, person, [van], 0)
    assert is_in_sight(ego, lorry, [van], 0)
    gone = van._replace(present=np.zeros(ROWS, dtype=bool))
    assert is_in_sight(ego, person, [gone], 0)
    assert not is_in_sight(ego, gone, [], 0)


def test_what_was_touched_goes_on_until_it_stands():
    """10 m/s, and 11 m/s half a second before: 2 m/s^2, so 25 m more."""
    track = still(0.0, rows=11, yaw=0.1)
    speed = np.linspace(11.0, 10.0, 11)
    one, other = continue_track(track, speed, 10, 200, DT, 0.0)
    assert np.hypot(one.x[-1], one.y[-1]) == pytest.approx(25.0)
    assert one.y[-1] == pytest.approx(25.0 * sin(0.1))
    assert (other.x[-1], other.y[-1]) == pytest.approx((25.0, 0.0))
    assert len(one.x) == 211
