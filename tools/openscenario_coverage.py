"""Which elements of OpenSCENARIO XML are understood: read from the tables that the compiler uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

from lxml import etree

from skidpad.scenarios.actions.controllers import TABLE as CONTROLLERS
from skidpad.scenarios.actions.private import GROUPS, PRIVATE
from skidpad.scenarios.actions.traffic import MOST, TRAFFIC
from skidpad.scenarios.actions.world import GLOBAL
from skidpad.scenarios.conditions.by_value import BY_VALUE
from skidpad.scenarios.places.positions import POSITIONS
from skidpad.scenarios.places.trajectories import SHAPES
from skidpad.scenarios.reading.schema import schema_file
from skidpad.scenarios.scenario import FURTHER_POSITIONS
from skidpad.scenarios.triggers import ENTITY_CONDITIONS

XS = "{http://www.w3.org/2001/XMLSchema}"
ENDINGS = ("Action", "Condition", "Position", "TargetLane", "TargetLaneOffset", "TargetSpeed")
INSIDE = frozenset(  # understood where they stand inside others
    {
        "AbsoluteTargetSpeed", "RelativeTargetSpeed", "AbsoluteTargetLane", "RelativeTargetLane",
        "AbsoluteTargetLaneOffset", "RelativeTargetLaneOffset", "AddEntityAction",
        "DeleteEntityAction", "SetAction", "ModifyAction", "TrafficSignalStateAction",
        "TrafficSignalControllerAction", "TrafficSignalAction", "UserDefinedAction",
        "GlobalAction", "PrivateAction", "Position", "Action", "Condition", "EntityCondition",
        "ByEntityCondition", "ByValueCondition",
        "TargetPosition", "InRoutePosition", "RoadCondition", "CustomCommandAction",
        "ConnectTrailerAction", "DisconnectTrailerAction", "TrafficStopAction",
    }
)  # fmt: skip
TILTED = "pitch and roll are those of a trajectory, pitch also by the climb of its points, else of the road"
ROUTED = (
    "chooses the way at forks, without changes of lanes where there is one; "
    "does not change lanes by itself"
)
STATES = (
    "colours and three lamps such as `on;off;off` are shown; other words are for conditions alone"
)
NAMED = "by registered names; others are noted, without effect"
CONTROLLED = (
    "of others `ACC` and `ReferenceDriver` along their lanes, `SkidpadStack`, registered names"
)
TOWED = "without slip at the trailer's axle; masses and forces do not count"
FOLLOW = "under `follow` walkers and objects are placed"
PARTIAL: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(
            (*POSITIONS, *FURTHER_POSITIONS),
            "pitch and roll of its orientation are read in vertices of polylines alone",
        ),
        "FollowTrajectoryAction": FOLLOW,
        "LaneChangeAction": FOLLOW,
        "SpeedAction": "limits of jerk act under `follow`, not on a target that goes on changing",
        "SpeedProfileAction": (
            "limits of jerk act under `follow`; where corners overlap each speed with acceleration 0"
        ),
        "LongitudinalDistanceAction": (
            "axes of the world and of trajectories are those of the entity; braking ends at once"
        ),
        "LateralDistanceAction": (
            "no limits of braking; axes of the world and of trajectories are those of the lane"
        ),
        "AppearanceAction": "lights; animations are noted, without effect",
        "LightStateAction": (
            "brake lamps and the ego's beams are drawn, all are exported as OSI; no colours, no fading"
        ),
        "VisibilityAction": "for sensors; pictures for people and other traffic go by none",
        "EnvironmentAction": "falling snow counts by its sight, wind with the setting `wind`",
        "TrafficSignalStateAction": STATES,
        "UserDefinedValueCondition": NAMED,
        "CustomCommandAction": NAMED,
        **dict.fromkeys(
            ("TrailerAction", "ConnectTrailerAction", "DisconnectTrailerAction"), TOWED
        ),
        "InfrastructureAction": STATES,
        **dict.fromkeys(("AngleCondition", "RelativeAngleCondition"), TILTED),
        "AssignControllerAction": CONTROLLED,
        "ActivateControllerAction": CONTROLLED,
        **dict.fromkeys(("AcquirePositionAction", "AssignRouteAction"), ROUTED),
        "TrafficSourceAction": f"at most {MOST} at a time; who drives them is chosen here",
        "TrafficSinkAction": "takes vehicles of traffic, never entities of the file",
        "TrafficSwarmAction": f"at most {MOST}; who drives them is chosen here",
        "TrafficAreaAction": f"at most {MOST}; who drives them is chosen here",
        "UserDefinedAction": NAMED,
        "OverrideControllerValueAction": "no clutch, no brake by force; a wheel has 1.5 turns to either side",
    }
)


class Support(Enum):
    """How far an element is understood."""

    YES = "yes"
    PARTIAL = "partial"
    NO = "no"


@dataclass(frozen=True, slots=True)
class Coverage:
    """One element of the standard."""

    element: str
    support: Support
    remark: str = ""


def without_effect() -> tuple[str, ...]:
    """Actions that are read and noted, and change nothing that this world can show."""
    silent = (tag for tag, make in PRIVATE.items() if make.__name__ == "no_effect")
    return (*silent, "SetMonitorAction")


def known_elements() -> frozenset[str]:
    """Elements that the compiler has a place for."""
    tables = (
        PRIVATE,
        GLOBAL,
        BY_VALUE,
        ENTITY_CONDITIONS,
        POSITIONS,
        FURTHER_POSITIONS,
        SHAPES,
        CONTROLLERS,
        TRAFFIC,
    )
    return INSIDE.union(GROUPS, *tables)


def coverage() -> list[Coverage]:
    """Actions, conditions, positions, targets and shapes of OpenSCENARIO XML 1.3, by name."""
    schema = etree.parse(str(schema_file("3")))
    names = {str(e.get("name")) for e in schema.iter(f"{XS}element")}
    wanted = {n for n in names if n.endswith(ENDINGS)} | set(SHAPES)
    known, silent = known_elements(), without_effect()
    found = []
    for name in sorted(wanted):
        remark = PARTIAL.get(name, "")
        if name in silent:
            found.append(Coverage(name, Support.NO, "is read and noted, without effect"))
        elif name not in known:
            found.append(Coverage(name, Support.NO))
        else:
            found.append(Coverage(name, Support.PARTIAL if remark else Support.YES, remark))
    return found
