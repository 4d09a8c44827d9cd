"""Details of single tiers: holds, approaches, laws of braking, verification, texts."""

from __future__ import annotations

import re
from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.settings.parts import Settings
from skidpad.core.settings.stack import StackSettings
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import Tier
from skidpad.stack.adas import AdasConfig, AdasStack
from skidpad.stack.configurations import (
    CONFIGURATIONS,
    Function,
    functions_of,
    parse_functions,
)
from skidpad.stack.control.pid import DISTANCE_GAINS, SPEED_GAINS
from skidpad.stack.control.text import LABELS, mode_text
from support.interpreted import interpret
from support.stack_parts import (
    Hierarchy,
    Lead,
    Pid,
    Request,
    situation_of,
    time_gap,
    zones,
)
from support.stackfakes import GREEN, RED, SPECS, ArcMap, Car, ego_at, frame

approx = pytest.approx


def situation(v_kmh, distance=None, stop=None, confirmed=True, cap=1e9, cruise=150.0):
    v = v_kmh / 3.6
    lead = None if distance is None else Lead(distance, time_gap(distance, v), confirmed)
    return situation_of(v, v_kmh, lead, stop, cruise, cap)


def hierarchy(configuration=4, **settings):
    return Hierarchy(functions_of(configuration), Settings().with_values(settings).stack, 0.05)


def decide(s, configuration=4, **settings):
    return hierarchy(configuration, **settings).decide(s)


@pytest.mark.req("A-105")
def test_no_derivative_without_a_step():
    for dt in (0.0, -0.05):
        pid = Pid(SPEED_GAINS, dt)
        assert pid.update(0.5) == approx(0.4 * 0.5 + 0.0132 * 0.5 * dt)


@pytest.mark.req("A-109")
def test_pids_are_reset_by_tiers_1_and_3_only():
    for s, resets in (
        (situation(36.0, 4.0), True),
        (situation(36.0, 7.0), True),
        (situation(8.0, 4.0), False),
        (situation(36.0, 25.0), False),
        (situation(36.0, stop=30.0), False),
    ):
        h = hierarchy(light_braking="proportional")
        for pid in (h.speed_pid, h.distance_pid):
            pid.update(1.0)
        h.decide(s)
        cleared = [(p.previous, p.integral) == (0.0, 0.0) for p in (h.speed_pid, h.distance_pid)]
        assert cleared == [resets, resets]


@pytest.mark.req("A-109")
def test_entering_cruise_resets_the_distance_pid_once():
    h = hierarchy()
    h.distance_pid.update(1.0)
    h.decide(situation(100.0))
    assert h.distance_pid.integral == 0.0
    h.distance_pid.update(1.0)
    h.decide(situation(100.0))
    assert h.distance_pid.integral != 0.0


@pytest.mark.req("A-110")
def test_time_gap():
    assert time_gap(25.0, 10.0) == 2.5
    assert time_gap(25.0, 0.1) == time_gap(25.0, 0.0) == time_gap(25.0, -3.0) == approx(250.0)


@pytest.mark.req("A-112", "A-111")
@given(
    st.floats(0.0, 200.0),
    st.one_of(st.none(), st.floats(0.2, 79.0)),
    st.one_of(st.none(), st.floats(0.0, 240.0)),
    st.booleans(),
    st.integers(0, 4),
)
def test_every_tick_gives_one_clean_request(v_kmh, distance, stop, confirmed, configuration):
    """Never both pedals, never out of range, handbrake only when slow and by tiers 4 and 6."""
    h = hierarchy(configuration)
    h.decide(situation(30.0, 6.0, stop=1.0))  # something left over from the tick before
    r = h.decide(situation(v_kmh, distance, stop, confirmed))
    assert 0.0 <= r.throttle <= 1.0
    assert 0.0 <= r.brake <= 1.0
    assert r.throttle == 0.0 or r.brake == 0.0
    if r.handbrake:
        assert v_kmh < 3.0
        assert r.tier in (Tier.STOPPED_BEHIND_CAR, Tier.HOLDING_AT_LINE)
    assert r.tier is not Tier.NONE
    assert not VehicleCommand(r.throttle, r.brake, 0.0, r.handbrake).reverse


@pytest.mark.req("A-112")
def test_a_fresh_control_is_all_off():
    assert Request(Tier.CRUISE) == (Tier.CRUISE, 0.0, 0.0, False)
    assert VehicleCommand() == VehicleCommand(0.0, 0.0, 0.0, False, False)


@pytest.mark.req("A-111")
def test_unconfirmed_targets_fall_through_or_consume_the_tick():
    near, short = situation(36.0, 4.0, confirmed=False), situation(72.0, 14.0, confirmed=False)
    for s in (near, short):
        assert decide(s).tier is Tier.ACC_CLOSE
        assert decide(s, unconfirmed="consume") == Request(Tier.NONE)


def settled(cars, v_kmh, ticks=8, lights=None, map=None, x=0.0, **options):
    """A stack that has seen the same scene for some ticks, and its last command."""
    stack = AdasStack(SPECS, map or ArcMap(), {"configuration": 4, **options})
    for k in range(ticks):
        command = stack.tick(
            frame(k, cars, ego_at(x, v=v_kmh / 3.6), lights=lights or {}, level="pixels")
        )
    return stack, command


@pytest.mark.req("A-115")
@pytest.mark.parametrize(("v_kmh", "asked"), [(2.9, True), (3.1, False), (10.0, False)])
def test_creeping_asks_the_cameras(v_kmh, asked):
    stack, command = settled([Car(4.0)], v_kmh)
    assert (stack.report.tier, command.brake) == (Tier.STOPPED_TOO_CLOSE, 1.0)
    assert (command.throttle, command.handbrake) == (0.0, False)
    assert stack.verified_by == ("bumper" if asked else "")


@pytest.mark.req("A-115")
@pytest.mark.parametrize(("configuration", "detected"), [(0, True), (1, False)])
def test_only_tier_2_asks_the_cameras(configuration, detected):
    """Without it nobody drops a target: the radar sees it, the bumper but not near enough."""
    stack = AdasStack(SPECS, ArcMap(), {"configuration": configuration})
    near_radar = [(4.0, 0.0, 0.0, 0.0)]
    for k in range(2):
        stack.tick(frame(k, [Car(15.0)], ego_at(v=0.5), radar=near_radar))
    assert stack.report.radar_lane == 4.0
    assert stack.report.detected is detected
    assert stack.verified_by == ("" if detected else "none")


@pytest.mark.req("A-115", "A-139")
def test_the_source_of_a_verification_is_that_of_the_tick():
    stack, _ = settled([Car(4.0)], 2.9)
    assert stack.verified_by == "bumper"
    assert re.fullmatch(r"STOPPED TOO CLOSE \(bumper\) \d\.\d m \[LCA o(n|ff)\]", stack.mode)
    stack.tick(frame(8, [Car(4.0)], ego_at(v=5.0 / 3.6)))
    assert stack.verified_by == ""


@pytest.mark.req("A-115", "A-116")
def test_a_phantom_at_standstill_is_dropped_and_the_car_drives_on():
    """The held distance of a car that is gone: without the check the ego would stand forever."""
    stack, _ = settled([Car(4.0)], 0.0)
    for k in range(8, 14):
        command = stack.tick(frame(k, [], ego_at(0.0)))
        report = stack.report
        if k >= 10:  # the median lets go of it: it is only remembered now
            break
    assert report.status.name in ("FUSION_PERSIST", "FUSION_DETECT")
    assert not report.detected
    assert (report.distance, report.time_gap) == (None, None)
    assert report.tier is Tier.CRUISE
    assert command.throttle > 0.0
    # faster than 3 km/h nobody asks, and the remembered car still brakes
    stack, _ = settled([Car(4.0)], 5.0)
    command = stack.tick(frame(8, [], ego_at(v=5.0 / 3.6)))
    assert command.brake == 1.0


@pytest.mark.req("A-119", "A-120")
def test_hold_behind_a_car_or_at_the_line():
    """Effective distance: the nearer of 2.5 m behind the lead and the line; hold below 2 m."""
    assert decide(situation(2.0, 30.0, stop=1.99)).tier is Tier.STOPPED_BEHIND_CAR
    assert decide(situation(2.0, 30.0, stop=2.01)).tier is Tier.APPROACH
    # 2.0 + 2.5 = 4.5 m is nearer than the 5 m of tiers 1 and 2, so a lead cannot trigger it (D-049)
    assert decide(situation(2.0, 5.01, stop=30.0)).tier is Tier.APPROACH
    assert decide(situation(2.0, 4.4, stop=30.0)).tier is Tier.STOPPED_TOO_CLOSE
    # without emergency braking, tiers 1 and 2 are gone and the lead does trigger the hold
    alone = Hierarchy(frozenset({Function.TLA}), StackSettings(), 0.05)
    assert alone.decide(situation(2.0, 4.49, stop=30.0)).tier is Tier.STOPPED_BEHIND_CAR
    alone = Hierarchy(frozenset({Function.TLA}), StackSettings(), 0.05)
    assert alone.decide(situation(2.0, 4.51, stop=30.0)).tier is Tier.APPROACH
    # tier 4 acts below 50 m to the line
    assert decide(situation(40.0, 60.0, stop=49.9)).tier is Tier.APPROACH
    assert decide(situation(40.0, 60.0, stop=50.1)).tier is Tier.LIGHT_STOP


@pytest.mark.req("A-120", "A-122")
def test_hold_latch_is_released_by_green():
    h = hierarchy()
    assert h.decide(situation(2.0, 30.0, stop=1.0)).tier is Tier.STOPPED_BEHIND_CAR
    held = h.decide(situation(2.0, 30.0, stop=20.0))
    assert held == Request(Tier.STOPPED_BEHIND_CAR, 0.0, 1.0, True), "the latch keeps it"
    assert h.decide(situation(2.0, 30.0)).tier is not Tier.STOPPED_BEHIND_CAR
    assert h.decide(situation(2.0, 30.0, stop=20.0)).tier is Tier.APPROACH


@pytest.mark.req("A-122")
def test_green_releases_a_car_that_holds_behind_another():
    map, cars = ArcMap(lights=((7, 0, 11.0),)), [Car(8.0)]
    stack, command = settled(cars, 1.0, lights={7: RED}, map=map, x=10.0)
    assert stack.report.tier is Tier.STOPPED_BEHIND_CAR
    assert command.handbrake
    command = stack.tick(frame(9, cars, ego_at(10.0, v=1 / 3.6), lights={7: GREEN}))
    assert stack.report.tier in (Tier.ACC_OPEN, Tier.ACC_HOLD)
    assert not command.handbrake


@pytest.mark.req("A-121")
def test_approach_behind_a_car_brakes_by_the_excess_speed():
    for distance in (12.5, 22.5, 40.0):
        v = sqrt(2 * 2.5 * (distance - 2.5))
        slow = decide(situation(3.6 * (v - 0.01), distance, stop=45.0))
        assert (slow.tier, slow.throttle, slow.brake) == (Tier.APPROACH, 0.2, 0.0)
        for excess, brake in ((0.01, 0.4), (0.79, 0.4), (1.0, 0.5), (1.6, 0.8), (2.1, 1.0)):
            r = decide(situation(3.6 * (v + excess), distance, stop=45.0), configuration=3)
            if r.tier is Tier.APPROACH:
                assert (r.throttle, r.brake) == approx((0.0, brake))
    # never slower than 1.5 m/s: effective 0.36 m would ask for 1.34 m/s
    alone = Hierarchy(frozenset({Function.TLA}), StackSettings(), 0.05)
    for v, throttle in ((3.14, 0.2), (3.18, 0.0)):  # sqrt(2 x 2.5 x 2.0) = 3.162
        r = alone.decide(situation(3.6 * v, 30.0, stop=2.0))
        assert (r.tier, r.throttle) == (Tier.APPROACH, throttle)


@pytest.mark.req("A-129", "A-178")
def test_following_gives_no_throttle_above_the_cap():
    gap = 80 / 3.6 * 3.5
    assert decide(situation(79.0, gap, cap=80.0)).throttle > 0.4
    capped = decide(situation(81.0, gap, cap=80.0))
    assert (capped.tier, capped.throttle, capped.brake) == (Tier.ACC_OPEN, 0.0, 0.0)
    assert decide(situation(81.0, 40.0, cap=80.0)).brake > 0.0, "it still brakes"


@pytest.mark.req("A-131")
def test_last_metres_before_the_line():
    for d in (0.6, 1.0, 2.5, 4.9):
        v = sqrt(2 * 0.5 * d)
        fast = decide(situation(3.6 * v * 1.02, stop=d))
        assert fast == (Tier.LIGHT_STOP, 0.0, 0.2, False)
        slow = decide(situation(3.6 * v * 0.98, stop=d))
        assert slow == (Tier.LIGHT_STOP, 0.15, 0.0, False)


@pytest.mark.req("A-132")
def test_farther_from_the_line_the_speed_pid_brakes():
    for d in (5.0, 20.0, 60.0):
        v = sqrt(2 * 1.5 * d)
        slow = decide(situation(3.6 * v * 0.99, stop=d))
        assert slow == (Tier.LIGHT_STOP, 0.35, 0.0, False)
        error = -0.2  # km/h
        fast = decide(situation(3.6 * v + 0.2, stop=d))
        u = 0.4 * error + 0.0132 * error * 0.05 + 0.225 * error / 0.05
        assert (fast.tier, fast.throttle) == (Tier.LIGHT_STOP, 0.0)
        assert fast.brake == approx(min(-u, 1.0))


@pytest.mark.req("A-133")
def test_proportional_law_before_the_line():
    v = sqrt(2 * 1.5 * 30.0)
    for excess, brake in ((0.1, 0.3), (0.74, 0.3), (1.25, 0.5), (2.0, 0.8), (2.6, 1.0)):
        r = decide(situation(3.6 * (v + excess), stop=30.0), light_braking="proportional")
        assert (r.tier, r.throttle, r.brake) == (Tier.LIGHT_STOP, 0.0, approx(brake))


@pytest.mark.req("A-132", "A-133", "A-131", "A-130")
@pytest.mark.parametrize("law", ["speed_pid", "proportional"])
@pytest.mark.parametrize("v_kmh", [50.0, 80.0])
def test_both_laws_stop_within_the_line(law, v_kmh):
    """A point mass that brakes with up to 8 m/s^2 and accelerates with up to 3 m/s^2 (D-047)."""
    h, v, d = hierarchy(light_braking=law), v_kmh / 3.6, 133.0
    for _ in range(1600):
        r = h.decide(situation(3.6 * v, stop=max(d, 0.0)))
        v = max(v + 0.05 * (3.0 * r.throttle - 8.0 * r.brake - 0.1), 0.0)
        d -= 0.05 * v
    assert v == 0.0
    assert -0.2 < d < 0.5
    assert r == (Tier.HOLDING_AT_LINE, 0.0, 1.0, True)


@pytest.mark.req("A-108")
def test_distance_pid_can_follow_instead():
    s = situation(36.0, 25.05)
    u = 0.2 * 0.05 + 0.005 * 0.05 * 0.05 + 1.2 * 0.05 / 0.05
    assert u > 1.0
    request = decide(s, follower="distance_pid")
    assert (request.throttle, request.brake) == (1.0, 0.0)
    closer = decide(situation(36.0, 24.99), follower="distance_pid")
    u = 0.2 * 0.01 + 0.005 * 0.01 * 0.05 + 1.2 * 0.01 / 0.05
    assert (closer.throttle, closer.brake) == (0.0, approx(u))
    assert decide(s).throttle == 0.15, "the zones by default"
    assert DISTANCE_GAINS.kd == 1.2


@pytest.mark.req("A-139")
@pytest.mark.parametrize(
    ("tier", "text"),
    [
        (Tier.HARD_STOP, "HARD STOP 4.0 m [LCA on]"),
        (Tier.STOPPED_TOO_CLOSE, "STOPPED TOO CLOSE (bumper) 4.0 m [LCA on]"),
        (Tier.EMERGENCY, "EMERGENCY 0.7 s [LCA on]"),
        (Tier.STOPPED_BEHIND_CAR, "STOPPED BEHIND CAR 4.0 m [LCA on]"),
        (Tier.APPROACH, "APPROACH 33.0 m [LCA on]"),
        (Tier.ACC_HOLD, "ACC HOLD 0.7 s [LCA on]"),
        (Tier.ACC_CLOSE, "ACC CLOSE 0.7 s [LCA on]"),
        (Tier.ACC_OPEN, "ACC OPEN 0.7 s [LCA on]"),
        (Tier.LIGHT_STOP, "LIGHT STOP 33.0 m [LCA on]"),
        (Tier.HOLDING_AT_LINE, "HOLDING AT LINE 33.0 m [LCA on]"),
        (Tier.COAST, "CRUISE (COAST) [LCA on]"),
        (Tier.CRUISE, "CRUISE [LCA on]"),
    ],
)
def test_mode_text(tier, text):
    report = StackReport(tier=tier, distance=4.0, time_gap=0.7, light_distance=33.0)
    assert mode_text(report, True, "bumper") == text
    assert mode_text(report, False).endswith("[LCA off]")


@pytest.mark.req("A-139")
def test_every_tier_has_a_text():
    assert set(LABELS) == set(Tier)
    assert mode_text(StackReport(), False) == "NO ACTION [LCA off]"
    assert mode_text(StackReport(tier=Tier.EMERGENCY), True) == "EMERGENCY [LCA on]"


@pytest.mark.req("A-008", "A-009")
def test_the_five_configurations():
    acc, lca, tla, resume = Function.ACC, Function.LCA, Function.TLA, Function.RESUME
    assert {
        0: set(),
        1: {acc},
        2: {acc, lca},
        3: {acc, lca, tla, resume},
        4: {acc, lca, tla, resume, Function.LIMITER},
    } == CONFIGURATIONS
    for number, kmh in ((0, 150), (1, 150), (2, 150), (3, 150), (4, 80)):
        stack = AdasStack(SPECS, ArcMap(), {"configuration": number})
        stack.tick(frame(0, (), ego_at(v=20.0)))
        assert stack.report.v_target == approx(kmh / 3.6)


@pytest.mark.req("A-140")
def test_emergency_braking_alone_is_a_baseline():
    config = AdasConfig.from_mapping({"configuration": 0, "set": {"aeb_without_acc": True}})
    assert config.functions == {Function.AEB}
    h = Hierarchy(config.functions, config.settings, 0.05)
    assert h.decide(situation(36.0, 4.0)).tier is Tier.HARD_STOP
    assert h.decide(situation(36.0, 25.0)).tier in (Tier.COAST, Tier.CRUISE)
    with_acc = AdasConfig.from_mapping({"configuration": 1, "set": {"aeb_without_acc": True}})
    assert with_acc.functions == {Function.ACC}


@pytest.mark.req("A-011")
def test_functions_are_switched_while_driving():
    stack = AdasStack(SPECS, ArcMap(), {})
    assert stack.functions == set(Function) - {Function.AEB, Function.BEND}, "all published ones"

    def tick(k, v=20.0):
        command = stack.tick(frame(k, [Car(40.0)], ego_at(0.0, 0.8, 0.0, v), level="pixels"))
        return stack.report.tier, command.steer, stack.report.v_target

    for k in range(8):
        tier, steer, target = tick(k)
    assert (tier, target) == (Tier.ACC_CLOSE, approx(80 / 3.6))
    assert steer < 0.0
    stack.switch(functions_of(2))
    assert tick(9)[2] == approx(150 / 3.6)
    stack.switch(parse_functions("lca")[0])
    assert tick(10)[0] in (Tier.COAST, Tier.CRUISE)
    stack.switch(parse_functions("")[0])
    assert tick(11)[1] != steer
    stack.switch(functions_of(4))
    assert tick(12)[:2] == (Tier.ACC_CLOSE, approx(steer))


@pytest.mark.req("A-117")
def test_emergency_begins_below_0_75_s():
    for gap, tier in ((0.74, Tier.EMERGENCY), (0.76, Tier.ACC_CLOSE)):
        s = situation_of(20.0, 72.0, Lead(20.0 * gap, gap, True), None, 150.0, 1e9)
        assert decide(s).tier is tier


@pytest.mark.req("A-121")
def test_approach_is_never_slower_than_1_5_m_s():
    """The floor shows where the hold does not: effective 2 m asks for more, so shorten the hold."""
    with pytest.MonkeyPatch.context() as patch:
        interpret(patch)
        alone = Hierarchy(frozenset({Function.TLA}), StackSettings(), 0.05)
        patch.setattr("skidpad.stack.control.tiers.LEAD_HOLD", 0.1)
        for v, throttle in ((1.45, 0.2), (1.55, 0.0)):
            r = alone.decide(situation(3.6 * v, 30.0, stop=0.3))
            assert (r.tier, r.throttle) == (Tier.APPROACH, throttle)


@pytest.mark.req("A-123")
def test_range_of_following():
    """Below 5 s or below 40 m."""
    for v, distance, follows in (
        (10.0, 49.0, True), (10.0, 51.0, False), (2.0, 39.5, True), (2.0, 40.5, False),
        (20.0, 79.0, True),
    ):  # fmt: skip
        tier = decide(situation(3.6 * v, distance)).tier
        assert (tier is Tier.ACC_OPEN) is follows, (v, distance)


@pytest.mark.req("A-124", "A-125", "A-128")
def test_edges_of_the_zones():
    for gap, tier in (
        (2.21, Tier.ACC_HOLD), (2.2, Tier.ACC_CLOSE), (2.79, Tier.ACC_HOLD), (2.8, Tier.ACC_OPEN),
    ):  # fmt: skip
        assert zones(gap).tier is tier
    for gap, throttle, brake in (
        (2.595, 0.15, 0.0), (2.605, 0.30, 0.0), (2.405, 0.15, 0.0), (2.395, 0.0, 0.10),
    ):  # fmt: skip
        assert zones(gap)[1:3] == (throttle, brake)


@pytest.mark.req("A-130", "A-131", "A-132")
def test_edges_before_the_line():
    assert decide(situation(2.0, stop=0.49)).tier is Tier.HOLDING_AT_LINE
    assert decide(situation(2.0, stop=0.51)).tier is Tier.LIGHT_STOP
    assert decide(situation(2.0, stop=4.9)).throttle == 0.15
    assert decide(situation(2.0, stop=5.1)).throttle == 0.35


@pytest.mark.req("A-134")
def test_coasting_brakes_a_little_above_15_km_h():
    for v_kmh, coasts in ((15.5, True), (14.5, False)):
        h = hierarchy()
        h.decide(situation(36.0, 25.0))
        r = h.decide(situation(v_kmh))
        assert (r.tier is Tier.COAST) is coasts
        if coasts:
            assert r == (Tier.COAST, 0.0, 0.10, False)
            assert h.speed_pid.previous == 0.0, "the PID does not run"


@pytest.mark.req("A-138", "A-137")
def test_handbrake_below_3_km_h():
    for v_kmh, pulled in ((2.8, True), (3.2, False)):
        assert decide(situation(v_kmh, 30.0, stop=1.0)).handbrake is pulled
        assert decide(situation(v_kmh, stop=0.4)).handbrake is pulled
        assert not decide(situation(v_kmh, 4.0, stop=0.4)).handbrake, "tier 2 comes first"
