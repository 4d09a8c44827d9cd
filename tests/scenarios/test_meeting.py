"""Synchronised arrivals across directions: ways are those that the entities take."""

from __future__ import annotations

import pytest

from support.scenarios.files import (
    BRIDGE,
    at,
    event,
    init,
    on_lane,
    pedestrian,
    private,
    speed,
    story,
    synchronize,
    teleport,
    time,
    to,
    told,
    trajectory,
    vehicle,
    world,
)

CROSSING = trajectory((160.0, -20.0), (160.0, 10.0))  # across the road, first towards lane -3
FINAL = '<FinalSpeed><AbsoluteSpeed value="1.5">{}</AbsoluteSpeed></FinalSpeed>'
STEADY = FINAL.format('<TargetDistanceSteadyState distance="4"/>')


def crossing(tmp_path, final, goal=None, end=12.0, walk=CROSSING, master=160.0):
    """A car on lane -3 needs 10 s to where somebody on foot is to cross, who needs 7.5 s or less."""
    meet = synchronize("ego", on_lane(-3, master), goal or world(160.0, -8.75), final)
    begin = at("ego", -3, 60) + init("other", teleport(world(160.0, -20.0, 1.5707963)), walk)
    return told(
        tmp_path, init=begin, entities=vehicle("ego") + pedestrian("other"), end=end,
        stories=story(event("e", private(meet), time(0.0))),
    )  # fmt: skip


@pytest.mark.osc("SynchronizeAction")
@pytest.mark.parametrize("final", ["", FINAL.format(""), STEADY])
def test_who_crosses_the_road_comes_when_the_car_does(tmp_path, final):
    result = crossing(tmp_path, final)
    at_goal = [r for r in result.of("other") if r.y >= -8.75]
    assert at_goal[0].time == pytest.approx(10.0, abs=0.15)
    if final:
        assert at_goal[0].speed == pytest.approx(1.5, abs=0.05)


def test_who_would_come_too_early_waits_before_going(tmp_path):
    """6.25 m with 4 m of them steady at 1.5 m/s, 2.67 s before the car is there: 7.33 s for 2.25 m.

    By hand: from a stand to 1.5 m/s over 2.25 m takes 3 s, so that it stands for 4.33 s.
    """
    walk = trajectory((160.0, -15.0), (160.0, 10.0))
    rows = crossing(tmp_path, STEADY, walk=walk).of("other")
    assert all(r.y == pytest.approx(-15.0, abs=1e-3) for r in rows if r.time < 4.3)
    assert next(r.time for r in rows if r.speed > 0.01) == pytest.approx(4.33, abs=0.15)
    assert all(r.speed == pytest.approx(1.5, abs=0.01) for r in rows if -12.7 < r.y < -8.8)
    assert next(r.time for r in rows if r.y >= -8.75) == pytest.approx(10.0, abs=0.1)


def test_a_place_on_the_trajectory_is_as_far_as_the_trajectory_is_long(tmp_path):
    """The line goes round a corner: 20 m of way where 14 m are straight."""
    walk = trajectory((150.0, -18.75), (160.0, -18.75), (160.0, 10.0))
    meet = synchronize("ego", on_lane(-3, 160.0), world(160.0, -8.75), FINAL.format(""))
    begin = at("ego", -3, 60) + init("other", teleport(world(150.0, -18.75)), walk)
    rows = told(
        tmp_path, init=begin, entities=vehicle("ego") + pedestrian("other"), end=12.0,
        stories=story(event("e", private(meet), time(0.0))),
    ).of("other")  # fmt: skip
    assert next(r.time for r in rows if r.y >= -8.75 - 1e-9) == pytest.approx(10.0, abs=0.1)


def test_cars_of_two_roads_meet_where_these_cross(tmp_path):
    (tmp_path / "bridge.xodr").write_text(BRIDGE)
    meet = synchronize("ego", on_lane(-1, 100, road=1), on_lane(-1, 100, road=2),
                       FINAL.format("").replace("1.5", "8"))  # fmt: skip
    begin = init("ego", teleport(on_lane(-1, 10, road=1)), speed(to(10)))
    begin += init("other", teleport(on_lane(-1, 50, road=2)), speed(to(12)))
    result = told(
        tmp_path, init=begin, end=12.0, road='<LogicFile filepath="bridge.xodr"/>',
        stories=story(event("e", private(meet), time(1.0))),
    )  # fmt: skip
    assert next(r.time for r in result.of("other") if r.y >= 0.0) == pytest.approx(9.0, abs=0.1)


@pytest.mark.osc("SynchronizeAction")
@pytest.mark.parametrize("final", ["", FINAL.format("").replace("1.5", "-4")])
def test_a_reversing_car_arrives_as_the_other_one_does(tmp_path, final):
    """The ego needs 6 s for its 60 m; the other one is 34 m ahead of its place, and backs at 6 m/s."""
    meet = synchronize("ego", on_lane(-3, 160.0), on_lane(-1, 160.0), final)
    begin = at("ego", -3, 100) + at("other", -1, 194, -6)
    rows = told(
        tmp_path, init=begin, end=8.0, stories=story(event("e", private(meet), time(0.0)))
    ).of("other")
    arrival = min(rows, key=lambda row: abs(row.x - 160.0))
    assert arrival.x == pytest.approx(160.0, abs=0.3)
    assert arrival.time == pytest.approx(6.0, abs=0.11)
    assert all(row.speed < 0.0 for row in rows if row.time < 6.0)
