"""All actions of entities, by their elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from skidpad.scenarios.actions import controllers
from skidpad.scenarios.actions.base import PrivateAction
from skidpad.scenarios.actions.beside import compile_lateral_distance
from skidpad.scenarios.actions.distance import compile_gap
from skidpad.scenarios.actions.lateral import compile_lane_change, compile_lane_offset
from skidpad.scenarios.actions.lights import compile_light_state
from skidpad.scenarios.actions.meeting import compile_synchronize
from skidpad.scenarios.actions.routing import (
    compile_acquire,
    compile_assign_route,
    compile_follow,
    compile_random_route,
    compile_teleport,
)
from skidpad.scenarios.actions.speed import compile_speed
from skidpad.scenarios.actions.speed_profile import compile_profile
from skidpad.scenarios.actions.trailers import compile_trailer
from skidpad.scenarios.context import Context
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Kind

Compile = Callable[[Node, Context], PrivateAction]

PRIVATE: Mapping[str, Compile] = {
    "TeleportAction": compile_teleport,
    "SpeedAction": compile_speed,
    "SpeedProfileAction": compile_profile,
    "LongitudinalDistanceAction": compile_gap,
    "SynchronizeAction": compile_synchronize,
    "LaneChangeAction": compile_lane_change,
    "LaneOffsetAction": compile_lane_offset,
    "LateralDistanceAction": compile_lateral_distance,
    "AssignRouteAction": compile_assign_route,
    "AcquirePositionAction": compile_acquire,
    "RandomRouteAction": compile_random_route,
    "FollowTrajectoryAction": compile_follow,
    "ControllerAction": controllers.compile_controller,
    **controllers.TABLE,  # where they stood before 1.1, and may stand since
    "VisibilityAction": controllers.compile_visibility,
    "LightStateAction": compile_light_state,
    "AnimationAction": controllers.no_effect,
    "TrailerAction": compile_trailer,
}
GROUPS = ("LongitudinalAction", "LateralAction", "RoutingAction", "AppearanceAction")


def private_action(node: Node, ctx: Context) -> PrivateAction:
    """Compiles the action inside a <PrivateAction>; an empty one is over as it begins, with a note."""
    if next(node.children(), None) is None:
        ctx.findings.append(node.finding("holds no action: nothing is done", Kind.NOTE))
        return controllers.Several(())
    inner = node.only()
    if inner.tag in GROUPS:
        inner = inner.only()
    return inner.choose(PRIVATE)(inner, ctx)
