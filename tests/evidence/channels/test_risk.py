"""Risk of plans in worlds, against shapely footprints moved in small steps (C-091 to C-095)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity

from skidpad.evidence.channels.risk import (
    HORIZON,
    MISS_MOST,
    PET_SAFE,
    RiskForm,
    braking_needed,
    close_risk,
    ordered_risk,
    risk_matrix,
    safety_scores,
)
from support.channel_worlds import CAR, frame
from support.examples import examples

EGO = (0.0, 0.0, 0.0, 10.0, 0.0)


PRINTED = RiskForm.AS_PRINTED


class Times(NamedTuple):
    """To the one object of the world, s; None: there is none."""

    ttc: float | None
    pet: float | None


def single(ego, obj, form=RiskForm.RECOMMENDED, **more):
    f = frame(0.0, ego, [obj], **more)
    matrix = risk_matrix([f, f], form)
    times = (float(matrix.ttc[0, 1]), float(matrix.pet[0, 1]))
    return matrix, Times(*(None if t == np.inf else t for t in times))


def hit(ttc):
    """Risk of a hit by hand: from 0.1 at 4 s to 1 now."""
    return 0.1 + 0.9 * (1 - ttc / 4.0)


def box_at(state, t):
    x, y, heading, vx, vy = state
    shape = shapely.Polygon(CAR)
    direction = np.arctan2(vy, vx) if np.hypot(vx, vy) > 0.5 else heading
    moved = affinity.rotate(shape, direction, origin=(0, 0), use_radians=True)
    return affinity.translate(moved, x + vx * t, y + vy * t)


@pytest.mark.req("C-092", "C-094")
def test_closing_on_a_standing_car_by_hand():
    standing = (24.5, 0, 0, 0, 0)  # 20 m between the bumpers at 10 m/s
    matrix, one = single(EGO, standing)
    assert one.ttc == pytest.approx(2.0, abs=1e-9)
    assert one.pet is None  # never together with a time to collision
    assert matrix.safety_scores == pytest.approx([1 - hit(2.0)] * 2)
    assert single(EGO, standing, PRINTED)[0].safety_scores == pytest.approx([0.5, 0.5])
    assert matrix.risk_behind[0, 1] == 0.0


@pytest.mark.req("C-092", "C-094")
def test_following_at_equal_speed_has_its_time_gap_as_encroachment_time():
    lead = (14.5, 0, 0, 10.0, 0)  # 10 m gap: 1.0 s
    matrix, one = single(EGO, lead)
    assert one.ttc is None
    assert one.pet == pytest.approx(1.0, abs=1e-9)
    # nearest: the ego comes in 1.0 s to where the lead is now
    assert matrix.safety_scores[0] == pytest.approx(1 - 0.1 * (1 - 1 / 2) * (1 - 1 / 4))
    assert single(EGO, lead, PRINTED)[0].safety_scores[0] == pytest.approx(0.5)


@pytest.mark.req("C-092", "C-095")
def test_two_metres_behind_a_lead_at_90_km_h_are_not_safe():
    v = 25.0
    ego = (0.0, 0.0, 0.0, v, 0.0)
    matrix, one = single(ego, (6.5, 0, 0, v, 0))  # cars of 4.5 m: 2 m between the bumpers
    assert one.ttc is None
    assert matrix.safety_scores == pytest.approx([0.5, 0.5])
    # by hand: 2 m and the lead's 52.1 m of braking less 25 m of response leave 29.1 m
    assert braking_needed(2.0, v, v, v) == pytest.approx(v**2 / (2 * (2 + v**2 / 12 - v)))
    assert braking_needed(2.0, v, v, v) > 10.0
    assert single(ego, (6.5, 0, 0, v, 0), PRINTED)[0].safety_scores[0] == pytest.approx(0.04)
    behind, _ = single(ego, (-6.5, 0, 0, v, 0))
    assert behind.risk_behind[0, 1] == pytest.approx(0.5)
    assert behind.risk_ahead[0, 1] == 0.0


@pytest.mark.req("C-092")
def test_following_is_a_risk_below_a_second_of_gap_and_only_in_the_same_lane():
    v = 20.0
    ego = (0.0, 0.0, 0.0, v, 0.0)
    needed = v**2 / (2 * (15.0 + v**2 / 12 - v))  # at 15 m, 7.06 m/s^2
    for gap, risk in ((20.0, 0.0), (15.0, 0.5 * (needed - 6.0) / 2.0), (10.0, 0.5)):
        assert close_risk(gap, v, v, v) == pytest.approx(risk)
        matrix, _ = single(ego, (gap + 4.5, 0, 0, v, 0))
        assert (
            matrix.risk_ahead[0, 1] == pytest.approx(risk)
            if risk
            else matrix.risk_ahead[0, 1] < 0.1
        )
        beside, _ = single(ego, (gap + 4.5, 3.5, 0, v, 0))
        assert beside.safety_scores == pytest.approx([1.0, 1.0])
    oncoming, _ = single(ego, (14.5, 0, np.pi, -1.0, 0))
    assert oncoming.risk_ahead[0, 1] > 0.5, "a hit, and no following"
    gaps = [close_risk(g, v, v, v) for g in np.linspace(0.0, 30.0, 61)]
    assert gaps == sorted(gaps, reverse=True)
    assert max(gaps) == 0.5


@pytest.mark.req("C-091", "C-123")
def test_a_follower_is_judged_behind_and_apart_from_what_is_ahead():
    follower, lead = (-10.0, 0, 0, 14.0, 0), (39.0, 0, 0, 10.0, 0)
    f = frame(0.0, EGO, [follower, lead])
    matrix = risk_matrix([f, f])
    assert matrix.worst_behind[0, 1] == 0
    assert matrix.risk_behind[0, 1] == pytest.approx(hit(5.5 / 4.0))
    assert matrix.risk_ahead[0, 1] == 0.0
    assert matrix.behind_share == pytest.approx([1.0, 1.0])


@pytest.mark.req("C-122", "C-123")
def test_collisions_ahead_and_behind_are_told_apart_and_closeness_is_none():
    matrix, _ = single(EGO, (24.5, 0, 0, 0, 0))
    assert matrix.ttc_ahead[0, 0] == pytest.approx(2.0, abs=2e-3)
    assert np.isinf(matrix.ttc_behind).all()
    matrix, _ = single(EGO, (-10.0, 0, 0, 14.0, 0))
    assert matrix.ttc_behind[0, 0] == pytest.approx(5.5 / 4.0, abs=2e-3)
    assert np.isinf(matrix.ttc_ahead).all()
    matrix, one = single(EGO, (14.5, 0, 0, 10.0, 0))
    assert one.pet is not None
    assert np.isinf(matrix.ttc_ahead).all()


@pytest.mark.req("C-091")
def test_other_lanes_and_the_oncoming_lane_are_no_risk():
    beside = [(0.0, 3.5, 0, 12.0, 0), (15.0, -3.5, 0, 5.0, 0), (60.0, 3.5, np.pi, -15.0, 0)]
    f = frame(0.0, EGO, beside)
    assert risk_matrix([f, f]).safety_scores == pytest.approx([1.0, 1.0])


@pytest.mark.req("C-091")
def test_one_channel_that_misses_the_lead_still_meets_it_in_the_others_world():
    sees, blind = frame(0.0, EGO, [(20.0, 0, 0, 0, 0)]), frame(0.0, EGO)
    braking = np.column_stack([np.full(16, 0.0), np.zeros(16), np.arange(16) * 0.2])
    sees = sees._replace(plan=braking)
    matrix = risk_matrix([sees, blind])
    assert matrix.risk[0].tolist() == [0.0, 0.0]
    assert matrix.risk[1, 1] == 0.0
    assert matrix.risk[1, 0] > 0.5
    assert matrix.safety_scores[1] < 0.5


def test_an_absent_channel_or_one_without_a_plan_is_not_evaluated():
    f = frame(0.0, EGO, [(30.0, 0, 0, 0, 0)])
    matrix = risk_matrix([f, None, f._replace(plan=np.zeros((0, 3)))])
    assert np.isnan(matrix.risk[:, 1]).all()
    assert np.isfinite(matrix.safety_scores).tolist() == [True, False, False]
    assert np.isfinite(matrix.risk[0, 2])  # its world still judges the others
    assert np.isnan(risk_matrix([None, None]).safety_scores).all()


@pytest.mark.req("C-095")
def test_a_collision_only_at_the_end_of_the_plan_leaves_a_high_score():
    matrix, one = single(EGO, (4.5 + 38.0, 0, 0, 0, 0))
    assert one.ttc == pytest.approx(3.8, abs=1e-9)
    assert 0.8 < matrix.safety_scores[0] < 0.9  # and that of any miss is higher


states = st.tuples(
    st.floats(-40, 40),
    st.floats(-20, 20),
    st.floats(-np.pi, np.pi),
    st.floats(1, 15),
    st.booleans(),
)


@pytest.mark.req("C-092", "C-095")
@given(states)
@settings(max_examples=examples(60))
def test_times_agree_with_shapely_footprints_in_small_steps(state):
    x, y, heading, v, stands = state
    v = 0.0 if stands else v
    other = (x, y, heading, v * np.cos(heading), v * np.sin(heading))
    _, one = single(EGO, other, plan_length=4.0, prediction_length=4.0)
    fine = 0.02
    times = np.arange(round(HORIZON / fine) + 1) * fine
    ego = [box_at(EGO, t) for t in times]
    obj = [box_at(other, t) for t in times]
    met = [t for t, a, b in zip(times, ego, obj, strict=True) if a.intersects(b)]
    if met:
        assert one.pet is None
        assert met[0] - fine - 1e-9 <= one.ttc <= met[0] + 1e-9
        return
    if one.ttc is not None:  # a touch that passes between two of the small steps
        assert box_at(EGO, one.ttc).distance(box_at(other, one.ttc)) < 1e-6
        return
    tree = shapely.STRtree(obj)
    pairs = tree.query(ego, predicate="intersects")
    shift = np.abs(times[pairs[0]] - times[pairs[1]]).min(initial=np.inf)
    if one.pet is None:
        assert shift > PET_SAFE - 2 * fine
    else:
        assert shift - 2 * fine <= one.pet <= shift + 1e-9


conflicts = st.tuples(
    st.booleans(), st.floats(0, HORIZON), st.floats(0, PET_SAFE)
)  # a hit or a miss, when, and by how much it misses


def risk_of(conflict):
    is_hit, t, apart = conflict
    if is_hit:
        return ordered_risk(t, 0.0)
    return ordered_risk(np.inf, (1 - apart / PET_SAFE) * (1 - t / HORIZON))


@pytest.mark.req("C-094", "C-095")
@given(conflicts, conflicts)
@settings(max_examples=examples(300), derandomize=True)
def test_risk_is_ordered_as_danger_is(one, two):
    surer = one[0] >= two[0]
    sooner = one[1] <= two[1]
    deeper = one[0] or one[2] <= two[2]
    if surer and sooner and deeper:
        assert risk_of(one) >= risk_of(two)
    if one[0] and not two[0]:
        assert risk_of(one) >= MISS_MOST >= risk_of(two)
    assert 0.0 <= risk_of(one) <= 1.0


@pytest.mark.req("C-094")
@given(
    x=st.floats(10, 35), v=st.floats(4, 15), slack=st.floats(-1.5, 1.5), angle=st.floats(0.6, 2.5)
)
@settings(max_examples=examples(40), derandomize=True)
def test_a_crossing_car_that_comes_nearer_in_time_never_lowers_the_risk(x, v, slack, angle):
    """It crosses the ego's path x m ahead, `slack` s from where both would be there at once."""
    c, s = v * np.cos(angle), v * np.sin(angle)

    def risk(slack, elapsed):
        t = x / 10.0 + slack - elapsed
        matrix, one = single(
            (10.0 * elapsed, 0, 0, 10.0, 0), (x - c * t, -s * t, angle, c, s),
            plan_length=4.0, prediction_length=4.0,
        )  # fmt: skip
        return matrix.risk[0, 1], one

    before, one = risk(slack, 0.0)
    for elapsed in (0.2, 0.5, 0.8):  # the same scene later: sooner
        now, later = risk(slack, elapsed)
        if one.ttc is not None and elapsed > one.ttc:
            break  # it has come to pass
        if later.ttc is None and later.pet is None:
            break  # the nearest place lies behind both
        if one.ttc is None and later.ttc is None and later.pet > one.pet + 1e-6:
            break
        assert now >= before - 1e-9
        before = now


@pytest.mark.req("C-092")
def test_a_touch_between_two_samples_is_a_hit_and_a_hair_later_a_miss():
    """The ego leaves the crossing lane after 3.315 s; the other car's front comes to its side."""
    matrix, one = single(EGO, (30.0, -36.17, np.pi / 2, 0.0, 10.0))
    assert one.ttc == pytest.approx(3.302, abs=1e-9)  # and until 3.315 s: no sample is in between
    later_matrix, later = single(EGO, (30.0, -36.31, np.pi / 2, 0.0, 10.0))
    assert later.ttc is None
    assert later.pet == pytest.approx(0.001, abs=1e-9)
    assert later_matrix.risk[0, 1] < matrix.risk[0, 1]


@given(st.floats(-np.pi, np.pi), st.floats(-1e4, 1e4), states)
@settings(max_examples=examples(30))
def test_scores_are_bounded_and_do_not_see_the_map(angle, shift, state):
    x, y, heading, v, _ = state
    c, s = np.cos(angle), np.sin(angle)

    def placed(row):
        px, py, h, vx, vy = row
        return (
            c * px - s * py + shift, s * px + c * py - shift, h + angle,
            c * vx - s * vy, s * vx + c * vy,
        )  # fmt: skip

    other = (x, y, heading, v * np.cos(heading), v * np.sin(heading))
    one = risk_matrix([frame(0.0, EGO, [other])]).safety_scores
    two = risk_matrix([frame(0.0, placed(EGO), [placed(other)])]).safety_scores
    assert 0.0 <= one[0] <= 1.0
    assert one == pytest.approx(two, abs=2e-3)


@pytest.mark.req("C-023", "C-091")
def test_scores_of_n_channels_do_not_depend_on_their_order():
    rng = np.random.default_rng(4)
    frames = [frame(0.0, EGO, rng.normal(0, 12, (6, 5))) for _ in range(4)]
    scores = safety_scores(frames)
    order = [2, 0, 3, 1]
    assert safety_scores([frames[i] for i in order]) == pytest.approx(scores[order])


def test_degenerate_shapes_and_numbers_that_are_none_are_survived():
    f = frame(0.0, EGO, [(20.0, 0, 0, 0, 0), (np.nan, 0, 0, 0, 0), (30.0, 0, 0, 0, 0)])
    shapes = f.polygons.copy()
    shapes[0] = 0.0
    shapes[2] = np.nan
    f = f._replace(polygons=shapes)
    assert safety_scores([f, f]) == pytest.approx([1 - hit((20 - 2.25) / 10)] * 2)
    late = np.array([[0, 0, 0.0], [2, 0, 0.2], [9, 9, 0.1], [4, 0, 0.4]], dtype=float)
    assert np.isfinite(safety_scores([f._replace(plan=late)])).all()
