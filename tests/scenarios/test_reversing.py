"""Vehicles that go backwards through their tyres, and what our stack makes of one ahead of it."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
import pytest

import skidpad
from skidpad.simulation.scripted import ActorDriver, Demand, Motion
from support.scenarios.files import (
    at,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    trajectory,
    vehicle,
    write,
)


def rows_of(folder, name="other", *, stack="ideal", **parts):
    """States of an actor by time, moved through its tyres."""
    scenario = skidpad.Scenario(write(folder, **parts), stack=stack, actors="physical")
    rows = []
    while scenario.step():
        rows.append((scenario.t, scenario.states[name]))
    return rows, scenario


@pytest.mark.parametrize("v", [-1.11, -3.0, -8.0])
def test_it_reverses_at_the_speed_that_is_asked_for(tmp_path, v):
    """-1.11 m/s are the 4 km/h of Euro NCAP's reversing car. From 0.5 m aside it comes to its lane."""
    begins = init("other", teleport(on_lane(-1, 300, 0.5)), speed(to(v), "linear", 2))
    centre = init("other", teleport(on_lane(-1, 300)), speed(to(v), "linear", 2))
    moved = event("e", private(lane_offset()), time(0.0))
    rows, _ = rows_of(tmp_path, init=at("ego", -3, 100, 0) + begins, stories=story(moved), end=22.0)
    on_line, _ = rows_of(tmp_path, init=at("ego", -3, 100, 0) + centre, end=0.2)
    late = [state for t, state in rows if t > 8.0]
    assert [state.vx for state in late] == pytest.approx([v] * len(late), abs=0.1)
    assert late[-1].x == pytest.approx(300.0 + v * 21.0, abs=1.0 + 0.1 * abs(v))
    assert late[-1].y == pytest.approx(on_line[0][1].y, abs=0.06)
    assert max(abs(state.yaw - on_line[0][1].yaw) for state in late[-40:]) < 0.02


def lane_offset() -> str:
    return """<LateralAction><LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
maxLateralAcc="0.3" dynamicsShape="cubic"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="0"/>
</LaneOffsetTarget></LaneOffsetAction></LateralAction>"""


def test_it_stops_before_it_goes_the_other_way(tmp_path):
    begins = init("other", teleport(on_lane(-1, 200)), speed(to(8)))
    turns = event("e", private(speed(to(-2), "linear", 4)), time(1.0))
    back = event("b", private(speed(to(5), "linear", 3)), time(9.0))
    rows, _ = rows_of(
        tmp_path, init=at("ego", -3, 100, 0) + begins, stories=story(turns, back), end=16.0
    )
    v = [state.vx for _, state in rows]
    assert v[15] == pytest.approx(8.0, abs=0.2)
    assert v[170] == pytest.approx(-2.0, abs=0.15)
    assert v[-1] == pytest.approx(5.0, abs=0.2)


def test_it_follows_a_trajectory_rear_first(tmp_path):
    """An arc of 12 m radius to its left rear at 2 m/s, from a stand: it makes up for the start by 6 s."""
    bend = [(100 - 12 * sin(0.05 * k), 12 - 12 * cos(0.05 * k), -0.05 * k) for k in range(32)]
    timing = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'
    vertices = [(x, y, h, 0.05 * 12 * k / 2.0) for k, (x, y, h) in enumerate(bend)]
    path = trajectory(*vertices, timing=timing)
    begins = init("other", teleport('<WorldPosition x="100" y="0" h="0"/>'), path)
    parts = {"entities": vehicle("ego") + vehicle("other", 1.4), "end": 9.0}
    rows, _ = rows_of(tmp_path, init=at("ego", -3, 100, 0) + begins, **parts)
    during = [state for t, state in rows if 2.0 < t < 8.5]
    axles = [(s.x - 1.4 * cos(s.yaw) - 100.0, s.y - 1.4 * sin(s.yaw) - 12.0) for s in during]
    away = [abs(hypot(x, y) - 12.0) for x, y in axles]
    assert max(away) < 0.3
    assert max(away[80:]) < 0.06
    assert during[-1].yaw == pytest.approx(-8.5 * 2.0 / 12.0, abs=0.1)
    assert abs(during[-1].yaw) < pi


def test_without_a_word_of_reverse_nothing_changes():
    """A speed below zero alone, as on the way to a place that was passed, is braked for as before."""
    driver = ActorDriver("saloon")
    braked = driver.command(Motion(0.0, 0.0, 0.0, 1.0, 0.0), Demand(-0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    assert not braked.reverse
    assert braked.brake > 0.0


def test_our_stack_stops_for_a_car_that_reverses_towards_it(tmp_path):
    """Closing at the sum of both speeds: the radar says so, and the ego stands before it is reached."""
    begins = init("ego", teleport(on_lane(-1, 100)), speed(to(12)))
    begins += init("other", teleport(on_lane(-1, 220)), speed(to(-2), "linear", 2))
    stop = event("stop", private(speed(to(0), "linear", 2)), time(9.5))
    file = write(tmp_path, init=begins, stories=story(stop), end=14.0)
    scenario = skidpad.Scenario(file, stack=2, actors="physical")
    while scenario.step():
        pass
    log = scenario.finish().log
    ego, other = log.actors.vx[:, 0], log.actors.vx[:, 1]
    seen = log.report.radar_velocity
    known = np.isfinite(seen) & (log.t > 2.5) & (ego > 1.0)
    assert known.sum() > 20
    right = np.abs(seen + ego - other) < 0.01
    still = np.abs(seen + ego) < 0.1  # where what stands beside the road is nearer
    assert (right | still)[known].mean() > 0.95
    assert right[known][-15:].all()
    assert (log.actors.x[:, 1] - log.actors.x[:, 0]).min() > 4.5
    assert ego[-1] < 0.5
