"""Every action and condition shows its effect: those that no other file of tests is about."""

from __future__ import annotations

from math import cos, hypot, radians, sin, sqrt

import pytest

from skidpad.core.courses import ActorMode
from skidpad.roads.bundled import load_map
from skidpad.scenarios.movement.network import network_of
from skidpad.scenarios.places.routes import random_roads
from skidpad.scenarios.playing.player import Player
from skidpad.scenarios.playing.stage import IdealWorld, play_ideal
from skidpad.scenarios.scenario import check
from support.scenarios.files import (
    at,
    by_value,
    compiled,
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

STOP = private(speed(to(0)))
LIGHTS = """<RoadNetwork><LogicFile filepath="straight.xodr"/><TrafficSignals>
<TrafficSignalController name="a"><Phase name="go" duration="2"><TrafficSignalState
trafficSignalId="7" state="green"/></Phase><Phase name="stop" duration="3"><TrafficSignalState
trafficSignalId="7" state="red"/></Phase></TrafficSignalController>
<TrafficSignalController name="b" delay="1" reference="a"><Phase name="go" duration="2"/><Phase
name="stop" duration="3"/></TrafficSignalController></TrafficSignals></RoadNetwork>"""


def begun(result, name="probe"):
    return next(e.t for e in result.player.events if e.name.endswith(name))


def fired(tmp_path, when, *more, edge="none", **parts):
    """When the ego stops by a condition, s; None: never. more: events of the other car."""
    probe = story(event("probe", STOP, when, edge), actor="ego", name="probing")
    stories = (story(*more) if more else "") + probe
    return begun(told(tmp_path, stories=stories, end=9.0, **parts))


def world(action):
    return f"<GlobalAction>{action}</GlobalAction>"


@pytest.mark.osc(
    "SimulationTimeCondition", "ByValueCondition", "Condition", "Action", "PrivateAction",
    "LongitudinalAction",
)  # fmt: skip
@pytest.mark.parametrize(("rule", "t"), [("greaterOrEqual", 3.0), ("greaterThan", 3.05)])
def test_time_lets_an_action_begin(tmp_path, rule, t):
    assert fired(tmp_path, time(3.0, rule)) == pytest.approx(t)


ADD = world(
    '<EntityAction entityRef="other"><AddEntityAction><Position><WorldPosition x="300" y="-1.75" '
    'h="0"/></Position></AddEntityAction></EntityAction>'
)
CHANGE = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="linear" value="2"
dynamicsDimension="time"/><LaneChangeTarget><AbsoluteTargetLane value="-2"/></LaneChangeTarget>
</LaneChangeAction></LateralAction>"""
DELETE = world('<EntityAction entityRef="other"><DeleteEntityAction/></EntityAction>')


@pytest.mark.osc(
    "GlobalAction", "EntityAction", "AddEntityAction", "DeleteEntityAction", "Position"
)
def test_entities_vanish_and_appear_somewhere(tmp_path):
    events = event("gone", DELETE, time(2.0)), event("back", ADD, time(4.0))
    rows = told(tmp_path, stories=story(*events), end=6.0).of("other")
    times = [round(r.time, 2) for r in rows]
    assert not any(2.06 < t < 4.0 for t in times)
    back = next(r for r in rows if r.time > 4.0)
    assert (back.x, back.y) == pytest.approx((300.0, -1.75), abs=0.6)


def test_a_lane_change_does_not_bring_back_who_vanishes_in_its_step(tmp_path):
    gone, aside = event("gone", DELETE, time(2.0)), event("aside", private(CHANGE), time(2.0))
    rows = told(tmp_path, stories=story(gone, aside), end=4.0).of("other")
    assert rows[-1].time == pytest.approx(2.0, abs=0.06)


@pytest.mark.osc("SetAction", "ModifyAction")
@pytest.mark.parametrize(
    ("what", "seen"),
    [
        ('<SetAction value="7"/>', "7"),
        ('<ModifyAction><Rule><MultiplyByValue value="3"/></Rule></ModifyAction>', "6"),
    ],
)
def test_variables_are_set_and_modified(tmp_path, what, seen):
    change = event("e", world(f'<VariableAction variableRef="v">{what}</VariableAction>'), time(1))
    declared = """<VariableDeclarations><VariableDeclaration name="v" variableType="double"
value="2"/></VariableDeclarations>"""
    when = by_value(f'<VariableCondition variableRef="v" value="{seen}" rule="equalTo"/>')
    assert fired(tmp_path, when, change, variables=declared) == pytest.approx(1.0, abs=0.051)


def lit(tmp_path, when, *more):
    file = write(tmp_path, stories=story(*more) if more else "", end=12.0)
    probe = story(event("probe", STOP, when, "rising"), actor="ego", name="probing")
    text = file.read_text()
    a, b = text.index("<RoadNetwork>"), text.index("</RoadNetwork>") + len("</RoadNetwork>")
    file.write_text(
        (text[:a] + LIGHTS + text[b:]).replace("<StopTrigger>", probe + "<StopTrigger>", 1)
    )
    return begun(play_ideal(check(file).playable(), 20.0))


def phase(controller, name):
    return by_value(
        f'<TrafficSignalControllerCondition trafficSignalControllerRef="{controller}" '
        f'phase="{name}"/>'
    )


@pytest.mark.osc("TrafficSignalControllerCondition")
@pytest.mark.parametrize(
    ("when", "t"),
    [
        (phase("a", "stop"), 2.0),
        (phase("a", "go"), 5.0),  # again: its rise
        (phase("b", "go"), 1.0),  # which lies behind a
        (by_value('<TrafficSignalCondition name="7" state="red"/>'), 2.0),
        (by_value('<TrafficSignalCondition name="7" state="green"/>'), 5.0),
    ],
)
def test_phases_of_controllers_follow_each_other(tmp_path, when, t):
    assert lit(tmp_path, when) == pytest.approx(t, abs=0.051)


@pytest.mark.osc("InfrastructureAction", "TrafficSignalAction", "TrafficSignalControllerAction")
def test_a_controller_that_is_set_goes_on_from_there(tmp_path):
    switch = world("""<InfrastructureAction><TrafficSignalAction><TrafficSignalControllerAction
trafficSignalControllerRef="a" phase="stop"/></TrafficSignalAction></InfrastructureAction>""")
    red = by_value('<TrafficSignalCondition name="7" state="red"/>')
    green = by_value('<TrafficSignalCondition name="7" state="green"/>')
    assert lit(tmp_path, red, event("e", switch, time(1.0))) == pytest.approx(1.0, abs=0.11)
    assert lit(tmp_path, green, event("e", switch, time(1.0))) == pytest.approx(4.0, abs=0.11)


SKY = """<GlobalAction><EnvironmentAction><Environment name="e"><TimeOfDay animation="{}"
dateTime="2026-06-05T12:00:00"/></Environment></EnvironmentAction></GlobalAction>"""
NOON = by_value('<TimeOfDayCondition dateTime="2026-06-05T12:00:02" rule="greaterOrEqual"/>')


@pytest.mark.osc("TimeOfDayCondition")
@pytest.mark.parametrize(("runs", "t"), [("true", 2.0), ("false", None)])
def test_the_time_of_day_goes_on_where_the_file_says_so(tmp_path, runs, t):
    found = fired(tmp_path, NOON, init=SKY.format(runs) + at("ego", -3, 100) + at("other", -1, 120))
    assert found == (None if t is None else pytest.approx(t, abs=0.051))


def test_there_is_no_time_of_day_before_the_file_says_one(tmp_path):
    assert fired(tmp_path, NOON) is None
    later = event("e", SKY.format("true"), time(3.0))
    assert fired(tmp_path, NOON, later) == pytest.approx(5.0, abs=0.11)


@pytest.mark.osc("UserDefinedValueCondition")
def test_a_value_of_the_users_never_holds_and_the_check_says_so(tmp_path):
    when = by_value('<UserDefinedValueCondition name="button" value="1" rule="equalTo"/>')
    assert fired(tmp_path, when) is None
    probe = story(event("probe", STOP, when))
    assert any("button" in str(f) for f in compiled(tmp_path, stories=probe).findings)


WITHOUT_EFFECT = {
    "LightStateAction": private("""<AppearanceAction><LightStateAction><LightType>
<UserDefinedLight userDefinedLightType="disco"/></LightType><LightState mode="on"/>
</LightStateAction></AppearanceAction>"""),
    "AnimationAction": private("""<AppearanceAction><AnimationAction><AnimationType>
<ComponentAnimation><VehicleComponent vehicleComponentType="hood"/></ComponentAnimation>
</AnimationType></AnimationAction></AppearanceAction>"""),
    "OverrideControllerValueAction": private("""<ControllerAction><OverrideControllerValueAction>
<Brake active="true"><BrakePercent value="1"/></Brake></OverrideControllerValueAction>
</ControllerAction>"""),
    "UserDefinedAction": """<UserDefinedAction><CustomCommandAction type="x">y</CustomCommandAction>
</UserDefinedAction>""",
    "SetMonitorAction": world('<SetMonitorAction monitorRef="m" value="true"/>'),
}  # fmt: skip


@pytest.mark.osc_noted(
    "AnimationAction", "UserDefinedAction", "CustomCommandAction", "SetMonitorAction",
)  # fmt: skip
@pytest.mark.parametrize("tag", WITHOUT_EFFECT)
def test_what_this_world_cannot_show_is_over_at_once_and_told(tmp_path, tag):
    events = event("e", WITHOUT_EFFECT[tag], time(2.0))
    result = told(tmp_path, stories=story(events), minor=3)
    moved = [(h.t, h.what) for h in result.player.scene.story if h.path[-1:] == ("e_action",)]
    assert moved == [(2.0, "startTransition"), (2.0, "endTransition")]
    assert any(tag in notice for notice in result.player.scene.notices)
    assert result.of("other")[-1].x == pytest.approx(120.0 + 10.0 * 6.0, abs=0.51)


def driven_by_others(tmp_path, action, end=4.0):
    """The ego's commands by tick, while somebody else may drive it."""
    scenario = compiled(tmp_path, stories=story(event("e", action, time(2.0)), actor="ego"))
    stage = IdealWorld(scenario)
    modes = dict.fromkeys(scenario.entities, ActorMode.IDEAL) | {"ego": None}
    player, moved = Player(scenario, modes=modes), []
    for _ in range(round(end / 0.05)):
        words = player.step(stage.truth())
        moved.append(any(w.actor == "ego" for w in words))
        stage.step(words)
    return moved


@pytest.mark.osc("ControllerAction", "ActivateControllerAction", "AssignControllerAction")
@pytest.mark.parametrize(
    "action",
    [
        '<ActivateControllerAction lateral="true" longitudinal="true"/>',
        """<AssignControllerAction activateLateral="true" activateLongitudinal="true"><Controller
name="c"><Properties/></Controller></AssignControllerAction>""",
    ],
)
def test_a_controller_that_an_event_activates_takes_the_ego_over(tmp_path, action):
    moved = driven_by_others(tmp_path, private(f"<ControllerAction>{action}</ControllerAction>"))
    assert all(moved[:40])  # the file drives
    assert not any(moved[41:])


TOWN = '<LogicFile filepath="town.xodr"/>'


def goals():
    """Two places that lie behind different arms of the first junction."""
    network = network_of(load_map("town"), "town")
    start = network.map.on_lane(5, -1, 1.0)
    found = {}
    for pick in (0, -1):
        roads = random_roads(network, start, True, lambda found, pick=pick: found[pick])
        point = network.ahead(start, 320.0, roads)
        if point is not None:
            found[point.road] = point
    return list(found.values())


@pytest.mark.osc("RoutingAction", "AcquirePositionAction", "AssignRouteAction")
@pytest.mark.parametrize("kind", ["acquire", "route"])
def test_a_way_is_taken_at_forks(tmp_path, kind):
    ends = []
    for goal in goals():
        place = (
            f'<Position><WorldPosition x="{goal.x}" y="{goal.y}" h="{goal.heading}"/></Position>'
        )
        first = '<Position><LanePosition roadId="5" laneId="-1" s="1"/></Position>'
        action = f"<AcquirePositionAction>{place}</AcquirePositionAction>"
        if kind == "route":
            points = "".join(
                f'<Waypoint routeStrategy="shortest">{p}</Waypoint>' for p in (first, place)
            )
            action = f"""<AssignRouteAction><Route name="r" closed="false">{points}</Route>
</AssignRouteAction>"""
        rows = told(
            tmp_path, road=TOWN, end=30.0,
            init=init("ego", teleport(first[10:-11])) + init(
                "other", teleport(first[10:-11]), speed(to(12))),
            stories=story(event("e", private(f"<RoutingAction>{action}</RoutingAction>"), time(0.1))),
        ).of("other")  # fmt: skip
        assert min(hypot(r.x - goal.x, r.y - goal.y) for r in rows) < 3.0
        ends.append(goal)
    assert len(ends) == 2


@pytest.mark.osc("GeoPosition")
def test_degrees_are_metres_by_the_maps_projection(tmp_path):
    """Near the origin of a transverse Mercator, at 48.1 and 11.5: radii of curvature of WGS 84."""
    place = '<GeoPosition latitudeDeg="48.0999" longitudeDeg="11.501"/>'
    begin = init("ego", teleport(place)) + at("other", -1, 120)
    row = told(tmp_path, init=begin, end=0.2, minor=3).of("ego")[0]
    a, e2, lat = 6_378_137.0, 0.0066943799901413, radians(48.1)
    across = a / sqrt(1.0 - e2 * sin(lat) ** 2)
    along = across * (1.0 - e2) / (1.0 - e2 * sin(lat) ** 2)
    x, y = across * cos(radians(48.0999)) * radians(0.001), -along * radians(0.0001)
    assert (row.x, row.y) == pytest.approx((x, y), abs=0.001)


@pytest.mark.osc("InRoutePosition", "TargetPosition")
def test_a_place_on_a_route_may_be_asked_by_lane(tmp_path):
    points = "".join(
        f'<Waypoint routeStrategy="shortest"><Position>{on_lane(-2, s)}</Position></Waypoint>'
        for s in (100, 400)
    )
    place = f"""<RoutePosition><RouteRef><Route name="r" closed="false">{points}</Route></RouteRef>
<InRoutePosition><FromLaneCoordinates pathS="50" laneId="-1"/></InRoutePosition></RoutePosition>"""
    row = told(tmp_path, init=init("ego", teleport(place)) + at("other", -3, 120), end=0.2).of(
        "ego"
    )
    assert (row[0].x, row[0].y) == pytest.approx((150.0, -1.75), abs=0.05)


def test_t_of_a_place_on_a_route_counts_from_the_line_of_the_road(tmp_path):
    points = "".join(
        f'<Waypoint routeStrategy="shortest"><Position>{on_lane(-2, s)}</Position></Waypoint>'
        for s in (100, 400)
    )
    place = f"""<RoutePosition><RouteRef><Route name="r" closed="false">{points}</Route></RouteRef>
<InRoutePosition><FromRoadCoordinates pathS="50" t="-2.5"/></InRoutePosition></RoutePosition>"""
    row = told(tmp_path, init=init("ego", teleport(place)) + at("other", -3, 120), end=0.2).of(
        "ego"
    )
    assert (row[0].x, row[0].y) == pytest.approx((150.0, -2.5), abs=0.05)


@pytest.mark.osc("EntityCondition", "ByEntityCondition", "LateralAction")
def test_a_change_aside_by_a_condition_of_another(tmp_path):
    near = """<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef
entityRef="ego"/></TriggeringEntities><EntityCondition><SpeedCondition value="5"
rule="greaterThan"/></EntityCondition></ByEntityCondition>"""
    aside = private("""<LateralAction><LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
dynamicsShape="step"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="1"/></LaneOffsetTarget>
</LaneOffsetAction></LateralAction>""")
    rows = told(tmp_path, stories=story(event("e", aside, near))).of("other")
    assert rows[-1].y - rows[0].y == pytest.approx(1.0, abs=0.01)
