"""Truths by closed forms and scenes whose outcome is plain; matching against brute force."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.core.channels import Cycle
from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.judging.evaluation import Evaluation, read_labels
from skidpad.evidence.channels.judging.segments import judge
from skidpad.evidence.channels.judging.truth import simulator
from skidpad.evidence.channels.judging.truth.simulator import (
    G,
    footprint,
    least_gap,
    simulator_truth,
)
from skidpad.evidence.channels.judging.truth.worldmodel import world_model_truth
from skidpad.evidence.channels.matching import (
    Span,
    Tally,
    macro,
    match,
    merge_spans,
    micro,
    percent,
    score,
    tally,
)
from skidpad.recording.channels.cycles import cycles
from support.channel_worlds import CAR, Eyes, World, drive, frame, truth
from support.examples import examples

TAILGATED, TAILGATING = HazardType.EGO_TAILGATED, HazardType.EGO_TAILGATING
LOCALISATION = HazardType.INCONSISTENT_LOCALISATION


@given(v=st.floats(3.0, 40.0), gap=st.floats(0.5, 100.0), mu=st.floats(0.2, 1.0))
@settings(max_examples=examples(80))
def test_equal_speeds_hit_as_their_stopping_distances_say(v, gap, mu):
    a_lead, a_follow = min(6.0, mu * G), mu * G
    distance = v * 1.0 + v * v / (2 * a_follow) - v * v / (2 * a_lead)
    if a_follow > a_lead + 1e-6 and v / a_follow + 1.0 < v / a_lead:
        return  # the follower may stop first: the nearest moment is then not the end
    if abs(distance - gap) > 0.05:
        assert (least_gap(gap, v, mu, v, mu) <= 0.0) == (distance > gap)


@given(st.floats(0, 60), st.floats(0, 40), st.floats(0, 40), st.floats(0.1, 1.0))
@settings(max_examples=examples(60))
def test_a_hit_stays_a_hit_when_nearer_faster_or_slicker(gap, v_lead, v_follow, mu):
    if least_gap(gap, v_lead, 0.9, v_follow, mu) <= 0.0:
        assert least_gap(gap * 0.9, v_lead, 0.9, v_follow, mu) <= 0.0
        assert least_gap(gap, v_lead, 0.9, v_follow * 1.1, mu) <= 0.0
        assert least_gap(gap, v_lead, 0.9, v_follow, mu * 0.9) <= 0.0


def scene(objects, ego=(0.0, 0.0, 0.0, 15.0, 0.0), duration=8.0, eyes=None):
    eyes = eyes or (Eyes("a"), Eyes("b"))
    world = World(ego, np.array(objects, dtype=float))
    return list(cycles(drive(world, eyes, duration))), [e.name for e in eyes]


@pytest.mark.req("C-212")
@pytest.mark.parametrize(
    ("obj", "expected"),
    [
        ((-12.0, 0, 0, 15.0, 0), {TAILGATED}),  # 7.5 m behind at 54 km/h
        ((-60.0, 0, 0, 15.0, 0), set()),
        ((-12.0, 3.5, 0, 15.0, 0), set()),  # the next lane
        ((12.0, 0, 0, 15.0, 0), {TAILGATING}),
        ((60.0, 0, 0, 15.0, 0), set()),
    ],
)
def test_simulator_truth_of_plain_scenes(obj, expected):
    found = simulator_truth(*scene([obj]))
    assert {h.hazard for h in found} == expected
    assert all(h.seen and h.about == {"actor 0"} for h in found)


def test_ice_makes_a_gap_a_hazard_and_standing_still_none():
    rows, names = scene([(-25.0, 0, 0, 15.0, 0)])
    assert simulator_truth(rows, names) == []
    icy = [c._replace(truth=c.truth._replace(mu=np.array([0.15]))) for c in rows]
    assert {h.hazard for h in simulator_truth(icy, names)} == {TAILGATED}
    rows, names = scene([(-6.0, 0, 0, 0.0, 0)], ego=(0, 0, 0, 0.0, 0))
    assert simulator_truth(rows, names) == []


def test_a_cyclist_has_no_grip_and_is_tailgated_all_the_same():
    rows, names = scene([(8.0, 0, 0, 4.0, 0)], duration=2.0)
    ridden = [c._replace(truth=c.truth._replace(mu=np.array([np.nan]))) for c in rows]
    assert {h.hazard for h in simulator_truth(ridden, names)} == {TAILGATING}


@given(seed=st.integers(0, 10_000), long=st.sampled_from([1.0, 12.0]))
@settings(max_examples=examples(60), derandomize=True)
def test_nobody_who_could_hit_is_left_out(seed, long):
    """Looking only at who is near enough to stop in time finds what looking at all finds."""
    rng = np.random.default_rng(seed)
    n, v = 12, rng.uniform(2.0, 35.0)
    objects = np.column_stack(
        [rng.uniform(-80, 80, n), rng.uniform(-4, 4, n), rng.normal(0, 0.2, n),
         rng.uniform(0, 40, n), np.zeros(n)]
    )  # fmt: skip
    rows, names = scene(objects, ego=(0.0, 0.0, 0.0, v, 0.0), duration=1.0)
    mu = rng.choice([0.1, 0.5, 0.9, np.nan], n)
    odd = [
        c._replace(truth=c.truth._replace(mu=mu, polygons=c.truth.polygons * [long, 1.0]))
        for c in rows
    ]
    near = simulator_truth(odd, names)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulator, "_near", lambda truth, spare: np.arange(len(truth.actors)))
        assert simulator_truth(odd, names) == near


@pytest.mark.req("C-212")
def test_an_object_that_no_channel_reports_is_marked_unseen():
    eyes = (Eyes("a", blind=(0,)), Eyes("b", blind=(0,)))
    (hazard,) = simulator_truth(*scene([(-12.0, 0, 0, 15.0, 0)], eyes=eyes))
    assert not hazard.seen


@pytest.mark.req("C-121")
@pytest.mark.parametrize(
    ("offset", "worldly"),
    [((1.5, 0.0), False), ((3.0, 0.0), True), ((0.0, 1.1), False), ((0.0, -1.2), True)],
)
def test_a_jump_of_one_channel_is_a_localisation_hazard(offset, worldly):
    """In the world model from where both cannot be within their alert limits: 2.8 m and 1.14 m."""
    rows, names = scene([], eyes=(Eyes("a"), Eyes("b", ego_offset={4.0: offset})))
    (sim,) = simulator_truth(rows, names)
    assert (sim.hazard, sim.kind, sim.about) == (LOCALISATION, "jump", {"b"})
    assert sim.t_start == pytest.approx(4.0)
    world = world_model_truth(rows, names)
    assert [h.hazard for h in world] == [LOCALISATION] * worldly
    assert all(h.t_start == pytest.approx(4.0) for h in world)


def held(*frames, cycles=6):
    """The same said for 0.5 s, or for another number of cycles."""
    rows = [Cycle(k, 0.1 * k, tuple(f._replace(t=0.1 * k) for f in frames)) for k in range(cycles)]
    return world_model_truth(rows, ["a", "b"][: len(frames)])


@pytest.mark.req("C-212")
def test_what_lasts_under_half_a_second_is_no_hazard_of_the_world_model():
    lead = frame(0.0, (0.0, 0.0, 0.0, 10.0, 0.0), [(20.0, 0, 0, 2.0, 0)], ids=[3])
    assert held(lead, cycles=5) == []
    assert [h.hazard for h in held(lead, cycles=6)] == [TAILGATING]


@pytest.mark.req("C-122", "C-123", "C-212")
@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ((20.0, 0, 0.7, 1.5, 1.3), [TAILGATING]),  # 40 deg
        ((20.0, 0, 0.9, 1.0, 1.3), []),  # 52 deg: it crosses
        ((25.0, 0, np.pi, -8.0, 0), []),  # oncoming
        ((25.0, -14.0, np.pi / 2, 0, 6.0), []),  # crossing
        ((-12.0, 0, 0, 16.0, 0), [TAILGATED]),
        ((-12.0, 0, np.pi / 2, 16.0, 0), []),  # slides sideways into the ego: no tailgater
    ],
)
def test_only_who_goes_the_same_way_on_the_same_path_tailgates(other, expected):
    ego = (0.0, 0.0, 0.0, 10.0, 0.0)
    assert [h.hazard for h in held(frame(0.0, ego, [other]))] == expected


def test_in_a_bend_ahead_and_behind_are_along_the_plan():
    """The plan turns left by 180 deg on 12 m: who drives at its end is behind in x, and ahead."""
    r, v = 12.0, 12.0
    t = np.arange(21) * 0.2
    angle = v * t / r
    plan = np.column_stack([r * np.sin(angle), r * (1 - np.cos(angle)), t])
    where = 2.6  # rad of the bend
    c, s = np.cos(where), np.sin(where)
    other = (r * s, r * (1 - c), where, 1.0 * c, 1.0 * s)
    ego = (0.0, 0.0, 0.0, v, 0.0)
    found = held(frame(0.0, ego, [other], plan=plan))
    assert [h.hazard for h in found] == [TAILGATING]
    assert other[0] > 0.0
    beyond = 3.25  # rad: behind the ego by its heading, ahead along the plan
    c, s = np.cos(beyond), np.sin(beyond)
    other = (r * s, r * (1 - c), beyond, 0.1 * c, 0.1 * s)
    assert other[0] < 0.0
    assert [h.hazard for h in held(frame(0.0, ego, [other], plan=plan))] == [TAILGATING]


@given(
    st.lists(st.tuples(st.floats(0, 9), st.floats(0, 9)), min_size=1, max_size=1),
    st.floats(-np.pi, np.pi),
    st.floats(-1e3, 1e3),
)
@settings(max_examples=examples(20), derandomize=True)
def test_world_model_truth_does_not_see_the_map(places, angle, shift):
    (x, y) = places[0]
    c, s = np.cos(angle), np.sin(angle)

    def placed(row):
        px, py, h, vx, vy = row
        return (
            c * px - s * py + shift,
            s * px + c * py,
            h + angle,
            c * vx - s * vy,
            s * vx + c * vy,
        )

    ego, other = (0.0, 0.0, 0.0, 10.0, 0.0), (10.0 + x, 0.1 * y, 0.0, 3.0, 0.0)
    plain = held(frame(0.0, ego, [other]))
    moved = held(frame(0.0, placed(ego), [placed(other)]))
    assert [h.hazard for h in plain] == [h.hazard for h in moved] == [TAILGATING]


@pytest.mark.req("C-218", "C-122", "C-123")
def test_world_model_truth_believes_ghosts_and_tells_ahead_from_behind():
    ego = (0.0, 0.0, 0.0, 10.0, 0.0)
    ghost = [(-12.0, 0, 0, 16.0, 0)]  # reported by one channel only
    (hazard,) = held(frame(0.0, ego), frame(0.0, ego, ghost, ids=[7]))
    assert (hazard.hazard, hazard.about) == (TAILGATED, {"b 7"})
    lead = [(20.0, 0, 0, 2.0, 0)]
    (hazard,) = held(frame(0.0, ego), frame(0.0, ego, lead))
    assert hazard.hazard is TAILGATING
    beside = [(-12.0, 3.5, 0, 16.0, 0)]
    assert held(frame(0.0, ego), frame(0.0, ego, beside)) == []


@given(st.data())
@settings(max_examples=examples(60))
def test_world_model_truth_agrees_with_footprints_moved_in_small_steps(data):
    ego = (0.0, 0.0, 0.0, 10.0, 0.0)
    x, y = data.draw(st.floats(-35, 35)), data.draw(st.floats(-3, 3))
    heading, v = data.draw(st.floats(-1.2, 1.2)), data.draw(st.floats(1.0, 15.0))
    other = np.array([x, y, heading, v * np.cos(heading), v * np.sin(heading)])
    f = frame(0.0, ego, [other])
    distances = [
        footprint(CAR, np.array([10 * t, 0, 0, 0, 0])).distance(
            footprint(CAR, np.array([*(other[:2] + other[3:] * t), heading, 0, 0]))
        )
        for t in np.arange(0, 3.001, 0.01)
    ]
    found = held(f)
    if abs(y) >= 1.8 or abs(heading) > np.pi / 4:  # beside both half widths, or another way
        assert found == []
    elif distances.count(0.0) > 6:  # longer than the 0.05 s between two looks
        assert len(found) == 1
    elif min(distances) > 0.0:
        assert found == []


def test_world_model_truth_does_not_call_close_following_an_overlap():
    ego = (0.0, 0.0, 0.0, 20.0, 0.0)
    close = frame(0.0, ego, [(6.5, 0.0, 0.0, 20.0, 0.0)])  # 2 m apart: 0.1 s, less than a step
    assert held(close) == []


def test_a_prediction_that_ends_early_is_believed_to_its_end():
    ego = (0.0, 0.0, 0.0, 10.0, 0.0)
    f = frame(0.0, ego, [(20.0, 0, 0, 0, 0)])
    predictions = f.predictions.copy()
    predictions[:, 3:] = np.nan
    early = f._replace(predictions=predictions)
    assert held(early) == []
    assert len(held(f)) == 1


def test_truth_survives_strange_frames():
    ego = (np.nan,) * 5
    strange = frame(0.0, ego, np.full((2, 5), np.nan))
    rows = [Cycle(0, 0.0, (strange, None), truth=truth(0.0, (0, 0, 0, 0, 0), np.zeros((0, 5))))]
    assert world_model_truth(rows, ["a", "b"]) == []
    assert simulator_truth(rows, ["a", "b"]) == []


# -- matching

times = st.floats(0, 60).map(lambda t: round(t, 1))
spans = st.lists(
    st.tuples(times, st.floats(0, 4)).map(lambda p: Span(TAILGATED, p[0], p[0] + p[1])), max_size=5
)


@pytest.mark.req("C-214")
@given(spans, spans)
@settings(max_examples=examples(80))
def test_matching_is_one_to_one_and_the_largest_possible(detected, true):
    m = match(detected, true)
    assert len({d for d, _ in m.pairs}) == len({h for _, h in m.pairs}) == len(m.pairs)
    assert len(m.pairs) + len(m.false_alarms) == len(detected)
    assert len(m.pairs) + len(m.missed) == len(true)

    def near(d, h):
        return d.t_start <= h.t_end + 1.0 and h.t_start <= d.t_end + 1.0

    assert all(near(detected[d], true[h]) for d, h in m.pairs)
    small, large = sorted((detected, true), key=len)
    best = max(
        sum(near(s, c) for s, c in zip(small, chosen, strict=True))
        for chosen in permutations(large, len(small))
    )
    assert len(m.pairs) == best


def test_other_hazards_and_other_objects_do_not_match():
    a = Span(TAILGATED, 0, 1, frozenset({"x"}))
    assert match([a], [Span(TAILGATING, 0, 1)]).pairs == ()
    assert match([a], [Span(TAILGATED, 0, 1, frozenset({"y"}))]).pairs == ()
    assert match([a], [Span(TAILGATED, 0, 1)]).pairs == ((0, 0),)
    assert match([a], [Span(TAILGATED, 2.5, 3)], tolerance=2.0).pairs == ((0, 0),)


@pytest.mark.req("C-214", "C-216", "C-217")
def test_scores_add_up_and_macro_differs_from_micro():
    one = Tally(69, 6, 4, 3.0), Tally(17, 0, 4, 3.0), Tally(18, 10, 7, 3.0)
    scores = {
        h: score([t]) for h, t in zip((TAILGATED, LOCALISATION, TAILGATING), one, strict=True)
    }
    assert percent(macro(scores)[0]) == "85.43"  # the published counts, recomputed
    assert percent(macro(scores)[1]) == "82.49"
    assert tuple(map(percent, micro(scores))) == ("86.67", "87.39")
    assert percent(0.846150001) == "84.62"
    assert percent(0.00005) == "0.01"  # half up
    halves = [Tally(30, 3, 1, 1.0, (0.5,)), Tally(39, 3, 3, 2.0, (0.1,))]
    total = score(halves)
    assert total.total == Tally(69, 6, 4, 3.0, (0.5, 0.1))
    assert total.precision is None  # two drives are too few for limits
    many = score(halves * 4)
    assert many.precision.low <= many.total.precision <= many.precision.high
    assert score([Tally()]).recall is None
    assert Tally(0, 6, 0, 3.0).false_alarms_per_hour == 2.0


def test_lead_time_is_positive_when_the_rule_was_first():
    row = tally([Span(TAILGATED, 1.0, 4.0)], [Span(TAILGATED, 3.0, 5.0)], 0.1)
    assert row[TAILGATED].lead_times == (2.0,)


@pytest.mark.req("C-140")
def test_spans_with_short_pauses_are_one():
    rows = [Span(TAILGATED, 0, 1), Span(TAILGATED, 2.9, 4), Span(TAILGATED, 6.0, 7)]
    assert [(s.t_start, s.t_end) for s in merge_spans(rows)] == [(0, 4), (6.0, 7)]


def test_a_merged_span_has_the_largest_weight_of_its_parts():
    rows = [
        Span(TAILGATED, start, start + 1.0, frozenset({name}), weight)
        for start, name, weight in ((0.0, "a", 0.25), (2.0, "b", 0.5), (9.0, "c", 0.125))
    ]
    merged = merge_spans(rows)
    assert [s.weight for s in merged] == [0.5, 0.125]
    assert merged[0].about == {"a", "b"}


@pytest.mark.req("C-211", "C-213", "C-215")
def test_a_drive_is_judged_by_rules_truths_and_labels():
    rows, names = scene(
        [(-30.0, 0, 0, 18.0, 0), (50.0, 3.5, 0, 15.0, 0)],
        eyes=(Eyes("a", 0.02), Eyes("b", 0.02, blind=(0,))),
    )
    segment = judge("s", "town", names, rows, [Span(TAILGATED, 3.0, 5.0)])
    evaluation = Evaluation([segment])
    for truth_name in ("sim", "world", "labels"):
        total = evaluation.scores(Profile.PRACTICAL.value, truth_name)[TAILGATED].total
        assert (total.tp, total.fp, total.fn) == (1, 0, 0), truth_name
    # one unseen vehicle opens the gap to at most 0.5, which the printed rule does not exceed
    total = evaluation.scores(Profile.AS_PRINTED.value, "sim")[TAILGATED].total
    assert (total.tp, total.fn) == (0, 1)
    table = evaluation.as_dict()
    assert table["by_route"]["practical/sim"] == {
        "town": {
            LOCALISATION.value: [0, 0, 0],
            TAILGATING.value: [0, 0, 0],
            TAILGATED.value: [1, 0, 0],
        }
    }
    assert table["truths_agree"][TAILGATED.value]["tp"] == 1


@pytest.mark.parametrize(
    "text",
    [
        "hazard,start_s,end_s,world,annotator\nego_tailgated,0,1,sim,me",
        "hazard,start_s,end_s,world,annotator,note\nspeeding,0,1,sim,me,",
        "hazard,start_s,end_s,world,annotator,note\nego_tailgated,2,1,sim,me,",
        "hazard,start_s,end_s,world,annotator,note\nego_tailgated,0,1,moon,me,",
    ],
)
def test_labels_are_checked_line_by_line(tmp_path, text):
    path = tmp_path / "labels.csv"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"labels\.csv:2"):
        read_labels(path)
