"""Conditions on distances and times between an entity and another one or a place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import hypot, inf

from skidpad.core.geometry import Pose
from skidpad.scenarios.conditions.base import EntityCondition, Rule, rule
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import (
    Axes,
    Direction,
    along_road,
    between,
    clearance,
    extent_gap,
    extents_along_road,
)
from skidpad.scenarios.places.positions import Position, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Actor, Scene

EUCLIDEAN = (Direction.EUCLIDEAN, Direction.CARTESIAN)
SLOWEST = 1e-3  # m/s, of an approach


@dataclass(frozen=True, slots=True)
class Measure:
    """How a distance is taken; free: between outlines, else between reference points."""

    direction: Direction
    axes: Axes
    free: bool

    def distance(self, scene: Scene, actor: Actor, goal: Pose, other: Actor | None) -> float:
        """Returns the distance from an entity to a place, or to the entity there; m, never negative."""
        if self.direction in EUCLIDEAN:
            if not self.free:
                return hypot(goal.x - actor.pose.x, goal.y - actor.pose.y)
            outline = [(goal.x, goal.y)] if other is None else other.outline()
            return clearance(actor.outline(), outline)
        forward = self.direction is Direction.LONGITUDINAL
        if self.axes in (Axes.ROAD, Axes.LANE):
            found = along_road(scene.network, actor.pose, goal)
            if found is not None:
                room = self._free_on_road(scene, actor, other) if self.free else None
                if room is not None:
                    return room
                way = found[0 if forward else 1]
                return max(abs(way) - self._room(actor, other, way, forward), 0.0)
        if self.free:
            k = 0 if forward else 1
            own = [between(actor.pose, x, y)[k] for x, y in actor.outline()]
            its = [(goal.x, goal.y)] if other is None else other.outline()
            return extent_gap(own, [between(actor.pose, x, y)[k] for x, y in its])
        base = Pose(0.0, 0.0) if self.axes is Axes.WORLD else actor.pose
        dx, dy = between(base, goal.x, goal.y)
        if self.axes is Axes.WORLD:
            dx, dy = goal.x - actor.pose.x, goal.y - actor.pose.y
        return abs(dx if forward else dy)

    def _free_on_road(self, scene: Scene, actor: Actor, other: Actor | None) -> float | None:
        """Returns the free room between two bodies in the coordinates of their road, m; None off one road."""
        if other is None:
            return None
        a, b = (
            extents_along_road(scene.network, one.outline(), one.pose) for one in (actor, other)
        )
        if a is None or b is None or a[0] != b[0]:
            return None
        if self.direction is Direction.LONGITUDINAL:
            return extent_gap(a[1], b[1])
        return extent_gap(a[2], b[2])

    def _room(self, actor: Actor, other: Actor | None, way: float, forward: bool) -> float:
        """Returns what the bodies take of a signed distance of their reference points, m.

        0 unless outlines count. way: m; forward: it runs along the road, else across.
        """
        if not self.free:
            return 0.0
        sign = 1.0 if way >= 0.0 else -1.0
        room = 0.0
        for body, side in ((actor, sign), (other, -sign)):
            if body is not None:
                b = body.entity.box
                room += 0.5 * (b.length if forward else b.width)
                room += side * (b.forward if forward else b.left)
        return room


def measure(node: Node, free: str = "freespace") -> Measure:
    """Returns how a condition measures, by its attributes."""
    along = node.flag("alongRoute", default=False)  # the way to ask for the road before 1.1
    axes = node.choice("coordinateSystem", Axes, Axes.ROAD if along else Axes.ENTITY)
    default = Direction.LONGITUDINAL if along else Direction.EUCLIDEAN
    direction = node.choice("relativeDistanceType", Direction, default)
    return Measure(direction, axes, node.flag(free, default=False))


@dataclass(frozen=True, slots=True)
class Distance:
    """Distance to another entity or to a place, m."""

    rule: Rule
    measure: Measure
    other: str | None
    goal: Position | None

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the actor's distance in m meets the comparison with the value."""
        goal, other = target(scene, self.other, self.goal)
        return self.rule.is_met(self.measure.distance(scene, scene.actors[actor], goal, other))


def target(scene: Scene, other: str | None, goal: Position | None) -> tuple[Pose, Actor | None]:
    """Returns where a condition measures to, and the entity that is there; None for a place."""
    if other is not None:
        actor = scene.actors[other]
        return actor.pose, actor
    assert goal is not None
    return goal.place(scene).pose, None


@dataclass(frozen=True, slots=True)
class TimeHeadway:
    """Time in s until the entity is where the other one is now, at its own speed.

    There is none while the entity stands, or for one that is behind it: the whole of it, where bodies count.
    """

    rule: Rule
    measure: Measure
    other: str

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the time headway in s meets the comparison; a standing actor has none."""
        own, other = scene.actors[actor], scene.actors[self.other]
        behind = scene.between(actor, self.other)[0] < 0.0
        if own.v <= 0.0:
            return False
        distance = self.measure.distance(scene, own, other.pose, other)
        if behind and distance > 0.0 and self.measure.direction is Direction.LONGITUDINAL:
            return False
        return self.rule.is_met(distance / own.v)


@dataclass(frozen=True, slots=True)
class TimeToCollision:
    """Distance over the speed at which it shrinks; infinite while it does not."""

    rule: Rule
    measure: Measure
    other: str | None
    goal: Position | None

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the time to collision in s meets the comparison; inf where nothing closes."""
        own = scene.actors[actor]
        goal, other = target(scene, self.other, self.goal)
        distance = self.measure.distance(scene, own, goal, other)
        vx, vy = own.motion.vx, own.motion.vy
        if other is not None:
            vx, vy = vx - other.motion.vx, vy - other.motion.vy
        if self.measure.direction in EUCLIDEAN:
            dx, dy = goal.x - own.pose.x, goal.y - own.pose.y
            reach = hypot(dx, dy)
            closing = (vx * dx + vy * dy) / reach if reach > 0.0 else 0.0
        else:
            ahead, left = between(own.pose, goal.x, goal.y)
            along, across = between(Pose(0.0, 0.0, yaw=own.pose.yaw), vx, vy)
            forward = self.measure.direction is Direction.LONGITUDINAL
            way, speed = (ahead, along) if forward else (left, across)
            closing = speed if way >= 0.0 else -speed
        return self.rule.is_met(distance / closing if closing > SLOWEST else inf)


def _collision_time(node: Node, ctx: Context) -> EntityCondition:
    """Compiles a condition on the time to collision in s with an entity or a position."""
    goal = node.child("TimeToCollisionConditionTarget").only()
    how = measure(node)
    if goal.tag == "EntityRef":
        return TimeToCollision(rule(node), how, ctx.entity(goal), None)
    return TimeToCollision(rule(node), how, None, position(goal, ctx))


DISTANCES: Mapping[str, Callable[[Node, Context], EntityCondition]] = {
    "RelativeDistanceCondition": lambda node, ctx: Distance(
        rule(node), measure(node), ctx.entity(node), None
    ),
    "DistanceCondition": lambda node, ctx: Distance(
        rule(node), measure(node), None, position(node.child("Position"), ctx)
    ),
    "TimeHeadwayCondition": lambda node, ctx: TimeHeadway(
        rule(node), measure(node), ctx.entity(node)
    ),
    "TimeToCollisionCondition": _collision_time,
}
