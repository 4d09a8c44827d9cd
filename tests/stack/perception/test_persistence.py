"""Detection status and its memory, tick by tick."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.settings.stack import RadarCloseCheck
from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.stack.adas import AdasStack
from support.stack_parts import NO_RADAR, MedianFilter, Persistence, RadarReading
from support.stackfakes import SPECS, ArcMap, Car, ego_at, frame

approx = pytest.approx
NO, SEEN, HELD, RADAR, SAFE = (
    DetectionStatus.NO_TARGET,
    DetectionStatus.FUSION_DETECT,
    DetectionStatus.FUSION_PERSIST,
    DetectionStatus.RADAR_ACTIVE,
    DetectionStatus.SAFETY_PERSIST,
)


def persistence(dt=0.05, gate=60.0, check=RadarCloseCheck.BUMPER, safety=False, rejected=False):
    return Persistence(
        dt, detection_gate=gate, radar_close_check=check, safety_persist=safety,
        rejected_stays_active=rejected,
    )  # fmt: skip


def at(distance, lane=True):
    return RadarReading(distance, distance if lane else None, -3.0, 1)


def play(p, fused, radar=NO_RADAR, acc=False, stopping=False, bumper=None):
    """Detections of some ticks; fused: one value per tick."""
    rows = []
    for distance in fused:
        detection = p.update(distance, bumper, radar)
        p.conclude(detection.distance is not None, acc, stopping)
        rows.append(detection)
    return rows


def statuses(rows):
    return [row.status for row in rows]


def held_ticks(p, seen, missing, **options):
    play(p, [30.0] * seen, **options)
    return statuses(play(p, [None] * missing, **options)).count(HELD)


@pytest.mark.req("A-085", "A-086")
def test_status_words():
    assert {s.name for s in DetectionStatus} == {
        "NO_TARGET", "FUSION_DETECT", "FUSION_PERSIST", "RADAR_ACTIVE", "SAFETY_PERSIST",
    }  # fmt: skip
    assert persistence().update(None, None, NO_RADAR) == (NO, None)


@pytest.mark.req("A-087", "A-088")
def test_vision_counts_from_the_second_tick():
    p = persistence()
    assert play(p, [30.0, 29.0, 28.0]) == [(NO, None), (SEEN, 29.0), (SEEN, 28.0)]
    slow = persistence(dt=0.1)  # 0.1 s is longer than 0.067 s
    assert play(slow, [30.0]) == [(SEEN, 30.0)]
    fast = persistence(dt=0.01)
    assert statuses(play(fast, [30.0] * 8)) == [NO] * 6 + [SEEN] * 2


@pytest.mark.req("A-063")
def test_only_below_60_m_vision_detects():
    assert statuses(play(persistence(), [59.9] * 2)) == [NO, SEEN]
    assert statuses(play(persistence(), [60.0] * 2)) == [NO, NO]
    assert statuses(play(persistence(gate=70.0), [69.0] * 2)) == [NO, SEEN]


@pytest.mark.req("A-089")
def test_radar_bridges_until_vision_is_confirmed():
    assert play(persistence(), [30.0, 29.0], at(31.0)) == [(RADAR, 31.0), (SEEN, 29.0)]
    assert play(persistence(), [30.0], at(31.0, lane=False)) == [(NO, None)]


@pytest.mark.req("A-090", "A-091", "A-092", "A-100")
def test_windows_of_3_20_and_30_ticks():
    assert held_ticks(persistence(), 5, 40) == 3
    assert held_ticks(persistence(), 5, 40, acc=True) == 20
    assert held_ticks(persistence(), 5, 40, acc=True, stopping=True) == 30
    assert held_ticks(persistence(), 5, 40, stopping=True) == 30


@pytest.mark.req("A-092", "A-096")
def test_held_distance_is_the_last_one():
    p = persistence()
    play(p, [30.0, 29.0, 28.5])
    assert play(p, [None] * 4) == [(HELD, 28.5)] * 3 + [(NO, None)]


@pytest.mark.req("A-092", "A-093")
def test_an_unconfirmed_sight_is_not_held():
    p = persistence()
    assert statuses(play(p, [30.0, None, 30.0, 30.0])) == [NO, NO, NO, SEEN]


@pytest.mark.req("A-087", "A-088")
def test_sight_accumulates_over_gaps_within_the_window():
    """Cumulative, as listed (D-022): a held gap does not start confirmation anew."""
    p = persistence()
    play(p, [30.0] * 2)
    assert statuses(play(p, [None, 30.0, None, None, 30.0])) == [HELD, SEEN, HELD, HELD, SEEN]


@pytest.mark.req("A-093")
def test_after_the_window_confirmation_starts_anew():
    p = persistence()
    play(p, [30.0] * 5)
    assert statuses(play(p, [None] * 4 + [30.0, 30.0])) == [HELD] * 3 + [NO, NO, SEEN]


@pytest.mark.req("A-094")
@pytest.mark.parametrize(
    ("radar", "bumper", "status"),
    [
        (22.1, None, RADAR),
        (21.9, None, NO),
        (21.9, 21.9, RADAR),
        (21.9, 22.1, NO),
        (5.0, 4.0, RADAR),
    ],
)
def test_a_near_radar_target_needs_the_bumper(radar, bumper, status):
    p = persistence()
    play(p, [None])
    assert p.update(None, bumper, at(radar)).status is status
    assert p.missed_ticks == (0 if bumper is not None and status is RADAR else 2)
    lax = persistence(check=RadarCloseCheck.NOTHING)
    assert lax.update(None, None, at(radar)) == (RADAR, radar)


@pytest.mark.req("A-095")
def test_safety_persist_holds_a_near_lead_for_5_s():
    def run(distance, acc=True, safety=True):
        p = persistence(safety=safety)
        play(p, [distance] * 5, acc=acc)
        return statuses(play(p, [None] * 120, acc=acc))

    # 20 ticks of persistence, then safety until 5.0 s: ticks 21 to 99
    near = run(29.9)
    assert near == [HELD] * 20 + [SAFE] * 79 + [NO] * 21
    assert SAFE not in run(30.1)
    assert SAFE not in run(29.9, acc=False)
    assert SAFE not in run(29.9, safety=False)


@pytest.mark.req("A-096")
def test_last_distance_takes_any_detection_below_80_m():
    p = persistence()
    play(p, [None], at(79.9))
    assert p.last_distance == 79.9
    play(p, [None], at(80.1))
    assert p.last_distance == 79.9
    play(p, [None], at(25.0))
    assert p.last_distance == 25.0


@pytest.mark.req("A-097")
def test_following_is_remembered_for_5_s():
    p = persistence()
    play(p, [30.0] * 3, acc=False)
    assert not p.was_following
    play(p, [30.0], acc=True)
    assert p.was_following
    play(p, [None] * 100)
    assert p.was_following
    play(p, [None])
    assert not p.was_following


@pytest.mark.req("A-098")
def test_stopping_is_that_of_the_last_tick():
    p = persistence()
    play(p, [30.0] * 3, stopping=True)
    play(p, [30.0])
    assert held_ticks(p, 0, 40) == 3


@pytest.mark.req("A-099", "A-002")
def test_the_pace_of_the_machine_changes_nothing():
    def run(pause):
        p = persistence()
        rows = []
        for fused in [30.0, 30.0, None, None, None, None, 30.0]:
            time.sleep(pause)
            rows += play(p, [fused])
        return rows

    assert run(0.0) == run(0.06)


@given(
    st.lists(st.one_of(st.none(), st.floats(1.0, 99.0)), max_size=60),
    st.booleans(),
    st.booleans(),
)
def test_a_detection_always_has_a_distance_and_no_target_never(fused, acc, safety):
    rows = play(persistence(safety=safety), fused, at(40.0, lane=acc), acc=acc)
    for row in rows:
        assert (row.status is NO) is (row.distance is None)


def chain(fused):
    """Median and persistence together, as the stack joins them."""
    median, p = MedianFilter(), persistence()
    return statuses(play(p, [median.update(d) for d in fused], acc=True))


@pytest.mark.req("A-101")
def test_chain_delays_detection_and_loss_by_three_ticks():
    parts = statuses(play(persistence(), [30.0] * 3))
    assert parts.index(SEEN) == 1
    joined = chain([30.0] * 10 + [None] * 40)
    assert joined.index(SEEN) == 3, "the third sample turns the median, the fourth tick confirms"
    assert joined.index(HELD) - 10 == 2, "it is lost when the third sample is missing"
    assert joined.count(HELD) == 20


@pytest.mark.req("A-101", "A-102")
@pytest.mark.parametrize("length", [1, 2])
@pytest.mark.parametrize("level", ["pixels", "objects"])
def test_a_phantom_of_one_or_two_ticks_never_reaches_the_controller(length, level):
    stack = AdasStack(SPECS, ArcMap(), {"configuration": 2})
    for k in range(12):
        cars = [Car(4.0)] if 5 <= k < 5 + length else []
        stack.tick(frame(k, cars, ego_at(v=20.0), level=level))
        assert stack.report.tier is Tier.CRUISE
        assert not stack.report.detected
    assert stack.memory["seen_ticks"] == 0


@pytest.mark.req("A-088", "A-091", "A-095", "A-097", "A-100")
def test_durations_in_milliseconds():
    """With a step of 1 ms no rounding to ticks hides a wrong duration."""

    def rows(seen, missing, safety=False, **options):
        p = persistence(dt=0.001, safety=safety)
        return p, statuses(play(p, [25.0] * seen + [None] * missing, **options))

    assert rows(100, 0)[1].index(SEEN) == 66
    assert rows(100, 400)[1].count(HELD) == 170
    assert rows(100, 1400, acc=True)[1].count(HELD) == 1000
    assert rows(100, 1900, stopping=True)[1].count(HELD) == 1500
    assert rows(100, 5600, safety=True, acc=True)[1].count(SAFE) == 3999
    for missing, remembered in ((5000, True), (5001, False)):
        assert rows(100, missing, acc=True)[0].was_following is remembered
