"""OpenSCENARIO 0.9.1 as 1.0: elements and attributes that have other names since, in place.

By the rules of ASAM's migration from 0.9.1 to 1.0; what is not named here stays as it is, and is
refused by name where it matters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lxml import etree

Element = etree._Element
POSITION = {
    "World": "WorldPosition", "RelativeWorld": "RelativeWorldPosition", "Road": "RoadPosition",
    "RelativeObject": "RelativeObjectPosition", "RelativeRoad": "RelativeRoadPosition",
    "Lane": "LanePosition", "RelativeLane": "RelativeLanePosition", "Route": "RoutePosition",
}  # fmt: skip
OF_PRIVATE = {
    "Longitudinal": "LongitudinalAction", "Lateral": "LateralAction", "Routing": "RoutingAction",
    "Visibility": "VisibilityAction", "Meeting": "SynchronizeAction",
}  # fmt: skip
OF_ACTION = {
    "Private": "PrivateAction", "Global": "GlobalAction", "UserDefined": "UserDefinedAction",
}  # fmt: skip
TAGS: Mapping[str, Mapping[str, str]] = {  # by the new name of what they stand in
    "OpenSCENARIO": {"ParameterDeclaration": "ParameterDeclarations", "Catalogs": "CatalogLocations"},
    "ParameterDeclarations": {"Parameter": "ParameterDeclaration"},
    "CatalogLocations": {"DriverCatalog": "ControllerCatalog"},
    "Catalog": {"Driver": "Controller"},
    "RoadNetwork": {"Logics": "LogicFile", "SceneGraph": "SceneGraphFile"},
    "Entities": {"Object": "ScenarioObject", "Selection": "EntitySelection"},
    "Vehicle": {"ParameterDeclaration": "ParameterDeclarations"},
    "BoundingBox": {"Dimension": "Dimensions"},
    "Axles": {"Front": "FrontAxle", "Rear": "RearAxle", "Additional": "AdditionalAxle"},
    "Storyboard": {"EndConditions": "StopTrigger"},
    "Actions": {"Global": "GlobalAction", "UserDefined": "UserDefinedAction"},
    "Private": {"Action": "PrivateAction"},
    "Action": OF_ACTION,
    "Act": {"Sequence": "ManeuverGroup", "Start": "StartTrigger", "End": "StopTrigger"},
    "Actors": {"Entity": "EntityRef"},
    "TriggeringEntities": {"Entity": "EntityRef"},
    "TimeToCollisionConditionTarget": {"Entity": "EntityRef"},
    "CollisionCondition": {"ByEntity": "EntityRef"},
    "Event": {"StartConditions": "StartTrigger"},
    "Condition": {
        "ByEntity": "ByEntityCondition", "ByValue": "ByValueCondition", "ByState": "ByValueCondition",
    },
    "ByValueCondition": {
        "SimulationTime": "SimulationTimeCondition", "Parameter": "ParameterCondition",
        "AtStart": "StoryboardElementStateCondition",
        "AfterTermination": "StoryboardElementStateCondition",
    },
    "EntityCondition": {
        name: f"{name}Condition"
        for name in (
            "EndOfRoad", "Collision", "Offroad", "TimeHeadway", "TimeToCollision", "Acceleration",
            "StandStill", "Speed", "RelativeSpeed", "TraveledDistance", "ReachPosition",
            "Distance", "RelativeDistance",
        )
    },
    "TimeToCollisionCondition": {"Target": "TimeToCollisionConditionTarget"},
    "PrivateAction": OF_PRIVATE,
    "LongitudinalAction": {"Speed": "SpeedAction", "Distance": "LongitudinalDistanceAction"},
    "SpeedAction": {"Dynamics": "SpeedActionDynamics", "Target": "SpeedActionTarget"},
    "SpeedActionTarget": {"Absolute": "AbsoluteTargetSpeed", "Relative": "RelativeTargetSpeed"},
    "LongitudinalDistanceAction": {"Dynamics": "DynamicConstraints", "Limited": "DynamicConstraints"},
    "LateralAction": {
        "LaneChange": "LaneChangeAction", "LaneOffset": "LaneOffsetAction",
        "Distance": "LateralDistanceAction",
    },
    "LaneChangeAction": {"Dynamics": "LaneChangeActionDynamics", "Target": "LaneChangeTarget"},
    "LaneChangeTarget": {"Absolute": "AbsoluteTargetLane", "Relative": "RelativeTargetLane"},
    "LaneOffsetAction": {"Dynamics": "LaneOffsetActionDynamics", "Target": "LaneOffsetTarget"},
    "LaneOffsetTarget": {
        "Absolute": "AbsoluteTargetLaneOffset", "Relative": "RelativeTargetLaneOffset",
    },
    "RoutingAction": {
        "FollowRoute": "AssignRouteAction", "FollowTrajectory": "FollowTrajectoryAction",
        "AcquirePosition": "AcquirePositionAction",
    },
    "FollowTrajectoryAction": {
        "Longitudinal": "TimeReference", "Lateral": "TrajectoryFollowingMode",
    },
    "GlobalAction": {
        "SetEnvironment": "EnvironmentAction", "Entity": "EntityAction", "Parameter": "ParameterAction",
    },
    "ParameterAction": {"Set": "SetAction", "Modify": "ModifyAction"},
    "Rule": {"Add": "AddValue", "Multiply": "MultiplyByValue"},
    "EntityAction": {"Add": "AddEntityAction", "Delete": "DeleteEntityAction"},
    "Position": POSITION,
    "TargetPosition": POSITION,
    "TargetPositionMaster": POSITION,
    "RoutePosition": {"Position": "InRoutePosition"},
    "InRoutePosition": {
        "Current": "FromCurrentEntity", "RoadCoord": "FromRoadCoordinates",
        "LaneCoord": "FromLaneCoordinates",
    },
}  # fmt: skip
OWNER = "$owner"  # in a story: the entity that its attribute `owner` names
ATTRIBUTES: Mapping[str, Mapping[str, str]] = {  # by the new name of the element
    "ParameterDeclaration": {"type": "parameterType"},
    "Vehicle": {"category": "vehicleCategory"},
    "Pedestrian": {"category": "pedestrianCategory"},
    "MiscObject": {"category": "miscObjectCategory"},
    "Private": {"object": "entityRef"},
    "ManeuverGroup": {"numberOfExecutions": "maximumExecutionCount"},
    "EntityRef": {"name": "entityRef"},
    "Condition": {"edge": "conditionEdge"},
    "TriggeringEntities": {"rule": "triggeringEntitiesRule"},
    "ParameterCondition": {"name": "parameterRef"},
    "ParameterAction": {"name": "parameterRef"},
    "Waypoint": {"strategy": "routeStrategy"},
    "RelativeDistanceCondition": {"type": "relativeDistanceType"},
    "RoadPosition": {"id": "roadId"},
    "EntityAction": {"name": "entityRef"},
    "Precipitation": {"type": "precipitationType"},
    "RoadCondition": {"frictionScale": "frictionScaleFactor"},
    "RelativeTargetSpeed": {"valueType": "speedTargetValueType"},
    "SpeedActionDynamics": {"shape": "dynamicsShape"},
    "LaneChangeActionDynamics": {"shape": "dynamicsShape"},
    "LaneOffsetActionDynamics": {"shape": "dynamicsShape"},
    "TrajectoryFollowingMode": {"purpose": "followingMode"},
    "Timing": {"domain": "domainAbsoluteRelative"},
}
WORDS = {
    "rule": {"greater_than": "greaterThan", "less_than": "lessThan", "equal_to": "equalTo"},
    "conditionEdge": {"any": "risingOrFalling"},
    "relativeDistanceType": {"inertial": "cartesianDistance"},
    "followingMode": {"steering": "follow"},
}
DIMENSIONS = ("rate", "time", "distance")
STATES = {"AtStart": "startTransition", "end": "endTransition", "cancel": "stopTransition"}
ELEMENT_REF = "storyboardElementRef"  # where it is, the content is newer than the header says
A_MAX = "200"  # m/s^2, as in ASAM's migration; 0.9.1 knows no largest acceleration


def renew(root: Element) -> None:
    """Gives everything under the root, in place, the name that it has since 1.0."""
    for element in list(root.iter("*")):
        parent = element.getparent()
        inside = "" if parent is None else str(parent.tag)
        old = str(element.tag)
        if old == "Story":
            _name_owner(element)
        if old == "Conditions" and inside == "Act":
            _lift(element)
            continue
        element.tag = TAGS.get(inside, {}).get(old, old)
        _rename(element, old)
        special = SPECIAL.get(str(element.tag))
        if special is not None:
            special(element)


def _name_owner(story: Element) -> None:
    """Puts the owner's name, in place, where something in a story is its keyword `$owner`."""
    owner = str(story.get("owner", ""))
    for element in story.iter("*") if owner else ():
        for key, value in element.attrib.items():
            if value == OWNER:
                element.set(key, owner)


def _rename(element: Element, old: str) -> None:
    """Renames an element's attributes and values of old versions in place to those of the newest one."""
    names = ATTRIBUTES.get(str(element.tag), {})
    for name, value in list(element.attrib.items()):
        key = str(name)
        new = names.get(key, "entityRef" if key in ("object", "entity") else key)
        if new != key:
            del element.attrib[key]
        element.set(new, WORDS.get(new, {}).get(str(value), str(value)))
    if str(element.tag) == "StoryboardElementStateCondition" and not element.get(ELEMENT_REF):
        kind, name = element.attrib.pop("type", ""), element.attrib.pop("name", "")
        state = STATES.get(old) or STATES.get(str(element.attrib.pop("rule", "")), "completeState")
        element.set("storyboardElementType", "maneuver" if kind == "sequence" else str(kind))
        element.set(ELEMENT_REF, str(name))
        element.set("state", state)


def _lift(element: Element) -> None:
    """Moves the triggers in <Conditions> of an act into the act itself, in place."""
    parent = element.getparent()
    assert parent is not None
    for child in list(element):
        parent.append(child)
        child.tag = TAGS["Act"].get(str(child.tag), str(child.tag))
    parent.remove(element)


def _dynamics(element: Element) -> None:
    """Replaces the attribute rate, time or distance in place by dynamicsDimension and value."""
    found = [d for d in DIMENSIONS if element.get(d) is not None]
    if not found or element.get("value") is not None:
        return
    chosen = next((d for d in found if element.get(d) not in ("0", "0.0")), found[0])
    element.set("dynamicsDimension", chosen)
    element.set("value", str(element.get(chosen)))
    for name in found:
        del element.attrib[name]


def _performance(element: Element) -> None:
    """Adds the missing maxAcceleration of version 0.9.1 in place, as ASAM's migration does."""
    if element.get("maxAcceleration") is None:
        element.set("maxAcceleration", A_MAX)


def _private(element: Element) -> None:
    """Puts the position of a private action, in place, into a teleport."""
    place = element.find("Position")
    if place is not None:
        teleport = etree.SubElement(element, "TeleportAction")
        teleport.sourceline = place.sourceline
        teleport.append(place)


def _actors(element: Element) -> None:
    """Replaces the element ByCondition in place by the attribute selectTriggeringEntities."""
    chosen = element.find("ByCondition")
    if chosen is not None:
        element.set("selectTriggeringEntities", "true")
        element.remove(chosen)


def _time(element: Element) -> None:
    """Joins the elements Date and Time in place into the attribute dateTime, where both are there."""
    clock, date = element.find("Time"), element.find("Date")
    if clock is not None and date is not None:
        day = "-".join(str(date.get(k, "1")).zfill(2) for k in ("year", "month", "day"))
        hour, minute = (str(clock.get(k, "0")).zfill(2) for k in ("hour", "min"))
        element.set("dateTime", f"{day}T{hour}:{minute}:00")


def _meeting(element: Element) -> None:
    """Names master and places of a meeting of 0.9.1 as a synchronisation does, in place.

    One with an offset in time is left: later versions do not have it.
    """
    relative, place = element.find("Relative"), element.find("Position")
    there = None if relative is None else relative.find("Position")
    if relative is None or place is None or there is None:
        return
    if str(relative.get("offsetTime", "0")).strip("0."):
        return
    element.set("masterEntityRef", str(relative.get("object", "")))
    element.attrib.pop("mode", "")
    place.tag, there.tag = "TargetPosition", "TargetPositionMaster"
    element.replace(relative, there)


def _trajectory(element: Element) -> None:
    """Puts the shape around the vertices, in place; only lines from point to point are taken over."""
    vertices = element.findall("Vertex")
    if not vertices or any(v.find("Shape/Polyline") is None for v in vertices):
        return
    line = etree.SubElement(etree.SubElement(element, "Shape"), "Polyline")
    for vertex in vertices:
        vertex.set("time", str(vertex.attrib.pop("reference", "0")))
        shape = vertex.find("Shape")
        if shape is not None:
            vertex.remove(shape)
        line.append(vertex)


SPECIAL: Mapping[str, Callable[[Element], None]] = {
    "SpeedActionDynamics": _dynamics,
    "LaneChangeActionDynamics": _dynamics,
    "Performance": _performance,
    "PrivateAction": _private,
    "Actors": _actors,
    "SynchronizeAction": _meeting,
    "TimeOfDay": _time,
    "Trajectory": _trajectory,
}
