"""The three scenarios of the friction study, written from here as OpenSCENARIO XML (B-090 to B-092).

`make data` writes the files of the catalogue anew: each as 1.2, and as
1.0 for ScenarioRunner. Everything that repeats vary is a parameter of the file.

What ScenarioRunner 0.9.16 reads otherwise, and what the 1.0 files do about it: it measures lane
changes by length only, so they have one; it ends with the last event, does not look at the stop
trigger, and waits a delay before it asks, so a last event waits for the time limit; it judges by
conditions named `criteria_...`, of which one asks for collisions. By the standard that one never
holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from shutil import copyfile
from typing import Any
from xml.etree import ElementTree

from scenariogeneration import xosc

from skidpad.roads.bundled import map_file
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.shipped import FOLDER

ROAD = "straight"
EPOCH = datetime(2026, 1, 1)  # noqa: DTZ001  # the library writes naive times
LANE = -2  # the ego's; -1 lies to its left
T_END = 40.0  # s
AFTERMATH = 12.0  # s from the last event to the end
STANDING = 3.0  # s of standing still that end a run
EGO, GHOST, LEAD, SECOND = "ego", "ghost", "lead", "second"
LONG_AGO = -0.1  # s


@dataclass(frozen=True, slots=True)
class Car:
    """A vehicle as OpenSCENARIO describes it; sizes in m."""

    blueprint: str
    length: float
    width: float
    height: float
    wheelbase: float
    mass: float


COOPER = Car("vehicle.mini.cooper_s", 3.81, 1.97, 1.48, 2.47, 1250.0)
SALOON = Car("vehicle.tesla.model3", 4.69, 1.85, 1.44, 2.88, 1840.0)


@dataclass(frozen=True, slots=True)
class Writer:
    """What differs between versions of OpenSCENARIO."""

    version: OscVersion

    @property
    def old(self) -> bool:
        """1.0."""
        return self.version is OscVersion.V1_0

    def after(self, value: Any) -> Any:
        """Simulation time; OpenSCENARIO 1.0 knows no `greaterOrEqual`."""
        rule = xosc.Rule.greaterThan if self.old else xosc.Rule.greaterOrEqual
        return xosc.SimulationTimeCondition(value, rule)

    @property
    def at_once(self) -> Any:
        """Fulfilled from the first step on."""
        return self.after(LONG_AGO if self.old else 0)

    def event(self, name: str, trigger: Any, **actions: Any) -> Any:
        """An event with one action or more."""
        parallel = xosc.Priority.parallel
        event = xosc.Event(name, parallel)
        for label, action in actions.items():
            event.add_action(f"{name}_{label}", action)
        event.add_trigger(trigger)
        return event

    def vehicle(self, car: Car, properties: Mapping[str, str]) -> Any:
        """A vehicle with its box and axles."""
        box = xosc.BoundingBox(car.width, car.length, car.height, 0.0, 0.0, car.height / 2.0)
        mass = {} if self.old else {"mass": car.mass}
        front = xosc.Axle(0.5, 0.62, 1.5, 0.5 * car.wheelbase, 0.31)
        rear = xosc.Axle(0.0, 0.62, 1.5, -0.5 * car.wheelbase, 0.31)
        category = xosc.VehicleCategory.car
        vehicle = xosc.Vehicle(car.blueprint, category, box, front, rear, 60.0, 8.0, 10.0, **mass)
        for name, value in properties.items():
            vehicle.add_property(name, value)
        return vehicle


def when(name: str, condition: Any, actor: str | None = None, delay: float = 0.0) -> Any:
    """A trigger of one condition; by an actor or by value."""
    none = xosc.ConditionEdge.none
    if actor is None:
        return xosc.ValueTrigger(name, delay, none, condition)
    return xosc.EntityTrigger(name, delay, none, condition, actor)


def speed(target: Any, rate: Any) -> Any:
    """Change of speed at a constant rate."""
    shape, dimension = xosc.DynamicsShapes.linear, xosc.DynamicsDimension.rate
    return xosc.AbsoluteSpeedAction(target, xosc.TransitionDynamics(shape, dimension, rate))


def swerve_right(w: Writer, actor: str, name: str) -> Any:
    """Change to the next lane on the right; its time, in 1.0 its length, is a parameter."""
    shape = xosc.DynamicsShapes.sinusoidal
    dimension = xosc.DynamicsDimension.distance if w.old else xosc.DynamicsDimension.time
    size = f"${name}Length" if w.old else f"${name}Time"
    return xosc.RelativeLaneChangeAction(-1, actor, xosc.TransitionDynamics(shape, dimension, size))


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One scenario: parameters with defaults (SI), actors with lane, place and speed, and events."""

    name: str
    title: str
    parameters: Mapping[str, float]
    actors: Mapping[str, tuple[int, str, str]]  # name to lane, s, speed
    events: Callable[[Writer], Mapping[str, list[Any]]]  # by actor
    last: str  # name of the event after which the scenario is over
    route_length: float  # m, median way on dry road, of which a collision leaves a share (B-105)
    lengths: Mapping[str, tuple[str, float]] = field(default_factory=dict)  # m, for times in 1.0

    def declared(self, w: Writer) -> dict[str, float]:
        """The parameters of a file."""
        renamed = self.lengths if w.old else {}
        return dict(renamed.get(item[0], item) for item in self.parameters.items())


def ghost_cut_in(w: Writer) -> Mapping[str, list[Any]]:
    """From behind in the left lane; merges at a distance, then slows (B-073, B-090)."""
    near = xosc.RelativeDistanceCondition(
        "$MergeDistance",
        xosc.Rule.lessThan,
        xosc.RelativeDistanceType.longitudinal,
        EGO,
        freespace=False,
    )
    merged = xosc.StoryboardElementStateCondition(
        xosc.StoryboardElementType.event, "merge", xosc.StoryboardElementState.completeState
    )
    merge = w.event(
        "merge", when("near_the_ego", near, GHOST), lane=swerve_right(w, GHOST, "Merge")
    )
    slow = w.event("slow", when("merged", merged), speed=speed("$GhostEndSpeed", "$Deceleration"))
    return {GHOST: [merge, slow]}


def lead_slowdown(w: Writer) -> Mapping[str, list[Any]]:
    """The vehicle ahead slows and stops (B-091)."""
    travelled = xosc.TraveledDistanceCondition("$TriggerDistance")
    slow = w.event(
        "slow", when("lead_has_driven", travelled, LEAD), speed=speed(0, "$Deceleration")
    )
    return {LEAD: [slow]}


def front_accident(w: Writer) -> Mapping[str, list[Any]]:
    """Two vehicles ahead collide while slowing (B-092)."""

    def travelled() -> Any:
        return xosc.TraveledDistanceCondition("$TriggerDistance")

    swerve = w.event(
        "swerve",
        when("second_has_driven", travelled(), SECOND),
        lane=swerve_right(w, SECOND, "Swerve"),
        speed=speed(0, "$SecondDeceleration"),
    )
    slow = w.event(
        "slow", when("lead_follows", travelled(), SECOND), speed=speed(0, "$LeadDeceleration")
    )
    return {SECOND: [swerve], LEAD: [slow]}


SCENARIOS = (
    Scenario(
        name="ghost_cut_in",
        title="Ghost cut-in: a vehicle from behind swerves in front of the ego and slows",
        parameters={
            "EgoSpeed": 0.0,  # from rest, as the spawn delay needs (G-3)
            "CruiseSpeed": 13.9,
            "GhostS": 37.0,
            "GhostSpeed": 24.0,  # 86 km/h: well above the ego's (B-073)
            "MergeDistance": 2.0,  # m from centre to centre along the road, the repaired value
            "MergeTime": 2.0,
            "GhostEndSpeed": 4.0,
            "Deceleration": 5.0,
        },
        actors={EGO: (LANE, "100", "$EgoSpeed"), GHOST: (LANE + 1, "$GhostS", "$GhostSpeed")},
        events=ghost_cut_in,
        last="slow",
        route_length=155.0,
        lengths={"MergeTime": ("MergeLength", 48.0)},
    ),
    Scenario(
        name="lead_slowdown",
        title="Lead slowdown: the vehicle ahead slows and finally stops",
        parameters={
            "EgoSpeed": 22.2,  # 80 km/h
            "CruiseSpeed": 22.2,
            "LeadS": 128.0,
            "LeadSpeed": 22.2,
            "TriggerDistance": 30.0,
            "Deceleration": 6.0,
        },
        actors={EGO: (LANE, "100", "$EgoSpeed"), LEAD: (LANE, "$LeadS", "$LeadSpeed")},
        events=lead_slowdown,
        last="slow",
        route_length=90.0,
    ),
    Scenario(
        name="front_accident",
        title="Front accident: two vehicles ahead collide with one another while slowing",
        parameters={
            "EgoSpeed": 22.2,
            "CruiseSpeed": 22.2,
            "LeadS": 140.0,
            "LeadSpeed": 22.2,
            "SecondS": 148.0,
            "SecondSpeed": 22.2,
            "TriggerDistance": 40.0,
            "SwerveTime": 1.5,
            "SecondDeceleration": 6.0,
            "LeadDeceleration": 3.0,
        },
        actors={
            EGO: (LANE, "100", "$EgoSpeed"),
            LEAD: (LANE, "$LeadS", "$LeadSpeed"),
            SECOND: (LANE + 1, "$SecondS", "$SecondSpeed"),
        },
        events=front_accident,
        last="slow",
        route_length=130.0,
        lengths={"SwerveTime": ("SwerveLength", 33.3)},
    ),
)


def build(scenario: Scenario, version: OscVersion) -> ElementTree.Element:
    """The file's root element."""
    xosc.VersionBase().setVersion(minor=version.minor)  # a class variable of the whole library
    w = Writer(version)
    parameters, entities, init = xosc.ParameterDeclarations(), xosc.Entities(), xosc.Init()
    for name, value in scenario.declared(w).items():
        parameters.add_parameter(xosc.Parameter(name, xosc.ParameterType.double, str(value)))
    for name, (lane, s, v) in scenario.actors.items():
        entities.add_scenario_object(name, w.vehicle(*_role(scenario, name)))
        init.add_init_action(name, xosc.TeleportAction(xosc.LanePosition(s, 0, lane, 1)))
        init.add_init_action(name, _at_once(v))
    act = xosc.Act("act", when("start", w.at_once))
    for actor, events in scenario.events(w).items():
        if w.old and scenario.last in [event.name for event in events]:
            events.append(w.event("rest", when("time_is_up", w.after(T_END)), speed=_at_once(0)))
        manoeuvre = xosc.Maneuver(f"{actor}_manoeuvre")
        for event in events:
            manoeuvre.add_event(event)
        group = xosc.ManeuverGroup(f"{actor}_group")
        group.add_actor(actor)
        group.add_maneuver(manoeuvre)
        act.add_maneuver_group(group)
    story = xosc.Story("story")
    story.add_act(act)
    storyboard = xosc.StoryBoard(init, _stop(scenario, w))
    storyboard.add_story(story)
    root: ElementTree.Element = xosc.Scenario(
        scenario.title,
        "Skidpad",
        parameters,
        entities,
        storyboard,
        xosc.RoadNetwork(f"{ROAD}.xodr"),
        xosc.Catalog(),
        osc_minor_version=version.minor,
        creation_date=EPOCH,
    ).get_element()
    return root


def _role(scenario: Scenario, name: str) -> tuple[Car, dict[str, str]]:
    if name != EGO:
        return SALOON, {"type": "simulation"}
    route = {"route_length": f"{scenario.route_length:g}", "cruise_speed": "$CruiseSpeed"}
    return COOPER, {"type": "ego_vehicle", **route}


def _at_once(v: Any) -> Any:
    """A speed without transition."""
    step = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0)
    return xosc.AbsoluteSpeedAction(v, step)


def _stop(scenario: Scenario, w: Writer) -> Any:
    """After the last event and its aftermath, when the ego has come to a stop, or at the limit."""
    over = xosc.StoryboardElementStateCondition(
        xosc.StoryboardElementType.event, scenario.last, xosc.StoryboardElementState.completeState
    )
    stands = xosc.EntityTrigger(
        "ego_stands",
        0,
        xosc.ConditionEdge.none,
        xosc.StandStillCondition(STANDING),
        EGO,
        triggeringpoint="stop",
    )
    none = xosc.ConditionEdge.none
    triggers = [
        xosc.ValueTrigger("over", AFTERMATH, none, over, "stop"),
        stands,
        xosc.ValueTrigger("time_is_up", 0, none, w.after(T_END), "stop"),
    ]
    if w.old:
        never = xosc.ParameterCondition("EgoSpeed", 0, xosc.Rule.lessThan)
        triggers.append(xosc.ValueTrigger("criteria_CollisionTest", 0, none, never, "stop"))
    stop = xosc.Trigger("stop")
    for trigger in triggers:
        group = xosc.ConditionGroup("stop")
        group.add_condition(trigger)
        stop.add_conditiongroup(group)
    return stop


def file_name(name: str, version: OscVersion) -> str:
    """1.2 has the plain name."""
    return f"{name}.xosc" if version is OscVersion.V1_2 else f"{name}_{version.value}.xosc"


def write(folder: Path, scenarios: Iterable[Scenario] = SCENARIOS) -> list[Path]:
    """Write the files of all versions, and the road beside them."""
    paths = []
    for scenario in scenarios:
        for version in OscVersion:
            path = folder / file_name(scenario.name, version)
            root = build(scenario, version)
            ElementTree.indent(root, "  ")
            ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
            paths.append(path)
    road = folder / f"{ROAD}.xodr"
    copyfile(map_file(ROAD), road)
    return [*paths, road]


if __name__ == "__main__":
    for path in write(FOLDER):
        print(path)
