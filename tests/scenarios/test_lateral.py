"""Lane changes and offsets: where they end, how far they get meanwhile, across the centre line."""

from __future__ import annotations

import itertools
from math import atan2, cos, hypot, sin

import pytest

from support.oracle.roads import network, road
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
    told,
)


def lane_change(target, shape="sinusoidal", value=4, dimension="time", offset=0.0):
    return private(f"""<LateralAction><LaneChangeAction targetLaneOffset="{offset}">
<LaneChangeActionDynamics dynamicsShape="{shape}" value="{value}" dynamicsDimension="{dimension}"/>
<LaneChangeTarget>{target}</LaneChangeTarget></LaneChangeAction></LateralAction>""")


def relative(value, other="other"):
    return f'<RelativeTargetLane entityRef="{other}" value="{value}"/>'


def absolute(lane):
    return f'<AbsoluteTargetLane value="{lane}"/>'


def changed(tmp_path, action, **parts):
    return told(tmp_path, stories=story(event("e", action, time(1.0))), end=9.0, **parts).of(
        "other"
    )


def way(rows):
    return sum(hypot(b.x - a.x, b.y - a.y) for a, b in itertools.pairwise(rows))


@pytest.mark.osc("LaneChangeAction", "RelativeTargetLane")
@pytest.mark.parametrize("shape", ["linear", "sinusoidal", "cubic"])
def test_the_way_of_a_lane_change_is_as_long_as_the_speed_says(tmp_path, shape):
    rows = changed(tmp_path, lane_change(relative(-1), shape, 3))
    assert rows[-1].y == pytest.approx(-5.25, abs=1e-3)
    assert way(rows) == pytest.approx(10.0 * 9.0, abs=0.02)
    assert rows[-1].x < 120.0 + 90.0 - 0.2  # the way aside is no way ahead


def test_no_step_beside_a_lane_is_longer_than_the_speed_says_where_a_bend_begins(tmp_path):
    """10 m/s, 3 m outside the centre of a lane that turns with a radius of 12 m from s = 100 m on."""
    bend = network(road((100.0, "<line/>"), (18.0, '<arc curvature="0.0833333"/>')))
    (tmp_path / "bend.xodr").write_text(bend, encoding="utf-8")
    begins = at("ego", -2, 10) + init("other", teleport(on_lane(-1, 89.6, -3.0)), speed(to(10)))
    parts = {"road": '<LogicFile filepath="bend.xodr"/>', "init": begins, "end": 2.0}
    rows = told(tmp_path, **parts).of("other")
    steps = [hypot(b.x - a.x, b.y - a.y) for a, b in itertools.pairwise(rows)]
    assert max(steps) == pytest.approx(0.5, rel=0.02)


@pytest.mark.osc("AbsoluteTargetLane")
@pytest.mark.parametrize("target", [absolute(1), relative(1)])
def test_from_the_innermost_lane_to_the_one_beyond_the_centre_line_is_one_change(tmp_path, target):
    rows = changed(tmp_path, lane_change(target))
    assert rows[-1].y == pytest.approx(1.75, abs=1e-3)
    assert rows[-1].x > rows[0].x + 80.0  # it still drives the way it looked
    assert abs(rows[-1].h) < 0.01


def test_an_oncoming_car_changes_lanes_in_its_own_left_and_right(tmp_path):
    begin = at("ego", -3, 100) + at("other", 1, 300)
    rows = changed(tmp_path, lane_change(relative(1)), init=begin)
    assert rows[-1].y == pytest.approx(-1.75, abs=1e-3)
    assert rows[-1].x < 300.0 - 80.0


def test_a_change_to_a_lane_that_is_not_there_keeps_the_distance_and_is_no_error(tmp_path):
    rows = changed(tmp_path, lane_change(absolute(-9)))
    assert rows[-1].y == pytest.approx(-1.75 - 8 * 3.5, abs=0.05)


@pytest.mark.parametrize("value", [0, -2])
def test_no_time_for_a_lane_change_is_a_step(tmp_path, value):
    rows = changed(tmp_path, lane_change(absolute(-2), "linear", value))
    assert rows[21].y == pytest.approx(-5.25, abs=1e-3)


def test_a_lane_change_over_a_distance_takes_that_distance(tmp_path):
    rows = changed(tmp_path, lane_change(absolute(-2), "sinusoidal", 30, "distance"))
    moving = [r for r in rows if 1e-6 < abs(r.y + 1.75) < 3.5 - 1e-6]
    assert moving[-1].x - moving[0].x == pytest.approx(30.0, abs=1.0)


def test_a_rate_is_the_largest_speed_aside(tmp_path):
    rows = changed(tmp_path, lane_change(absolute(-2), "sinusoidal", 1.4, "rate"))
    steps = [abs(b.y - a.y) / 0.05 for a, b in itertools.pairwise(rows)]
    assert max(steps) == pytest.approx(1.4, abs=0.01)


def test_nothing_goes_aside_while_it_stands(tmp_path):
    begin = at("ego", -3, 100) + at("other", -1, 120, 0)
    rows = changed(tmp_path, lane_change(absolute(-2)), init=begin)
    assert rows[-1].y == pytest.approx(-1.75)


@pytest.mark.osc("LaneOffsetAction", "AbsoluteTargetLaneOffset")
@pytest.mark.parametrize("lane", [-1, 1])
def test_an_offset_counts_to_the_left_of_the_road(tmp_path, lane):
    offset = private("""<LateralAction><LaneOffsetAction continuous="false">
<LaneOffsetActionDynamics dynamicsShape="cubic" maxLateralAcc="1.5"/><LaneOffsetTarget>
<AbsoluteTargetLaneOffset value="0.8"/></LaneOffsetTarget></LaneOffsetAction></LateralAction>""")
    rows = changed(tmp_path, offset, init=at("ego", -3, 100) + at("other", lane, 400))
    assert rows[-1].y - rows[0].y == pytest.approx(0.8, abs=1e-3)
    sharp = [abs(a.y - 2 * b.y + c.y) / 0.05**2 for a, b, c in zip(rows, rows[1:], rows[2:])]  # noqa: B905
    assert max(sharp) == pytest.approx(1.5, abs=0.15)


@pytest.mark.osc("RelativeTargetLaneOffset")
def test_an_offset_may_be_that_of_another_car(tmp_path):
    offset = private("""<LateralAction><LaneOffsetAction continuous="false">
<LaneOffsetActionDynamics dynamicsShape="sinusoidal" maxLateralAcc="1"/><LaneOffsetTarget>
<RelativeTargetLaneOffset entityRef="ego" value="0.5"/></LaneOffsetTarget></LaneOffsetAction>
</LateralAction>""")
    begin = init("ego", teleport(on_lane(-1, 100, 0.4)), speed(to(10))) + at("other", -1, 140)
    rows = changed(tmp_path, offset, init=begin)
    assert rows[-1].y == pytest.approx(-1.75 + 0.9, abs=1e-3)


@pytest.mark.osc("LateralDistanceAction")
def test_a_sideways_distance_is_kept(tmp_path):
    keep = private("""<LateralAction><LateralDistanceAction entityRef="ego" distance="2.5"
freespace="false" continuous="true" displacement="leftToReferencedEntity">
<DynamicConstraints maxAcceleration="5" maxDeceleration="5" maxSpeed="1.0"/>
</LateralDistanceAction></LateralAction>""")
    rows = changed(tmp_path, keep)
    assert rows[-1].y == pytest.approx(-8.75 + 2.5, abs=0.01)
    assert max(abs(b.y - a.y) for a, b in itertools.pairwise(rows)) <= 0.05 + 1e-6


BESIDE = """<LateralAction><LateralDistanceAction entityRef="ego" distance="2.5" freespace="false"
continuous="true" {}/></LateralAction>"""


def beside(tmp_path, words, begin, minor=2, **parts):
    return told(
        tmp_path, init=begin, stories=story(event("e", private(BESIDE.format(words)), time(1.0))),
        end=6.0, minor=minor, **parts,
    )  # fmt: skip


@pytest.mark.parametrize("axes", ["entity", "lane", "road"])
@pytest.mark.parametrize(
    ("side", "y"),
    [("leftToReferencedEntity", -0.75), ("any", -0.75), ("rightToReferencedEntity", 4.25)],
)
def test_left_and_right_are_those_of_the_other_one_that_comes_towards(tmp_path, axes, side, y):
    begin = at("ego", 1, 300) + at("other", -1, 100)
    words = f'displacement="{side}" coordinateSystem="{axes}"'
    rows = beside(tmp_path, words, begin).of("other")
    assert rows[-1].y == pytest.approx(y, abs=1e-3)


@pytest.mark.parametrize(
    ("axes", "lane"),
    [("", False), ('coordinateSystem="entity"', False), ('coordinateSystem="lane"', True)],
)
def test_a_sideways_distance_is_straight_from_the_entity_or_along_the_lane(tmp_path, axes, lane):
    """On a circle of 60 m radius to the left, 20 m behind the other one, by plane geometry."""
    (tmp_path / "bend.xodr").write_text(BEND)
    begin = at("ego", -1, 80, 2) + at("other", -1, 60, 2)
    words = f'displacement="leftToReferencedEntity" {axes}'
    result = beside(tmp_path, words, begin, road='<LogicFile filepath="bend.xodr"/>')
    own, it = result.of("other")[-1], result.of("ego")[-1]
    if lane:
        assert 61.75 - hypot(own.x, own.y - 60.0) == pytest.approx(2.5, abs=0.01)
    else:
        phi = atan2(own.x, 60.0 - own.y) - atan2(it.x, 60.0 - it.y)
        left = (own.y - it.y) * cos(it.h) - (own.x - it.x) * sin(it.h)
        assert left == pytest.approx(2.5, abs=0.01)
        assert 61.75 - hypot(own.x, own.y - 60.0) == pytest.approx(
            61.75 - 59.25 / cos(phi), abs=0.01
        )


BEND = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/><road name="" length="180"
id="1" junction="-1"><link/><planView><geometry s="0" x="0" y="0" hdg="0" length="180"><arc
curvature="0.016666666666666666"/></geometry></planView><lanes><laneSection s="0"><center><lane id="0"
type="none" level="false"/></center><right><lane id="-1" type="driving" level="false"><width
sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road></OpenDRIVE>"""


def test_a_speed_changed_after_a_lane_change_in_a_step_moves_it_a_step_later(tmp_path):
    """As in esmini: the lane change, first in the file, goes on at the speed of the step before."""
    change = event("a", lane_change(absolute(-2), value=3), time(1.0))
    brake = event("b", private(speed(to(0), "linear", 5, "rate")), time(2.0))

    def length(*events):
        return way(told(tmp_path, stories=story(*events), end=4.0).of("other"))

    assert length(change, brake) - length(brake) == pytest.approx(2.0 * 5.0 * 0.05, abs=0.03)
    assert length(brake, change) - length(brake) == pytest.approx(0.0, abs=0.03)
