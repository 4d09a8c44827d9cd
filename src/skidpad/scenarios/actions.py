"""Actions: one small class each, found through the tables at the end."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi
from typing import Protocol

from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand
from skidpad.scenarios.motion import Polyline, Shape, Transition
from skidpad.scenarios.positions import position
from skidpad.scenarios.reader import Node, Unsupported
from skidpad.scenarios.scene import Actor, Running, Scene

STEEPEST = {Shape.LINEAR: 1.0, Shape.SINUSOIDAL: pi / 2.0, Shape.CUBIC: 1.5}  # of the mean rate


class PrivateAction(Protocol):
    """Something that one entity does."""

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Start it for an entity."""
        ...


class GlobalAction(Protocol):
    """Something that happens to the world."""

    def begin(self, scene: Scene) -> Running:
        """Start it."""
        ...


class Done:
    """An action that takes no time."""

    def step(self, scene: Scene) -> bool:
        """It is over at once."""
        del scene
        return True


DONE = Done()


class Dynamics:
    """How fast a change is: a shape, and a time, a rate or a distance."""

    def __init__(self, node: Node) -> None:
        self.shape = Shape(node.choice("dynamicsShape", tuple(s.value for s in Shape)))
        self.value = node.number("value")
        self.dimension = node.choice("dynamicsDimension", ("time", "rate", "distance"))
        if node.text("followingMode", "position") != "position":
            raise Unsupported(node, "followingMode other than position is not supported")
        if self.value < 0.0 or (self.value == 0.0 and self.dimension == "rate"):
            raise node.error(f"value must be positive, got {self.value:g}")

    def over(self, span: float, v: float) -> float:
        """Duration in s of a change by `span`; v: speed, for changes over a distance."""
        if self.shape is Shape.STEP:
            return 0.0
        if self.dimension == "time":
            return self.value
        if self.dimension == "rate":
            return abs(span) * STEEPEST[self.shape] / self.value
        return self.value / max(v, 0.1)


class Speed:
    """Change of the demanded speed."""

    def __init__(self, node: Node) -> None:
        self.dynamics = Dynamics(node.child("SpeedActionDynamics"))
        target = node.child("SpeedActionTarget").only()
        self.other: str | None = None
        self.factor = False
        if target.tag == "RelativeTargetSpeed":
            self.other = target.text("entityRef")
            kind = target.choice("speedTargetValueType", ("delta", "factor"))
            self.factor = kind == "factor"
            if target.flag("continuous", default=False):
                raise Unsupported(target, "continuous relative speeds are not supported")
        elif target.tag != "AbsoluteTargetSpeed":
            raise Unsupported(target)
        self.value = target.number("value")

    def target(self, scene: Scene) -> float:
        """Speed at the end, m/s."""
        if self.other is None:
            return self.value
        v = scene.actors[self.other].v
        return v * self.value if self.factor else v + self.value

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """From the speed demanded so far."""
        v, end = actor.lane.v, self.target(scene)
        # a change over a distance takes place at the mean of both speeds
        duration = self.dynamics.over(end - v, 0.5 * (v + end))
        change = Transition(v, end, duration, self.dynamics.shape)
        actor.longitudinal = ChangeOfSpeed(actor, change, scene.t)
        return actor.longitudinal


class ChangeOfSpeed:
    """A speed action under way."""

    def __init__(self, actor: Actor, change: Transition, began: float) -> None:
        self.actor, self.change, self.began = actor, change, began

    def step(self, scene: Scene) -> bool:
        """Demand the speed of the end of this step."""
        if self.actor.longitudinal is not self:
            return True
        t = scene.t + scene.dt - self.began
        lane = self.actor.lane
        lane.v, lane.a, _ = self.change.at(t)
        return self.change.over(t)


class LaneChange:
    """Go to another lane."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.dynamics = Dynamics(node.child("LaneChangeActionDynamics"))
        target = node.child("LaneChangeTarget").only()
        if target.tag not in ("RelativeTargetLane", "AbsoluteTargetLane"):
            raise Unsupported(target)
        if node.number("targetLaneOffset", 0.0) != 0.0:
            raise Unsupported(node, "targetLaneOffset is not supported")
        try:
            self.value = int(target.text("value"))
        except ValueError:
            raise target.error("value must be a lane id or a number of lanes") from None
        relative = target.tag == "RelativeTargetLane"
        self.other = target.text("entityRef") if relative else None

    def lanes_left(self, scene: Scene, actor: Actor) -> int:
        """How many lanes to the left of the entity's own the target lies."""
        here = actor.lane.base
        if here is None:
            raise self.node.error(f"{actor.name} is on no lane")
        if self.other is None:
            # ids grow to the left on right-hand lanes, and fall to it on left-hand ones
            return self.value - here.lane_id if here.lane_id < 0 else here.lane_id - self.value
        if self.other == actor.name:
            return self.value
        other = scene.actors[self.other].lane.base
        if other is None:
            raise self.node.error(f"{self.other} is on no lane")
        sign = 1 if here.lane_id < 0 else -1
        return self.value + sign * (other.lane_id - here.lane_id)

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """From where the entity is now."""
        actor.lane.advance(actor.motion)
        lanes = self.lanes_left(scene, actor)
        shift = actor.lane.change(lanes)
        if shift is None:
            raise self.node.error(f"{actor.name} has no lane {lanes} to the left")
        duration = self.dynamics.over(shift, actor.v)
        change = Transition(actor.lane.offset, 0.0, duration, self.dynamics.shape)
        actor.lateral = ChangeOfOffset(actor, change, scene.t)
        return actor.lateral


class LaneOffset:
    """Keep to a lateral offset from the lane's centre."""

    def __init__(self, node: Node) -> None:
        self.continuous = node.flag("continuous", default=False)
        dynamics = node.child("LaneOffsetActionDynamics")
        self.shape = Shape(dynamics.choice("dynamicsShape", tuple(s.value for s in Shape)))
        self.a_most = dynamics.number("maxLateralAcc", 1.0)
        target = node.child("LaneOffsetTarget").only()
        if target.tag != "AbsoluteTargetLaneOffset":
            raise Unsupported(target)
        self.value = target.number("value")

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """The duration follows from the largest lateral acceleration of a cosine."""
        span = self.value - actor.lane.offset
        duration = pi * (abs(span) / (2.0 * self.a_most)) ** 0.5
        change = Transition(actor.lane.offset, self.value, duration, self.shape)
        actor.lateral = ChangeOfOffset(actor, change, scene.t)
        return actor.lateral


class ChangeOfOffset:
    """A sideways motion under way."""

    def __init__(self, actor: Actor, change: Transition, began: float) -> None:
        self.actor, self.change, self.began = actor, change, began

    def step(self, scene: Scene) -> bool:
        """Demand the offset of the end of this step."""
        if self.actor.lateral is not self:
            return True
        t = scene.t + scene.dt - self.began
        lane = self.actor.lane
        lane.offset, lane.offset_rate, lane.offset_bend = self.change.at(t)
        return self.change.over(t)


class Teleport:
    """Be somewhere else."""

    def __init__(self, node: Node) -> None:
        self.position = position(node.child("Position"))

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """At once, keeping the demanded speed."""
        pose = self.position.pose(scene, actor.name)
        actor.put(scene.map, pose, actor.lane.v)
        return DONE


class FollowTrajectory:
    """Go along a polyline by its times."""

    def __init__(self, node: Node) -> None:
        trajectory = node.find("Trajectory") or node.find("TrajectoryRef", "Trajectory")
        if trajectory is None:
            raise Unsupported(node, "only trajectories written out in the file are supported")
        if trajectory.flag("closed", default=False):
            raise Unsupported(trajectory, "closed trajectories are not supported")
        shape = trajectory.child("Shape").only()
        if shape.tag != "Polyline":
            raise Unsupported(shape)
        mode = node.find("TrajectoryFollowingMode")
        if mode is not None:
            mode.choice("followingMode", ("position",))
        self.relative, self.scale, self.shift = _timing(node)
        self.vertices = [_vertex(v) for v in shape.children("Vertex")]
        if not self.vertices:
            raise shape.error("needs at least one <Vertex>")
        times = [t for t, _ in self.vertices]
        if any(b < a for a, b in pairwise(times)):
            raise shape.error("the times of its vertices must not fall")

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Absolute times count from the begin of the scenario."""
        begin = self.shift + (scene.t if self.relative else 0.0)
        rows = [(begin + t * self.scale, pose) for t, pose in self.vertices]
        track = Polyline(rows)
        actor.track = track
        return Following(actor, track)


def _timing(node: Node) -> tuple[bool, float, float]:
    """Whether times are relative to the action's begin, their scale and offset."""
    reference = node.find("TimeReference") or node
    timing = reference.find("Timing")
    if timing is None:
        raise Unsupported(node, "a <TimeReference> without <Timing> is not supported")
    domain = timing.choice("domainAbsoluteRelative", ("absolute", "relative"))
    return domain == "relative", timing.number("scale", 1.0), timing.number("offset", 0.0)


def _vertex(node: Node) -> tuple[float, Pose]:
    inner = node.child("Position").only()
    if inner.tag != "WorldPosition":
        raise Unsupported(inner, "vertices need a <WorldPosition>")
    pose = Pose(
        inner.number("x"), inner.number("y"), inner.number("z", 0.0), yaw=inner.number("h", 0.0)
    )
    return node.number("time"), pose


class Following:
    """A trajectory under way."""

    def __init__(self, actor: Actor, track: Polyline) -> None:
        self.actor, self.track = actor, track

    def step(self, scene: Scene) -> bool:
        """Until the last vertex; the entity then stands there."""
        return self.actor.track is not self.track or scene.t >= self.track.end


class AddEntity:
    """Appear."""

    def __init__(self, node: Node) -> None:
        self.name = node.text("entityRef")
        self.position = position(node.child("AddEntityAction", "Position"))

    def begin(self, scene: Scene) -> Running:
        """At a place, with the speed demanded so far."""
        actor = scene.actors[self.name]
        actor.put(scene.map, self.position.pose(scene, self.name), actor.lane.v)
        return DONE


class DeleteEntity:
    """Vanish."""

    def __init__(self, node: Node) -> None:
        self.name = node.text("entityRef")

    def begin(self, scene: Scene) -> Running:
        """From the next step on."""
        actor = scene.actors[self.name]
        actor.present = False
        actor.word = ActorCommand(self.name, present=False)
        return DONE


PRIVATE: dict[str, Callable[[Node], PrivateAction]] = {
    "SpeedAction": Speed,
    "LaneChangeAction": LaneChange,
    "LaneOffsetAction": LaneOffset,
    "TeleportAction": Teleport,
    "FollowTrajectoryAction": FollowTrajectory,
}
GLOBAL: dict[str, Callable[[Node], GlobalAction]] = {
    "AddEntityAction": AddEntity,
    "DeleteEntityAction": DeleteEntity,
}
GROUPS = ("LongitudinalAction", "LateralAction", "RoutingAction")


def private_action(node: Node) -> PrivateAction:
    """The action inside a <PrivateAction>."""
    inner = node.only()
    if inner.tag in GROUPS:
        inner = inner.only()
    if inner.tag not in PRIVATE:
        raise Unsupported(inner)
    return PRIVATE[inner.tag](inner)


def global_action(node: Node) -> GlobalAction:
    """The action inside a <GlobalAction>."""
    inner = node.only()
    if inner.tag != "EntityAction":
        raise Unsupported(inner)
    leaf = inner.only()
    if leaf.tag not in GLOBAL:
        raise Unsupported(leaf)
    return GLOBAL[leaf.tag](inner)
