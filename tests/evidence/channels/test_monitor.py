"""Rules, time filter, records, and that no truth leaks into what the monitor says."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.channels import Context, Cycle
from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Form, Profile
from skidpad.evidence.channels.hazards import Clause, Signal, load_only_rules, load_rules
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings, drive_events
from skidpad.evidence.channels.recorder import WORLD_LIMIT
from skidpad.evidence.channels.timefilter import TimeFilter
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.mcap_files import ChannelWriter, McapRecording
from support.channel_worlds import Eyes, Listed, World, drive, frame, traffic, truth

NAN = float("nan")
FOLLOWER = (-30.0, 0, 0, 16.5, 0)  # 4.8 m and 3.2 s from a collision after 13.8 s
EGO = (0.0, 0.0, 0.0, 15.0, 0.0)
BLIND_BEHIND = (Eyes("lav", 0.02), Eyes("tfuse", 0.02, blind=(0,)))


def signals(**values):
    return {s: values.get(s.value, 0.0) for s in Signal}


def verdict(profile, hazard, **values):
    (rule,) = [r for r in load_rules(profile) if r.hazard is hazard]
    return rule.fires(signals(**values))


@pytest.mark.req("C-120", "C-121", "C-122", "C-123", "C-126")
@pytest.mark.parametrize(
    ("hazard", "values", "expected"),
    [
        (HazardType.INCONSISTENT_LOCALISATION, {"location_variance": 0.0501}, True),
        (HazardType.INCONSISTENT_LOCALISATION, {"location_variance": 0.05}, False),
        (HazardType.EGO_TAILGATING, {"gap": 0.51, "safety_score": 0.8, "comfort_least": 0.7}, True),
        (HazardType.EGO_TAILGATING, {"gap": 0.5, "safety_score": 0.8, "comfort_least": 0.7}, False),
        (
            HazardType.EGO_TAILGATING,
            {"gap": 0.6, "safety_score": 0.79, "comfort_least": 0.8},
            False,
        ),
        (HazardType.EGO_TAILGATING, {"gap": 0.6, "safety_score": 0.9, "comfort_least": 0.9}, False),
        (
            HazardType.EGO_TAILGATED,
            {"gap": 0.6, "safety_score": 0.79, "comfort_driving": 0.8},
            True,
        ),
        (
            HazardType.EGO_TAILGATED,
            {"gap": 0.6, "safety_score": 0.8, "comfort_driving": 0.9},
            False,
        ),
        (
            HazardType.EGO_TAILGATED,
            {"gap": 0.6, "safety_score": 0.7, "comfort_driving": 0.79},
            False,
        ),
        (HazardType.EGO_TAILGATED, {"gap": NAN, "safety_score": 0.7, "comfort_driving": 0.9}, None),
        (
            HazardType.EGO_TAILGATED,
            {"gap": NAN, "safety_score": 0.9, "comfort_driving": 0.9},
            False,
        ),
    ],
)
def test_printed_rules_row_by_row(hazard, values, expected):
    assert verdict(Profile.AS_PRINTED, hazard, **values) is expected


@pytest.mark.req("C-125", "C-126")
@given(gap=st.floats(0, 1), score=st.floats(0, 1), driving=st.floats(0, 1), least=st.floats(0, 1))
def test_the_printed_tailgating_rules_exclude_each_other(gap, score, driving, least):
    values = {
        "gap": gap, "safety_score": score, "comfort_driving": driving, "comfort_least": least
    }  # fmt: skip
    both = [verdict(Profile.AS_PRINTED, h, **values) for h in list(HazardType)[1:3]]
    assert both != [True, True]


@pytest.mark.req("C-125")
def test_practical_rules_ask_for_a_gap_and_a_collision_on_the_right_side():
    close = {
        "safety_score": 0.6, "comfort_driving": 0.85, "comfort_least": 0.85, "gap": 0.45,
        "ttc_ahead": np.inf, "ttc_behind": np.inf,
    }  # fmt: skip
    to_rear, to_front = (
        {"gap_signed": 0.45, "risk_ahead_lead": -0.4},
        {"gap_signed": -0.45, "risk_ahead_lead": 0.4},
    )
    assert not verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATED, **close, **to_rear)
    assert not verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATING, **close, **to_front)
    behind, ahead = close | to_rear | {"ttc_behind": 2.5}, close | to_front | {"ttc_ahead": 2.5}
    assert verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATED, **behind)
    assert not verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATING, **behind)
    assert verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATING, **ahead)
    assert not verdict(Profile.PRACTICAL, HazardType.EGO_TAILGATED, **ahead)


TAILGATING = {"safety_score": 0.79, "comfort_least": 0.85, "ttc_ahead": 2.5, "risk_ahead_lead": 0.4}
TAILGATED = {
    "safety_score": 0.79,
    "comfort_driving": 0.85,
    "ttc_behind": 2.5,
    "risk_ahead_lead": -0.4,
}


@pytest.mark.req("C-122", "C-123", "C-125")
@pytest.mark.parametrize(
    ("profile", "hazard", "gap", "limit", "others"),
    [
        (
            Profile.AS_PRINTED,
            HazardType.EGO_TAILGATING,
            "gap",
            0.5,
            TAILGATING | {"safety_score": 0.8},
        ),
        (Profile.AS_PRINTED, HazardType.EGO_TAILGATED, "gap", 0.5, TAILGATED),
        (Profile.PRACTICAL, HazardType.EGO_TAILGATING, "gap", 0.3, TAILGATING),
        (Profile.PRACTICAL, HazardType.EGO_TAILGATED, "gap_signed", 0.3, TAILGATED),
    ],
)
def test_the_gap_must_exceed_its_limit_and_a_hair_is_enough(profile, hazard, gap, limit, others):
    for value, expected in ((limit - 1e-6, False), (limit, False), (limit + 1e-6, True)):
        assert verdict(profile, hazard, **others | {gap: value}) is expected


@pytest.mark.req("C-122", "C-123")
@pytest.mark.parametrize(
    ("hazard", "name", "inside", "outside"),
    [
        (HazardType.EGO_TAILGATING, "safety_score", 0.799999, 0.8),
        (HazardType.EGO_TAILGATING, "ttc_ahead", 3.199999, 3.2),
        (HazardType.EGO_TAILGATING, "risk_ahead_lead", 1e-6, 0.0),
        (HazardType.EGO_TAILGATING, "comfort_least", 0.7, 0.699999),
        (HazardType.EGO_TAILGATING, "comfort_least", 0.899999, 0.9),
        (HazardType.EGO_TAILGATED, "safety_score", 0.799999, 0.8),
        (HazardType.EGO_TAILGATED, "ttc_behind", 3.199999, 3.2),
        (HazardType.EGO_TAILGATED, "risk_ahead_lead", -1e-6, 0.0),
        (HazardType.EGO_TAILGATED, "comfort_driving", 0.8, 0.799999),
    ],
)
def test_every_limit_of_the_practical_rules_is_where_it_is_printed(hazard, name, inside, outside):
    calm = {"gap": 0.4, "gap_signed": 0.4}
    others = calm | (TAILGATING if hazard is HazardType.EGO_TAILGATING else TAILGATED)
    assert verdict(Profile.PRACTICAL, hazard, **others | {name: inside}) is True
    assert verdict(Profile.PRACTICAL, hazard, **others | {name: outside}) is False


@pytest.mark.req("C-121")
@pytest.mark.parametrize(("distance", "expected"), [(1.9, False), (2.1, True)])
def test_practical_localisation_sees_a_drift_however_slow(distance, expected):
    values = {"location_variance": 0.0, "shift_short": 0.05, "ego_location": 1 / (1 + distance)}
    hazard = HazardType.INCONSISTENT_LOCALISATION
    assert verdict(Profile.PRACTICAL, hazard, **values) is expected
    assert verdict(Profile.AS_PRINTED, hazard, **values) is False


@pytest.mark.req("C-127", "C-128", "C-129")
@pytest.mark.parametrize(
    ("hazard", "values"),
    [
        (
            HazardType.CROSSING_OBJECT,
            {"cross_path_variance": 0.06, "channel_path_variance": 0.06, "safety_score": 0.5},
        ),
        (HazardType.CONFLICTING_PATHS, {"cross_path": 0.4, "ego_trajectory": 0.5}),
        (HazardType.STUCK_VEHICLE, {"steady_share": 0.95, "cross_path_dips": 3}),
        (HazardType.STUCK_VEHICLE, {"steady_share": 0.95, "score_range": 0.3, "count_range": 0.5}),
    ],
)
def test_candidate_rules_need_every_clause(hazard, values):
    calm = {"cross_path": 1.0, "ego_trajectory": 1.0, "safety_score": 1.0}
    assert verdict(Profile.PRACTICAL, hazard, **(calm | values)) is True
    for name in values:
        rest = {k: v for k, v in values.items() if k != name}
        assert verdict(Profile.PRACTICAL, hazard, **(calm | rest)) is False


def test_rules_are_checked_when_read(tmp_path):
    with pytest.raises(ConfigError, match="SIGNAL OPERATOR NUMBER"):
        Clause.parse("gap = 3")
    with pytest.raises(ConfigError, match="SIGNAL OPERATOR NUMBER"):
        Clause.parse("gip > 3")
    path = tmp_path / "rules.yaml"
    path.write_text("practical: {ego_tailgated: {any: [[]], extreme: {signal: gap, of: least}}}")
    with pytest.raises(ConfigError, match=r"rules\.yaml"):
        load_rules(Profile.PRACTICAL, path)
    path.write_text(
        "practical: {ego_tailgated: {any: [['gap > 0.1']], extreme: {signal: gap, of: least}}}"
    )
    assert len(load_rules(Profile.PRACTICAL, path)) == 1
    with pytest.raises(ConfigError, match="no profile as_printed"):
        load_rules(Profile.AS_PRINTED, path)


@pytest.mark.req("C-140", "C-141")
@given(st.lists(st.integers(0, 200), unique=True, min_size=1).map(sorted))
def test_the_filter_joins_exactly_what_pauses_for_less_than_two_seconds(ticks):
    repeats: TimeFilter[str] = TimeFilter()
    for k in ticks:
        repeats.add("a", 0.1 * k, -float(k), least=True)
        if k % 3 == 0:
            repeats.add("b", 0.1 * k, 1.0, least=False)
    events = [e for e in repeats.finish() if e.key == "a"]
    breaks = sum(b - a >= 20 for a, b in pairwise(ticks))
    assert len(events) == breaks + 1
    assert sum(e.count for e in events) == len(ticks)
    for e in events:
        assert e.extreme == pytest.approx(-10.0 * e.t_end)


def monitored(source):
    monitor = Monitor(source.channels, MonitorSettings(profile=Profile.PRACTICAL))
    evidence = [monitor.update(c) for c in cycles(source)]
    return monitor, evidence, monitor.records() + monitor.finish()


@pytest.mark.req("C-001", "C-002", "C-007", "C-008", "C-123", "C-124")
def test_a_follower_that_one_channel_cannot_see_is_found_and_recorded():
    source = drive(World(EGO, np.array([FOLLOWER, (60.0, 3.5, 0, 15.0, 0)])), BLIND_BEHIND, 16.0)
    monitor, evidence, records = monitored(source)
    (record,) = [r for r in records if r.type is HazardType.EGO_TAILGATED]
    assert "lav" in record.involved
    (obj,) = record.objects
    assert (obj.channel, obj.id) == ("lav", 0)
    assert obj.x == pytest.approx(-30.0 + 16.5 * record.t_worst, abs=0.2)
    assert record.flags == ("cut",)
    assert record.worlds[0].t == pytest.approx(record.t_start - 5.0)
    assert record.count == sum(HazardType.EGO_TAILGATED in e.fired for e in evidence)
    found, _ = drive_events(monitor)
    assert [e.key for e in found].count(HazardType.EGO_TAILGATED) == 1


@pytest.mark.req("C-150")
def test_a_record_holds_the_world_from_5_s_before_to_5_s_after():
    eyes = (Eyes("a"), Eyes("b", ego_offset={20.0: (1.5, 0.0)}))
    _, _, records = monitored(drive(World(), eyes, 45.0, with_truth=False))
    (record,) = [r for r in records if r.type is HazardType.INCONSISTENT_LOCALISATION]
    assert record.t_start == pytest.approx(20.0)
    assert record.worlds[0].t == pytest.approx(15.0)
    assert record.worlds[-1].t == pytest.approx(record.t_end + 5.0, abs=0.11)
    assert record.flags == ()
    assert record.involved == ("a", "b")


def test_a_hazard_without_end_is_cut_at_the_limit():
    source = drive(World(EGO, np.array([(-4.3, 0, 0, 15.0, 0)])), BLIND_BEHIND, 75.0)
    _, _, records = monitored(source)
    (record,) = [r for r in records if r.type is HazardType.EGO_TAILGATED]
    assert len(record.worlds) == WORLD_LIMIT
    assert "cut" in record.flags
    assert "assumed" in record.flags  # the blind channel has nothing to pair with


def all_values(evidence):
    return np.array([e.readings.values for e in evidence])


def without_context(records):
    return [{n: str(getattr(r, n)) for n in r.__struct_fields__ if n != "context"} for r in records]


@pytest.mark.req("C-021", "C-203")
def test_truth_and_context_change_nothing_and_neither_does_the_file(tmp_path):
    world = World(EGO, np.array([FOLLOWER, (40.0, 0, 0, 12.0, 0)]))
    live = drive(world, BLIND_BEHIND, 16.0)
    rng = np.random.default_rng(1)
    bare, scrambled = tmp_path / "bare.mcap", tmp_path / "scrambled.mcap"
    for path, extra in ((bare, False), (scrambled, True)):
        with ChannelWriter(path, live.channels) as writer:
            for channel, item in live.rows:
                if channel is not None:
                    writer.add(item, channel)
                elif extra:
                    writer.add(truth(item.t, rng.normal(size=5), rng.normal(size=(3, 5))))
                    writer.add(Context(item.t, {"route": str(rng.integers(9))}))
    runs = [monitored(s) for s in (live, McapRecording(bare), McapRecording(scrambled))]
    values = [all_values(evidence) for _, evidence, _ in runs]
    records = [without_context(found) for _, _, found in runs]
    assert records[0]
    for i in (1, 2):
        assert np.array_equal(values[0], values[i], equal_nan=True)
        assert records[0] == records[i]


@pytest.mark.parametrize("form", list(Form))
@pytest.mark.parametrize("profile", list(Profile))
def test_strange_input_is_survived_marked_and_counted(form, profile):
    nan5 = (NAN,) * 5
    many = np.random.default_rng(2).normal(0, 50, (10_000, 5))
    turned = np.array([[0, 0, 0.0], [1, 0, 0.2], [2, 0, 0.1], [NAN, 0, 0.4]])
    shapes = frame(0.0, EGO, np.zeros((2, 5)))._replace(
        polygon_size=np.array([0, 2]), polygons=np.zeros((2, 2, 2))
    )
    rows = [
        frame(0.0, nan5, [nan5, (5.0, 0, 0, 1, 0)]),
        frame(0.1, EGO, many),
        frame(0.2, EGO, plan=np.zeros((0, 3))),
        frame(0.3, EGO, plan=turned),
        shapes._replace(t=0.4),
        frame(0.5, EGO, np.zeros((3, 5)), prediction_length=-0.2),
        frame(0.6, (1e300, -1e300, 1e9, 0, 0)),
    ]
    normal = [frame(0.1 * k, EGO, [(20.0, 0, 0, 9, 0)]) for k in range(len(rows))]
    monitor = Monitor(
        ["odd", "even"],
        MonitorSettings(indicators=IndicatorSettings(form=form), profile=profile),
    )
    for k, (odd, even) in enumerate(zip(rows, normal, strict=True)):
        e = monitor.update(Cycle(k, 0.1 * k, (odd, even)))
        assert np.isfinite(e.readings[Indicator.PLANNED_PATH_COMFORT][1])
        values = e.readings.values
        assert not np.isinf(values).any()
    u = monitor.unusable
    assert (u.poses["odd"], u.objects["odd"], u.plans["odd"], u.shapes["odd"]) == (1, 1, 1, 2)
    assert u.objects_beyond_limit["odd"] == 10_000 - 300
    assert monitor.not_evaluated[Indicator.EGO_LOCATION, "odd+even"] == 1
    monitor.finish()


@pytest.mark.req("C-056")
def test_all_objects_are_counted_even_where_few_are_compared():
    many = np.zeros((1000, 5))
    monitor = Monitor(["a", "b"])
    e = monitor.update(Cycle(0, 0.0, (frame(0.0, EGO, many), frame(0.0, EGO, many[:999]))))
    assert e.readings[Indicator.OBJECT_COUNT][0] == 0.5


@pytest.mark.req("C-129")
def test_a_stuck_vehicle_is_steady_while_its_cross_path_dips():
    rows = []
    for k in range(260):
        t = 0.1 * k
        still = np.column_stack([np.zeros(16), np.zeros(16), np.arange(16) * 0.2])
        away = still.copy()
        if k % 60 < 3 and k > 0:
            away[:, 1] = np.arange(16) * 0.5
        rows.append((0, frame(t, (0, 0, 0, 0, 0), plan=still)))
        rows.append((1, frame(t, (0, 0, 0, 0, 0), plan=away)))
    _, evidence, _ = monitored(Listed(("a", "b"), rows))
    steady = [e.signals.values[Signal.STEADY_SHARE] for e in evidence]
    assert evidence[-1].signals.values[Signal.CROSS_PATH_DIPS] == 4, "of five, one is 20 s ago"
    # of 17 values that are known, b's plan, its variance and the ego trajectories move
    assert steady[-1] == pytest.approx(14 / 17)
    assert np.isnan(steady[:180]).all(), "20 s of evidence are needed"
    assert not np.isnan(steady[200:]).any()


@pytest.mark.req("C-129")
def test_what_stands_still_for_20_s_is_steady_and_fires_with_its_dips():
    def standing(moved):
        plan = np.column_stack([np.zeros(16), np.zeros(16), np.arange(16) * 0.2])
        for k in range(230):
            ego = (moved * (k % 2), 0, 0, 0, 0)
            yield 0, frame(0.1 * k, (0, 0, 0, 0, 0), plan=plan)
            yield 1, frame(0.1 * k, ego, plan=plan)

    def share(moved):
        _, evidence, _ = monitored(Listed(("a", "b"), list(standing(moved))))
        return evidence[-1].signals.values[Signal.STEADY_SHARE]

    assert share(0.0) == 1.0
    # positions d apart are 1 / (1 + d) alike: a tenth less at 1/9 m
    assert share(0.110) == 1.0
    assert share(0.112) == pytest.approx(16 / 17)
    fires = {"steady_share": 0.9, "cross_path_dips": 2}
    assert verdict(Profile.PRACTICAL, HazardType.STUCK_VEHICLE, **fires) is True
    for name, below in (("steady_share", 0.899), ("cross_path_dips", 1)):
        assert (
            verdict(Profile.PRACTICAL, HazardType.STUCK_VEHICLE, **fires | {name: below}) is False
        )


@pytest.mark.req("C-023", "C-051")
def test_three_channels_take_the_pair_with_the_largest_gap():
    objects = [(20.0, 0, 0, 9, 0), (-15.0, 0, 0, 9, 0)]
    frames = (frame(0.0, EGO, objects), frame(0.0, EGO, objects), frame(0.0, EGO, objects[:1]))
    e = Monitor(["a", "b", "c"]).update(Cycle(0, 0.0, frames))
    assert e.signals.gap_pair in (1, 2)  # a+c or b+c
    assert e.signals.values[Signal.GAP_SIGNED] == pytest.approx(0.5)


@pytest.mark.req("C-101", "C-106")
def test_violations_of_a_drive_are_counted_as_cycles_and_as_events():
    eyes = (Eyes("a"), Eyes("b", ego_offset={3.0: (1.0, 0.0), 6.0: (-1.0, 0.0)}))
    monitor, _, _ = monitored(drive(World(objects=traffic(3)), eyes, 12.0))
    key = Indicator.EGO_LOCATION, "a+b"
    assert monitor.violation_cycles[key] == 30
    _, violations = drive_events(monitor)
    (event,) = [e for e in violations if e.key == key]
    assert (event.count, event.extreme) == (30, pytest.approx(0.5))


@pytest.mark.req("C-130")
def test_an_object_of_one_channel_for_a_moment_is_a_cue_for_a_ghost():
    lead, ghost = (30.0, 0, 0, 15.0, 0), (15.0, 6.0, 0, 15.0, 0)
    monitor = Monitor(["a", "b"])
    for k in range(30):
        t = 0.1 * k
        real = np.array([lead]) + np.array([15.0 * t, 0, 0, 0, 0])
        more = np.vstack([real, [np.add(ghost, (15.0 * t, 0, 0, 0, 0))]])
        seen_by_a = (
            frame(t, EGO, more, ids=[1, 2]) if 10 <= k < 13 else frame(t, EGO, real, ids=[1])
        )
        # the follower of b stays for long, the lead is known to both
        lasting = np.vstack([real, [(-20.0 + 15.0 * t, 0, 0, 15.0, 0)]])
        seen_by_b = frame(t, EGO, lasting, ids=[8, 9]) if k < 20 else frame(t, EGO, real, ids=[8])
        monitor.update(Cycle(k, t, (seen_by_a, seen_by_b)))
    assert dict(monitor.ghosts.brief) == {"a": 1}


@pytest.mark.req("C-090", "C-104")
def test_safety_scores_have_no_threshold_and_every_violation_has_a_meaning():
    table = Monitor(["a", "b"]).thresholds
    assert table[Indicator.SAFETY_SCORE].threshold is None
    assert table[Indicator.SAFETY_SCORE].claim is None
    assert all(entry.meaning for entry in table.values())


def test_the_default_rules_are_those_by_safe_distances():
    assert MonitorSettings().profile is Profile.TRACKED
    assert Monitor(("a", "b")).rules == load_rules(Profile.TRACKED)


def test_a_file_of_one_profile_says_which_rules_it_holds(tmp_path):
    one = "{ego_tailgated: {any: [['gap > 0.1']], extreme: {signal: gap, of: least}}}"
    path = tmp_path / "own.yaml"
    path.write_text(f"tracked: {one}")
    profile, rules = load_only_rules(path)
    assert profile is Profile.TRACKED
    assert [rule.hazard for rule in rules] == [HazardType.EGO_TAILGATED]
    path.write_text(f"tracked: {one}\npractical: {one}")
    with pytest.raises(ConfigError, match="must hold the rules of one profile, holds 2"):
        load_only_rules(path)
