"""Each constant of the metrics, from both sides: a tenth more or less must change a result."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest

from skidpad.core.states import ContactEvent, LaneInvasion, StackReport
from skidpad.core.vocabulary import DetectionStatus, Supervision, Tier
from skidpad.evidence.drive.collisions import Crash, find_crashes
from skidpad.evidence.drive.metrics import count_invasions, run_metrics
from skidpad.evidence.drive.prepared import prepare
from skidpad.recording.campaign.matrix import Metrics
from support.makelog import DT, drive
from support.makemap import ring_map, straight_map

SEEN = StackReport(
    status=DetectionStatus.FUSION_DETECT, tier=Tier.ACC_HOLD, detected=True, distance=10.0
)
UNSEEN = StackReport(status=DetectionStatus.NO_TARGET, tier=Tier.CRUISE, detected=False)


def one_tick(v: float = 20.0, centre: float = 34.0, y: float = 0.0, **report: Any) -> Metrics:
    log = drive(
        1,
        lambda _k: [{"x": 50.0, "y": y, "vx": v}, {"x": 50.0 + centre, "vx": v}],
        report=lambda _k: dataclasses.replace(SEEN, **report),
    )
    return run_metrics(log, straight_map())


@pytest.mark.req("A-232")
def test_the_ego_is_faster_than_1_m_per_s() -> None:
    assert one_tick(v=1.04).min_ttc_s is not None
    assert one_tick(v=0.96).min_ttc_s is None


@pytest.mark.req("A-232")
def test_closing_is_faster_than_half_a_metre_per_second() -> None:
    assert one_tick(radar_velocity=-0.52).min_ttc_s is not None
    assert one_tick(radar_velocity=-0.48).min_ttc_s is None


@pytest.mark.req("A-232")
def test_ttc_is_below_30_s() -> None:
    assert one_tick(distance=29.0, radar_velocity=-1.0).min_ttc_s == 29.0
    assert one_tick(distance=31.0, radar_velocity=-1.0).min_ttc_s is None


@pytest.mark.req("A-234")
def test_critical_is_below_one_and_a_half_seconds() -> None:
    assert one_tick(distance=1.45, radar_velocity=-1.0).ttc_critical_count == 1
    assert one_tick(distance=1.55, radar_velocity=-1.0).ttc_critical_count == 0


@pytest.mark.req("A-254")
def test_the_gate_is_at_10_km_per_h() -> None:
    assert one_tick(v=10.4 / 3.6).min_ttc_above_10_kmh_s is not None
    assert one_tick(v=9.6 / 3.6).min_ttc_above_10_kmh_s is None


@pytest.mark.req("A-237")
def test_a_vehicle_is_present_from_2_to_80_m() -> None:
    assert [one_tick(centre=d).fn for d in (1.95, 2.05, 79.0, 81.0)] == [0, 1, 1, 0]


@pytest.mark.req("A-240")
@pytest.mark.parametrize(
    ("measured", "counts"),
    [(0.1, False), (0.1001, True), (98.999, True), (99.0, False), (99.001, False)],
)
def test_errors_are_of_distances_from_a_tenth_to_99_m(measured: float, counts: bool) -> None:
    assert (one_tick(distance=measured).mean_error_m is not None) == counts


@pytest.mark.req("A-245")
def test_lateral_offset_counts_above_5_km_per_h() -> None:
    assert one_tick(v=5.2 / 3.6, y=0.4).lateral_max_m == pytest.approx(0.4)
    assert one_tick(v=4.8 / 3.6, y=0.4).lateral_max_m is None


@pytest.mark.req("A-031")
@pytest.mark.parametrize(("gap", "changes"), [(11.5, 1), (12.5, 2)])
def test_lane_changes_are_12_s_apart(gap: float, changes: int) -> None:
    marks = [LaneInvasion(0, "broken", 1), LaneInvasion(round(gap / DT), "broken", 1)]
    assert count_invasions(marks, frozenset(), DT).lane_changes == changes


def leave_road(radius: float = 90.0, lead_until: int = -1, lag: int = 1) -> Crash:
    """Contact with a guardrail at tick 100; a lead that vanishes after `lead_until`."""

    def rows(k: int) -> list[dict[str, float]]:
        a = 10.0 * k * DT / radius
        spots = [a, a + 20.0 / radius if k <= lead_until else a + math.pi]
        return [
            {"x": radius * math.cos(b), "y": radius * math.sin(b), "yaw": b + math.pi / 2}
            for b in spots
        ]

    log = drive(
        130,
        rows,
        contacts=[ContactEvent(100, -1, "guardrail", 1.0, 1.0, 0.0, 0.0)],
        supervision=lambda k: Supervision.BRAKE if k >= 100 + lag else Supervision.NONE,
    )
    (crash,) = find_crashes(prepare(log, ring_map(radius)))
    return crash


def test_a_bend_is_tighter_than_250_m() -> None:
    assert leave_road(240.0).bend_exit
    assert not leave_road(260.0).bend_exit


def test_a_lead_in_the_last_2_s_makes_it_no_bend_exit() -> None:
    assert not leave_road(lead_until=62).bend_exit
    assert leave_road(lead_until=58).bend_exit


@pytest.mark.req("A-189", "A-190")
def test_a_contact_starts_a_recovery_within_a_quarter_second() -> None:
    assert leave_road(lag=5).other == "guardrail"
    assert leave_road(lag=6).other == "something"


@pytest.mark.parametrize(("angle", "behind"), [(118.0, False), (122.0, True)])
def test_behind_is_within_60_degrees_of_straight_back(angle: float, behind: bool) -> None:
    away = math.radians(angle)

    def rows(_k: int) -> list[dict[str, float]]:
        c, s = math.cos(away), math.sin(away)
        return [{"x": 50.0}, {"x": 50.0 + 12 * c, "y": 12 * s, "vx": -9 * c, "vy": -9 * s}]

    log = drive(
        9,
        rows,
        contacts=[ContactEvent(4, 1, "", 1.0, 1.0, 0.0, 0.0)],
        supervision=lambda k: Supervision.BRAKE if k > 4 else Supervision.NONE,
    )
    assert find_crashes(prepare(log, straight_map()))[0].rear_ended == behind


def test_the_history_of_a_crash_is_10_s_long() -> None:
    log = drive(
        300,
        lambda _k: [{"x": 50.0}, {"x": 80.0}],
        report=lambda _k: UNSEEN,
        contacts=[ContactEvent(280, 1, "", 1.0, 1.0, 0.0, 0.0)],
        supervision=lambda k: Supervision.BRAKE if k > 280 else Supervision.NONE,
    )
    assert find_crashes(prepare(log, straight_map()))[0].unseen == pytest.approx(10.0, abs=0.06)
