"""How a crash came about, told from the log: true gaps to the vehicle that was hit, in order of time."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from skidpad.core.states import ContactEvent, StackReport
from skidpad.core.vocabulary import (
    ActorKind,
    DetectionStatus,
    RelocationReason,
    Supervision,
    Tier,
)
from skidpad.evidence.drive.collisions import Crash, CrashKind, find_crashes
from skidpad.evidence.drive.prepared import Drive, prepare
from skidpad.evidence.drive.story import Arrival, Story, tell_story
from skidpad.recording.run.events import Relocation
from skidpad.recording.run.log import RunLog
from support.makelog import DT, actor_table, drive, pose
from support.makemap import WIDTH, straight_map

HIT = 100  # tick of the contact
V, LENGTH = 20.0, 4.0
RADAR = StackReport(
    status=DetectionStatus.RADAR_ACTIVE, tier=Tier.ACC_CLOSE, detected=True, distance=11.9
)
NOTHING = StackReport(status=DetectionStatus.NO_TARGET, tier=Tier.CRUISE, detected=False)
Rows = Callable[[int], list[dict[str, float]]]


def car(x: float, y: float = 0.0, v: float = V) -> dict[str, float]:
    return {"x": x, "y": y, "vx": v}


def ego(k: int) -> dict[str, float]:
    return car(50.0 + V * k * DT)


def ahead(k: int, gap: float, y: float = 0.0) -> dict[str, float]:
    return car(50.0 + V * k * DT + LENGTH + gap, y)


def crashed(
    rows: Rows,
    report: Callable[[int], StackReport | None] = lambda _k: NOTHING,
    actor: int = 1,
    relocations: tuple[Relocation, ...] = (),
    static: str = "",
) -> RunLog:
    """A drive whose contact at HIT begins a recovery of 3 s."""

    def supervision(k: int) -> Supervision:
        return Supervision.BRAKE if HIT < k <= HIT + 60 else Supervision.NONE

    def extra(log, k: int) -> None:
        for moved in relocations:
            if moved.tick == k:
                log.relocated(moved)

    contact = ContactEvent(HIT, actor, static, 900.0, 5.0, 0.0, 0.0)
    log = drive(
        HIT + 80,
        rows,
        report=report,
        supervision=supervision,
        contacts=[contact],
        extra=extra,
        table=actor_table(len(rows(0))),
    )
    log.applied.brake[:] = 0.0
    return log


def told(log: RunLog) -> Story:
    found: Drive = prepare(log, straight_map())
    (crash,) = find_crashes(found)
    return tell_story(found, crash)


def cut_in(k: int) -> list[dict[str, float]]:
    """car 1 leads 64.8 m ahead; car 2 comes from the left lane 0.1 s before the contact."""
    return [ego(k), ahead(k, 64.8), ahead(k, 3.7, 0.0 if k >= HIT - 2 else WIDTH)]


def test_a_vehicle_that_cuts_in_is_named_with_its_gap_and_time() -> None:
    s = told(crashed(cut_in, actor=2))
    assert s.arrival is Arrival.CUT_IN
    assert s.came_just_before
    assert s.arrived is not None
    assert (s.arrived.before, s.arrived.gap) == (pytest.approx(0.1), pytest.approx(3.7, abs=1e-3))


def test_the_true_gap_is_to_the_lead_until_the_vehicle_that_was_hit_is_ahead() -> None:
    hard = dataclasses.replace(RADAR, tier=Tier.HARD_STOP)
    s = told(crashed(cut_in, lambda k: hard if k >= HIT - 10 else NOTHING, actor=2))
    assert s.worst is not None
    assert (s.worst.distance, s.worst.to) == (11.9, "car 1")
    assert s.worst.gap == pytest.approx(64.8, abs=1e-3)
    assert s.worst.is_wrong
    last = told(crashed(cut_in, lambda k: RADAR if k >= HIT - 2 else NOTHING, actor=2)).news[-1]
    assert (last.to, last.is_wrong) == ("car 2", True)
    assert last.gap == pytest.approx(3.7, abs=1e-3)


def test_the_gap_is_that_of_the_vehicle_that_was_hit_when_another_one_is_the_lead() -> None:
    """A car half out of the lane is hit; the lane's own vehicle stands further ahead."""

    def rows(k: int) -> list[dict[str, float]]:
        gap = max(8.3 + 5.0 * (HIT - 20 - k) * DT, 0.0)
        return [ego(k), ahead(k, 20.9), ahead(k, gap, y=1.9)]

    def report(k: int) -> StackReport:
        measured = max(8.3 + 5.0 * (HIT - 20 - k) * DT, 0.1)
        return dataclasses.replace(RADAR, distance=measured) if k >= HIT - 20 else NOTHING

    first = told(crashed(rows, report, actor=2)).news[-1]
    assert (first.before, first.to) == (pytest.approx(1.0), "car 2")
    assert first.gap == pytest.approx(8.3, abs=0.01)
    assert not first.is_wrong


@pytest.mark.parametrize(
    ("gap", "measured", "is_wrong"),
    [(10.0, 12.9, False), (10.0, 13.1, True), (60.0, 71.9, False), (60.0, 72.1, True)],
)
def test_measured_and_true_agree_within_3_m_or_a_fifth(
    gap: float, measured: float, is_wrong: bool
) -> None:
    report = dataclasses.replace(RADAR, distance=measured)
    s = told(crashed(lambda k: [ego(k), ahead(k, gap)], lambda _k: report))
    assert s.news[-1].is_wrong is is_wrong
    assert (s.worst is not None) is is_wrong


def test_a_distance_to_nothing_is_wrong_and_matters_when_the_stack_braked_hard_for_it() -> None:
    rows: Rows = lambda k: [ego(k), car(50.0 + V * k * DT - 8.0)]  # noqa: E731
    soft = told(crashed(rows, lambda _k: RADAR))
    assert soft.news[-1].is_wrong
    assert (soft.news[-1].gap, soft.worst) == (None, None)
    hard = told(crashed(rows, lambda _k: dataclasses.replace(RADAR, tier=Tier.EMERGENCY)))
    assert hard.worst is not None
    assert (hard.worst.distance, hard.worst.gap) == (11.9, None)


@pytest.mark.parametrize(("measured", "is_wrong"), [(78.9, False), (80.0 - LENGTH - 1.0, True)])
def test_a_report_beyond_what_the_truth_looks_at_is_not_wrong(
    measured: float, is_wrong: bool
) -> None:
    """Leads are sought within 80 m from centre to centre: a gap of 79 m may well be right."""
    rows: Rows = lambda k: [ego(k), car(50.0 + V * k * DT - 8.0)]  # noqa: E731
    far = dataclasses.replace(RADAR, distance=measured)
    assert told(crashed(rows, lambda _k: far)).news[-1].is_wrong is is_wrong


def test_a_lead_that_leaves_uncovers_the_vehicle_that_is_hit() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        return [ego(k), ahead(k, 30.0), ahead(k, 10.0, 0.0 if k < HIT - 30 else WIDTH)]

    s = told(crashed(rows))
    assert s.arrival is Arrival.UNCOVERED
    assert s.arrived is not None
    assert s.arrived.before == pytest.approx(1.5)


def test_a_change_of_lanes_brings_the_ego_behind_the_vehicle() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        y = min(max((HIT - 20 - k) * speed * DT, 0.0), WIDTH)
        v = -speed if 0.0 < y < WIDTH else 0.0
        return [{**ego(k), "y": y, "vy": v}, ahead(k, 10.0)]

    speed = 1.5
    s = told(crashed(rows))
    assert s.arrival is Arrival.EGO_CAME
    assert s.arrived is not None
    assert 1.0 < s.arrived.before < 2.6


def test_an_ego_that_was_put_behind_a_vehicle_is_told() -> None:
    moved = Relocation(HIT - 40, RelocationReason.STUCK, 0.0, pose(1.0), pose(2.0))
    log = crashed(lambda k: [ego(k), ahead(k, 12.0)], relocations=(moved,))
    s = told(log)
    assert s.arrival is Arrival.EGO_PUT
    assert s.arrived is not None
    assert s.arrived.before == pytest.approx(39 * DT)


def test_a_stack_that_says_nothing_has_a_story_without_news() -> None:
    s = told(crashed(lambda k: [ego(k), ahead(k, 12.0)], lambda _k: None))
    assert (s.news, s.first, s.worst) == ((), None, None)
    assert s.arrived is not None


def test_what_was_always_ahead_did_not_come() -> None:
    s = told(crashed(lambda k: [ego(k), ahead(k, 12.0)]))
    assert (s.arrival, s.came_just_before) == (Arrival.DRIVEN_UP, False)


def test_a_pedestrian_who_crosses_is_ahead_only_while_in_the_way() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        return [ego(k), {"x": 50.0 + V * HIT * DT + 3.0, "y": -0.1 * (HIT - k)}]

    log = crashed(rows)
    log.table.kind[1] = ActorKind.PEDESTRIAN
    s = told(log)
    assert s.crash.lead_since is None
    assert s.arrived is not None
    assert s.arrived.before == pytest.approx(19 * DT)  # 2 m of reach at 0.1 m per tick


def test_a_lane_that_is_lost_for_half_a_second_does_not_begin_anew() -> None:
    def rows(k: int) -> list[dict[str, float]]:
        lost = HIT - 30 <= k < HIT - 30 + missing
        return [ego(k), ahead(k, 50.0, WIDTH if lost else 0.0)]

    missing = 9
    assert told(crashed(rows)).arrival is Arrival.DRIVEN_UP
    missing = 12
    s = told(crashed(rows))
    assert s.arrived is not None
    assert s.arrived.before == pytest.approx(18 * DT)


def test_the_ego_braked_since_the_pedal_was_last_free() -> None:
    log = crashed(lambda k: [ego(k), ahead(k, 12.0)])
    log.applied.brake[HIT - 30 : HIT - 25] = 0.5
    log.applied.brake[HIT - 20 :] = 0.5
    s = told(log)
    assert s.braked is not None
    assert (s.braked.before, s.braked.v) == (pytest.approx(1.0), pytest.approx(V))
    log.applied.brake[HIT - 1] = 0.0
    assert told(log).braked is None


def test_a_vehicle_that_slowed_is_told_with_its_speed_before() -> None:
    log = crashed(lambda k: [ego(k), ahead(k, 12.0)])
    log.actors.vx[HIT - 40 :, 1] = np.float32(14.0)
    s = told(log)
    assert s.slowed is not None
    assert (s.slowed.before, s.slowed.v) == (pytest.approx(41 * DT), pytest.approx(V))
    log.actors.vx[HIT - 40 :, 1] = np.float32(15.5)
    assert told(log).slowed is None


def test_flicker_is_left_out_and_a_hard_stop_is_not() -> None:
    def report(k: int) -> StackReport:
        return dataclasses.replace(RADAR, tier=tier) if k in (60, 61) else NOTHING

    tier = Tier.ACC_CLOSE
    log = crashed(lambda k: [ego(k), car(900.0)], report, actor=-1, static="guardrail")
    assert len(told(log).news) == 2  # before and after it, the same words
    tier = Tier.HARD_STOP
    log = crashed(lambda k: [ego(k), car(900.0)], report, actor=-1, static="guardrail")
    assert [s.tier for s in told(log).news] == [Tier.CRUISE, Tier.HARD_STOP, Tier.CRUISE]


def test_a_touch_before_a_departure_is_told_and_what_followed_it() -> None:
    put = Relocation(HIT + 55, RelocationReason.COLLISION, 0.0, pose(1.0), pose(2.0))
    log = crashed(
        lambda k: [ego(k), ahead(k, 0.5)], actor=-1, static="guardrail", relocations=(put,)
    )
    more = (
        ContactEvent(HIT - 20, 1, "", 5.0, 1.0, 0.0, 0.0),
        ContactEvent(HIT + 10, 1, "", 5.0, 1.0, 0.0, 0.0),
        ContactEvent(HIT + 75, 1, "", 5.0, 1.0, 0.0, 0.0),
    )
    log = dataclasses.replace(log, events=tuple(sorted((*log.events, *more), key=lambda e: e.tick)))
    found = prepare(log, straight_map())
    crash: Crash = find_crashes(found)[0]
    assert crash.kind is CrashKind.STATIC
    s = tell_story(found, crash)
    assert s.pushed_by is not None
    assert (s.pushed_by.before, s.pusher) == (pytest.approx(1.0), "car 1")
    assert [round(after, 2) for after, _ in s.others] == [0.5]
    assert s.put_back == pytest.approx(55 * DT)
