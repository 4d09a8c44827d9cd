"""Triggers: states and transitions of all elements, collisions between any, values, distances."""

# ruff: noqa: ISC004  elements in lists of parameters
from __future__ import annotations

from math import pi

import pytest

from support.scenarios.files import (
    BRIDGE,
    at,
    by_entity,
    by_value,
    condition,
    event,
    init,
    on_lane,
    private,
    speed,
    state,
    story,
    teleport,
    time,
    to,
    told,
    vehicle,
    world,
)

STOP = private(speed(to(0)))
SLOW = private(speed(to(4), "linear", 2))


def fired(tmp_path, when, edge="none", end=12.0, more="", **parts):
    """When an event with this condition begins, s; None: never."""
    events = story(event("probe", STOP, when, edge), actor="ego", name="probing")
    result = told(tmp_path, stories=more + events, end=end, **parts)
    return next(e.t for e in result.player.events if e.name.endswith("probe"))


@pytest.mark.osc("StoryboardElementStateCondition")
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("story", "s"),
        ("act", "s_act"),
        ("maneuverGroup", "s_group"),
        ("maneuver", "s_manoeuvre"),
        ("event", "slow"),
        ("action", "slow_action"),
        ("event", "s_manoeuvre::slow"),
    ],
)
@pytest.mark.parametrize(
    ("what", "t"), [("completeState", 5.0), ("endTransition", 5.0), ("runningState", 3.0)]
)
def test_the_state_of_every_element_can_be_asked(tmp_path, kind, name, what, t):
    slow = story(event("slow", SLOW, time(3.0)), name="s")
    begun = fired(tmp_path, state(kind, name, what), more=slow)
    if what == "runningState" and kind not in ("event", "action"):
        assert begun == pytest.approx(0.0, abs=0.051)
    else:
        assert begun == pytest.approx(t, abs=0.051)


def test_a_transition_is_seen_once(tmp_path):
    twice = story(event("slow", SLOW, time(3.0)), name="s")
    probe = event("probe", private(speed(to(4))), state("event", "slow", "endTransition"))
    probe = probe.replace('priority="parallel"', 'priority="parallel" maximumExecutionCount="5"', 1)
    result = told(tmp_path, stories=twice + story(probe, actor="ego", name="p"))
    assert next(e for e in result.player.telling.events if e.path[-1] == "probe").left == 4


@pytest.mark.osc("CollisionCondition")
@pytest.mark.parametrize(
    "who", ['<EntityRef entityRef="other"/>', '<ByType type="vehicle"/>', ""], ids=str
)
def test_a_collision_between_two_others_is_seen(tmp_path, who):
    hit = f"<CollisionCondition>{who}</CollisionCondition>"
    entities = vehicle("ego") + vehicle("other") + vehicle("third")
    begin = at("ego", -3, 100) + at("other", -1, 120, 0) + at("third", -1, 80, 10)
    t = fired(tmp_path, by_entity(hit, "third"), entities=entities, init=begin)
    assert t == pytest.approx((40.0 - 4.2) / 10.0, abs=0.06)
    assert fired(tmp_path, by_entity(hit, "ego"), entities=entities, init=begin) is None


@pytest.mark.parametrize(("height", "t"), [(6, None), (1, 5.875)])
def test_cars_over_and_under_a_bridge_do_not_touch(tmp_path, height, t):
    """Bodies 1.5 m high; the second to come to the other lane has 58.75 m to go at 10 m/s."""
    (tmp_path / "bridge.xodr").write_text(BRIDGE.replace('a="6"', f'a="{height}"'))
    entities = vehicle("ego") + vehicle("other") + vehicle("third")
    lanes = {"ego": (1, 10, 0), "other": (1, 40, 10), "third": (2, 40, 10)}
    begin = "".join(
        init(name, teleport(on_lane(-1, s, road=road)), speed(to(v)))
        for name, (road, s, v) in lanes.items()
    )
    hit = "<CollisionCondition>{}</CollisionCondition>".format('<EntityRef entityRef="other"/>')
    found = fired(
        tmp_path, by_entity(hit, "third"), entities=entities, init=begin,
        road='<LogicFile filepath="bridge.xodr"/>',
    )  # fmt: skip
    assert found == (None if t is None else pytest.approx(t, abs=0.06))


def test_a_contact_of_the_ego_does_not_end_what_the_file_goes_on_with(tmp_path):
    begin = at("ego", -1, 100, 10) + at("other", -1, 120, 0)
    result = told(tmp_path, init=begin, end=4.0)
    assert result.rows[-1].time == pytest.approx(4.0)


@pytest.mark.osc("TraveledDistanceCondition")
def test_travelled_distance(tmp_path):
    when = by_entity('<TraveledDistanceCondition value="35"/>', "other")
    assert fired(tmp_path, when) == pytest.approx(3.5, abs=0.06)


@pytest.mark.osc("StandStillCondition")
def test_standing_still(tmp_path):
    stop = story(event("e", STOP, time(2.0)))
    when = by_entity('<StandStillCondition duration="1.5"/>', "other")
    assert fired(tmp_path, when, more=stop) == pytest.approx(3.5, abs=0.11)


@pytest.mark.osc("SpeedCondition", "AccelerationCondition")
@pytest.mark.parametrize(
    ("body", "t"),
    [
        ('<SpeedCondition value="7" rule="lessThan"/>', 4.0),
        ('<SpeedCondition value="7" rule="lessThan" direction="longitudinal"/>', 4.0),
        ('<AccelerationCondition value="-2" rule="lessThan"/>', 3.0),
        ('<SpeedCondition value="1" rule="greaterThan" direction="lateral"/>', None),
    ],
)
def test_speed_and_acceleration(tmp_path, body, t):
    slow = story(event("e", SLOW, time(3.0)))
    begun = fired(tmp_path, by_entity(body, "other"), more=slow)
    assert begun == (None if t is None else pytest.approx(t, abs=0.11))


@pytest.mark.osc("RelativeSpeedCondition")
def test_relative_speed(tmp_path):
    slow = story(event("e", SLOW, time(3.0)))
    body = '<RelativeSpeedCondition entityRef="other" value="3" rule="greaterThan"/>'
    assert fired(tmp_path, by_entity(body), more=slow) == pytest.approx(4.0, abs=0.11)


CROSSING = at("ego", -1, 100, 20) + init(
    "other", teleport(world(300.0, -90.0, h=pi / 2)), speed(to(10))
)


@pytest.mark.osc("RelativeSpeedCondition")
@pytest.mark.parametrize(
    ("by", "reference", "comparison", "t"),
    [
        ("ego", "other", 'direction="lateral" value="-7" rule="greaterThan"', 4.0),
        ("ego", "other", 'direction="longitudinal" value="19" rule="lessThan"', None),
        ("other", "ego", 'direction="longitudinal" value="7" rule="lessThan"', 4.0),
        ("other", "ego", 'direction="lateral" value="19" rule="lessThan"', None),
        ("other", "ego", 'value="-13" rule="lessThan"', 4.0),
    ],
)
def test_relative_speed_at_right_angles_is_measured_along_the_triggering_entity(
    tmp_path, by, reference, comparison, t
):
    """The ego drives east at 20 m/s, the other one north at 10 m/s, from 3 s on 3 m/s² slower."""
    slow = story(event("e", SLOW, time(3.0)))
    when = by_entity(f'<RelativeSpeedCondition entityRef="{reference}" {comparison}/>', by)
    begun = fired(tmp_path, when, more=slow, init=CROSSING, end=6.0)
    assert begun == (None if t is None else pytest.approx(t, abs=0.11))


FASTER = at("ego", -1, 100, 20) + at("other", -1, 160, 10)


@pytest.mark.osc("RelativeDistanceCondition", "DistanceCondition", "TimeHeadwayCondition",
                 "TimeToCollisionCondition", "ReachPositionCondition")  # fmt: skip
@pytest.mark.parametrize(
    ("body", "t"),
    [
        ('<RelativeDistanceCondition entityRef="other" relativeDistanceType="longitudinal" '
         'value="20" freespace="false" rule="lessThan"/>', 4.0),
        ('<RelativeDistanceCondition entityRef="other" relativeDistanceType="longitudinal" '
         'value="20" freespace="true" rule="lessThan"/>', 3.58),
        ('<RelativeDistanceCondition entityRef="other" relativeDistanceType="longitudinal" '
         'coordinateSystem="road" value="20" freespace="true" rule="lessThan"/>', 3.58),
        ('<RelativeDistanceCondition entityRef="other" relativeDistanceType="euclidianDistance" '
         'value="20" freespace="true" rule="lessThan"/>', 3.58),
        ('<TimeHeadwayCondition entityRef="other" value="1" freespace="false" alongRoute="true" '
         'rule="lessThan"/>', 4.0),
        ('<TimeToCollisionCondition value="2" freespace="true" rule="lessThan" '
         'relativeDistanceType="longitudinal"><TimeToCollisionConditionTarget>'
         '<EntityRef entityRef="other"/></TimeToCollisionConditionTarget>'
         '</TimeToCollisionCondition>', 3.58),
        (f'<DistanceCondition value="40" freespace="false" alongRoute="false" rule="lessThan">'
         f'<Position>{on_lane(-1, 200)}</Position></DistanceCondition>', 3.0),
        (f'<ReachPositionCondition tolerance="5"><Position>{on_lane(-1, 200)}</Position>'
         f'</ReachPositionCondition>', 4.75),
    ],
)  # fmt: skip
def test_distances_and_times_to_others(tmp_path, body, t):
    assert fired(tmp_path, by_entity(body), init=FASTER) == pytest.approx(t, abs=0.06)


@pytest.mark.parametrize("axes", ["road", "lane", "entity"])
def test_a_distance_across_the_road_that_is_not_reached_does_not_fire(tmp_path, axes):
    body = f"""<RelativeDistanceCondition entityRef="other" relativeDistanceType="lateral" value="1"
freespace="false" rule="lessThan" coordinateSystem="{axes}"/>"""
    begin = at("ego", -2, 100, 20) + at("other", -1, 130, 10)
    assert fired(tmp_path, by_entity(body), init=begin) is None


def test_there_is_a_headway_to_one_beside_where_bodies_count(tmp_path):
    """Its front draws level with the ego's back after (40 m - a length of 4.2 m) / 10 m/s."""
    begin = at("ego", -2, 140, 10) + at("other", -1, 100, 20)
    body = """<TimeHeadwayCondition entityRef="other" value="0.5" freespace="{}" rule="lessThan"
relativeDistanceType="longitudinal"/>"""
    times = [fired(tmp_path, by_entity(body.format(b)), init=begin) for b in ("true", "false")]
    assert times == pytest.approx([3.58, 4.0], abs=0.06)


def test_there_is_no_headway_to_one_behind(tmp_path):
    body = """<TimeHeadwayCondition entityRef="other" value="99" freespace="false" rule="lessThan"
relativeDistanceType="longitudinal" coordinateSystem="entity"/>"""
    assert fired(tmp_path, by_entity(body), init=at("ego", -1, 200) + at("other", -1, 100)) is None


@pytest.mark.osc("EndOfRoadCondition")
def test_the_end_of_the_road(tmp_path):
    body = '<EndOfRoadCondition duration="1"/>'
    begin = at("ego", -3, 100) + at("other", -1, 1480)
    assert fired(tmp_path, by_entity(body, "other"), init=begin) == pytest.approx(3.0, abs=0.2)


def test_the_end_of_the_road_is_reached_in_the_step_that_ends_there(tmp_path):
    begin = at("ego", -3, 100) + at("other", -1, 1480)
    body = '<EndOfRoadCondition duration="0"/>'
    assert fired(tmp_path, by_entity(body, "other"), init=begin) == pytest.approx(2.0, abs=1e-6)


@pytest.mark.osc("OffroadCondition")
def test_off_the_road(tmp_path):
    body = '<OffroadCondition duration="1"/>'
    begin = at("ego", -3, 100) + init("other", teleport('<WorldPosition x="100" y="90" h="0"/>'))
    assert fired(tmp_path, by_entity(body, "other"), init=begin) == pytest.approx(1.0, abs=0.11)
    assert fired(tmp_path, by_entity(body, "ego"), init=begin) is None


@pytest.mark.osc("RelativeClearanceCondition")
def test_nothing_in_the_way(tmp_path):
    body = """<RelativeClearanceCondition distanceForward="30" distanceBackward="10"
freeSpace="false" oppositeLanes="false"><RelativeLaneRange from="0" to="0"/>
</RelativeClearanceCondition>"""
    assert fired(tmp_path, by_entity(body), init=FASTER) == pytest.approx(0.0)
    near = at("ego", -1, 100, 20) + at("other", -1, 120, 10)
    assert fired(tmp_path, by_entity(body), init=near) == pytest.approx(3.0, abs=0.11)


@pytest.mark.osc("RelativeAngleCondition", "AngleCondition")
def test_angles(tmp_path):
    begin = at("ego", -1, 100) + at("other", 1, 300)
    body = """<RelativeAngleCondition angleType="heading" entityRef="other" angle="3.1416"
angleTolerance="0.1"/>"""
    assert fired(tmp_path, by_entity(body), init=begin, minor=3) == pytest.approx(0.0)
    body = '<AngleCondition angleType="heading" angle="1" angleTolerance="0.1"/>'
    assert fired(tmp_path, by_entity(body), init=begin, minor=3) is None


VARIABLES = """<VariableDeclarations><VariableDeclaration name="v" variableType="double" value="1"/>
</VariableDeclarations>"""
MODES = """<ParameterDeclaration name="mode" parameterType="string" value="calm"/>"""


@pytest.mark.osc("VariableAction", "VariableCondition", "ParameterAction", "ParameterCondition")
@pytest.mark.parametrize(
    ("action", "when"),
    [
        ('<VariableAction variableRef="v"><SetAction value="4"/></VariableAction>',
         '<VariableCondition variableRef="v" value="3.5" rule="greaterThan"/>'),
        ('<VariableAction variableRef="v"><ModifyAction><Rule><AddValue value="3"/></Rule>'
         '</ModifyAction></VariableAction>',
         '<VariableCondition variableRef="v" value="4" rule="equalTo"/>'),
        ('<VariableAction variableRef="v"><ModifyAction><Rule><MultiplyByValue value="-2"/></Rule>'
         '</ModifyAction></VariableAction>',
         '<VariableCondition variableRef="v" value="-2" rule="equalTo"/>'),
        ('<ParameterAction parameterRef="mode"><SetAction value="wild"/></ParameterAction>',
         '<ParameterCondition parameterRef="mode" value="wild" rule="equalTo"/>'),
    ],
)  # fmt: skip
def test_values_change_and_are_seen(tmp_path, action, when):
    change = story(event("e", f"<GlobalAction>{action}</GlobalAction>", time(2.0)))
    t = fired(tmp_path, by_value(when), more=change, variables=VARIABLES, parameters=MODES)
    assert t == pytest.approx(2.0, abs=0.051)


@pytest.mark.osc("TrafficSignalStateAction", "TrafficSignalCondition")
def test_the_state_of_a_signal_is_set_and_seen(tmp_path):
    action = """<GlobalAction><InfrastructureAction><TrafficSignalAction><TrafficSignalStateAction
name="7" state="on;off;off"/></TrafficSignalAction></InfrastructureAction></GlobalAction>"""
    when = by_value('<TrafficSignalCondition name="7" state="on;off;off"/>')
    assert fired(tmp_path, when, more=story(event("e", action, time(2.0)))) == pytest.approx(
        2.0, abs=0.051
    )


@pytest.mark.parametrize(
    ("edge", "t"), [("none", 2.0), ("rising", 2.0), ("falling", 4.0), ("risingOrFalling", 2.0)]
)
def test_edges(tmp_path, edge, t):
    body = """<RelativeDistanceCondition entityRef="other" relativeDistanceType="longitudinal"
value="20" freespace="false" rule="lessThan"/>"""
    begin = at("ego", -1, 100, 30) + at("other", -3, 160, 10)
    assert fired(tmp_path, by_entity(body), edge, init=begin) == pytest.approx(t, abs=0.06)


def test_all_conditions_of_a_group_and_any_group(tmp_path):
    both = condition(time(2.0)).replace("</ConditionGroup>", "") + condition(time(3.0)).replace(
        "<ConditionGroup>", ""
    )
    probe = event("probe", STOP, time(0)).replace(condition(time(0)), both + condition(time(5.0)))
    result = told(tmp_path, stories=story(probe))
    assert result.player.events[0].t == pytest.approx(3.0, abs=0.01)


def test_no_lane_is_no_clearance(tmp_path):
    body = """<RelativeClearanceCondition distanceForward="30" distanceBackward="10"
freeSpace="false" oppositeLanes="{}"><RelativeLaneRange from="{}" to="{}"/>
</RelativeClearanceCondition>"""
    begin = at("ego", -1, 100) + at("other", -3, 500)
    assert fired(tmp_path, by_entity(body.format("false", -1, -1)), init=begin) == 0.0
    assert fired(tmp_path, by_entity(body.format("false", -8, -8)), init=begin) is None
    assert fired(tmp_path, by_entity(body.format("false", 1, 1)), init=begin) is None  # opposite


def test_an_event_of_the_first_step_takes_over_before_init_goes_on(tmp_path):
    begin = at("ego", -3, 100) + init(
        "other", teleport(on_lane(-1, 120)), speed(to(20), "linear", 5, "rate")
    )
    change = story(event("e", private(speed(to(30), "linear", 5, "rate")), time(0.1)))
    rows = told(tmp_path, init=begin, stories=change, end=2.0).of("other")
    assert [round(r.speed, 6) for r in rows[:6]] == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25]
