"""The reference with hindsight: perfect eyes reach 100 / 100, noise lowers it, hindsight heals gaps."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.judging.reference import (
    NAME,
    OF_TRUTH,
    at_the_truths_limits,
    reference,
    smooth_states,
)
from skidpad.evidence.channels.judging.segments import TOLD, judge
from skidpad.evidence.channels.matching import tally
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive

TAILGATED = HazardType.EGO_TAILGATED
LOCALISATION = HazardType.INCONSISTENT_LOCALISATION
CLOSE = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-12.0, 0, 0, 15.0, 0), (60.0, 3.5, 0, 15, 0)]))


def judged(eyes):
    rows = list(cycles(drive(CLOSE, eyes, 8.0)))
    return judge("s", "town", [e.name for e in eyes], rows)


def counts(segment):
    row = tally(segment.detected[NAME], segment.truths["sim"], segment.hours)[TAILGATED]
    return row.tp, row.fp, row.fn


@pytest.mark.req("C-214")
def test_perfect_eyes_reach_it_all_and_blind_ones_nothing():
    assert counts(judged((Eyes("a"), Eyes("b")))) == (1, 0, 0)
    assert counts(judged((Eyes("a", 0.3, 0.1), Eyes("b", blind=(0, 1))))) == (1, 0, 0)
    assert counts(judged((Eyes("a", blind=(0,)), Eyes("b", blind=(0,))))) == (0, 0, 1)


@pytest.mark.req("C-121")
@pytest.mark.parametrize(("offset", "found"), [((0.0, 0.0), 0), ((0.6, 0.0), 0), ((1.5, 0.0), 1)])
def test_positions_that_jump_are_found_as_the_truth_finds_them(offset, found):
    eyes = (Eyes("a", ego_noise=0.08), Eyes("b", ego_noise=0.08, ego_offset={4.0: offset}))
    rows = list(cycles(drive(World(), eyes, 8.0)))
    spans = [
        s
        for s in at_the_truths_limits(reference(rows, ["a", "b"], 0.0))
        if s.hazard is LOCALISATION
    ]
    assert len(spans) == found
    assert all(s.t_start == pytest.approx(4.0, abs=0.15) for s in spans)


@pytest.mark.req("C-105", "C-214")
def test_the_reference_is_a_curve_that_meets_the_truth_at_its_own_limit():
    """By hand: at 15 m/s both and a dry road 7.5 m of gap leave between 0 and 10 m, so more is asked."""
    segment = judged((Eyes("a"), Eyes("b")))
    curves = {(c.identifier, c.hazard): c.points for c in segment.points if c.truth == "sim"}
    points = {p.limit: (p.tp, p.fp, p.fn) for p in curves[NAME, TAILGATED]}
    assert points[OF_TRUTH[TAILGATED]] == counts(segment) == (1, 0, 0)
    assert points[-20.0] == (0, 0, 1)  # no gap is 20 m too short
    found = [tp + fp for _, (tp, fp, _) in sorted(points.items())]
    assert found == sorted(found)  # a wider limit finds no less
    assert {h for name, h in curves if name == NAME} == set(OF_TRUTH)


@pytest.mark.parametrize(("mu", "nominal", "told"), [(0.9, 0, 0), (0.3, 0, 1)])
def test_only_who_is_told_of_ice_finds_what_ice_makes_too_close(mu, nominal, told):
    world = World(CLOSE.ego, np.array([(-14.0, 0, 0, 15.0, 0)]), mu)
    segment = judge(
        "s", "town", ["a", "b"], list(cycles(drive(world, (Eyes("a"), Eyes("b")), 8.0)))
    )
    assert len(segment.truths["sim"]) == told
    assert [len(segment.detected[n]) for n in ("tracked", TOLD, NAME)] == [nominal, told, told]


def test_no_truth_no_reference():
    rows = list(cycles(drive(CLOSE, (Eyes("a"), Eyes("b")), 3.0, with_truth=False)))
    assert not {NAME, TOLD} & set(judge("s", "town", ["a", "b"], rows).detected)
    assert at_the_truths_limits(reference(rows, ["a", "b"], 0.0)) == ()


def test_a_line_is_smoothed_to_itself_and_noise_shrinks():
    t = np.arange(60) * 0.1
    line = np.column_stack([3.0 + 2.0 * t, 1.0 - t, 0.3 + 0.0 * t, 2.0 + 0.0 * t, -1.0 + 0.0 * t])
    assert smooth_states(t, line) == pytest.approx(line)
    rng = np.random.default_rng(1)
    noisy = line.copy()
    noisy[:, :2] += rng.normal(0.0, 0.3, (60, 2))
    noisy[20:24] = np.nan  # four cycles without it
    out = smooth_states(t, noisy)
    assert np.isfinite(out[10:50]).all()
    assert np.abs(out[10:50, :2] - line[10:50, :2]).std() < 0.12
    lone = np.full((60, 5), np.nan)
    lone[30] = line[30]
    assert np.isnan(smooth_states(t, lone)).all()
