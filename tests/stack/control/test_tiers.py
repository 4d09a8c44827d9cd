"""The tiers row by row, with the values that the requirements print."""

from __future__ import annotations

import pytest

from skidpad.core.settings.stack import StackSettings
from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.stack.configurations import functions_of
from skidpad.stack.control.pid import DISTANCE_GAINS, SPEED_GAINS
from skidpad.stack.control.steering import lookahead_distance, steer_command, steering_gain
from skidpad.stack.timing import ticks_to_reach, ticks_within
from support.stack_parts import Hierarchy, Lead, Pid, situation_of, time_gap, zones

approx = pytest.approx


def situation(v_kmh, distance=None, stop=None, confirmed=True, cap=1e9):
    v = v_kmh / 3.6
    lead = None if distance is None else Lead(distance, time_gap(distance, v), confirmed)
    return situation_of(v, v_kmh, lead, stop, 150.0, cap)


def decide(s, configuration=4):
    return Hierarchy(functions_of(configuration), StackSettings(), 0.05).decide(s)


@pytest.mark.req("A-111", "A-113", "A-114", "A-119", "A-123", "A-130", "A-135", "A-137", "A-138")
@pytest.mark.parametrize(
    ("s", "tier", "throttle", "brake", "handbrake"),
    [
        (situation(10.1, 4.9), Tier.HARD_STOP, 0.0, 1.0, False),
        (situation(10.0, 4.9), Tier.STOPPED_TOO_CLOSE, 0.0, 1.0, False),
        (situation(36.0, 5.0), Tier.EMERGENCY, 0.0, 1.0, False),
        (situation(36.0, 7.4), Tier.EMERGENCY, 0.0, 0.92, False),
        (situation(2.0, 6.0, stop=1.9), Tier.STOPPED_BEHIND_CAR, 0.0, 1.0, True),
        (situation(4.0, 6.0, stop=1.9), Tier.STOPPED_BEHIND_CAR, 0.0, 1.0, False),
        (situation(72.0, 50.0, stop=12.8), Tier.APPROACH, 0.0, 1.0, False),
        (situation(18.0, 50.0, stop=45.0), Tier.APPROACH, 0.2, 0.0, False),
        (situation(36.0, 25.0), Tier.ACC_HOLD, 0.15, 0.0, False),
        (situation(36.0, 25.0, cap=30.0), Tier.ACC_HOLD, 0.0, 0.0, False),
        (situation(2.0, stop=0.4), Tier.HOLDING_AT_LINE, 0.0, 1.0, True),
        (situation(3.6, stop=0.5), Tier.LIGHT_STOP, 0.0, 0.2, False),
        (situation(3.6, stop=1.1), Tier.LIGHT_STOP, 0.15, 0.0, False),
        (situation(43.0, stop=48.0), Tier.LIGHT_STOP, 0.35, 0.0, False),
        (situation(60.0), Tier.CRUISE, 1.0, 0.0, False),
        (situation(250.0), Tier.CRUISE, 0.0, 0.2, False),
    ],
)
def test_first_tier_wins(s, tier, throttle, brake, handbrake):
    request = decide(s)
    assert (request.tier, request.handbrake) == (tier, handbrake)
    assert (request.throttle, request.brake) == approx((throttle, brake))


@pytest.mark.req("A-124", "A-125", "A-126", "A-127", "A-128")
@pytest.mark.parametrize(
    ("gap", "throttle", "brake"),
    [
        (2.5, 0.15, 0.0), (2.65, 0.30, 0.0), (2.35, 0.0, 0.10), (2.8, 0.48, 0.0),
        (4.0, 0.8, 0.0), (4.9, 0.8, 0.0), (2.2, 0.0, 0.29), (1.5, 0.0, 0.5), (1.0, 0.0, 0.5),
    ],
)  # fmt: skip
def test_zones(gap, throttle, brake):
    request = zones(gap)
    assert (request.throttle, request.brake) == approx((throttle, brake))


@pytest.mark.req("A-117", "A-118", "A-140")
def test_emergency_brake_values_and_configuration_zero():
    at = [
        decide(situation_of(10.0, 36.0, Lead(20.0, g, True), None, 150.0, 1e9))
        for g in (0.7499, 0.7)
    ]
    assert [r.brake for r in at] == approx([0.9002, 1.0])
    assert decide(situation(36.0, 5.5), configuration=0).tier is Tier.CRUISE


@pytest.mark.req("A-134", "A-136")
def test_coasts_twenty_ticks_after_following():
    h = Hierarchy(functions_of(2), StackSettings(), 0.05)
    h.decide(situation(36.0, 25.0))
    tiers = [h.decide(situation(36.0)).tier for _ in range(22)]
    assert tiers == [Tier.COAST] * 20 + [Tier.CRUISE] * 2


@pytest.mark.req("A-100")
def test_nominal_tick_counts():
    assert ticks_to_reach(0.067, 0.05) == 2
    assert [ticks_within(t, 0.05) for t in (0.17, 1.0, 1.5)] == [3, 20, 30]
    assert ticks_to_reach(15.0, 0.05) == 300


@pytest.mark.req("A-103", "A-104", "A-106", "A-107", "A-108")
def test_pid_by_hand():
    pid = Pid(SPEED_GAINS, 0.05)
    assert pid.update(0.1) == approx(0.4 * 0.1 + 0.0132 * 0.005 + 0.225 * 2.0)
    for _ in range(1000):
        pid.update(100.0)
    assert SPEED_GAINS.ki * pid.integral == approx(0.66)
    assert pid.update(100.0) == 1.0
    pid.reset()
    assert (pid.previous, pid.integral) == (0.0, 0.0)
    assert Pid(DISTANCE_GAINS, 0.05).update(0.02) == approx(0.004 + 0.000005 + 0.48)


def test_numbers_of_tiers_and_of_detections_are_their_places():
    for words in (Tier, DetectionStatus):
        assert tuple(map(int, words)) == tuple(range(len(words)))


@pytest.mark.req("A-143", "A-144", "A-145", "A-146")
def test_steering_by_hand():
    assert [lookahead_distance(v) for v in (10, 60, 150, 200)] == approx([12.0, 24.0, 60.0, 65.0])
    assert [steering_gain(v) for v in (39, 40, 90, 150)] == approx([1.2, 1.2, 0.8, 0.35])
    assert steer_command(0.1, 90.0) == approx(0.1 * 0.8 * (1 - 0.03 / 3.14159265), rel=1e-6)
    assert steer_command(-0.1, 90.0) == -steer_command(0.1, 90.0)
