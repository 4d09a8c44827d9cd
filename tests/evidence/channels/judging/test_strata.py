"""Natural and risky drivers apart, weights, and precision against recall by limit."""

from __future__ import annotations

import json

import numpy as np
import pytest

from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.hazards import Signal, load_rules
from skidpad.evidence.channels.judging.curves import (
    LEADS,
    SURES,
    columns,
    constant,
    found_by,
    with_limit,
)
from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.reference import NAME as REFERENCE
from skidpad.evidence.channels.judging.segments import Weights, judge, weights_from
from skidpad.evidence.channels.judging.truth import marks
from skidpad.evidence.channels.matching import Span, Weighed, score, tally
from skidpad.evidence.channels.timefilter import TimeFilter
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import Eyes, World, drive

TAILGATED = HazardType.EGO_TAILGATED
EYES = (Eyes("a", 0.02), Eyes("b", 0.02, blind=(0,)))
FOLLOWED = World(
    (0, 0, 0, 15.0, 0), np.array([(-10.5, 0, 0, 15.7, 0), (60.0, 3.5, 0, 15.0, 0)])
)  # actor 0 follows closely


def judged(name: str, **context: str):
    source = drive(FOLLOWED, EYES, 8.0)
    return judge(name, "route-1", source.channels, list(cycles(source)), context=context)


@pytest.fixture(scope="module")
def table():
    weights = json.dumps({"0": [0.25, 2.0], "1": [2.0, 2.0]})
    segments = [judged("a"), judged("b", stratum="risky", weights=weights)]
    return Evaluation(segments).as_dict()


@pytest.mark.req("C-5")
def test_strata_are_told_apart_and_never_pooled(table):
    assert table["stratum"] == "natural"
    assert table["segments"] == 1
    assert {k: v["segments"] for k, v in table["strata"].items()} == {"natural": 1, "risky": 1}
    json.dumps(table, allow_nan=False)


@pytest.mark.req("C-5")
def test_a_true_hazard_counts_as_the_driver_whom_it_is_about(table):
    (row,) = [
        r["hazards"][TAILGATED.value]
        for r in table["strata"]["risky"]["results"]
        if (r["rules"], r["truth"], r["tolerance_s"]) == ("practical", "sim", 1.0)
    ]
    assert row["tp"] + row["fn"] == 1
    assert row["effective_size"] == 1.0
    points = table["strata"]["risky"]["precision_recall"]["sim"]["tracked"][TAILGATED.value]
    assert {p[5] for p in points} == {0.25}  # its follower's, from the tail of headways


def test_weighted_recall_and_effective_size_by_hand():
    true = [Span(TAILGATED, t, t + 1.0, weight=w) for t, w in ((0, 1.0), (20, 3.0), (40, 1.0))]
    row = tally([Span(TAILGATED, 20.5, 20.6)], true, 1.0)[TAILGATED]
    assert row.weighed == Weighed(3.0, 5.0, 11.0)
    assert row.weighed.recall == pytest.approx(0.6)
    assert row.weighed.size == pytest.approx(25.0 / 11.0)
    both = row + row
    assert both.weighed.size == pytest.approx(50.0 / 11.0)
    three = [row, row, tally([], true, 1.0)[TAILGATED]]
    assert score(three).weighed is None  # too few drives for limits
    interval = score(three * 4).weighed
    assert interval.low <= 0.4 <= interval.high
    assert score([tally(true, true, 1.0)[TAILGATED]] * 6).weighed.high == 1.0


def test_words_that_are_no_weights_are_one_sentence():
    for text in ("[]", "nonsense", '{"3": 1}', '{"3": ["a", 1]}'):
        with pytest.raises(FileError, match="two numbers per actor"):
            weights_from({"weights": text})
    for text in ("often", "nan", "inf", "-1", "0", "1.5", "1e999", "..."):
        with pytest.raises(FileError, match="weight_of_jumps` must be a number in"):
            weights_from({"weight_of_jumps": text})


def test_a_jump_counts_as_the_recording_says():
    kind = HazardType.INCONSISTENT_LOCALISATION
    jump, drift = (marks.TrueHazard(kind, 1, 2, marks.World.SIM, kind=k) for k in ("jump", "drift"))
    weights = weights_from({"weight_of_jumps": "0.05"})
    assert (weights.weigh(jump).weight, weights.weigh(drift).weight) == (0.05, 1.0)
    assert Weights().weigh(jump).weight == 1.0


@pytest.mark.req("C-105")
def test_a_rule_over_whole_drives_finds_what_it_finds_cycle_by_cycle():
    """By a second route: clause by clause and cycle by cycle, through the time filter."""
    rng = np.random.default_rng(5)
    t = np.arange(600) * 0.1
    values = {s: rng.normal(0.5, 0.6, t.size) for s in Signal}
    for row in values.values():
        row[rng.random(t.size) < 0.1] = np.nan
    rows = [{s: float(v[k]) for s, v in values.items()} for k in range(t.size)]
    for profile in Profile:
        for rule in load_rules(profile):
            events: TimeFilter[HazardType] = TimeFilter()
            for at, row in zip(t, rows, strict=True):
                if rule.fires(row):
                    events.add(rule.hazard, at, 0.0, least=True)
            expected = [(e.t_start, e.t_end) for e in events.finish() if e.t_end >= 2.0]
            found = found_by(rule, t, columns(rows), 2.0)
            assert [(s.t_start, s.t_end) for s in found] == expected


@pytest.mark.req("C-105")
def test_a_stricter_limit_never_finds_in_more_cycles():
    rng = np.random.default_rng(6)
    rows = [{s: float(rng.normal(0.5, 0.6)) for s in Signal} for _ in range(400)]
    (rule,) = [r for r in load_rules(Profile.PRACTICAL) if r.hazard is TAILGATED]
    signal, limits = LEADS[Profile.PRACTICAL][TAILGATED]
    varied = [with_limit(rule, signal, constant(limit)) for limit in limits]
    cycles_found = [sum(v.fires(row) is True for row in rows) for v in varied]
    assert cycles_found == sorted(cycles_found, reverse=True)
    assert cycles_found[0] > cycles_found[-1]


@pytest.mark.req("C-105")
def test_every_identifier_has_a_curve_with_the_counts_that_results_have():
    s = judged("a")
    base = {h: tally(s.detected["tracked"], s.truths["sim"], s.hours)[h] for h in (TAILGATED,)}[
        TAILGATED
    ]
    (curve,) = [c.points for c in s.points if c[:3] == ("tracked", "sim", TAILGATED)]
    points = {p.limit: p for p in curve}
    assert tuple(points) == SURES
    assert (points[2.0].tp, points[2.0].fp, points[2.0].fn) == (base.tp, base.fp, base.fn)
    assert {c.identifier for c in s.points} == {"practical", "tracked", REFERENCE}
    assert {c.truth for c in s.points} == {"sim", "world"}
