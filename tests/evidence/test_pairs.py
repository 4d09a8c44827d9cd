"""Numbers of pairs against what happens when the motion is simply carried on."""

from __future__ import annotations

from math import cos, pi, sin
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import floats

from skidpad.core.errors import ConfigError
from skidpad.evidence.bodies import Body
from skidpad.evidence.expectations import parse_expectation
from skidpad.evidence.pairs import (
    Pair,
    following,
    pair_of,
    post_encroachment,
    required_deceleration,
    together,
)
from support.examples import examples

L, W = 4.0, 1.8
STEP = 1e-3


def a_body(x, y, yaw, v, a=0.0):
    x, y, yaw, v, a = np.broadcast_arrays(*(np.asarray(q, float) for q in (x, y, yaw, v, a)))
    x, y, yaw, v, a = (np.atleast_1d(q) for q in (x, y, yaw, v, a))
    return Body(x, y, yaw, v * np.cos(yaw), v * np.sin(yaw), a, np.zeros_like(a), L, W)


def until_contact(gap, v_behind, a_behind, v_lead, a_lead):
    """s until the gap is used up, by steps; None: never, and both stay apart."""
    t = 0.0
    while t < 60.0:
        if gap <= 0.0:
            return t
        gap += (v_lead - v_behind) * STEP
        v_behind, v_lead = max(v_behind + a_behind * STEP, 0.0), max(v_lead + a_lead * STEP, 0.0)
        if v_behind <= v_lead and a_behind <= a_lead:
            return None
        t += STEP
    return None


def test_a_gap_is_from_bumper_to_bumper_in_any_direction():
    for h in (0.0, 1.0, -2.5):
        ego = a_body(3.0, -1.0, h, 20.0)
        lead = a_body(
            3.0 + 30.0 * cos(h) - 0.5 * sin(h), -1.0 + 30.0 * sin(h) + 0.5 * cos(h), h, 15
        )
        f = following(ego, lead)
        assert f.gap[0] == pytest.approx(26.0)
        assert f.v_closing[0] == pytest.approx(5.0)
        assert np.isnan(following(lead, ego).gap[0])
        beside = a_body(3.0 - 2.0 * sin(h), -1.0 + 2.0 * cos(h), h, 15.0)
        assert np.isnan(following(ego, beside).gap[0])
    across = following(a_body(0.0, 0.0, 0.0, 10.0), a_body(20.0, 0.0, pi / 2, 3.0))
    assert across.gap[0] == pytest.approx(20.0 - L / 2 - W / 2)


@settings(max_examples=examples(25), derandomize=True)
@given(gap=floats(2.0, 40.0), v=floats(5.0, 30.0), dv=floats(3.0, 15.0))
def test_ttc_and_drac_are_what_carrying_on_gives(gap, v, dv):
    pair = only_pair(a_body([0.0] * 2, 0.0, 0.0, v + dv), a_body([gap + L] * 2, 0.0, 0.0, v))
    assert until_contact(gap, v + dv, 0.0, v, 0.0) == pytest.approx(pair.min_ttc_s, abs=2e-3)
    assert until_contact(gap, v + dv, -1.01 * pair.max_drac_mps2, v, 0.0) is None
    assert until_contact(gap, v + dv, -0.98 * pair.max_drac_mps2, v, 0.0) is not None


@settings(max_examples=examples(25), derandomize=True)
@given(h=floats(-3.0, 3.0), gap=floats(2.0, 40.0), v=floats(5.0, 30.0), a=floats(0.0, 3.0))
def test_headway_is_when_the_follower_passes_where_the_lead_is(h, gap, v, a):
    """Read off the follower's own way, for a lead that draws away, so that the first tick is least."""
    t = np.arange(0.0, 10.0, 0.05)
    way = v * t
    lead = gap + L + (v + 1.0) * t + 0.5 * a * t**2
    one = a_body(way * cos(h), way * sin(h), h, np.full_like(t, v))
    other = a_body(lead * cos(h), lead * sin(h), h, v + 1.0 + a * t, a)
    passes = np.interp(lead[0] - L / 2, way + L / 2, t)
    assert only_pair(one, other).min_thw_s == pytest.approx(passes, abs=1e-6)
    assert only_pair(other, one).min_thw_s == pytest.approx(passes, abs=1e-6)


@pytest.mark.parametrize(("v", "some"), [(0.9, False), (1.1, True)])
def test_one_who_creeps_has_no_headway(v, some):
    pair = only_pair(a_body([0.0] * 2, 0.0, 0.0, v), a_body([20.0] * 2, 0.0, 0.0, v))
    assert (pair.min_thw_s is not None) == some


@settings(max_examples=examples(25), derandomize=True)
@given(gap=floats(10.0, 60.0), v=floats(25.0, 35.0), dv=floats(1.0, 8.0), a=floats(0.2, 2.0))
def test_the_required_deceleration_is_enough_behind_one_that_brakes(gap, v, dv, a):
    needed = float(required_deceleration(np.array(gap), np.array(dv), np.array(-a)))
    if v / a < dv / (needed - a):  # it would stand before, which the formula leaves out
        return
    assert until_contact(gap, v + dv, -1.02 * needed, v, -a) is None
    assert until_contact(gap, v + dv, -0.97 * needed, v, -a) is not None


def only_pair(ego, other):
    return pair_of(("ego", "other"), ego, other, np.ones(len(ego.x), bool), 0.05)


@pytest.mark.parametrize("late", [0.3, 1.1, 1.9, 2.5])
def test_crossing_paths_are_as_far_apart_in_time_as_they_cross(late):
    """One leaves the crossing rectangle, the other comes: by the closed form."""
    t = np.arange(0.0, 10.0, 0.05)
    v = 8.0
    first = a_body(-30.0 + v * t, 0.0, 0.0, np.full_like(t, v))
    leaves = (30.0 + W / 2 + L / 2) / v
    comes = leaves + late
    second = a_body(0.0, -W / 2 - L / 2 - v * comes + v * t, pi / 2, np.full_like(t, v))
    found = post_encroachment(first, second, np.ones(len(t), bool), 0.05)
    if late > 2.0:
        assert found is None
    else:
        assert found == pytest.approx(late, abs=0.02)


@pytest.mark.parametrize(
    ("ahead", "up", "apart"),
    [
        (10.0, 1.2, False),
        (100.0, 12.0, False),
        (4.0, 1.4, False),
        (4.0, 6.0, True),
        (0.0, -1.6, True),
    ],
)
def test_a_hill_is_no_bridge(ahead, up, apart):
    """12 % of climb, as roads have; 6 m up at a crossing; cars 1.5 m high."""
    columns = (np.array([[0.0, v]]) for v in (ahead, 0.0, up))
    actors = SimpleNamespace(**dict(zip("xyz", columns, strict=True)))
    table = SimpleNamespace(height=np.array([1.5, 1.5]))
    log = SimpleNamespace(actors=actors, table=table, present=np.ones((1, 2), bool))
    assert together(log, 0, 1).tolist() == together(log, 1, 0).tolist() == [not apart]


def test_what_never_applied_is_nothing_and_expected_of_no_run():
    pair = only_pair(a_body([0.0] * 2, 0.0, 0.0, 10.0), a_body([0.0] * 2, 50.0, 0.0, 10.0))
    assert pair == Pair("ego", "other", None, None, None, None, None, None)


@pytest.mark.parametrize("text", ["__import__('os')", "min_ttc_s", "ttc > 1", "min_ttc_s > 1.5.2"])
def test_only_comparisons_of_known_numbers_are_read(text):
    with pytest.raises(ConfigError):
        parse_expectation(text)


def test_a_run_without_conflicts_fulfils_every_limit():
    values = {"collisions": 0.0, "min_ttc_s": np.inf, "max_drac_mps2": 0.0}
    assert parse_expectation("min_ttc_s > 1.5").explain_failure(values) == ""
    assert parse_expectation("no-collision").explain_failure(values) == ""
    assert parse_expectation("max_drac_mps2 < 3").explain_failure({"max_drac_mps2": 4.0})
