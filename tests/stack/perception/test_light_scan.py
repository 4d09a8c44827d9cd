"""Lights by map: which one, how far, and whether to stop."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightSource, LightState
from skidpad.stack.adas import AdasStack
from skidpad.stack.control.tiers import stopping_speed
from skidpad.stack.perception.lights import (
    NO_LIGHT,
    NO_WAYPOINT,
    LightReading,
    LightScan,
    StopLock,
    StopRequest,
    scan_distance,
)
from support.stackfakes import GREEN, RED, SPECS, YELLOW, ArcMap, ego_at, frame

approx = pytest.approx
ONE = ((7, 0, 300.0),)  # light 7 governs the rightmost lane at s 300 m


def look(map, x, y=0.0, yaw=0.0, v=0.0, states=None, scan=None):
    pose = Pose(x, y, yaw=yaw)
    here = map.project(x, y, 0.0)
    lane, s = (-1, 0.0) if here is None else (here.lane, here.s)
    states = {7: RED} if states is None else states
    return (scan or LightScan(map)).look(map, pose, float(v), lane, s, states)


@pytest.mark.req("A-156")
def test_scan_distance_as_printed():
    assert scan_distance(80 / 3.6) == approx(133.333, abs=1e-3)
    assert scan_distance(10.0) == scan_distance(0.0) == 80.0
    map = ArcMap(lights=ONE)
    for v, reach in ((0.0, 80.0), (10.0, 80.0), (20.0, 120.0), (40.0, 240.0)):
        assert look(map, 300.0 - reach - 0.5, v=v) == NO_LIGHT
        assert look(map, 300.0 - reach + 0.5, v=v).distance == approx(reach - 0.5)


@pytest.mark.req("A-158", "A-160", "A-163", "M-5")
@pytest.mark.parametrize("curvature", [0.0, 1 / 150, -1 / 150])
def test_distance_runs_along_the_lane_and_over_road_ends(curvature):
    map = ArcMap(curvature, piece=25.0, lights=((7, 6, 15.0),))  # on the third piece
    reading = look(map, 0.0)
    assert reading == (LightSource.MAP_SCAN, 7, approx(65.0, abs=0.05), RED)
    x, y, _ = map._point(65.0, 0.0)
    if curvature:
        assert hypot(x, y) < 64.6, "the straight line is shorter"


@pytest.mark.req("A-160", "A-158")
def test_nearest_line_of_the_own_lane_wins():
    map = ArcMap(lights=((9, 0, 340.0), (7, 0, 300.0), (8, 1, 290.0)))
    assert look(map, 260.0).signal == 7
    assert look(map, 302.0).signal == 9, "the line behind is passed"
    assert look(map, 260.0, y=3.5, states={8: RED}).signal == 8


@pytest.mark.req("A-159")
def test_a_light_must_be_ahead():
    """The head stands beside the stop line, so it leaves the cone before the line is reached."""
    map = ArcMap(lights=ONE)
    map.signals = map.signals._replace(x=np.array([300.0]), y=np.array([30.0]))
    # cos 78.46 deg = 0.2: ahead while (300 - x) / 30 > 0.2041, that is before x = 293.88
    assert look(map, 293.7).distance == approx(6.3)
    assert look(map, 294.0) == NO_LIGHT
    assert look(map, 294.6, yaw=0.1).distance == approx(5.4)


@pytest.mark.req("A-157", "A-161")
@pytest.mark.parametrize(
    ("x", "state", "source", "distance"),
    [
        (294.9, RED, LightSource.MAP_SCAN, 5.1),
        (295.1, RED, LightSource.IMMEDIATE_TRIGGER, 4.9),
        (295.1, YELLOW, LightSource.IMMEDIATE_TRIGGER, 4.9),
        (295.1, LightState.UNKNOWN, LightSource.IMMEDIATE_TRIGGER, 4.9),
        (295.1, GREEN, LightSource.MAP_SCAN, 4.9),
        (300.95, RED, LightSource.IMMEDIATE_TRIGGER, 0.0),
        (301.05, RED, LightSource.NO_LIGHT, None),
        (300.5, GREEN, LightSource.NO_LIGHT, None),
        (100.0, RED, LightSource.NO_LIGHT, None),
    ],
)
def test_source_and_distance(x, state, source, distance):
    map = ArcMap(lights=ONE)
    # the head stands beyond the line, so that the cone does not decide here
    map.signals = map.signals._replace(x=np.array([330.0]))
    reading = look(map, x, states={7: state})
    assert reading.source is source
    assert reading.distance == (None if distance is None else approx(distance))
    assert reading.state == (state if distance is not None else None)


@pytest.mark.req("A-161")
def test_no_waypoint_and_unseen_state():
    map = ArcMap(lights=ONE)
    assert look(map, 0.0, y=300.0) == NO_WAYPOINT == (LightSource.NO_WAYPOINT, None, None, None)
    assert look(map, 260.0, states={}).state is LightState.UNKNOWN
    assert look(ArcMap(), 260.0) == NO_LIGHT
    assert LightScan(map).look(map, Pose(0, 0), 0.0, -1, 0.0, {}) == NO_WAYPOINT


@pytest.mark.req("A-162")
def test_geometry_is_read_once():
    map = ArcMap(lights=ONE)
    scan = LightScan(map)
    assert map.held
    map.signals = None
    assert look(map, 260.0, scan=scan).distance == approx(40.0)


def lock(hsv_required=False):
    return StopLock(0.05, hsv_required)


def seen(distance, state=RED, signal=7):
    return LightReading(LightSource.MAP_SCAN, signal, distance, state)


@pytest.mark.req("A-168")
def test_red_stops_green_does_not_and_yellow_only_with_room():
    def asked(state, v=20.0, distance=100.0):
        return lock().update(seen(distance, state), v, {7: state}, None)

    assert asked(RED) == StopRequest(100.0)
    for state in (GREEN, LightState.OFF, LightState.UNKNOWN):
        assert asked(state) is None
    # v^2 / 2d = 1.5 m/s^2 at 17.32 m/s and 100 m
    assert asked(YELLOW, v=17.3) == StopRequest(100.0)
    assert asked(YELLOW, v=17.4) is None
    assert lock().update(NO_LIGHT, 20.0, {7: RED}, None) is None


@pytest.mark.req("A-168")
def test_camera_may_be_required():
    for hsv, answer in ((RED, StopRequest(50.0)), (YELLOW, None), (None, None)):
        assert lock(True).update(seen(50.0), 10.0, {7: RED}, hsv) == answer
        assert lock(False).update(seen(50.0), 10.0, {7: RED}, hsv) == StopRequest(50.0)


@pytest.mark.req("A-169")
def test_lock_keeps_its_line_until_green():
    k = lock()
    red = {7: RED, 8: RED}
    assert k.update(seen(30.0), 10.0, red, None) == StopRequest(30.0)
    assert k.update(seen(29.5), 10.0, red, None) == StopRequest(29.5)
    # lost from sight, or another line comes nearer: the chosen one counts on
    assert k.update(NO_LIGHT, 10.0, red, None) == StopRequest(29.0)
    assert k.update(seen(5.0, signal=8), 10.0, red, None) == StopRequest(28.5)
    # a yellow phase lets nobody go who is committed, however fast
    assert k.update(seen(28.0, YELLOW), 30.0, {7: YELLOW}, None) == StopRequest(28.0)
    assert k.update(NO_LIGHT, 1000.0, red, None) == StopRequest(0.0), "never behind the line"
    assert k.update(seen(1.0, GREEN), 10.0, {7: GREEN}, None) is None
    assert k.update(NO_LIGHT, 10.0, {7: RED}, None) is None, "green cleared the lock"


@pytest.mark.req("A-169")
def test_lock_takes_the_next_line_in_the_tick_in_which_the_first_turns_green():
    k = lock()
    k.update(seen(3.0), 1.0, {7: RED}, None)
    assert k.update(seen(60.0, RED, 8), 1.0, {7: GREEN, 8: RED}, None) == StopRequest(60.0)


@pytest.mark.req("A-170")
def test_approach_speed_is_that_of_uniform_braking():
    """Against integration: braking uniformly from it ends at the line."""
    for a, d in ((1.5, 40.0), (1.5, 5.0), (0.5, 4.9)):
        v, x, dt = stopping_speed(a, d), 0.0, 1e-4
        while v > 0.0:
            x += v * dt
            v -= a * dt
        assert x == approx(d, rel=1e-3)
    assert stopping_speed(1.5, -1.0) == 0.0


@pytest.mark.req("A-155")
@pytest.mark.parametrize("configuration", range(5))
def test_only_the_light_assist_sees_lights(configuration):
    stack = AdasStack(SPECS, ArcMap(lights=ONE), {"configuration": configuration})
    stack.tick(frame(0, (), ego_at(260.0, v=10.0), lights={7: RED}))
    report, assists = stack.report, configuration >= 3
    assert report.light_stop is assists
    assert (report.light_distance is not None) is assists
    assert (report.light_source is LightSource.MAP_SCAN) is assists
    assert (report.light_source is None) is not assists


@pytest.mark.req("A-155")
def test_green_and_far_lights_stop_nobody():
    for x, lights in ((260.0, {7: GREEN}), (100.0, {7: RED})):
        stack = AdasStack(SPECS, ArcMap(lights=ONE), {"configuration": 4})
        stack.tick(frame(0, (), ego_at(x, v=10.0), lights=lights))
        assert not stack.report.light_stop
