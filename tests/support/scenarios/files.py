"""Small OpenSCENARIO files for tests, put together from parts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from skidpad.scenarios.playing.stage import PlayedScenario, play_ideal
from skidpad.scenarios.scenario import Scenario, compile_scenario

HEAD = """<?xml version='1.0'?>
<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="{minor}" date="2026-01-01T00:00:00" description="x" author="x"/>
"""


def document(body: str, minor: int = 2) -> str:
    """Returns a whole file of this body."""
    return f"{HEAD.format(minor=minor)}{body}\n</OpenSCENARIO>\n"


FILE = (
    HEAD
    + """  <ParameterDeclarations>{parameters}</ParameterDeclarations>
  {variables}
  <CatalogLocations>{catalogs}</CatalogLocations>
  <RoadNetwork>{road}</RoadNetwork>
  <Entities>{entities}</Entities>
  <Storyboard><Init><Actions>{init}</Actions></Init>{stories}
    <StopTrigger>{stop}</StopTrigger>
  </Storyboard>
</OpenSCENARIO>
"""
)
VEHICLE = """<Vehicle name="v" vehicleCategory="car"><BoundingBox><Center x="{x}" y="0" z="0.7"/>
<Dimensions width="1.8" length="4.2" height="1.5"/></BoundingBox>
<Performance maxSpeed="70" maxDeceleration="10" maxAcceleration="10"/>
<Axles><FrontAxle maxSteering="0.5" wheelDiameter="0.6" trackWidth="1.6" positionX="2.7"
positionZ="0.3"/><RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0"
positionZ="0.3"/></Axles><Properties/></Vehicle>"""
ROAD = '<LogicFile filepath="straight.xodr"/>'

# road 2 runs north over road 1, which runs east, at x = 100 and 6 m above it
BRIDGE = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/>
{}</OpenDRIVE>""".format(
    "".join(
        f"""<road name="" length="200" id="{id}" junction="-1"><link/><planView><geometry s="0" x="{x}"
y="{y}" hdg="{hdg}" length="200"><line/></geometry></planView><elevationProfile><elevation s="0" a="{z}"
b="0" c="0" d="0"/></elevationProfile><lanes><laneSection s="0"><center><lane id="0" type="none"
level="false"/></center><right><lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5"
b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>"""
        for id, x, y, hdg, z in ((1, 0, 0, 0, 0), (2, 100, -100, 1.5707963267948966, 6))
    )
)


def vehicle(name: str, x: float = 0.0) -> str:
    return f'<ScenarioObject name="{name}">{VEHICLE.format(x=x)}</ScenarioObject>'


def pedestrian(name: str, mass: float = 80.0) -> str:
    return f"""<ScenarioObject name="{name}"><Pedestrian name="p" mass="{mass}" model="p"
pedestrianCategory="pedestrian"><BoundingBox><Center x="0" y="0" z="0.9"/>
<Dimensions width="0.6" length="0.5" height="1.8"/></BoundingBox><Properties/></Pedestrian>
</ScenarioObject>"""


def world(x: float, y: float, h: float | None = None) -> str:
    return f'<WorldPosition x="{x}" y="{y}"' + ("/>" if h is None else f' h="{h}"/>')


def on_lane(lane: int, s: float, offset: float = 0.0, road: int = 1) -> str:
    return f'<LanePosition roadId="{road}" laneId="{lane}" s="{s}" offset="{offset}"/>'


def private(action: str) -> str:
    return f"<PrivateAction>{action}</PrivateAction>"


def teleport(position: str) -> str:
    return f"<TeleportAction><Position>{position}</Position></TeleportAction>"


def speed(target: str, shape: str = "step", value: object = 0, dimension: str = "time") -> str:
    return f"""<LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="{shape}" value="{value}" dynamicsDimension="{dimension}"/>
<SpeedActionTarget>{target}</SpeedActionTarget></SpeedAction></LongitudinalAction>"""


def to(v: object) -> str:
    return f'<AbsoluteTargetSpeed value="{v}"/>'


def trajectory(
    *points: tuple[Any, ...],
    timing: str = "<None/>",
    attributes: str = "",
    following: str = "position",
) -> str:
    """A polyline through points x, y, perhaps with heading (None: not said) and time."""
    vertices = ""
    for k, (x, y, *more) in enumerate(points):
        h = more[0] if more else None
        t = f' time="{more[1]}"' if len(more) > 1 else f' time="{k}"' if "Timing" in timing else ""
        vertices += f"<Vertex{t}><Position>{world(x, y, h)}</Position></Vertex>"
    return f"""<RoutingAction><FollowTrajectoryAction {attributes}><TrajectoryRef>
<Trajectory name="t" closed="false"><Shape><Polyline>{vertices}</Polyline></Shape></Trajectory>
</TrajectoryRef><TimeReference>{timing}</TimeReference>
<TrajectoryFollowingMode followingMode="{following}"/></FollowTrajectoryAction></RoutingAction>"""


def synchronize(
    master: str, its_goal: str, goal: str, final: str = "", tolerance: float = 0
) -> str:
    return f"""<SynchronizeAction masterEntityRef="{master}" targetTolerance="{tolerance}"
targetToleranceMaster="{tolerance}"><TargetPositionMaster>{its_goal}</TargetPositionMaster>
<TargetPosition>{goal}</TargetPosition>{final}</SynchronizeAction>"""


def init(name: str, *actions: str) -> str:
    return f'<Private entityRef="{name}">{"".join(map(private, actions))}</Private>'


def at(name: str, lane: int, s: float, v: object = 10) -> str:
    return init(name, teleport(on_lane(lane, s)), speed(to(v)))


def condition(body: str, edge: str = "none", delay: float = 0.0) -> str:
    return f"""<ConditionGroup><Condition name="c" delay="{delay}" conditionEdge="{edge}">
{body}</Condition></ConditionGroup>"""


def by_value(body: str) -> str:
    return f"<ByValueCondition>{body}</ByValueCondition>"


def time(t: float, rule: str = "greaterOrEqual") -> str:
    return by_value(f'<SimulationTimeCondition value="{t}" rule="{rule}"/>')


def state(kind: str, name: str, state: str) -> str:
    return by_value(
        f'<StoryboardElementStateCondition storyboardElementType="{kind}" '
        f'storyboardElementRef="{name}" state="{state}"/>'
    )


def by_entity(body: str, *names: str) -> str:
    who = "".join(f'<EntityRef entityRef="{n}"/>' for n in names or ("ego",))
    return f"""<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any">{who}
</TriggeringEntities><EntityCondition>{body}</EntityCondition></ByEntityCondition>"""


def event(name: str, action: str, when: str, edge: str = "none", priority: str = "parallel") -> str:
    return f"""<Event name="{name}" priority="{priority}"><Action name="{name}_action">{action}</Action>
<StartTrigger>{condition(when, edge)}</StartTrigger></Event>"""


def story(*events: str, actor: str = "other", name: str = "story", start: str = "") -> str:
    begin = condition(start) if start else ""
    return f"""<Story name="{name}"><Act name="{name}_act"><ManeuverGroup name="{name}_group"
maximumExecutionCount="1"><Actors selectTriggeringEntities="false"><EntityRef entityRef="{actor}"/>
</Actors><Maneuver name="{name}_manoeuvre">{"".join(events)}</Maneuver></ManeuverGroup>
<StartTrigger>{begin}</StartTrigger></Act></Story>"""


def write(folder: Path, **parts: object) -> Path:
    """A file with an ego on lane -3 and another car on lane -1, unless the parts say otherwise."""
    values = {
        "minor": 2,
        "parameters": "",
        "variables": "",
        "catalogs": "",
        "road": ROAD,
        "entities": vehicle("ego") + vehicle("other"),
        "init": at("ego", -3, 100) + at("other", -1, 120),
        "stories": "",
        "stop": condition(time(float(str(parts.pop("end", 6.0))))),
    }
    path = folder / "x.xosc"
    path.write_text(FILE.format(**values | parts), encoding="utf-8")
    return path


def compiled(folder: Path, **parts: object) -> Scenario:
    return compile_scenario(write(folder, **parts))


def told(folder: Path, **parts: object) -> PlayedScenario:
    """The file played by itself, everything ideal."""
    return play_ideal(compiled(folder, **parts), 60.0)


ACTIVATE = """<ControllerAction><ActivateControllerAction longitudinal="true" lateral="false"/>
</ControllerAction>"""


def with_controller(name: str, **properties: object) -> str:
    given = "".join(f'<Property name="{k}" value="{v}"/>' for k, v in properties.items())
    controller = f"""<ObjectController><Controller name="{name}"><Properties>{given}</Properties>
</Controller></ObjectController>"""
    body = VEHICLE.format(x=0.0)
    return f'<ScenarioObject name="other">{body}{controller}</ScenarioObject>'
