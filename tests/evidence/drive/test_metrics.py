from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.core.geometry import footprint
from skidpad.core.states import ContactEvent, LaneInvasion, StackReport
from skidpad.core.vocabulary import DetectionStatus, RelocationReason, Supervision, Tier
from skidpad.evidence.drive.collisions import CrashKind, Striker, find_crashes
from skidpad.evidence.drive.conflict import deceleration_to_avoid_crash, time_to_collision
from skidpad.evidence.drive.lanematch import LaneIndex
from skidpad.evidence.drive.metrics import count_invasions, run_metrics, weather_metrics
from skidpad.evidence.drive.prepared import LeadDefinition, MetricSettings, prepare
from skidpad.evidence.drive.story import tell_story
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.run.events import Relocation
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log, write_log
from skidpad.recording.run.ticks import TickLog
from support.examples import examples
from support.makelog import DT, drive, pose
from support.makemap import Lane, TestMap, line, ring_map, straight_map

SEEN = StackReport(
    status=DetectionStatus.FUSION_DETECT, tier=Tier.ACC_HOLD, detected=True, distance=30.0
)
NOTHING = StackReport(status=DetectionStatus.NO_TARGET, tier=Tier.CRUISE, detected=False)
PRINTED = MetricSettings(lead=LeadDefinition.SAME_ROAD_AND_LANE)


def follow(
    gap: float = 30.0,
    v: float = 20.0,
    v_lead: float = 20.0,
    n: int = 20,
    x: float = 50.0,
    y_lead: float = 0.0,
    report: Callable[[int], StackReport | None] = lambda _k: SEEN,
    **more: object,
) -> RunLog:
    """The ego at x, a car `gap` m ahead of it bumper to bumper; cars are 4 m long."""

    def rows(k: int) -> list[dict[str, float]]:
        t = k * DT
        return [
            {"x": x + v * t, "vx": v},
            {"x": x + gap + 4.0 + v_lead * t, "y": y_lead, "vx": v_lead},
        ]

    return drive(n, rows, report=report, **more)  # type: ignore[arg-type]


def metrics(log: RunLog, **more: object) -> Metrics:
    return run_metrics(log, straight_map(), **more)  # type: ignore[arg-type]


@pytest.mark.req("A-232", "A-233", "A-234")
def test_ttc_uses_radar_velocity_where_there_is_one() -> None:
    report = dataclasses.replace(SEEN, distance=12.0, radar_velocity=-8.0)
    assert metrics(follow(report=lambda _k: report)).min_ttc_s == pytest.approx(1.5)
    own = dataclasses.replace(SEEN, distance=12.0)
    assert metrics(follow(report=lambda _k: own, v=24.0)).min_ttc_s == pytest.approx(0.5)


@pytest.mark.req("A-232", "A-235")
@pytest.mark.parametrize(
    ("change", "v"),
    [
        ({"detected": False}, 20.0),
        ({}, 1.0),  # the ego must be faster than 1 m/s
        ({"radar_velocity": -0.5}, 20.0),  # closing must be faster than 0.5 m/s
        ({"radar_velocity": 3.0}, 20.0),  # opening
        ({"distance": None}, 20.0),
        ({"distance": 60.0, "radar_velocity": -2.0}, 20.0),  # 30 s is outside
        ({"distance": 0.0}, 20.0),
    ],
)
def test_no_ttc_gives_none_never_zero(change: dict[str, object], v: float) -> None:
    report = dataclasses.replace(SEEN, **change)  # type: ignore[arg-type]
    m = metrics(follow(report=lambda _k: report, v=v))
    assert m.min_ttc_s is None
    assert m.ttc_below_1_5_s == 0.0


@pytest.mark.req("A-234", "A-254")
def test_time_below_the_critical_ttc_and_the_gated_minimum() -> None:
    def report(k: int) -> StackReport:
        return dataclasses.replace(SEEN, distance=1.0 if k < 6 else 40.0, radar_velocity=-1.0)

    m = metrics(follow(report=report, v=2.0, n=20))
    assert (m.ttc_critical_count, m.min_ttc_s) == (6, 1.0)
    assert m.ttc_below_1_5_s == pytest.approx(6 * DT)
    assert m.min_ttc_above_10_kmh_s is None
    assert metrics(follow(report=report, v=3.0)).min_ttc_above_10_kmh_s == 1.0


@given(st.floats(0.0, 100.0), st.floats(0.1, 50.0))
def test_ttc_is_when_two_cars_meet(gap: float, v: float) -> None:
    t = float(time_to_collision(np.array(gap), np.array(v)))
    assert gap - v * t == pytest.approx(0.0, abs=1e-9)
    assert time_to_collision(np.array(gap), np.array(-v)) == np.inf


@given(st.floats(0.5, 100.0), st.floats(0.1, 50.0))
def test_braking_at_drac_stops_at_the_bumper(gap: float, v: float) -> None:
    a = float(deceleration_to_avoid_crash(np.array(gap), np.array(v)))
    t = np.linspace(0.0, v / a, 2001)
    assert np.trapezoid(v - a * t, t) == pytest.approx(gap, rel=1e-6)


@pytest.mark.req("A-254")
def test_true_conflicts_are_those_of_the_boxes() -> None:
    m = metrics(follow(gap=20.0, v=25.0, v_lead=15.0, n=11))
    gap_end = 20.0 - 10.0 * 0.5
    assert m.min_gap_true_m == pytest.approx(gap_end, abs=1e-3)
    assert m.min_ttc_true_s == pytest.approx(gap_end / 10.0, abs=1e-3)
    assert m.max_drac_true == pytest.approx(100.0 / (2.0 * gap_end), rel=1e-3)


def test_a_car_in_the_next_lane_is_no_conflict() -> None:
    m = metrics(follow(gap=5.0, v=25.0, v_lead=5.0, y_lead=3.5))
    assert (m.min_ttc_true_s, m.min_gap_true_m, m.max_drac_true) == (None, None, None)


@settings(max_examples=examples(25))
@given(st.floats(-0.4, 0.4), st.floats(6.0, 60.0))
def test_gap_along_a_straight_lane_agrees_with_shapely(turn: float, distance: float) -> None:
    log = drive(1, lambda _k: [{"x": 50.0, "vx": 9.0}, {"x": 50.0 + distance, "yaw": turn}])
    boxes = [
        shapely.Polygon(footprint(log.actors.x[0, i], 0.0, log.actors.yaw[0, i], 4.0, 2.0))
        for i in (0, 1)
    ]
    gap = prepare(log, straight_map()).lead.gap[0]
    assert gap == pytest.approx(boxes[0].distance(boxes[1]), abs=0.02 + 0.02 * abs(turn))


def test_gap_on_a_ring_follows_the_arc() -> None:
    r, angle = 100.0, 0.3

    def rows(_k: int) -> list[dict[str, float]]:
        places = ((0.1, 10.0), (0.1 + angle, 0.0))
        return [
            {
                "x": r * math.cos(a),
                "y": r * math.sin(a),
                "yaw": a + math.pi / 2,
                "vx": -v * math.sin(a),
                "vy": v * math.cos(a),
            }
            for a, v in places
        ]

    lead = prepare(drive(1, rows), ring_map(r)).lead
    assert lead.gap[0] == pytest.approx(r * angle - 4.0, abs=0.05)
    assert lead.v_closing[0] == pytest.approx(10.0, abs=0.05)
    assert lead.distance[0] == pytest.approx(2.0 * r * math.sin(angle / 2.0), abs=1e-3)
    assert lead.overlap[0]


@pytest.mark.req("A-236")
def test_the_lead_is_followed_across_a_road_boundary_unless_printed() -> None:
    log = follow(gap=30.0, x=180.0, v=0.0, v_lead=0.0, n=1)
    assert prepare(log, straight_map()).lead.distance[0] == pytest.approx(34.0)
    assert prepare(log, straight_map(), PRINTED).lead.actor[0] == -1


@pytest.mark.req("A-236")
def test_a_car_behind_is_a_lead_only_as_printed() -> None:
    log = follow(gap=-30.0, v=0.0, v_lead=0.0, n=1)
    assert prepare(log, straight_map()).lead.actor[0] == -1
    assert prepare(log, straight_map(), PRINTED).lead.distance[0] == pytest.approx(26.0)


@pytest.mark.req("A-236", "A-237")
@pytest.mark.parametrize(("centre", "there"), [(79.9, True), (80.1, False), (4.1, True)])
def test_a_lead_is_within_80_m(centre: float, there: bool) -> None:
    log = follow(gap=centre - 4.0, v=0.0, v_lead=0.0, n=1)
    assert (prepare(log, straight_map()).lead.actor[0] == 1) == there
    assert (metrics(log).fn == 1) == there


def test_cars_on_an_overpass_and_pedestrians_are_no_leads() -> None:
    over = TestMap([Lane(line(0, 300), 1, -1), Lane(line(0, 300), 5, -1, z=8.0)])
    log = drive(1, lambda _k: [{"x": 50.0}, {"x": 80.0, "z": 8.0}])
    assert prepare(log, over).lead.actor[0] == -1
    log = follow(n=1)
    log.table.kind[1] = 6
    assert prepare(log, straight_map()).lead.actor[0] == -1


@pytest.mark.req("A-238", "A-239", "A-252")
def test_confusion_counts_at_three_levels() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0, "vx": 20.0}, {"x": 80.0 if k < 6 else 400.0}]

    def report(k: int) -> StackReport:
        return dataclasses.replace(
            NOTHING,
            radar_pre=30.0 if k < 9 else None,
            radar_lane=30.0 if 2 <= k < 7 else None,
            detected=k < 5,
        )

    m = metrics(drive(10, rows, report=report))
    assert (m.tp, m.fp, m.tn, m.fn) == (4, 1, 3, 2)
    assert (m.radar_fpr_pct, m.radar_fnr_pct) == (25.0, pytest.approx(100.0 / 3.0))
    assert (m.radar_fpr_pct_pre, m.radar_fnr_pct_pre) == (75.0, 0.0)
    assert (m.radar_fpr_pct_final, m.radar_fnr_pct_final) == (0.0, pytest.approx(100.0 / 6.0))


@pytest.mark.req("A-238")
def test_a_rate_without_any_case_is_none() -> None:
    m = metrics(follow())
    assert m.fp == m.tn == 0
    assert m.radar_fpr_pct is None
    assert m.radar_fnr_pct == 100.0


@pytest.mark.req("A-240", "A-241", "A-254", "A-255")
def test_distance_error_is_against_the_distance_between_positions() -> None:
    measured = [33.0, 31.0, 34.0, None, 99.5, 0.05]

    def report(k: int) -> StackReport:
        return dataclasses.replace(SEEN, distance=measured[k])

    m = metrics(follow(gap=30.0, n=6, report=report))
    errors = [1.0, 3.0, 0.0]
    assert m.mean_error_m == pytest.approx(np.mean(errors), abs=1e-4)
    assert m.max_error_m == pytest.approx(3.0, abs=1e-4)
    assert m.max_error_at_s == pytest.approx(DT)
    assert m.headway_variance_m2 == pytest.approx(np.var(errors), abs=1e-4)


@pytest.mark.req("A-241", "A-251")
def test_one_error_has_no_variance_but_every_other_field_stands() -> None:
    def report(k: int) -> StackReport:
        return SEEN if k == 0 else NOTHING

    m = metrics(follow(report=report))
    assert m.mean_error_m is not None
    assert m.headway_variance_m2 is None
    nothing = metrics(follow(report=lambda _k: NOTHING))
    assert nothing.mean_error_m is None
    assert (nothing.fatal_collisions, nothing.samples, nothing.dropout_pct) == (0, 20, 100.0)


@pytest.mark.req("A-242")
def test_gap_variance_is_of_the_true_gap_while_following() -> None:
    def report(k: int) -> StackReport:
        return dataclasses.replace(SEEN, tier=Tier.ACC_OPEN if k < 3 else Tier.CRUISE)

    m = metrics(follow(gap=30.0, v=10.0, v_lead=30.0, report=report))
    assert m.gap_variance_m2 == pytest.approx(np.var([30.0, 31.0, 32.0]), rel=1e-3)


@pytest.mark.req("A-243", "A-244")
def test_dropout_of_all_ticks_and_of_those_with_a_vehicle() -> None:
    status = [
        DetectionStatus.NO_TARGET,
        DetectionStatus.FUSION_PERSIST,
        DetectionStatus.FUSION_DETECT,
        DetectionStatus.RADAR_ACTIVE,
        DetectionStatus.SAFETY_PERSIST,
        DetectionStatus.NO_TARGET,
        DetectionStatus.NO_TARGET,
        DetectionStatus.NO_TARGET,
    ]

    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0}, {"x": 90.0 if k < 5 else 400.0}]

    log = drive(8, rows, report=lambda k: dataclasses.replace(NOTHING, status=status[k]))
    m = metrics(log)
    assert m.dropout_pct == pytest.approx(100.0 * 5 / 8)
    assert m.dropout_present_pct == pytest.approx(100.0 * 2 / 5)


@pytest.mark.req("A-250")
def test_ticks_that_do_not_count_are_counted_with_their_reason() -> None:
    m = metrics(
        follow(
            report=lambda k: None if k in (3, 4) else SEEN,
            supervision=lambda k: Supervision.REVERSE if k >= 15 else Supervision.NONE,
        )
    )
    assert (m.samples, m.skipped_no_report, m.skipped_supervised) == (13, 2, 5)


@pytest.mark.req("A-154", "A-191", "A-245")
def test_lateral_offset_pauses_in_recovery_and_when_slow() -> None:
    offset = [0.5, -1.0, 0.3, 1.5, 1.6]
    speed = [20.0, 20.0, 20.0, 1.0, 20.0]

    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0 + k, "y": offset[k], "vx": speed[k]}]

    phase = [Supervision.NONE] * 4 + [Supervision.WARM_UP]
    m = metrics(drive(5, rows, supervision=lambda k: phase[k]))
    used = [0.5, 1.0, 0.3]
    assert m.lateral_mean_m == pytest.approx(np.mean(used), abs=1e-6)
    assert m.lateral_max_m == pytest.approx(1.0)
    assert m.lateral_std_m == pytest.approx(np.std(used), abs=1e-6)


@pytest.mark.req("A-030", "A-031", "A-032", "A-248")
def test_solid_markings_are_infractions_and_broken_ones_lane_changes() -> None:
    crossed = [(0, "broken", 1), (200, "broken", 1), (240, "broken", 1), (300, "solid", 1)]
    crossed += [(310, "solid_broken", 9), (320, "none", 1)]
    marks = [LaneInvasion(*c) for c in crossed]
    for m in (count_invasions(marks, frozenset({1}), DT), metrics(follow(n=400, invasions=marks))):
        assert (m.lane_invasions, m.lane_invasions_all, m.lane_changes) == (2, 6, 2)
        assert m.lane_invasions_highway == 1


def crash(
    contact: ContactEvent,
    v: float = 20.0,
    v_other: float = 5.0,
    gap: float = 10.0,
    seen_from: int = 0,
    relocations: tuple[Relocation, ...] = (),
) -> RunLog:
    def supervision(k: int) -> Supervision:
        return Supervision.BRAKE if contact.tick < k <= contact.tick + 10 else Supervision.NONE

    def extra(log: TickLog, k: int) -> None:
        for r in relocations:
            if r.tick == k:
                log.relocated(r)

    return follow(
        gap=gap,
        v=v,
        v_lead=v_other,
        n=60,
        contacts=[contact],
        supervision=supervision,
        extra=extra,
        report=lambda k: SEEN if k >= seen_from else NOTHING,
    )


def hit(actor: int = 1, tick: int = 12, static: str = "") -> ContactEvent:
    return ContactEvent(tick, actor, static, 900.0, 15.0, 70.0, 0.0)


@pytest.mark.req("A-190", "A-247", "A-249")
def test_driving_into_a_car_is_one_vehicle_collision_with_its_causes() -> None:
    log = crash(hit(), seen_from=5)
    m = metrics(log)
    assert (m.fatal_collisions, m.collisions_vehicle, m.collisions_static) == (1, 1, 0)
    assert (m.rear_ended, m.wrong_way, m.contacts) == (0, 0, 1)
    assert m.max_impact_kmh == m.max_impact_vehicle_kmh == pytest.approx(54.0)
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.kind, c.other, c.striker) == (CrashKind.VEHICLE, "car 1", Striker.EGO)
    assert (c.t, c.v_ego, c.v_other) == (pytest.approx(0.6), 20.0, 5.0)
    story = tell_story(prepare(log, straight_map()), c)
    assert story.first is not None
    assert story.first.before == pytest.approx(7 * DT)
    assert story.first.gap == pytest.approx(10.0 - 15.0 * 5 * DT, abs=1e-3)
    assert c.unseen == pytest.approx(5 * DT)
    assert c.lead_since == pytest.approx(12 * DT)
    assert [s.status for s in story.news] == [
        DetectionStatus.NO_TARGET,
        DetectionStatus.FUSION_DETECT,
        DetectionStatus.FUSION_DETECT,  # at the contact: 30 m measured, 1 m true
    ]
    assert story.worst == story.news[-1]
    assert c.lane_offset == pytest.approx(0.0)
    assert c.bend_radius is None
    assert c.mu == pytest.approx(0.9)


def test_being_hit_from_behind_is_told_apart() -> None:
    log = crash(hit(tick=15), v=10.0, v_other=30.0, gap=-24.0)
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.striker, c.rear_ended) == (Striker.OTHER, True)
    m = metrics(log)
    assert (m.collisions_vehicle, m.rear_ended) == (1, 1)


def test_being_hit_from_the_side_is_not_rear_ended() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0, "vx": 0.0}, {"x": 50.0, "y": 12.0 - k, "vy": -8.0}]

    log = drive(
        20,
        rows,
        contacts=[hit(tick=10)],
        supervision=lambda k: Supervision.BRAKE if k > 10 else Supervision.NONE,
    )
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.striker, c.rear_ended) == (Striker.OTHER, False)


@pytest.mark.parametrize(("v_across", "striker"), [(1.0, Striker.EGO), (0.0, Striker.OTHER)])
def test_a_slower_car_touched_sideways_is_not_rear_ended(v_across: float, striker: Striker) -> None:
    """The ego overtakes at 24 m/s; the other drives 15 and stands half a length back."""

    def rows(k: int) -> list[dict[str, float]]:
        ego = {"x": 50.0 + 24.0 * DT * k, "vx": 24.0, "vy": v_across}
        return [ego, {"x": 54.0 + 15.0 * DT * k, "y": 2.2, "vx": 15.0, "vy": -0.5}]

    log = drive(
        20,
        rows,
        contacts=[hit(tick=14)],
        supervision=lambda k: Supervision.BRAKE if k > 14 else Supervision.NONE,
    )
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.striker, c.rear_ended, c.sideways) == (striker, False, True)
    assert c.v_other is not None
    assert c.v_other < c.v_ego


@pytest.mark.req("A-189", "A-193")
def test_contacts_in_the_cool_down_are_logged_and_not_fatal() -> None:
    late = ContactEvent(45, -1, "guardrail", 5.0, 1.0, 0.0, 0.0)
    log = crash(hit())
    log = dataclasses.replace(log, events=(*log.events, late))
    m = metrics(log)
    assert (m.contacts, m.fatal_collisions) == (2, 1)


@pytest.mark.req("A-199", "A-253", "A-194")
def test_wrong_way_is_fatal_and_a_stuck_ego_is_not() -> None:
    moves = (
        Relocation(35, RelocationReason.WRONG_WAY, 0.0, pose(1.0), pose(2.0)),
        Relocation(50, RelocationReason.STUCK, 0.0, pose(1.0), pose(2.0)),
        Relocation(40, RelocationReason.COLLISION, 8.0, pose(1.0), pose(2.0)),
    )
    m = metrics(crash(hit(), relocations=moves))
    assert (m.wrong_way, m.stuck_relocations) == (1, 1)
    assert (m.fatal_collisions, m.collisions_vehicle) == (2, 1)


def field(
    n: int, off_from: int, off_to: int, moves: tuple[Relocation, ...] = (), v: float = 20.0
) -> RunLog:
    """A drive of `n` ticks along x that is 8 m beside the lane for some of them."""

    def extra(log: TickLog, k: int) -> None:
        for move in moves:
            if move.tick == k:
                log.relocated(move)

    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0 + v * k * DT, "y": -8.0 if off_from <= k < off_to else 0.0, "vx": v}]

    def supervision(k: int) -> Supervision:
        moved = any(0 <= k - m.tick < 11 for m in moves)
        return Supervision.WARM_UP if moved else Supervision.NONE

    return drive(n, rows, extra=extra, supervision=supervision)


def left(tick: int, x: float = 50.0, reason: int = RelocationReason.OFF_ROAD) -> Relocation:
    return Relocation(tick, RelocationReason(reason), 0.0, pose(x), pose(x))


@pytest.mark.req("R-6")
def test_leaving_the_road_is_fatal_counted_and_explained() -> None:
    log = field(100, 20, 40, (left(40),))
    m = metrics(log)
    assert (m.fatal_collisions, m.off_road, m.road_departures, m.crashes_vehicle) == (1, 1, 1, 0)
    assert m.first_fatal_s == pytest.approx(40 * DT)
    assert m.road_departures_per_100_km == pytest.approx(100.0 / (100 * 20.0 * DT / 1000.0))
    assert m.crashes_vehicle_per_100_km == 0.0
    assert m.off_lanes_pct == 0.0
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.kind, c.bend_exit, c.v_ego) == (CrashKind.OFF_ROAD, False, 20.0)


def test_a_roll_over_is_fatal_a_departure_and_a_kind_of_its_own() -> None:
    log = field(100, 0, 0, (left(40, reason=RelocationReason.ROLL_OVER),))
    m = metrics(log)
    assert (m.fatal_collisions, m.roll_overs, m.road_departures, m.off_road) == (1, 1, 1, 0)
    (c,) = find_crashes(prepare(log, straight_map()))
    assert (c.kind, c.other, c.v_ego) == (CrashKind.ROLL_OVER, "", 20.0)


@pytest.mark.req("R-6")
def test_ticks_off_all_lanes_that_nothing_counts_are_a_share() -> None:
    assert metrics(field(200, 20, 30)).off_lanes_pct == pytest.approx(5.0)
    half = field(200, 20, 40, (left(30),))  # the later ten are recovery
    assert metrics(half).off_lanes_pct == 0.0
    map_ends = field(200, 20, 40, (left(40, reason=RelocationReason.ROAD_END),))
    assert (metrics(map_ends).off_lanes_pct, metrics(map_ends).fatal_collisions) == (0.0, 0)


@pytest.mark.req("R-6", "A-188")
@pytest.mark.parametrize(
    ("tick", "x", "first"), [(160, 90.0, 1), (161, 90.0, 2), (60, 199.0, 1), (60, 201.0, 2)]
)
def test_what_happens_soon_and_near_a_relocation_follows_on_it(
    tick: int, x: float, first: int
) -> None:
    moved = Relocation(0, RelocationReason.WRONG_WAY, 0.0, pose(x), pose(x))
    log = field(tick + 5, 0, 0, (moved, left(tick)), v=50.0 / tick / DT)  # then at x = 100
    m = metrics(log)
    assert (m.fatal_collisions, m.fatal_first) == (2, first)
    assert (m.road_departures, m.road_departures_first) == (2, first)


def rail(lead_angle: float | None, radius: float) -> RunLog:
    def rows(k: int) -> list[dict[str, float]]:
        a = 20.0 * k * DT / radius
        spots = [(a, radius)] if lead_angle is None else [(a, radius), (a + lead_angle, radius)]
        return [
            {"x": r * math.cos(b), "y": r * math.sin(b), "yaw": b + math.pi / 2, "vx": 20.0}
            for b, r in spots
        ]

    return drive(
        30,
        rows,
        contacts=[hit(-1, 20, "guardrail")],
        supervision=lambda k: Supervision.BRAKE if k > 20 else Supervision.NONE,
    )


@pytest.mark.parametrize(
    ("lead_angle", "radius", "is_bend_exit"),
    [(None, 90.0, True), (0.3, 90.0, False), (None, 400.0, False)],
)
def test_leaving_a_bend_without_a_lead_is_its_own_category(
    lead_angle: float | None, radius: float, is_bend_exit: bool
) -> None:
    log, road_map = rail(lead_angle, radius), ring_map(radius)
    (c,) = find_crashes(prepare(log, road_map))
    assert (c.kind, c.other, c.striker) == (CrashKind.STATIC, "guardrail", None)
    assert c.bend_exit is is_bend_exit
    assert c.bend_radius == pytest.approx(radius)
    m = run_metrics(log, road_map)
    assert (m.collisions_static, m.bend_exits) == (1, int(is_bend_exit))


@pytest.mark.req("A-249")
def test_speeds_and_distance() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        return [{"x": 50.0 + k, "vx": 3.0 * k, "vy": 4.0 * k}]

    m = metrics(drive(5, rows))
    assert m.mean_speed_kmh == pytest.approx(36.0)
    assert m.max_speed_kmh == pytest.approx(72.0)
    assert m.p50_speed_kmh == pytest.approx(36.0)
    assert m.distance_km == pytest.approx(0.0025)
    assert m.bend_speed_kmh is None


@pytest.mark.req("A-231")
def test_metrics_per_weather_add_up_to_those_of_the_run() -> None:
    def extra(log: TickLog, k: int) -> None:
        if k == 12:
            log.set_weather("rain-night")

    log = follow(extra=extra, invasions=[LaneInvasion(3, "solid", 1), LaneInvasion(15, "solid", 1)])
    parts, whole = weather_metrics(log, straight_map()), metrics(log)
    assert list(parts) == ["clear-noon", "rain-night"]
    assert [p.samples for p in parts.values()] == [12, 8]
    for name in ("samples", "lane_invasions", "fn", "contacts", "fatal_collisions"):
        assert sum(getattr(p, name) for p in parts.values()) == getattr(whole, name)
    assert sum(p.distance_km or 0.0 for p in parts.values()) == pytest.approx(whole.distance_km)


@pytest.mark.req("A-251")
def test_an_empty_log_has_complete_metrics() -> None:
    assert metrics(drive(0, lambda _k: [{}])).samples == 0
    assert weather_metrics(drive(0, lambda _k: [{}]), straight_map()) == {}


@pytest.mark.req("A-260")
def test_a_stored_run_has_the_metrics_of_the_drive(tmp_path: Path) -> None:
    log = crash(hit(), seen_from=5)
    write_log(tmp_path, log)
    assert metrics(read_log(tmp_path)) == metrics(log)
    assert find_crashes(prepare(read_log(tmp_path), straight_map())) == find_crashes(
        prepare(log, straight_map())
    )


@settings(max_examples=examples(20))
@given(st.floats(0.0, 6.28), st.floats(-500.0, 500.0))
def test_metrics_do_not_depend_on_where_the_world_lies(angle: float, shift: float) -> None:
    base, road_map = follow(gap=20.0, v=25.0, v_lead=15.0, n=11), straight_map()
    turned, moved_map = turn(base, angle, shift), straight_map()
    c, s = math.cos(angle), math.sin(angle)
    x, y = moved_map.samples.x.copy(), moved_map.samples.y.copy()
    moved_map.samples = moved_map.samples._replace(
        x=c * x - s * y + shift, y=s * x + c * y, heading=moved_map.samples.heading + angle
    )
    a, b = run_metrics(base, road_map), run_metrics(turned, moved_map)
    for field in dataclasses.fields(a):
        before, after = getattr(a, field.name), getattr(b, field.name)
        if before is None:
            assert after is None, field.name
        else:
            assert after == pytest.approx(before, rel=1e-3, abs=2e-3), field.name


def turn(log: RunLog, angle: float, shift: float) -> RunLog:
    a, c, s = log.actors, math.cos(angle), math.sin(angle)
    f = np.float32
    return dataclasses.replace(
        log,
        actors=a._replace(
            x=f(c * a.x - s * a.y + shift),
            y=f(s * a.x + c * a.y),
            yaw=f(a.yaw + angle),
            vx=f(c * a.vx - s * a.vy),
            vy=f(s * a.vx + c * a.vy),
        ),
    )


@given(st.floats(0.0, 6.28), st.floats(-1.7, 1.7))
def test_matching_on_a_ring_gives_arc_length_and_offset(angle: float, left: float) -> None:
    index = LaneIndex(ring_map().samples, ring_map().lanes)
    r = 100.0 - left  # the centre lies on the left
    m = index.match(*(np.array([v]) for v in (r * math.cos(angle), r * math.sin(angle), 0.0)))
    assert m.lane[0] == 0
    assert m.offset[0] == pytest.approx(left, abs=0.01)
    apart = abs(m.s[0] - 100.0 * angle) % (200.0 * math.pi)
    assert min(apart, 200.0 * math.pi - apart) < 0.05


@settings(max_examples=examples(30))
@given(st.floats(-30.0, 1030.0), st.floats(-30.0, 30.0))
def test_matching_agrees_with_shapely(x: float, y: float) -> None:
    road_map = straight_map()
    index = LaneIndex(road_map.samples, road_map.lanes)
    m = index.match(np.array([x]), np.array([y]), np.array([0.0]))
    lanes = [
        shapely.LineString([(0, 0), (200, 0)]),
        shapely.LineString([(0, 3.5), (200, 3.5)]),
        shapely.LineString([(200, 0), (1000, 0)]),
        shapely.LineString([(200, 3.5), (1000, 3.5)]),
    ]
    distances = [lane.distance(shapely.Point(x, y)) for lane in lanes]
    if min(distances) >= 20.0:
        assert m.lane[0] == -1
    else:
        assert distances[m.lane[0]] == pytest.approx(min(distances), abs=1e-9)
        assert m.s[0] == pytest.approx(lanes[m.lane[0]].project(shapely.Point(x, y)), abs=1e-9)
