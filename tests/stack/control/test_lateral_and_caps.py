"""Steering on a road in closed form; limiter and resume protocol."""

from __future__ import annotations

from math import asin, atan2, cos, inf, isnan, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.geometry import Pose
from skidpad.core.settings.parts import Settings
from skidpad.core.settings.stack import CapScope, Lookahead, ResumeEnd, StackSettings
from skidpad.core.vocabulary import Tier
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import functions_of
from skidpad.stack.control.steering import angle_to, steering_rules
from support.stack_parts import Lanes, ResumeProtocol, Smoothing, speed_caps
from support.stackfakes import LANE_WIDTH, RED, SPECS, ArcMap, Car, ego_at, frame

approx = pytest.approx


def steer(rules, map, pose, v, first_branch=False):
    return Lanes(map, first_branch, rules).steer(pose, v)


def centring(**settings):
    return steering_rules(functions_of(2), StackSettings(**settings), 0.05)


@pytest.mark.req("A-142")
@given(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0), st.floats(-3.1, 3.1))
def test_angle_to_the_target_is_the_difference_of_directions(dx, dy, yaw):
    angle = angle_to(5.0, -3.0, yaw, 5.0 + dx, -3.0 + dy)
    if np.hypot(5.0 + dx - 5.0, -3.0 + dy + 3.0) < 0.1:
        assert isnan(angle)
    else:
        apart = angle - (atan2(dy, dx) - yaw)
        assert cos(apart) == approx(1.0, abs=1e-9)
        assert -pi <= angle <= pi


@pytest.mark.req("A-142", "A-143")
@pytest.mark.parametrize(("v_kmh", "lookahead"), [(20.0, 12.0), (60.0, 24.0), (150.0, 60.0)])
@pytest.mark.parametrize("curvature", [1 / 120, -1 / 300])
def test_centring_steers_by_the_chord_of_the_bend(v_kmh, lookahead, curvature):
    """From the lane centre, the chord to a point s ahead turns by s / 2R."""
    gain = {20.0: 1.2, 60.0: 1.04, 150.0: 0.35}[v_kmh]
    angle = lookahead * curvature / 2
    expected = angle * gain * (1.0 - 0.3 * abs(angle) / pi)
    assert steer(centring(), ArcMap(curvature), Pose(0, 0), v_kmh / 3.6) == approx(
        expected, rel=1e-6
    )


@pytest.mark.req("A-143")
def test_fixed_lookahead_is_12_m():
    beside, v = Pose(0.0, 0.5), 30.0
    fixed = steer(centring(lookahead=Lookahead.FIXED), ArcMap(), beside, v)
    angle = -atan2(0.5, 12.0)
    assert fixed == approx(angle * (1.2 - 0.008 * 68.0) * (1.0 - 0.3 * -angle / pi))


@pytest.mark.req("A-146")
def test_steer_is_zero_without_a_place_and_clipped():
    assert steer(centring(), ArcMap(), Pose(0.0, 300.0), 10.0) == 0.0
    end = ArcMap(piece=100.0, pieces=1)
    assert steer(centring(), end, Pose(80.0, 0.5), 12.0) != 0.0
    assert steer(centring(), end, Pose(80.0, 0.5), 20.0) == 0.0, "the road ends before"
    for beside, steers in ((0.095, False), (0.105, True)):
        assert isnan(angle_to(0.05, -beside, 0.0, 0.05, 0.0)) is not steers
    assert steer(centring(), ArcMap(), Pose(0.0, 0.0, yaw=2.0), 5.0) == -1.0
    assert steer(centring(), ArcMap(), Pose(0.0, 0.0, yaw=-2.0), 5.0) == 1.0


@pytest.mark.req("A-147", "A-148", "A-149")
def test_highway_route_leaves_the_slip_road_and_goes_straight():
    slip = ArcMap()
    slip.lanes = slip.lanes._replace(
        road=np.where(np.arange(24) % 3 == 0, slip.lanes.road + 50, slip.lanes.road)
    )
    slip.off_highway = frozenset(range(51, 59))
    ego, rules = Pose(0.0, 0.0), centring()
    towards = -steer(rules, slip, Pose(0.0, 2 * LANE_WIDTH), 20.0)
    assert towards == 0.0, "on the highway it stays in its lane"
    assert steer(rules, slip, ego, 20.0) > 0.05, "beside it, it goes there"
    assert steer(rules, slip, ego, 20.0, first_branch=True) == 0.0
    # As printed: stay in the lane, take the first branch, which here leads right.
    fork, ego = ArcMap(piece=20.0, forks=True), Pose(0.0, 2 * LANE_WIDTH)
    assert steer(rules, fork, ego, 20.0) == 0.0
    assert steer(rules, fork, ego, 20.0, first_branch=True) < -0.05
    assert steer(rules, ArcMap(piece=20.0), ego, 20.0, first_branch=True) == 0.0
    none = ArcMap(off_highway=frozenset(range(1, 9)))
    assert steer(rules, none, Pose(0.0, 0.0), 20.0) == 0.0, "no highway anywhere: stay"


@pytest.mark.req("A-150")
def test_lazy_driver_looks_8_m_ahead_ignores_little_and_halves_the_rest():
    lazy, map = steering_rules(functions_of(1), StackSettings(), 0.05), ArcMap()
    for v_kmh, gain in ((20.0, 1.2), (140.0, 0.4)):
        for offset in (0.05, 0.5, 1.5):
            angle = -atan2(offset, 8.0)
            command = angle * gain * (1.0 - 0.3 * abs(angle) / pi)
            expected = 0.45 * command if abs(command) >= 0.04 else 0.0
            assert steer(lazy, map, Pose(0.0, offset), v_kmh / 3.6) == approx(expected)
    threshold = [steer(lazy, map, Pose(0.0, 0.0, yaw=y), 5.0) for y in (0.0333, 0.0336)]
    assert threshold[0] == 0.0
    assert threshold[1] == approx(-0.45 * 0.0336 * 1.2, rel=0.01)


@pytest.mark.req("A-151")
def test_lazy_driver_has_settings():
    values = {"lazy_lookahead": 20.0, "lazy_dead_band": 0.0, "lazy_gain": 1.0}
    lazy = steering_rules(functions_of(0), Settings().with_values(values).stack, 0.05)
    angle = -atan2(0.5, 20.0)
    expected = angle * 1.2 * (1.0 - 0.3 * abs(angle) / pi)
    assert steer(lazy, ArcMap(), Pose(0.0, 0.5), 5.0) == approx(expected)


@pytest.mark.req("A-152")
def test_smoothing_is_a_low_pass_with_a_rate_limit():
    s = Smoothing(0.05)
    small = [s.update(0.1) for _ in range(40)]
    # one third per step of 0.05 s at a time constant of 0.10 s
    assert small[:3] == approx([0.1 / 3, 0.1 / 3 * (1 + 2 / 3), 0.1 / 3 * (1 + 2 / 3 + 4 / 9)])
    assert small[-1] == approx(0.1, rel=1e-4)
    s = Smoothing(0.05)
    large = np.diff([0.0] + [s.update(1.0) for _ in range(5)])
    assert large[:3] == approx([0.15] * 3)
    assert s.update(-1.0) - sum(large) == approx(-0.15)
    assert Smoothing(0.05, smooths=False).update(0.7) == 0.7


@pytest.mark.req("A-152")
def test_smoothing_is_off_unless_asked_for():
    def commands(**settings):
        stack = AdasStack(SPECS, ArcMap(), {"configuration": 2, "set": settings})
        return [stack.tick(frame(k, (), ego_at(0.0, 0.5, 0.0, 5.0))).steer for k in range(6)]

    plain, smooth = commands(), commands(steer_smoothing=True)
    assert len(set(plain)) == 1
    assert smooth[0] == approx(plain[0] / 3)
    assert smooth == sorted(smooth, reverse=True)


@pytest.mark.req("A-153")
def test_steering_is_the_same_in_every_tier():
    """At equal pose and speed, whatever the pedals do."""
    found = {}
    for cars, lights in (
        ([], {}), ([Car(4.0)], {}), ([Car(9.0)], {}), ([Car(30.0)], {}), ([], {7: RED}),
        ([Car(30.0)], {7: RED}),
    ):  # fmt: skip
        stack = AdasStack(SPECS, ArcMap(lights=((7, 0, 40.0),)), {"configuration": 4})
        for k in range(8):
            command = stack.tick(frame(k, cars, ego_at(0.0, 0.6, 0.02, 14.0), lights=lights))
        found[stack.report.tier] = command.steer
    assert len(found) >= 5
    assert len(set(found.values())) == 1
    assert command.steer < 0.0


@pytest.mark.req("A-148")
def test_lane_view_of_a_bend():
    view = Lanes(ArcMap(1 / 200)).view(Pose(0.0, 0.0, yaw=0.1))
    assert view.yaw_error == approx(0.1)
    assert sin(view.yaw_error) == approx(sin(0.1))
    assert asin(30.0 * view.kappa / 30.0) == approx(1 / 400, rel=1e-4)


def resume(end=ResumeEnd.TIME):
    return ResumeProtocol(0.05, end)


@pytest.mark.req("A-172", "A-173")
def test_timer_counts_from_the_last_tick_at_a_stop():
    r = resume()
    r.update(False, 0.0, 0.0)
    assert r.timer is None
    assert not r.active
    for v_kmh, timer in ((5.1, None), (4.9, 0.0), (0.0, 0.0)):
        r.update(True, v_kmh, 0.0)
        assert r.timer == timer
    for k in range(1, 5):
        r.update(True, 30.0, 0.0)
        assert r.timer == approx(0.05 * k)


@pytest.mark.req("A-174", "A-176")
def test_cap_ends_after_15_s_whatever_happens():
    r = resume()
    r.update(True, 0.0, 0.0)
    lasting = 0
    for k in range(400):
        lasting += r.active
        r.update(False, 90.0, 1 / 50 if k > 100 else 0.0)
    assert lasting == 300


@pytest.mark.req("A-177")
def test_spatial_cap_ends_behind_the_first_curve():
    r = resume(ResumeEnd.FIRST_CURVE)
    r.update(True, 0.0, 0.0)
    for _ in range(400):
        r.update(False, 60.0, 0.0)
        assert r.active, "20 s of straight road are not the end"
    for curvature in (1 / 550, 0.0):
        r.update(False, 60.0, curvature)
        assert r.active, "a wide bend is no curve"
    for _ in range(50):
        r.update(False, 60.0, -1 / 460)
        assert r.active
    r.update(False, 60.0, 0.0)
    assert not r.active


@pytest.mark.req("A-174", "A-175", "A-178", "A-009")
@pytest.mark.parametrize(
    ("configuration", "free", "resuming", "following"),
    [(0, 150, 150, inf), (1, 150, 150, inf), (2, 150, 150, inf), (3, 150, 80, 80), (4, 80, 80, 80)],
)
def test_caps_by_configuration(configuration, free, resuming, following):
    functions = functions_of(configuration)

    def caps(resuming, scope=CapScope.GLOBAL):
        return speed_caps(functions, 150.0, 80.0, scope, resuming)

    assert caps(False)[0] == free
    assert caps(True) == (resuming, following)
    assert caps(True, CapScope.CRUISE) == (resuming, inf)


@pytest.mark.req("A-178")
def test_limiter_speed_is_an_option():
    for kmh in (60.0, 100.0):
        stack = AdasStack(SPECS, ArcMap(), {"configuration": 4, "limiter_kmh": kmh})
        stack.tick(frame(0, (), ego_at(v=10.0)))
        assert stack.report.v_target == approx(kmh / 3.6)


@pytest.mark.req("A-174", "A-173", "A-176")
@pytest.mark.parametrize(("configuration", "target"), [(2, 150), (3, 80), (4, 80)])
def test_after_a_stop_at_a_light_the_car_cruises_at_80(configuration, target):
    stack = AdasStack(SPECS, ArcMap(lights=((7, 0, 40.0),)), {"configuration": configuration})
    stack.tick(frame(0, (), ego_at(39.0, v=1.0), lights={7: RED}))
    stack.tick(frame(1, (), ego_at(60.0, v=10.0)))
    assert stack.report.v_target == approx(target / 3.6)
    assert stack.report.resume_timer == (None if configuration == 2 else approx(0.05))
    assert stack.report.tier is Tier.CRUISE
    for k in range(2, 301):
        stack.tick(frame(k, (), ego_at(60.0, v=10.0)))
    free = {2: 150, 3: 150, 4: 80}[configuration]
    assert stack.report.v_target == approx(free / 3.6)
