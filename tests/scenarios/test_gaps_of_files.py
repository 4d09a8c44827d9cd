"""What files of others hold beyond the common: texts put together, no ego, empty actions, own starts."""

from __future__ import annotations

from math import atan, hypot

import pytest

from skidpad.core.errors import FileError
from skidpad.scenarios.reading.document import parse
from skidpad.scenarios.scenario import check
from support.scenarios.files import (
    at,
    by_entity,
    by_value,
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
    vehicle,
    write,
)

STOP = private(speed(to(0)))


def begun(result, name):
    return next(e.t for e in result.player.events if e.name.endswith(name))


def test_names_are_put_together_from_texts(tmp_path):
    owner = '<ParameterDeclaration name="who" parameterType="string" value="other"/>'
    first = event("${$who + first event}", private(speed(to(4), "linear", 1)), time(1.0))
    seen = by_value("""<StoryboardElementStateCondition storyboardElementType="event"
storyboardElementRef="${$who + first event}" state="completeState"/>""")
    result = told(tmp_path, stories=story(first, event("probe", STOP, seen)), parameters=owner)
    assert [e.name.rsplit("::", 1)[-1] for e in result.player.events] == [
        "otherfirst event",
        "probe",
    ]
    assert begun(result, "probe") == pytest.approx(2.0, abs=0.051)


def test_a_parameter_that_nobody_declares_is_no_text(tmp_path):
    found = check(write(tmp_path, init=at("ego", -3, 100, "${$unknown + 3}")))
    assert "unknown" in str(found.findings[0])
    assert found.scenario is None


CONE = """<ScenarioObject name="cone"><MiscObject name="c" mass="1" miscObjectCategory="obstacle">
<BoundingBox><Center x="0" y="0" z="0.3"/><Dimensions width="0.4" length="0.4" height="0.6"/>
</BoundingBox><Properties/></MiscObject></ScenarioObject>"""


def test_a_file_without_a_vehicle_is_watched_by_a_parked_car_that_nobody_touches(tmp_path):
    there = init("cone", teleport('<WorldPosition x="0" y="0" z="0" h="0"/>'))
    scenario = compiled(tmp_path, entities=CONE, init=there, end=1.0)
    assert scenario.ego == "spectator"
    assert scenario.ego_entity.is_ghost
    assert scenario.ego_is_handed_later  # so that no stack drives it away
    assert any("spectator" in str(f) for f in scenario.findings)


def test_an_action_that_holds_nothing_is_over_as_it_begins(tmp_path):
    events = event("nothing", "", time(1.0)) + event(
        "probe",
        STOP,
        by_value("""<StoryboardElementStateCondition storyboardElementType="event"
storyboardElementRef="nothing" state="completeState"/>"""),
    )
    assert begun(told(tmp_path, stories=story(events)), "probe") == pytest.approx(1.0, abs=0.051)


def test_a_private_action_that_holds_nothing_does_nothing(tmp_path):
    empty = "<PrivateAction></PrivateAction>"
    parts = at("ego", -3, 100).replace("</Private>", f"{empty}</Private>") + at("other", -1, 120)
    result = told(tmp_path, init=parts, stories=story(event("e", empty, time(1.0))), end=2.0)
    assert result.of("ego")[-1].speed == 10.0
    assert begun(result, "e") == pytest.approx(1.0)


def test_a_vehicle_without_a_largest_acceleration_has_none(tmp_path):
    cars = (vehicle("ego") + vehicle("other")).replace(' maxAcceleration="10"', "")
    jump = story(event("e", private(speed(to(40), "linear", 25, "rate")), time(1.0)))
    rows = told(tmp_path, entities=cars, stories=jump, end=3.0).of("other")
    assert rows[40].speed == pytest.approx(35.0)


def test_entities_that_trigger_an_event_take_part_in_it(tmp_path):
    near = by_entity(
        f'<ReachPositionCondition tolerance="3"><Position>{on_lane(-1, 150)}</Position>'
        "</ReachPositionCondition>", "other", "third",
    )  # fmt: skip
    of_all = story(event("e", STOP, near)).replace(
        '<Actors selectTriggeringEntities="false"><EntityRef entityRef="other"/>',
        '<Actors selectTriggeringEntities="true">',
    )
    result = told(
        tmp_path, stories=of_all, entities=vehicle("ego") + vehicle("other") + vehicle("third"),
        init=at("ego", -3, 100) + at("other", -1, 100, 5) + at("third", -1, 130),
    )  # fmt: skip
    assert result.of("third")[-1].speed == 0.0  # it came there first
    assert result.of("other")[-1].speed == 5.0


SPLINE = private("""<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t"
closed="false"><Shape><ClothoidSpline><ClothoidSplineSegment curvatureStart="0" curvatureEnd="0"
length="30"/><ClothoidSplineSegment curvatureStart="0.05" curvatureEnd="0.05" length="20"/>
</ClothoidSpline></Shape></Trajectory></TrajectoryRef><TimeReference><None/></TimeReference>
<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>""")


def test_a_spline_without_a_place_begins_where_the_entity_is(tmp_path):
    rows = told(tmp_path, stories=story(event("e", SPLINE, time(2.0))), minor=3).of("other")
    start = rows[40]
    assert rows[100].x == pytest.approx(start.x + 30.0, abs=0.1)
    assert rows[100].y == pytest.approx(start.y, abs=0.1)
    assert rows[119].h == pytest.approx(0.05 * 9.5, abs=0.05)  # an arc of 20 m radius follows


def test_moments_compare_as_moments(tmp_path):
    noon = """<ParameterDeclaration name="t" parameterType="dateTime"
value="2021-07-09T11:00:00.34+04:00"><ConstraintGroup><ValueConstraint rule="equalTo"
value="2021-07-09T10:00:00.34+03:00"/></ConstraintGroup></ParameterDeclaration>"""
    assert compiled(tmp_path, parameters=noon).parameters["t"].startswith("2021")
    later = noon.replace("equalTo", "greaterThan")
    assert check(write(tmp_path, parameters=later)).scenario is None


def slope(tmp_path, condition, **more):
    """When the angle of a car on a road that climbs holds."""
    road = ROAD.replace("GRADE", "0.1")
    (tmp_path / "hill.xodr").write_text(road)
    probe = story(event("probe", STOP, by_entity(condition, "other")), actor="ego")
    lane = on_lane(-1, 50)
    back = on_lane(1, 50)
    begin = init("ego", teleport(lane)) + init("other", teleport(more.get("place", back)))
    result = told(
        tmp_path, stories=probe, road='<LogicFile filepath="hill.xodr"/>', init=begin, minor=3,
        end=0.5,
    )  # fmt: skip
    return begun(result, "probe")


ROAD = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="200" id="1" junction="-1"><link/><planView><geometry s="0" x="0" y="0" hdg="0"
length="200"><line/></geometry></planView><elevationProfile><elevation s="0" a="0" b="GRADE" c="0"
d="0"/></elevationProfile><lanes><laneSection s="0"><left><lane id="1" type="driving"
level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left><center><lane id="0"
type="none" level="false"/></center><right><lane id="-1" type="driving" level="false"><width
sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.mark.osc("AngleCondition")
@pytest.mark.parametrize(
    ("kind", "axes", "angle", "lane"),
    [
        ("pitch", "world", -atan(0.1), -1),  # nose up
        ("pitch", "world", atan(0.1), 1),  # down the hill
        ("pitch", "road", 0.0, 1),
        ("roll", "world", 0.0, 1),
        ("heading", "world", 3.1416, 1),
        ("heading", "road", 3.1416, 1),
        ("heading", "lane", 0.0, 1),
    ],
)
def test_angles_against_world_road_and_lane(tmp_path, kind, axes, angle, lane):
    body = f"""<AngleCondition angleType="{kind}" angle="{{}}" angleTolerance="0.02"
coordinateSystem="{axes}"/>"""
    assert slope(tmp_path, body.format(angle), place=on_lane(lane, 50)) == 0.0
    assert slope(tmp_path, body.format(angle + 0.05), place=on_lane(lane, 50)) is None


@pytest.mark.parametrize(("angle", "met"), [(0.1, True), (0.0, False)])
def test_an_angle_against_a_trajectory_is_that_to_its_course(tmp_path, angle, met):
    vertices = "".join(
        f'<Vertex time="{k}"><Position><WorldPosition x="{200 + 15 * k}" y="-5" h="0.1"/></Position>'
        "</Vertex>"
        for k in range(4)
    )
    follow = f"""<RoutingAction><FollowTrajectoryAction><Trajectory name="t" closed="false"><Shape>
<Polyline>{vertices}</Polyline></Shape></Trajectory><TimeReference><Timing
domainAbsoluteRelative="relative" scale="1" offset="0"/></TimeReference><TrajectoryFollowingMode
followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""
    begin = story(event("follow", private(follow), time(1.0)))
    asked = f"""<AngleCondition angleType="heading" angle="{angle}" angleTolerance="0.01"
coordinateSystem="trajectory"/>"""
    result = told(tmp_path, stories=begin, stop=condition(by_entity(asked, "other")), minor=3)
    end = result.rows[-1].time
    assert end == pytest.approx(1.1, abs=0.06) if met else end > 10.0


@pytest.mark.osc("RandomRouteAction")
def test_a_random_route_takes_other_ways_for_other_names_and_the_same_again(tmp_path):
    random = "<RoutingAction><RandomRouteAction/></RoutingAction>"
    names = [f"car{k}" for k in range(8)]
    cars = "".join(vehicle(n) for n in ("ego", *names))
    start = teleport('<LanePosition roadId="5" laneId="-1" s="1"/>')

    def ends():
        begin = init("ego", start) + "".join(init(n, start, random, speed(to(15))) for n in names)
        result = told(
            tmp_path, road='<LogicFile filepath="town.xodr"/>', entities=cars, init=begin, end=25.0,
            minor=3,
        )  # fmt: skip
        return {n: (result.of(n)[-1].x, result.of(n)[-1].y) for n in names}

    once = ends()
    places = list(once.values())
    assert any(hypot(a[0] - b[0], a[1] - b[1]) > 20.0 for a in places for b in places)
    assert ends() == once


def test_a_document_type_may_hold_short_texts_and_nothing_else(tmp_path):
    text = write(tmp_path).read_text().split("?>", 1)[1]
    file = tmp_path / "typed.xosc"
    file.write_text('<!DOCTYPE OpenSCENARIO [ <!ENTITY v "10"> ]>' + text)
    assert check(file).scenario is not None
    for bad in ('<!ENTITY v SYSTEM "/etc/hostname">', '<!ENTITY a "x"><!ENTITY v "&a;&a;">'):
        file.write_text(f"<!DOCTYPE OpenSCENARIO [ {bad} ]>{text}")
        with pytest.raises(FileError, match="document type"):
            parse(file)


def test_a_road_without_a_lane_leaves_a_straight_one(tmp_path):
    (tmp_path / "empty.xodr").write_text(
        '<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/></OpenDRIVE>'
    )
    place = init("ego", teleport('<WorldPosition x="10" y="0" h="0"/>'))
    scenario = compiled(tmp_path, road='<LogicFile filepath="empty.xodr"/>', init=place)
    assert scenario.map_name == "straight"
    assert any("has no lane" in str(f) for f in scenario.findings)


def test_a_road_in_a_namespace_is_a_road(tmp_path):
    text = ROAD.replace("GRADE", "0").replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://x.org">')
    (tmp_path / "hill.xodr").write_text(text)
    place = init("ego", teleport(on_lane(-1, 50)))
    scenario = compiled(tmp_path, road='<LogicFile filepath="hill.xodr"/>', init=place)
    assert scenario.start.entities["ego"].place.pose.y == pytest.approx(-1.75)
