"""OpenSCENARIO 0.9.1: files with the names of that time play as those of 1.0 do."""

from __future__ import annotations

import pytest

from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import check

CAR = """<Object name="{0}"><Vehicle name="v" category="car"><ParameterDeclaration/>
<Performance maxSpeed="60" maxDeceleration="10" mass="1500"/><BoundingBox><Center x="1.4" y="0"
z="0.7"/><Dimension width="1.8" length="4.2" height="1.5"/></BoundingBox><Axles><Front
maxSteering="0.5" wheelDiameter="0.6" trackWidth="1.6" positionX="2.7" positionZ="0.3"/><Rear
maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0" positionZ="0.3"/></Axles>
<Properties/></Vehicle></Object>"""
BEGIN = """<Private object="{0}"><Action><Position><Lane roadId="1" laneId="{1}" s="{2}"/></Position>
</Action><Action><Longitudinal><Speed><Dynamics shape="step"/><Target><Absolute value="$v"/></Target>
</Speed></Longitudinal></Action></Private>"""
FILE = """<?xml version="1.0"?><OpenSCENARIO><FileHeader revMajor="0" revMinor="9"
date="2019-06-25T00:00:00" description="x" author="x"/><ParameterDeclaration><Parameter name="$v"
type="double" value="10"/></ParameterDeclaration><Catalogs/><RoadNetwork><Logics
filepath="straight.xodr"/><SceneGraph filepath=""/></RoadNetwork><Entities>{cars}</Entities>
<Storyboard><Init><Actions><Global><SetEnvironment><Environment name="e"><TimeOfDay
animation="false"><Time hour="9" min="30" sec="0"/><Date day="5" month="6" year="2019"/></TimeOfDay>
<Weather cloudState="free"><Sun intensity="1" azimuth="0" elevation="1"/><Fog visualRange="1000"/>
<Precipitation type="dry" intensity="0"/></Weather><RoadCondition frictionScale="0.5"/></Environment>
</SetEnvironment></Global>{begin}</Actions></Init><Story name="s" owner="other"><Act name="a">
<Sequence name="q" numberOfExecutions="1"><Actors><Entity name="other"/></Actors><Maneuver name="m">
{events}</Maneuver></Sequence><Conditions><Start><ConditionGroup><Condition name="c" delay="0"
edge="rising"><ByValue><SimulationTime value="1" rule="greater_than"/></ByValue></Condition>
</ConditionGroup></Start></Conditions></Act></Story><EndConditions><ConditionGroup><Condition
name="c" delay="0" edge="any"><ByValue><SimulationTime value="8" rule="greater_than"/></ByValue>
</Condition></ConditionGroup></EndConditions></Storyboard></OpenSCENARIO>"""
EVENT = """<Event name="{0}" priority="overwrite"><Action name="{0}a"><Private>{1}</Private></Action>
<StartConditions><ConditionGroup><Condition name="c" delay="0" edge="{3}">{2}</Condition>
</ConditionGroup></StartConditions></Event>"""
SLOW = """<Longitudinal><Speed><Dynamics shape="linear" rate="3"/><Target><Relative object="ego"
value="-6" valueType="delta" continuous="false"/></Target></Speed></Longitudinal>"""
CHANGE = """<Lateral><LaneChange><Dynamics shape="sinusoidal" time="2"/><Target><Relative
object="other" value="1"/></Target></LaneChange></Lateral>"""
NEAR = """<ByEntity><TriggeringEntities rule="any"><Entity name="ego"/></TriggeringEntities>
<EntityCondition><RelativeDistance entity="other" type="inertial" value="{0}" freespace="false"
rule="less_than"/></EntityCondition></ByEntity>"""
AFTER = '<ByState><AfterTermination type="event" name="slow" rule="end"/></ByState>'


def played_file(tmp_path, *events, cars=("ego", "other")):
    text = FILE.format(
        cars="".join(map(CAR.format, cars)),
        begin=BEGIN.format("ego", -2, 100) + BEGIN.format("other", -2, 140),
        events="".join(events),
    )
    path = tmp_path / "old.xosc"
    path.write_text(text)
    return play_ideal(check(path).playable(), 20.0)


def test_names_of_0_9_1_are_those_of_later(tmp_path):
    slow = EVENT.format("slow", SLOW, NEAR.format(41), "none")
    change = EVENT.format("change", CHANGE, AFTER, "rising")
    told = played_file(tmp_path, slow, change)
    rows = told.of("other")
    begun = {e.name.rsplit("::", 1)[-1]: e.t for e in told.player.events}
    assert begun["slow"] == pytest.approx(1.05, abs=0.051)  # when its act has begun
    assert rows[-1].speed == pytest.approx(4.0)
    assert begun["change"] == pytest.approx(begun["slow"] + 2.0, abs=0.11)
    assert rows[-1].y - rows[0].y == pytest.approx(3.5, abs=0.05)
    assert rows[-1].time == pytest.approx(8.0, abs=0.11)


def test_weather_and_time_of_0_9_1(tmp_path):
    environment = played_file(tmp_path).player.scenario.start.environment
    assert environment.friction_scale == 0.5
    assert environment.time_of_day == "2019-06-05T09:30:00"
    assert environment.visual_range == 1000.0


LINE = "".join(
    f"""<Vertex reference="{t}"><Position><World x="{150 + 12 * t}" y="-8.75" h="0"/></Position>
<Shape><Polyline/></Shape></Vertex>"""
    for t in range(5)
)
FOLLOW = f"""<Routing><FollowTrajectory><Trajectory name="t" closed="false" domain="time">{LINE}
</Trajectory><Longitudinal><Timing domain="relative" scale="1" offset="0"/></Longitudinal>
<Lateral purpose="position"/></FollowTrajectory></Routing>"""


def test_a_trajectory_of_0_9_1_is_a_line(tmp_path):
    rows = played_file(tmp_path, EVENT.format("e", FOLLOW, NEAR.format(99), "none")).of("other")
    k = next(k for k, r in enumerate(rows) if r.y < -8.0)
    assert rows[k + 40].x - rows[k].x == pytest.approx(24.0, abs=0.7)
    assert rows[k + 40].speed == pytest.approx(12.0)


def test_the_owner_of_a_story_is_meant_by_its_keyword(tmp_path):
    """0.9.1 has `$owner` for the entity that the story names, as an actor and as a partner."""
    slow = EVENT.format("slow", SLOW, NEAR.format(41).replace('"other"', '"$owner"'), "none")
    told = played_file(tmp_path, slow)
    text = (tmp_path / "old.xosc").read_text()
    file = tmp_path / "owner.xosc"
    file.write_text(
        text.replace('<Actors><Entity name="other"/>', '<Actors><Entity name="$owner"/>')
    )
    owned = play_ideal(check(file).playable(), 20.0)
    assert owned.of("other")[-1].speed == pytest.approx(4.0)
    assert owned.rows == told.rows


def test_a_place_on_a_route_of_0_9_1(tmp_path):
    """60 m on from a waypoint at s = 100 on lane -1 of a straight road."""
    route = """<Route name="r" closed="false"><Waypoint strategy="shortest"><Position><Lane roadId="1"
laneId="-1" s="100"/></Position></Waypoint><Waypoint strategy="shortest"><Position><Lane roadId="1"
laneId="-1" s="300"/></Position></Waypoint></Route>"""
    place = f"""<Position><Route><RouteRef>{route}</RouteRef><Position><LaneCoord pathS="60"
laneId="-1"/></Position></Route></Position>"""
    there = EVENT.format("there", place, NEAR.format(41), "none")
    rows = played_file(tmp_path, there).of("other")
    assert rows[-1].y == pytest.approx(-1.75, abs=0.01)
    assert next(r for r in rows if r.y > -2.0).x == pytest.approx(160.0, abs=0.6)


def test_two_cars_of_0_9_1_meet_at_their_places(tmp_path):
    """The ego is at s = 150 after 5 s, and the other one at s = 200 then."""
    meeting = """<Meeting mode="route"><Position><Lane roadId="1" laneId="-2" s="200"/></Position>
<Relative mode="route" object="ego" offsetTime="0" continuous="true"><Position><Lane roadId="1"
laneId="-2" s="150"/></Position></Relative></Meeting>"""
    told = played_file(tmp_path, EVENT.format("meet", meeting, NEAR.format(99), "none"))
    there = {name: next(r for r in told.of(name) if r.time > 4.999) for name in ("ego", "other")}
    assert there["ego"].x == pytest.approx(150.0, abs=0.6)
    assert there["other"].x == pytest.approx(200.0, abs=0.6)


@pytest.mark.parametrize(
    "change",
    ['<Set value="20"/>', '<Modify><Rule><Multiply value="2"/></Rule></Modify>'],
)
def test_parameters_of_0_9_1_are_changed_and_seen(tmp_path, change):
    double = f'</Private><Global><Parameter name="$v">{change}</Parameter></Global><Private>'
    doubled = EVENT.format("double", double, NEAR.format(41), "none").replace(
        "<Private></Private>", ""
    )
    seen = '<ByValue><Parameter name="$v" value="20" rule="equal_to"/></ByValue>'
    rows = played_file(tmp_path, doubled, EVENT.format("slow", SLOW, seen, "none")).of("other")
    assert rows[-1].speed == pytest.approx(4.0)
