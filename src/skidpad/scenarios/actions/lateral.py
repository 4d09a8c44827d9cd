"""Sideways: to another lane, to an offset in the lane."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sqrt

from skidpad.scenarios.actions.base import (
    ASIDE,
    Dimension,
    Dynamics,
    Following,
    dynamics,
    note_bound,
)
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.motion import SHARPEST, SLOW, Guide, Shape, Transition
from skidpad.scenarios.movement.network import next_lane_id
from skidpad.scenarios.movement.steering import LaneSteering, look_ahead
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Axles
from skidpad.scenarios.scene import DONE, Actor, Running, Scene

A_LATERAL = 1.0  # m/s^2, of a change of offset for which the file gives no limit


class ChangeOfOffset:
    """A sideways motion under way; by_way: its shape runs over distance instead of time.

    to_lane: the entity goes on at the speed that it has when this action's turn comes in a step,
    so that a change of speed later in the file acts a step later. A motion within the lane begins
    at the end of the step in which the action begins, one to another lane at its beginning. Both as
    in esmini.
    """

    def __init__(
        self, actor: Actor, change: Transition, *, by_way: bool = False, to_lane: bool = False
    ) -> None:
        self.actor, self.change, self.by_way, self.done = actor, change, by_way, 0.0
        self.to_lane, self.noted = to_lane, False

    def step(self, scene: Scene) -> bool:
        """Sets the offset demanded for the end of this step; True once the action is over.

        An actor that stands does not move aside.
        """
        actor, guide = self.actor, self.actor.guide
        if actor.lateral is not self or actor.track is not None:
            return True
        v = abs(guide.v)
        if v < SLOW and not self.change.over(self.done):
            guide.offset_rate = guide.offset_bend = 0.0
            return False
        guide.adds_offset = not self.to_lane
        if self.to_lane:
            guide.pace = guide.v
        _, slope, _ = self.change.at(self.done)
        pace = v / sqrt(1.0 + slope * slope) if self.by_way else 1.0
        if not self.by_way and abs(slope) > v:
            pace = v / abs(slope)  # no actor goes sideways faster than it goes
            self._note(scene, abs(slope), v)
        begin, self.done = self.done, self.done + pace * scene.dt
        now = self.done if self.to_lane else begin
        guide.offset, slope, bend = self.change.at(now)
        guide.offset_rate, guide.offset_bend = slope * pace, bend * pace * pace
        return self.change.over(now)

    def _note(self, scene: Scene, asked: float, applied: float) -> None:
        """Notes once that it should move aside faster than it goes."""
        element = "LaneChangeAction" if self.to_lane else "LaneOffsetAction"
        if not self.noted:
            self.noted = note_bound(scene, self.actor, element, asked, applied, ASIDE)


class SteeredChange(ChangeOfOffset):
    """A sideways motion that a vehicle steers to; it is done when the vehicle is there."""

    def __init__(self, actor: Actor, axles: Axles, change: Transition, *, by_way: bool) -> None:
        super().__init__(actor, change, by_way=by_way, to_lane=True)
        self.steering = actor.lane_steering = actor.lane_steering or LaneSteering(axles)
        self.steering.settled = False

    def step(self, scene: Scene) -> bool:
        """Sets the offset demanded, and aims at the one further on; True when the vehicle is there."""
        if self.actor.lateral is not self or self.actor.track is not None:
            return True
        over, v = super().step(scene), abs(self.actor.guide.v)
        way = look_ahead(self.steering.axles, v)
        self.actor.guide.pace = None
        self.steering.offset, _, _ = self.change.at(
            self.done + (way if self.by_way else way / max(v, SLOW))
        )
        return over and self.steering.settled


class OffsetKept(ChangeOfOffset):
    """An offset that is gone to and then kept until another action takes over."""

    def __init__(self, actor: Actor, change: Transition, action: LaneOffset) -> None:
        super().__init__(actor, change)
        self.action, self.there = action, False

    def step(self, scene: Scene) -> bool:
        """Stays beside the reference entity, moving aside no faster than it goes itself.

        True once another action has taken its place.
        """
        if not self.there:
            self.there = super().step(scene)
        elif self.actor.lateral is self:
            guide = self.actor.guide
            most = abs(guide.v) * scene.dt
            way = self.action.target(scene, self.actor) - guide.offset
            move = min(max(way, -most), most)
            self._note(scene, abs(way) / scene.dt, abs(move) / scene.dt)
            guide.offset, guide.offset_rate = guide.offset + move, move / scene.dt
        return self.actor.lateral is not self or self.actor.track is not None


@dataclass(frozen=True, slots=True)
class LaneChange:
    """Go to another lane: an absolute id, or so many lanes from an entity's own."""

    dynamics: Dynamics
    value: int
    other: str | None
    offset: float

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Begins the change from where the entity is now; put there in this step, it moves on at once."""
        if actor.word is not None and actor.word.place is not None:
            actor.goes_on = True
        actor.leave_track(scene.network)
        actor.catch_up(scene.network)
        guide = actor.guide
        end = self.aim(scene, actor.name, guide)
        if end is None:
            return DONE
        span = self.dynamics.span(end - guide.offset)
        change = Transition(guide.offset, end, span, self.dynamics.shape)
        by_way = self.dynamics.dimension is Dimension.DISTANCE
        axles, following = actor.entity.axles, self.dynamics.following
        if following is Following.FOLLOW and axles is not None and actor.placed_by_file:
            actor.lateral = SteeredChange(actor, axles, change, by_way=by_way)
            return actor.lateral
        actor.lateral = ChangeOfOffset(actor, change, by_way=by_way, to_lane=True)
        return actor.lateral

    @property
    def at_once(self) -> bool:
        """Returns whether the action takes no time."""
        return self.dynamics.span(1.0) <= 0.0

    def aim(self, scene: Scene, name: str, guide: Guide) -> float | None:
        """Makes the new lane the reference of a guide and returns the offset in it in m.

        None, with a notice, where it or the other entity is on no lane.
        """
        network, here = scene.network, guide.base
        target = self.target(scene)
        if here is None or target is None:
            scene.notice(f"{name} changes no lane: it or its reference is on none")
            return None
        lanes = target - here.lane_id
        forward = network.forward(here)
        if guide.shift_to(target) is None:  # it may begin further on; keep beside the own lane
            scene.notice(f"{name}: there is no lane {target} beside it yet")
            return guide.offset + (lanes if forward else -lanes) * here.width
        now = guide.base
        return self.offset if now is None or network.forward(now) else -self.offset

    def target(self, scene: Scene) -> int | None:
        """Returns the OpenDRIVE id of the lane to go to; None where the other entity is on no lane."""
        if self.other is None:
            return self.value
        place = scene.actors[self.other].place(scene.network)
        if place.lane is None:
            return None
        ahead = scene.network.forward(place.lane) == place.along
        return next_lane_id(place.lane.lane_id, self.value if ahead else -self.value)


def compile_lane_change(node: Node, ctx: Context) -> LaneChange:
    """Compiles a <LaneChangeAction> to a lane counted from an entity's, or to a lane id."""
    change = dynamics(node.child("LaneChangeActionDynamics"))
    target = node.child("LaneChangeTarget").only()
    if target.tag not in ("RelativeTargetLane", "AbsoluteTargetLane"):
        raise target.unsupported_fault()
    other = ctx.entity(target) if target.tag == "RelativeTargetLane" else None
    return LaneChange(change, target.whole("value"), other, node.number("targetLaneOffset", 0.0))


@dataclass(frozen=True, slots=True)
class LaneOffset:
    """Keep to a lateral offset from the lane's centre, or from another entity."""

    shape: Shape
    a_max: float
    value: float
    other: str | None
    continuous: bool

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Begins the change and returns it running.

        Its duration follows from the largest lateral acceleration.
        """
        actor.leave_track(scene.network)
        actor.catch_up(scene.network)
        guide = actor.guide
        end = self.target(scene, actor)
        size = abs(end - guide.offset)
        sharp = 0.0 if self.shape is Shape.STEP else SHARPEST[self.shape]
        change = Transition(guide.offset, end, sqrt(sharp * size / self.a_max), self.shape)
        keep = self.continuous
        actor.lateral = OffsetKept(actor, change, self) if keep else ChangeOfOffset(actor, change)
        return actor.lateral

    def target(self, scene: Scene, actor: Actor) -> float:
        """Returns the offset left of the lane as it runs, m, that is asked for.

        The file's number counts left of increasing s, or left of the other entity.
        """
        base = actor.guide.base
        if base is None:
            return actor.guide.offset
        if self.other is None:
            return self.value if scene.network.forward(base) else -self.value
        other = scene.actors[self.other]
        near, left = scene.network.abreast(base, other.pose.x, other.pose.y)
        along = 1.0 if cos(near.heading - other.pose.yaw) >= 0.0 else -1.0
        return left + along * self.value


def compile_lane_offset(node: Node, ctx: Context) -> LaneOffset:
    """Compiles a <LaneOffsetAction>: an offset in m, absolute or from another entity's.

    A lateral acceleration of 0 or less is a fault.
    """
    found = node.child("LaneOffsetActionDynamics")
    a_max = found.limit("maxLateralAcc", A_LATERAL)
    if a_max <= 0.0:
        raise found.error(f"maxLateralAcc must be positive, got {a_max:g}")
    target = node.child("LaneOffsetTarget").only()
    if target.tag not in ("AbsoluteTargetLaneOffset", "RelativeTargetLaneOffset"):
        raise target.unsupported_fault()
    other = ctx.entity(target) if target.tag == "RelativeTargetLaneOffset" else None
    shape = found.choice("dynamicsShape", Shape)
    continuous = node.flag("continuous", default=False)
    return LaneOffset(shape, min(a_max, 1e6), target.number("value"), other, continuous)
