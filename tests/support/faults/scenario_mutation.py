"""Scenario files with much of the standard in them, and mutations that keep them scenarios.

An element is exchanged for another that may stand at its place, a number for another number, a word
for another word of the same attribute; so most inputs get past the reader and are played.
"""

from __future__ import annotations

import random
import re
from collections import defaultdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from lxml import etree

from support.scenarios.files import (
    at,
    by_entity,
    by_value,
    condition,
    event,
    on_lane,
    private,
    speed,
    state,
    story,
    teleport,
    time,
    to,
    vehicle,
    write,
)

LANE = f"<Position>{on_lane(-2, 180)}</Position>"
WORLD = '<Position><WorldPosition x="190" y="-3" h="0.1"/></Position>'
NEAR = '<Position><RelativeObjectPosition entityRef="ego" dx="12" dy="-2"/></Position>'
BY_LANE = '<Position><RelativeLanePosition entityRef="other" dLane="1" ds="9"/></Position>'
BY_ROAD = '<Position><RoadPosition roadId="1" s="150" t="-4"/></Position>'
REACH = "<ReachPositionCondition tolerance='3'>{}</ReachPositionCondition>"
GAP = """<LongitudinalAction><LongitudinalDistanceAction entityRef="ego" distance="20"
freespace="true" continuous="false"><DynamicConstraints maxAcceleration="3" maxDeceleration="4"
maxSpeed="30"/></LongitudinalDistanceAction></LongitudinalAction>"""
SIDE = """<LateralAction><LateralDistanceAction entityRef="ego" distance="2" freespace="false"
continuous="false"/></LateralAction>"""
CHANGE = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="sinusoidal"
value="2" dynamicsDimension="time"/><LaneChangeTarget><RelativeTargetLane entityRef="other"
value="-1"/></LaneChangeTarget></LaneChangeAction></LateralAction>"""
CHANGE_TO = CHANGE.replace('<RelativeTargetLane entityRef="other"\nvalue="-1"/>',
                           '<AbsoluteTargetLane value="-2"/>')  # fmt: skip
OFFSET = """<LateralAction><LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
dynamicsShape="cubic" maxLateralAcc="1"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="0.7"/>
</LaneOffsetTarget></LaneOffsetAction></LateralAction>"""
SYNC = f"""<SynchronizeAction masterEntityRef="ego"><TargetPositionMaster>{on_lane(-3, 150)}
</TargetPositionMaster><TargetPosition>{on_lane(-1, 170)}</TargetPosition></SynchronizeAction>"""
FOLLOW = """<RoutingAction><FollowTrajectoryAction><Trajectory name="t" closed="false"><Shape>{}
</Shape></Trajectory><TimeReference>{}</TimeReference><TrajectoryFollowingMode
followingMode="position"/></FollowTrajectoryAction></RoutingAction>"""
TIMED = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'
VERTICES = "".join(
    f'<Vertex time="{t}">{p}</Vertex>' for t, p in ((0, WORLD), (1, LANE), (3, NEAR), (4, BY_ROAD))
)
LINE = f"<Polyline>{VERTICES}</Polyline>"
CURVE = f'<Clothoid curvature="0.01" curvaturePrime="0.001" length="30">{WORLD}</Clothoid>'
POINTS = "".join(f'<ControlPoint time="{k}">{p}</ControlPoint>'
                 for k, p in enumerate((WORLD, LANE, BY_ROAD)))  # fmt: skip
SPLINE = f'<Nurbs order="3">{POINTS}{"".join(f"<Knot value={v!r}/>" for v in "000111")}</Nurbs>'
ROUTE = f"""<RoutingAction><AssignRouteAction><Route name="r" closed="false"><Waypoint
routeStrategy="shortest">{LANE}</Waypoint><Waypoint routeStrategy="fastest">{BY_ROAD}</Waypoint>
</Route></AssignRouteAction></RoutingAction>"""
ACQUIRE = f"<RoutingAction><AcquirePositionAction>{LANE}</AcquirePositionAction></RoutingAction>"
PROFILE = """<LongitudinalAction><SpeedProfileAction followingMode="position"><SpeedProfileEntry
time="1" speed="4"/><SpeedProfileEntry time="2" speed="12"/></SpeedProfileAction>
</LongitudinalAction>"""
CONTROL = """<ControllerAction><ActivateControllerAction longitudinal="true" lateral="false"/>
</ControllerAction>"""
SEEN = '<VisibilityAction graphics="true" sensors="false" traffic="true"/>'
RELATIVE = ('<RelativeTargetSpeed entityRef="other" value="2" speedTargetValueType="delta" '
            'continuous="false"/>')  # fmt: skip
STEERED = FOLLOW.replace('"position"', '"follow"')
LAMP = """<AppearanceAction><LightStateAction><LightType><VehicleLight vehicleLightType="{}"/>
</LightType><LightState mode="{}" flashingOnDuration="0.2" flashingOffDuration="0.3"/>
</LightStateAction></AppearanceAction>"""
ACTIONS = [
    speed(to(3), "linear", 2, "rate"), speed(to("$v"), "cubic", 1), speed(RELATIVE), PROFILE, GAP,
    SIDE, CHANGE, CHANGE_TO, OFFSET, SYNC, FOLLOW.format(LINE, TIMED), FOLLOW.format(CURVE, "<None/>"),
    FOLLOW.format(SPLINE, TIMED), ROUTE, ACQUIRE, CONTROL, SEEN, teleport(on_lane(-2, 140)),
    STEERED.format(LINE, TIMED), STEERED.format(CURVE, "<None/>"), STEERED.format(SPLINE, TIMED),
    CHANGE.replace("dynamicsDimension", 'followingMode="follow" dynamicsDimension'),
    speed(to(12), "cubic", 1).replace("dynamicsDimension", 'followingMode="follow" dynamicsDimension'),
    speed(to(-3), "step", 0).replace("dynamicsDimension", 'followingMode="follow" dynamicsDimension'),
    LAMP.format("brakeLights", "flashing"), LAMP.format("lowBeam", "off"),
]  # fmt: skip
GLOBAL = [
    f'<EntityAction entityRef="third"><AddEntityAction>{NEAR}</AddEntityAction></EntityAction>',
    '<EntityAction entityRef="third"><DeleteEntityAction/></EntityAction>',
    '<VariableAction variableRef="n"><SetAction value="3"/></VariableAction>',
    """<VariableAction variableRef="n"><ModifyAction><Rule><AddValue value="1"/></Rule>
</ModifyAction></VariableAction>""",
    """<EnvironmentAction><Environment name="e"><TimeOfDay animation="false"
dateTime="2026-01-01T12:00:00"/><Weather fractionalCloudCover="oneOktas"><Sun azimuth="1"
elevation="0.3" illuminance="1"/><Fog visualRange="500"/><Precipitation precipitationType="rain"
precipitationIntensity="9"/></Weather><RoadCondition frictionScaleFactor="0.7"/></Environment>
</EnvironmentAction>""",
    f"""<TrafficAction trafficName="a"><TrafficSourceAction radius="9" rate="0.5" speed="9">{LANE}
</TrafficSourceAction></TrafficAction>""",
    f"""<TrafficAction trafficName="b"><TrafficSinkAction radius="20" rate="1">{LANE}
</TrafficSinkAction></TrafficAction>""",
    """<TrafficAction trafficName="c"><TrafficSwarmAction innerRadius="9" semiMajorAxis="150"
semiMinorAxis="50" numberOfVehicles="6" offset="1"><CentralObject entityRef="ego"/>
<InitialSpeedRange lowerLimit="4" upperLimit="9"/><DirectionOfTravelDistribution same="2"
opposite="1"/></TrafficSwarmAction></TrafficAction>""",
    """<TrafficAction trafficName="d"><TrafficAreaAction numberOfEntities="4" continuous="true">
<TrafficArea><RoadRange length="200"><RoadCursor roadId="1" s="20"/><RoadCursor roadId="1" s="400"/>
</RoadRange></TrafficArea></TrafficAreaAction></TrafficAction>""",
    '<TrafficAction trafficName="c"><TrafficStopAction/></TrafficAction>',
    """<InfrastructureAction><TrafficSignalAction><TrafficSignalStateAction name="1" state="go"/>
</TrafficSignalAction></InfrastructureAction>""",
]
TO_OTHER = 'entityRef="other" value="3" rule="lessThan"'
ENTITY = [
    '<SpeedCondition value="7" rule="lessThan"/>',
    '<AccelerationCondition value="-1" rule="lessThan"/>',
    '<StandStillCondition duration="0.5"/>', '<TraveledDistanceCondition value="15"/>',
    '<EndOfRoadCondition duration="1"/>', '<OffroadCondition duration="0.2"/>',
    '<CollisionCondition><EntityRef entityRef="other"/></CollisionCondition>',
    f"<RelativeSpeedCondition {TO_OTHER}/>", REACH.format(LANE), REACH.format(BY_LANE),
    f'<RelativeDistanceCondition {TO_OTHER} relativeDistanceType="lateral" freespace="true"/>',
    f'<DistanceCondition value="9" rule="lessThan" freespace="false">{WORLD}</DistanceCondition>',
    f'<TimeHeadwayCondition {TO_OTHER} freespace="true"/>',
    """<TimeToCollisionCondition value="4" rule="lessThan" freespace="true">
<TimeToCollisionConditionTarget><EntityRef entityRef="other"/></TimeToCollisionConditionTarget>
</TimeToCollisionCondition>""",
    """<RelativeClearanceCondition oppositeLanes="false" freeSpace="true" distanceForward="20"
distanceBackward="5"><RelativeLaneRange from="-1" to="1"/></RelativeClearanceCondition>""",
]  # fmt: skip
VALUE = [
    '<SimulationTimeCondition value="0.5" rule="greaterThan"/>',
    '<ParameterCondition parameterRef="v" value="5" rule="equalTo"/>',
    '<VariableCondition variableRef="n" value="1" rule="greaterThan"/>',
    '<TrafficSignalCondition name="1" state="go"/>',
]
PARTS = {
    "parameters": '<ParameterDeclaration name="v" parameterType="double" value="8"/>',
    "variables": """<VariableDeclarations><VariableDeclaration name="n" variableType="integer"
value="1"/></VariableDeclarations>""",
}


FILES = 12
EASED = vehicle("other").replace(
    'maxAcceleration="10"', 'maxAcceleration="10" maxAccelerationRate="4" maxDecelerationRate="6"'
)


@cache
def seeds() -> list[bytes]:
    """Each action and condition is in one of these files."""
    found = []
    for k in range(FILES):
        actions = [private(a) for a in ACTIONS[k::FILES]]
        actions += [f"<GlobalAction>{a}</GlobalAction>" for a in GLOBAL[k::FILES]]
        asked = [by_entity(c) for c in ENTITY[k::FILES]] + [by_value(c) for c in VALUE[k::4]]
        asked += [time(0.3), state("event", "e0", "startTransition")]
        events = [event(f"e{i}", a, asked[i % len(asked)]) for i, a in enumerate(actions)]
        begin = at("ego", -3, 100) + at("other", -1, 120) + at("third", -2, 80)
        cars = vehicle("ego", 1.4) + EASED + vehicle("third")
        stop = condition(time(5.0)) + condition(asked[0] + "")
        with TemporaryDirectory() as folder:
            path = write(
                Path(folder), stories=story(*events), init=begin, entities=cars, stop=stop, **PARTS
            )
            found.append(path.read_bytes())
    return found


CHOSEN = ("PrivateAction", "GlobalAction", "EntityCondition", "ByValueCondition", "Position",
          "Shape", "SpeedActionTarget", "TimeReference", "LaneChangeTarget")  # fmt: skip
NUMBER = re.compile(r"[-+]?\d+(\.\d+)?")
FACTORS = (0.0, -1.0, 0.5, 2.0, 10.0, 1e3, 1e-3)


@cache
def pool() -> tuple[dict[str, list[bytes]], dict[str, list[str]]]:
    """What may stand in elements of CHOSEN, and the words of each attribute."""
    inside: dict[str, list[bytes]] = defaultdict(list)
    words: dict[str, list[str]] = defaultdict(list)
    for seed in seeds():
        for node in etree.fromstring(seed).iter():
            if node.tag in CHOSEN:
                inside[node.tag] += [etree.tostring(child) for child in node]
            for name, value in node.attrib.items():
                if not NUMBER.fullmatch(value) and value not in words[name]:
                    words[name].append(value)
    return dict(inside), dict(words)


def mutated_story(rng: random.Random, data: bytes) -> bytes:
    """One to three exchanges of elements, numbers and words."""
    root = etree.fromstring(data)
    for _ in range(rng.randint(1, 3)):
        nodes = [n for n in root.iter() if n.getparent() is not None]
        rng.choice((_exchange, _exchange, _number, _number, _word, _again, _order))(rng, nodes)
    return etree.tostring(root)


def _exchange(rng: random.Random, nodes: list) -> None:
    node = rng.choice([n for n in nodes if n.tag in CHOSEN and len(n)])
    node.replace(node[0], etree.fromstring(rng.choice(pool()[0][node.tag])))


def _number(rng: random.Random, nodes: list) -> None:
    found = [(n, k) for n in nodes for k, v in n.attrib.items() if NUMBER.fullmatch(v)]
    node, name = rng.choice(found)
    old = float(node.get(name))
    new = rng.choice((old * rng.choice(FACTORS), old + rng.choice((-1, 1)), rng.uniform(-50, 50)))
    whole = "." not in node.get(name) and rng.random() < 0.8
    text = str(round(new)) if whole else repr(new)
    node.set(name, f"${{{text} + 0}}" if rng.random() < 0.2 else text)


def _word(rng: random.Random, nodes: list) -> None:
    words = pool()[1]
    found = [(n, k) for n in nodes for k in n.attrib if len(words.get(k, ())) > 1 and k != "name"]
    node, name = rng.choice(found)
    node.set(name, rng.choice(words[name]))


def _again(rng: random.Random, nodes: list) -> None:
    """An event, a condition, a vertex or an action once more."""
    tags = ("Event", "Condition", "Vertex", "Waypoint", "ConditionGroup", "PrivateAction")
    found = [n for n in nodes if n.tag in tags and n.getparent().tag != "Action"]
    node = rng.choice(found)
    copy = etree.fromstring(etree.tostring(node))
    if copy.get("name"):
        copy.set("name", f"{copy.get('name')}{rng.randrange(1000)}")
    node.addnext(copy)


def _order(rng: random.Random, nodes: list) -> None:
    """Two neighbours of one kind change places, or one of them goes."""
    found = [n for n in nodes if n.getnext() is not None and n.getnext().tag == n.tag]
    if not found:
        return
    node = rng.choice(found)
    if rng.random() < 0.5:
        node.getnext().addnext(node)
    else:
        node.getparent().remove(node)
