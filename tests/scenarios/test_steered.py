"""Vehicles that steer to what they follow (`followingMode="follow"`), against paths derived by hand.

The test vehicles have axles 2.7 m apart and turn their front wheels by 0.5 rad: their smallest circle
has a radius of 2.7 / tan(0.5) = 4.94 m.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, exp, hypot, pi, sin, tan

import pytest

import skidpad
from skidpad.core.geometry import wrap_angle
from support.scenarios.files import (
    at,
    compiled,
    event,
    init,
    on_lane,
    pedestrian,
    private,
    speed,
    story,
    teleport,
    time,
    to,
    told,
    trajectory,
    vehicle,
    world,
    write,
)

RADIUS_MIN = 2.7 / tan(0.5)
RELATIVE = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'


def steered(tmp_path, x, y, h, v, *points, timing="<None/>", end=8.0, **parts):
    """The rows of `other`, which begins at a place and follows points from the first step on."""
    path = trajectory(*points, timing=timing, following="follow")
    begin = init("other", teleport(world(x, y, h)), speed(to(v)), path)
    return told(tmp_path, init=at("ego", -3, 100) + begin, end=end, **parts).of("other")


def decay(s: float, look: float) -> float:
    """The offset from a straight line per offset at the begin, s m on: y'' = -2 (y + L y') / L^2."""
    return exp(-s / look) * (cos(s / look) + sin(s / look))


@pytest.mark.osc("FollowTrajectoryAction")
def test_an_offset_from_a_straight_line_decays_over_the_look_ahead(tmp_path):
    """10 m/s look 8 m ahead: at 8 m exp(-1) (cos 1 + sin 1) = 0.508 of the 0.4 m are left."""
    rows = steered(tmp_path, 0.0, 0.4, 0.0, 10.0, (0, 0), (200, 0))
    assert (rows[0].x, rows[0].y) == pytest.approx((0.0, 0.4))
    for row in rows:
        assert row.y == pytest.approx(0.4 * decay(row.x, 8.0), abs=0.012)
    assert decay(8.0, 8.0) == pytest.approx(0.508, abs=1e-3)


def test_on_a_circle_that_it_can_turn_it_stays_on_it(tmp_path):
    """The arc of pure pursuit through two points of a circle that it is tangent to is the circle."""
    ring = [(20 * sin(0.01 * k), 20 - 20 * cos(0.01 * k)) for k in range(400)]
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 5.0, *ring)
    assert len(rows) > 100
    for row in rows:
        assert hypot(row.x, row.y - 20.0) == pytest.approx(20.0, abs=0.01)
    turned = rows[-1].time * 5.0 / 20.0
    assert rows[-1].h == pytest.approx(turned, abs=0.01)


def test_a_line_behind_it_is_reached_on_its_smallest_circle(tmp_path):
    """Heading east, the line leads west 2 m to the left: full lock left, an arc of 4.94 m."""
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 3.0, (10, 2), (-100, 2), end=20.0)
    for row in rows[1:]:
        turned = 3.0 * row.time / RADIUS_MIN
        if turned > 0.5 * pi:
            break
        place = RADIUS_MIN * sin(turned), RADIUS_MIN * (1.0 - cos(turned))
        assert (row.x, row.y) == pytest.approx(place, abs=0.01)
        assert row.h == pytest.approx(turned, abs=0.005)
    assert turned > 0.5 * pi
    turns = [abs(wrap_angle(b.h - a.h)) / 0.05 for a, b in pairwise(rows)]
    assert max(turns) <= 3.0 / RADIUS_MIN + 1e-3
    assert (rows[-1].y, abs(rows[-1].h)) == pytest.approx((2.0, pi), abs=0.15)


def test_a_corner_is_cut_and_no_step_is_a_jump(tmp_path):
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 8.0, (0, 0), (40, 0), (40, 60), end=12.0)
    for a, b in pairwise(rows):
        assert hypot(b.x - a.x, b.y - a.y) == pytest.approx(0.4, abs=0.01)
        assert abs(wrap_angle(b.h - a.h)) <= 0.4 / RADIUS_MIN + 1e-6
    beside = [hypot(row.x - 40.0, row.y) for row in rows]
    assert min(beside) > 0.5  # not through the corner itself
    assert any(abs(row.x - 40.0) < 0.1 and 30.0 < row.y < 60.0 for row in rows)


def test_times_are_caught_up_with_at_the_acceleration_that_it_has(tmp_path):
    """It begins 20 m late at 10 m/s: 12 m/s a second later by its 2 m/s2, and is there in the end."""
    slow = vehicle("other").replace('maxAcceleration="10"', 'maxAcceleration="2"')
    points = (20, 0, None, 0.0), (320, 0, None, 30.0)
    parts = {"entities": vehicle("ego") + slow, "end": 20.0}
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 10.0, *points, timing=RELATIVE, **parts)
    assert rows[20].time == pytest.approx(1.0)
    assert rows[20].speed == pytest.approx(12.0, abs=0.15)
    assert rows[20].x == pytest.approx(11.0, abs=0.15)
    assert max(b.speed - a.speed for a, b in pairwise(rows)) <= 2.0 * 0.05 + 1e-6
    late = next(row for row in rows if row.time > 15.0)
    assert late.x == pytest.approx(20.0 + 10.0 * late.time, abs=0.1)


def test_rear_first_it_goes_along_the_line_too(tmp_path):
    rows = steered(tmp_path, 0.0, 0.3, pi, -4.0, (0, 0), (100, 0), end=10.0)
    for row in rows:
        assert row.y == pytest.approx(0.3 * decay(row.x, 3.2), abs=0.01)
    assert rows[-1].x == pytest.approx(40.0, abs=0.2)
    assert abs(rows[-1].h) == pytest.approx(pi, abs=0.01)


def test_with_its_speed_turned_round_it_goes_back_along_the_line(tmp_path):
    """As in a file of esmini's: rear first to 50 m, then forwards to where it came from."""
    turn = event("e", private(speed(to(6), "linear", 4)), time(3.0))
    rows = steered(
        tmp_path, 100.0, 0.0, pi, -6.0, (100, 0), (200, 0), end=16.0, stories=story(turn)
    )
    assert max(row.x for row in rows) == pytest.approx(124.0, abs=0.5)
    assert rows[-1].speed == pytest.approx(6.0, abs=0.01)
    assert rows[-1].x < 90.0
    assert max(abs(row.y) for row in rows) < 0.01


def test_times_that_end_standing_are_braked_for_and_stay_standing(tmp_path):
    """20 m/s for 2 s, then nothing: 4 m/s2 need 50 m. It stands, and does not go back."""
    slow = vehicle("other").replace('maxDeceleration="10"', 'maxDeceleration="4"')
    points = (0, 0, None, 0.0), (40, 0, None, 2.0), (40, 0, None, 3.0)
    parts = {"entities": vehicle("ego") + slow, "end": 12.0}
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 20.0, *points, timing=RELATIVE, **parts)
    assert rows[-1].speed == pytest.approx(0.0, abs=1e-6)
    assert rows[-1].x == pytest.approx(40.0 + 50.0, abs=1.5)
    assert min(b.speed - a.speed for a, b in pairwise(rows)) >= -4.0 * 0.05 - 1e-6


def test_times_that_it_cannot_keep_in_a_bend_leave_it_near_the_line(tmp_path):
    """20 m/s on a circle of 15 m would be 27 m/s2: it slows down to turn, and gets round."""
    ring = [(15 * sin(0.1 * k), 15 - 15 * cos(0.1 * k), None, 0.075 * k) for k in range(60)]
    rows = steered(tmp_path, 0.0, 0.0, 0.0, 20.0, *ring, timing=RELATIVE, end=20.0)
    away = [abs(hypot(row.x, row.y - 15.0) - 15.0) for row in rows if row.time > 4.0]
    assert min(row.speed for row in rows) < 12.0
    assert max(away[:80]) < 15.0


def test_at_the_end_it_goes_on_from_where_it_is(tmp_path):
    rows = steered(tmp_path, 20.0, 0.3, 0.0, 10.0, (20, 0), (40, 0), end=6.0)
    for a, b in pairwise(rows):
        assert hypot(b.x - a.x, b.y - a.y) == pytest.approx(0.5, abs=0.01)


def test_a_walker_is_placed_on_its_line(tmp_path):
    walks = trajectory((0, 5), (20, 5), following="follow")
    begin = init("other", teleport(world(0, 0)), speed(to(2)), walks)
    entities = vehicle("ego") + pedestrian("other")
    rows = told(tmp_path, entities=entities, init=at("ego", -3, 100) + begin).of("other")
    assert rows[0].y == pytest.approx(5.0)


def lane_change(shape: str, value: float, offset: float, following: str) -> str:
    return f"""<LateralAction><LaneChangeAction targetLaneOffset="{offset}">
<LaneChangeActionDynamics dynamicsShape="{shape}" value="{value}" dynamicsDimension="time"
followingMode="{following}"/><LaneChangeTarget><AbsoluteTargetLane value="-1"/></LaneChangeTarget>
</LaneChangeAction></LateralAction>"""


@pytest.mark.osc("LaneChangeAction")
def test_a_step_aside_is_steered_to(tmp_path):
    """0.4 m to the left at 10 m/s: what is left of it decays over the 8 m that it looks ahead."""
    change = event("e", private(lane_change("step", 0, 0.4, "follow")), time(0.975))
    found = told(tmp_path, stories=story(change), minor=2)
    rows = found.of("other")
    y0, x0 = rows[0].y, next(row.x for row in rows if row.time > 0.99)
    for row in rows:
        way = row.x - x0
        left = 0.4 if way < 0.0 else 0.4 * decay(way, 8.0)
        assert abs(abs(row.y - y0) - (0.4 - left)) < 0.015
    story_ = found.player.scene.story
    ends = [h.t for h in story_ if h.path[-1:] == ("e",) and h.what == "endTransition"]
    assert len(ends) == 1
    assert 2.0 < ends[0] < 5.5


def test_a_change_of_lane_that_is_steered_to_has_no_corner(tmp_path):
    """Within 0.3 m of the change that is asked for, and never a turn that the wheels cannot make."""
    rows = {}
    for following in ("follow", "position"):
        begins = init("other", teleport(on_lane(-2, 120)), speed(to(10)))
        change = event("e", private(lane_change("cubic", 4, 0.0, following)), time(0.975))
        parts = {"init": at("ego", -3, 100) + begins, "stories": story(change), "end": 9.0}
        rows[following] = told(tmp_path, **parts).of("other")
    for a, b in pairwise(rows["follow"]):
        assert hypot(b.x - a.x, b.y - a.y) == pytest.approx(0.5, abs=0.002)
        assert abs(wrap_angle(b.h - a.h)) <= 0.5 * 7.0 / 100.0 + 1e-6  # 7 m/s2 aside at 10 m/s
    aside = [abs(a.y - b.y) for a, b in zip(rows["follow"], rows["position"], strict=True)]
    assert 0.01 < max(aside) < 0.3
    assert aside[-1] < 0.01


def test_an_impossible_axle_is_that_of_the_usual_vehicle(tmp_path):
    degrees = vehicle("other").replace('maxSteering="0.5"', 'maxSteering="30"')
    scenario = compiled(tmp_path, entities=vehicle("ego") + degrees)
    ego, other = scenario.entities["ego"], scenario.entities["other"]
    assert ego.axles.steering_max == 0.5
    assert 0.3 < other.axles.steering_max < 1.5
    notes = [str(f) for f in scenario.findings]
    assert any("maxSteering: 30" in note and "between 0 and 1.5 rad" in note for note in notes)


def test_through_its_tyres_it_begins_where_it_stands_too(tmp_path):
    """0.4 m beside the line: it is not put on it at the begin, and is there after 6 s."""
    path = trajectory((20, 0), (300, 0), following="follow")
    begins = init("other", teleport(world(20.0, 0.4, 0.0)), speed(to(10)), path)
    file = write(tmp_path, init=at("ego", -3, 100, 0) + begins, end=6.0)
    scenario, away = skidpad.Scenario(file, stack="ideal", actors="physical"), []
    while scenario.step():
        away.append(scenario.states["other"].y)
    assert away[0] == pytest.approx(0.4, abs=1e-3)
    assert abs(away[-1]) < 0.05
