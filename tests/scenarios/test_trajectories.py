"""Trajectories: with and without times, of all shapes, what comes after them; positions of all kinds."""

# ruff: noqa: ISC004  elements in lists of parameters
from __future__ import annotations

import re
from math import atan, cos, hypot, pi, sin, sqrt

import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import InputError
from skidpad.core.geometry import wrap_angle
from skidpad.recording.run.tilts import read_tilts
from support.oracle.actions import timing
from support.scenarios.files import (
    at,
    by_entity,
    compiled,
    condition,
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
    write,
)

ABSOLUTE = '<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/>'
RELATIVE = '<Timing domainAbsoluteRelative="relative" scale="2" offset="0.5"/>'


def world(x, y, h=None):
    heading = "" if h is None else f' h="{h}"'
    return f'<WorldPosition x="{x}" y="{y}"{heading}/>'


def follow(shape, timing="<None/>", closed="false"):
    return private(f"""<RoutingAction><FollowTrajectoryAction><TrajectoryRef>
<Trajectory name="t" closed="{closed}"><Shape>{shape}</Shape></Trajectory></TrajectoryRef>
<TimeReference>{timing}</TimeReference><TrajectoryFollowingMode followingMode="position"/>
</FollowTrajectoryAction></RoutingAction>""")


def polyline(*rows):
    vertices = "".join(
        f'<Vertex{"" if t is None else f""" time="{t}" """}><Position>{p}</Position></Vertex>'
        for t, p in rows
    )
    return f"<Polyline>{vertices}</Polyline>"


def rows_of(tmp_path, action, end=8.0, **parts):
    return told(tmp_path, stories=story(event("e", action, time(1.0))), end=end, **parts).of(
        "other"
    )


def test_after_its_end_the_entity_drives_on_along_its_lane(tmp_path):
    line = polyline((1.0, world(200, -1.75)), (3.0, world(230, -1.75)))
    rows = rows_of(tmp_path, follow(line, ABSOLUTE))
    assert rows[60].x == pytest.approx(230.0, abs=1e-6)
    assert rows[-1].x == pytest.approx(230.0 + 15.0 * 5.0, abs=0.01)
    assert rows[-1].speed == pytest.approx(15.0)


@pytest.mark.osc("FollowTrajectoryAction", "Polyline")
def test_relative_times_are_stretched_and_put_off(tmp_path):
    line = polyline((0.0, world(200, -1.75)), (2.0, world(220, -1.75)))
    rows = rows_of(tmp_path, follow(line, RELATIVE))
    assert rows[30].x == pytest.approx(200.0, abs=1e-6)  # 1 s + 0.5 s
    assert rows[70].x == pytest.approx(210.0, abs=1e-6)  # half of 2 s stretched to 4 s


SQUARE = ((200, -1.75), (220, -1.75), (220, 18.25), (200, 18.25))


def test_a_closed_line_keeps_its_times_and_ends_with_them(tmp_path):
    """As in esmini: nobody says when it is back at its begin, so that the last time is the end."""
    line = polyline(*((2.0 * k, world(*p)) for k, p in enumerate(SQUARE)))
    rows = rows_of(tmp_path, follow(line, ABSOLUTE, closed="true"))
    assert (rows[60].x, rows[60].y) == pytest.approx((220.0, 8.25), abs=1e-6)  # 3 s
    assert (rows[100].x, rows[100].y) == pytest.approx((210.0, 18.25), abs=1e-6)
    assert (rows[130].x, rows[130].y) == pytest.approx((195.0, 18.25), abs=0.02)  # straight on


def test_a_closed_line_without_times_goes_round_and_round(tmp_path):
    line = polyline(*((None, world(*p)) for p in SQUARE))
    rows = rows_of(tmp_path, follow(line, closed="true"), end=12.0)
    assert (rows[160].x, rows[160].y) == pytest.approx((200.0, 8.25), abs=0.02)  # 70 m since 1 s
    assert (rows[200].x, rows[200].y) == pytest.approx(
        (210.0, -1.75), abs=0.02
    )  # once round and 10 m


def test_relative_times_begin_where_the_action_asks_to(tmp_path):
    line = polyline((0.0, world(200, -1.75)), (2.0, world(220, -1.75)), (6.0, world(240, -1.75)))
    timing = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'
    action = follow(line, timing).replace(
        "<FollowTrajectoryAction>", '<FollowTrajectoryAction initialDistanceOffset="10">'
    )
    rows = rows_of(tmp_path, action)
    assert rows[40].x == pytest.approx(220.0, abs=1e-6)  # 10 m after 1 s
    assert rows[80].x == pytest.approx(230.0, abs=1e-6)  # at 5 m/s since


def test_without_times_the_own_speed_counts(tmp_path):
    corner = polyline((None, world(200, -1.75)), (None, world(215, -1.75)), (None, world(215, 30)))
    rows = rows_of(tmp_path, follow(corner), end=4.0)
    assert rows[50].y == pytest.approx(-1.75 + 0.0, abs=0.01)
    assert hypot(rows[60].x - 215.0, rows[60].y - 3.25) < 0.02
    assert rows[60].h == pytest.approx(pi / 2, abs=0.01)


@pytest.mark.osc("Clothoid")
def test_a_clothoid_of_constant_curvature_is_an_arc(tmp_path):
    arc = f"""<Clothoid curvature="0.02" curvaturePrime="0" length="60"><Position>{world(200, -1.75, 0)}
</Position></Clothoid>"""
    row = rows_of(tmp_path, follow(arc), end=5.0)[80]  # 3 s at 10 m/s: 30 m, 0.6 rad
    assert row.x == pytest.approx(200.0 + 50.0 * sin(0.6), abs=0.02)
    assert row.y == pytest.approx(-1.75 + 50.0 * (1.0 - cos(0.6)), abs=0.02)
    assert row.h == pytest.approx(0.6, abs=0.01)


@pytest.mark.osc("Nurbs")
def test_a_spline_of_order_two_is_its_polygon(tmp_path):
    points = "".join(
        f"<ControlPoint><Position>{world(x, y)}</Position></ControlPoint>"
        for x, y in ((200, -1.75), (220, -1.75), (240, -5.25))
    )
    knots = "".join(f'<Knot value="{k}"/>' for k in (0, 0, 1, 2, 2))
    rows = rows_of(tmp_path, follow(f'<Nurbs order="2">{points}{knots}</Nurbs>'), end=6.0)
    assert rows[40].x == pytest.approx(210.0, abs=0.02)
    assert rows[80].y == pytest.approx(-1.75 - 3.5 * 10.0 / hypot(20.0, 3.5), abs=0.02)


def timed_spline(*times):
    points = "".join(
        f'<ControlPoint time="{t}"><Position>{world(x, -1.75)}</Position></ControlPoint>'
        for x, t in zip((200, 220, 240), times, strict=True)
    )
    knots = "".join(f'<Knot value="{k}"/>' for k in (0, 0, 0, 1, 1, 1))
    return follow(f'<Nurbs order="3">{points}{knots}</Nurbs>', timing())


def test_time_is_a_dimension_of_the_control_points_of_a_spline(tmp_path):
    """Half of a parabola: x = 220 m where t = 0.25 * 0 + 0.5 * 3 + 0.25 * 4 s, 1 s after the begin."""
    rows = rows_of(tmp_path, timed_spline(0, 3, 4), end=6.0)
    assert rows[70].x == pytest.approx(220.0, abs=0.1)
    assert rows[100].x == pytest.approx(240.0, abs=0.1)


def test_times_of_control_points_must_not_fall(tmp_path):
    with pytest.raises(InputError, match="the times of its control points must not fall"):
        rows_of(tmp_path, timed_spline(0, 5, 4), end=1.0)


@pytest.mark.parametrize(
    ("knots", "weight", "said"),
    [
        ((0, 0, 1, 1, 1), 1, "a knot may stand 2 times"),
        ((0, 0, 1, 2, 1e300), 1, "knots must be between -1e+09 and 1e+09"),
        ((0, 0, 1, 2, 2), 1e-320, "weights must be between 1e-09 and 1e+09"),
        ((0, 0, 1, 2, 2), -1, "weights must be between 1e-09 and 1e+09"),
    ],
)
def test_a_spline_that_is_none_is_refused(tmp_path, knots, weight, said):
    point = (
        f'<ControlPoint weight="{weight}"><Position>{world(200, -1.75)}</Position></ControlPoint>'
    )
    told = "".join(f'<Knot value="{k}"/>' for k in knots)
    with pytest.raises(InputError, match=re.escape(said)):
        rows_of(tmp_path, follow(f'<Nurbs order="2">{3 * point}{told}</Nurbs>'), end=1.0)


@pytest.mark.osc("ClothoidSpline")
def test_pieces_of_a_spline_of_clothoids_follow_each_other(tmp_path):
    spline = f"""<ClothoidSpline timeEnd="6"><ClothoidSplineSegment curvatureStart="0"
curvatureEnd="0" length="20" timeStart="2"><PositionStart>{world(200, -1.75, 0)}</PositionStart>
</ClothoidSplineSegment><ClothoidSplineSegment curvatureStart="0.05" curvatureEnd="0.05" length="20"
timeStart="4"/></ClothoidSpline>"""
    rows = rows_of(tmp_path, follow(spline, ABSOLUTE), minor=3)
    assert rows[60].x == pytest.approx(210.0, abs=0.01)
    assert rows[100].x == pytest.approx(220.0 + 20.0 * sin(0.5), abs=0.01)


def place(tmp_path, position, ego=None):
    wish = (ego or at("ego", -2, 100)) + init("other", teleport(position), speed(to(0)))
    return compiled(tmp_path, init=wish).start.entities["other"].place.pose


@pytest.mark.osc("WorldPosition", "LanePosition", "RoadPosition", "RelativeLanePosition",
                 "RelativeRoadPosition", "RelativeObjectPosition", "RelativeWorldPosition",
                 "TrajectoryPosition", "RoutePosition")  # fmt: skip
@pytest.mark.parametrize(
    ("position", "x", "y", "yaw"),
    [
        (world(50, 1, 0.3), 50.0, 1.0, 0.3),
        (on_lane(-1, 60, 0.5), 60.0, -1.25, 0.0),
        (on_lane(1, 60, 0.5), 60.0, 2.25, pi),
        ('<RoadPosition roadId="1" s="70" t="-3"/>', 70.0, -3.0, 0.0),
        ('<RoadPosition roadId="1" s="70" t="2"><Orientation type="relative" h="0.2"/></RoadPosition>',
         70.0, 2.0, 0.2),
        ('<RelativeLanePosition entityRef="ego" dLane="1" ds="20" offset="0"/>', 120.0, -1.75, 0.0),
        ('<RelativeLanePosition entityRef="ego" dLane="-1" dsLane="-20" offset="0.5"/>',
         80.0, -8.25, 0.0),
        ('<RelativeRoadPosition entityRef="ego" ds="10" dt="1"/>', 110.0, -4.25, 0.0),
        ('<RelativeObjectPosition entityRef="ego" dx="5" dy="2"/>', 105.0, -3.25, 0.0),
        ('<RelativeWorldPosition entityRef="ego" dx="-5" dy="2"><Orientation type="absolute" h="1"/>'
         '</RelativeWorldPosition>', 95.0, -3.25, 1.0),
        (f'<TrajectoryPosition s="15" t="1"><TrajectoryRef><Trajectory name="t" closed="false">'
         f'<Shape>{polyline((None, world(10, 0)), (None, world(40, 0)))}</Shape></Trajectory>'
         f'</TrajectoryRef></TrajectoryPosition>', 25.0, 1.0, 0.0),
        # t and the heading count from the tangent, whatever the vertices' own headings say
        (f'<TrajectoryPosition s="15" t="1"><TrajectoryRef><Trajectory name="t" closed="false">'
         f'<Shape>{polyline((None, world(10, 0, 0.0)), (None, world(40, 30, pi)))}</Shape>'
         f'</Trajectory></TrajectoryRef></TrajectoryPosition>',
         10.0 + 14.0 / sqrt(2.0), 16.0 / sqrt(2.0), pi / 4),
        (f'<RoutePosition><RouteRef><Route name="r" closed="false">'
         f'<Waypoint routeStrategy="shortest"><Position>{on_lane(-1, 10)}</Position></Waypoint>'
         f'<Waypoint routeStrategy="shortest"><Position>{on_lane(-1, 900)}</Position></Waypoint>'
         f'</Route></RouteRef><InRoutePosition><FromLaneCoordinates pathS="30" laneId="-2"/>'
         f'</InRoutePosition></RoutePosition>', 40.0, -5.25, 0.0),
    ],
)  # fmt: skip
def test_positions_are_where_the_standard_says(tmp_path, position, x, y, yaw):
    pose = place(tmp_path, position)
    assert (pose.x, pose.y) == pytest.approx((x, y), abs=0.01)
    assert wrap_angle(pose.yaw - yaw) == pytest.approx(0.0, abs=1e-4)


def tilted_line():
    """Nose down by 0.2 rad and left side up by 0.1 rad after 2 s, in proportion to the way."""
    return polyline(
        (1.0, '<WorldPosition x="200" y="-1.75" h="0"/>'),
        (3.0, '<WorldPosition x="230" y="-1.75" h="0" p="0.2" r="0.1"/>'),
    )


@pytest.mark.parametrize(
    ("turn", "axes", "angle"),
    [
        ("pitch", "world", 0.1),
        ("roll", "world", 0.05),
        ("pitch", "road", 0.1),
        ("roll", "lane", 0.05),
    ],
)
def test_a_trajectory_tilts_what_follows_it(tmp_path, turn, axes, angle):
    half = f"""<AngleCondition angleType="{turn}" angle="{angle}" angleTolerance="0.001"
coordinateSystem="{axes}"/>"""
    follows = story(event("e", follow(tilted_line(), ABSOLUTE), time(1.0)))
    result = told(tmp_path, stories=follows, stop=condition(by_entity(half, "other")), minor=3)
    assert result.rows[-1].time == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize(
    ("height", "v", "pitch"),
    [
        ('z="{z}"', 10, -atan(0.1)),
        ('z="{z}"', -10, atan(0.1)),  # rear first up the line: nose down
        ('z="{z}" p="0.25"', 10, 0.25),
        ("", 10, 0.0),
    ],
)
def test_a_pitch_that_is_not_said_comes_from_the_climb_of_the_line(tmp_path, height, v, pitch):
    rows = [(200 + x, height.format(z=0.1 * x)) for x in (0, 20, 40)]
    line = polyline(*((None, f'<WorldPosition x="{x}" y="-1.75" {z}/>') for x, z in rows))
    half = f"""<AngleCondition angleType="pitch" angle="{pitch}" angleTolerance="0.001"
coordinateSystem="world"/>"""
    begin = init("ego") + init("other", teleport(on_lane(-1, 200)), speed(to(v)))
    stop = condition(by_entity(half, "other"))
    later = f'<Condition name="t" delay="0" conditionEdge="none">{time(1.45)}</Condition>'
    stop = stop.replace("</ConditionGroup>", f"{later}</ConditionGroup>")
    stories = story(event("e", follow(line), time(1.0)))
    result = told(tmp_path, init=begin, stories=stories, stop=stop, minor=3)
    assert result.rows[-1].time == pytest.approx(1.45, abs=1e-6)


def test_the_folder_and_osi_have_the_tilts(tmp_path):
    pytest.importorskip("osi3", reason="needs the extra osi")
    from osi3trace.osi_trace import OSITrace

    file = write(
        tmp_path, stories=story(event("e", follow(tilted_line(), ABSOLUTE), time(1.0))), end=4.5
    )
    run, trace = tmp_path / "run", tmp_path / "run.osi"
    for words in (
        ["play", file, "--out", run, "--stack", "ideal", "--actors", "ideal"],
        ["export", run, "--osi", trace],
    ):
        done = CliRunner().invoke(app, [str(w) for w in words])
        assert done.exit_code == 0, done.output
    tilts = read_tilts(run)
    assert tilts[2000, "other"] == pytest.approx((0.05, 0.1), abs=1e-5)
    assert {name for _, name in tilts} == {"other"}
    assert min(t for t, _ in tilts) > 1000
    assert max(t for t, _ in tilts) < 3200
    for message in OSITrace(str(trace), "GroundTruth"):
        ms = round(1000 * (message.timestamp.seconds + 1e-9 * message.timestamp.nanos))
        turned = message.moving_object[1].base.orientation
        assert (turned.roll, turned.pitch) == pytest.approx(
            tilts.get((ms, "other"), (0.0, 0.0)), abs=1e-6
        )
