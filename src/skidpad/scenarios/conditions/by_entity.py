"""Conditions on entities: their motion, their places, and each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import hypot, inf, nan

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.roads.queries import LanePoint
from skidpad.scenarios.conditions.base import EntityCondition, Rule, rule
from skidpad.scenarios.conditions.contact import are_in_contact
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import Axes, along_road, between
from skidpad.scenarios.movement.network import Network, next_lane_id
from skidpad.scenarios.movement.tracking import Track, course
from skidpad.scenarios.places.positions import Position, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Body
from skidpad.scenarios.scene import Actor, Scene

SOME = 1e-9  # s, what has begun to last


class Quantity(Enum):
    """How long something has lasted, or how far it went."""

    TRAVELLED = "TraveledDistanceCondition"
    STOOD = "StandStillCondition"
    OFF_ROAD = "OffroadCondition"
    AT_END = "EndOfRoadCondition"


TRAVELLED, STOOD = Quantity.TRAVELLED, Quantity.STOOD  # asked in every step


@dataclass(frozen=True, slots=True)
class Reaches:
    """A count of an entity is at least a value."""

    quantity: Quantity
    value: float

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the count has reached the value now; before the first tick nothing has lasted."""
        a = scene.actors[actor]
        quantity = self.quantity
        if quantity is TRAVELLED:
            return a.travelled >= max(self.value - SOME, 0.0)
        if quantity is STOOD:
            lasted = a.stood
        elif quantity is Quantity.OFF_ROAD:
            lasted = time_off_road(a, scene.network, scene.t)
        else:
            lasted = time_past_road(a, scene.network, scene.t)
        return lasted >= max(self.value - SOME, SOME)


def _reaches(node: Node, ctx: Context) -> EntityCondition:
    """Compiles a condition on the distance in m travelled, or on the duration in s of another quantity."""
    del ctx
    quantity = Quantity(node.tag)
    name = "value" if quantity is TRAVELLED else "duration"
    return Reaches(quantity, node.number(name))


class Component(Enum):
    """A component of a motion, in the entity's own axes."""

    TOTAL = ""
    LONGITUDINAL = "longitudinal"
    LATERAL = "lateral"
    VERTICAL = "vertical"


@dataclass(frozen=True, slots=True)
class Motion:
    """Speed or acceleration, own or relative to another entity."""

    rule: Rule
    component: Component
    acceleration: bool
    other: str | None

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether speed or acceleration meets the comparison; a vertical one counts 0.

        A relative one is taken in the axes of the triggering entity.
        """
        own = scene.actors[actor]
        if self.component is Component.VERTICAL:
            return self.rule.is_met(0.0)
        if self.component is Component.TOTAL:
            total = own.a if self.acceleration else own.v_signed
            other = 0.0 if self.other is None else scene.actors[self.other].v_signed
            return self.rule.is_met(total - other)
        x, y = own.acceleration if self.acceleration else (own.motion.vx, own.motion.vy)
        if self.other is not None:
            m = scene.actors[self.other].motion
            x, y = x - m.vx, y - m.vy
        forward, left = between(Pose(0.0, 0.0, yaw=own.motion.yaw), x, y)
        return self.rule.is_met(forward if self.component is Component.LONGITUDINAL else left)


def _motion(node: Node, ctx: Context) -> EntityCondition:
    """Compiles a condition on acceleration in m/s^2, or on speed in m/s, perhaps relative to an entity."""
    component = node.choice("direction", Component, Component.TOTAL)
    other = ctx.entity(node) if node.tag == "RelativeSpeedCondition" else None
    return Motion(rule(node), component, node.tag == "AccelerationCondition", other)


@dataclass(frozen=True, slots=True)
class ReachPosition:
    """Holds within a tolerance of a place."""

    tolerance: float
    position: Position

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the straight distance to the position is within the tolerance."""
        goal, here = self.position.place(scene).pose, scene.actors[actor].pose
        return hypot(goal.x - here.x, goal.y - here.y) <= self.tolerance


def _reach_position(node: Node, ctx: Context) -> EntityCondition:
    """Compiles the condition that an entity is within `tolerance` in m of a position."""
    return ReachPosition(node.number("tolerance"), position(node.child("Position"), ctx))


@dataclass(frozen=True, slots=True)
class Collision:
    """The entity touches another one, or one of a kind; others: None for all of the kind."""

    others: tuple[str, ...] | None
    body: Body = Body.VEHICLE

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the actor touches one of the others now."""
        return any(
            other != actor and are_in_contact(scene, actor, other) for other in self.names(scene)
        )

    def names(self, scene: Scene) -> tuple[str, ...]:
        """Returns the entities whose touch counts."""
        if self.others is not None:
            return self.others
        return tuple(n for n, a in scene.actors.items() if a.entity.body is self.body)


def _collision(node: Node, ctx: Context) -> EntityCondition:
    """Returns the condition; one that names nothing, as 1.0 allows, means any other entity."""
    if next(node.children(), None) is None:
        return Collision(tuple(ctx.entities))
    by = node.only()
    if by.tag == "EntityRef":
        return Collision(ctx.actors([by]))
    if by.tag != "ByType":
        raise by.unsupported_fault()
    return Collision(None, by.choice("type", Body))


class Turn(Enum):
    """About which axis an angle turns."""

    HEADING = "heading"
    PITCH = "pitch"
    ROLL = "roll"


@dataclass(frozen=True, slots=True)
class Angle:
    """An angle of an entity within a tolerance; all lie on the road, so that it has their slopes.

    other: against its angle; else against the lane, the road, the world, or the way that the
    entity's trajectory runs: without one, never.
    """

    turn: Turn
    angle: float
    tolerance: float
    axes: Axes
    other: str | None

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether the angle is as asked now, within the tolerance; never where it is NaN."""
        here = scene.actors[actor].pose
        if self.other is not None:
            value = self._of(scene, here) - self._of(scene, scene.actors[self.other].pose)
        else:
            value = self._against(scene, here, scene.actors[actor].track)
        return abs(wrap_angle(value - self.angle)) <= self.tolerance

    def _of(self, scene: Scene, pose: Pose) -> float:
        """Returns the angle in the world, rad."""
        if self.turn is Turn.HEADING:
            return pose.yaw
        tilt = pose.pitch, pose.roll
        pitch, roll = tilt if any(tilt) else scene.network.slopes(pose)
        return pitch if self.turn is Turn.PITCH else roll

    def _against(self, scene: Scene, pose: Pose, track: Track | None) -> float:
        """Returns the angle in rad in the condition's axes: NaN without trajectory.

        Pitch and roll are 0, unless a trajectory tilts the entity against the road.
        """
        if self.axes is Axes.WORLD:
            return self._of(scene, pose)
        if self.axes is Axes.TRAJECTORY and track is None:
            return nan
        if self.axes is Axes.ENTITY:
            return 0.0
        if self.turn is not Turn.HEADING:
            if not (pose.pitch or pose.roll):
                return 0.0
            return self._of(scene, pose) - self._of(scene, replace(pose, pitch=0.0, roll=0.0))
        if self.axes is Axes.TRAJECTORY and track is not None:
            return pose.yaw - course(track, scene.t, scene.dt)
        if self.axes is Axes.ROAD:
            at = scene.network.coordinates(pose)
            return pose.yaw if at is None else at.turn
        lane = scene.network.place_of(pose).lane
        return pose.yaw if lane is None else pose.yaw - lane.heading


def _angle(node: Node, ctx: Context) -> EntityCondition:
    """Compiles a condition on an entity's heading, pitch or roll in rad, perhaps relative to an entity."""
    return Angle(
        node.choice("angleType", Turn),
        node.number("angle"),
        node.number("angleTolerance"),
        node.choice("coordinateSystem", Axes, Axes.LANE),
        ctx.entity(node) if node.tag == "RelativeAngleCondition" else None,
    )


@dataclass(frozen=True, slots=True)
class Clearance:
    """No entity within a stretch of lanes beside, before and behind; others: () for all."""

    others: tuple[str, ...]
    ahead: float
    behind: float
    free: bool
    opposite: bool
    lanes: tuple[tuple[float, float], ...]  # from, to; relative to the own lane

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether no other entity is in the stretch and lanes; True off every lane."""
        here = scene.actors[actor]
        place = scene.network.place_of(here.pose)
        base = place.lane
        others = (n for n in self.others or scene.actors if n != actor and scene.actors[n].present)
        if base is None:
            return True
        sign = 1 if scene.network.forward(base) == place.along else -1
        if not self._has_lane(scene, base, sign):
            return False
        return not any(self._inside(scene, here, base, place.along, n) for n in others)

    def _find_lanes(self, lane: int, sign: int) -> set[int]:
        """Returns the OpenDRIVE ids of the lanes asked for, seen from `lane`; sign: 1 towards higher ids."""
        return {
            next_lane_id(lane, sign * k) if k else lane
            for low, high in self.lanes
            for k in range(int(max(low, -9)), int(min(high, 9)) + 1)
        }

    def _has_lane(self, scene: Scene, base: LanePoint, sign: int) -> bool:
        """Returns whether a lane of those asked for is beside the entity; none is no room."""
        wanted = self._find_lanes(base.lane_id, sign) or {base.lane_id}
        if not self.opposite:
            wanted = {i for i in wanted if (i > 0) == (base.lane_id > 0)}
        return any(i == base.lane_id or scene.network.beside(base, i) for i in wanted)

    def _inside(self, scene: Scene, here: Actor, base: LanePoint, along: bool, other: str) -> bool:
        """Returns whether the other entity is in the stretch and lanes that must be clear around this one."""
        it = scene.actors[other]
        there = scene.network.place_of(it.pose).lane
        way = along_road(scene.network, here.pose, it.pose)
        if there is None or way is None:
            return False
        room = 0.5 * (here.entity.box.length + it.entity.box.length) if self.free else 0.0
        if not -self.behind - room <= way[0] <= self.ahead + room:
            return False
        near = base  # the own lane on the road of the other one
        if there.road != base.road:
            near = scene.network.ahead(base, way[0] if along else -way[0]) or base
            if near.road != there.road:
                return False
        if not self.opposite and (there.lane_id > 0) != (near.lane_id > 0):
            return False
        sign = 1 if scene.network.forward(near) == along else -1
        return not self.lanes or there.lane_id in self._find_lanes(near.lane_id, sign)


def _clearance(node: Node, ctx: Context) -> EntityCondition:
    """Compiles the condition that lanes around an entity are clear; no lane range stands for all lanes."""
    lanes = tuple(
        (r.limit("from", -inf), r.limit("to", inf)) for r in node.children("RelativeLaneRange")
    )
    named = ctx.actors(node.children("EntityRef"))
    return Clearance(
        named,
        node.number("distanceForward", 0.0),
        node.number("distanceBackward", 0.0),
        node.flag("freeSpace", default=False),
        node.flag("oppositeLanes", default=False),
        lanes,
    )


BY_ENTITY: Mapping[str, Callable[[Node, Context], EntityCondition]] = {
    "TraveledDistanceCondition": _reaches,
    "StandStillCondition": _reaches,
    "OffroadCondition": _reaches,
    "EndOfRoadCondition": _reaches,
    "SpeedCondition": _motion,
    "RelativeSpeedCondition": _motion,
    "AccelerationCondition": _motion,
    "ReachPositionCondition": _reach_position,
    "CollisionCondition": _collision,
    "AngleCondition": _angle,
    "RelativeAngleCondition": _angle,
    "RelativeClearanceCondition": _clearance,
}


PAST = 0.05  # m beyond the last place of a lane


def time_off_road(actor: Actor, network: Network, t: float) -> float:
    """Returns how many s an actor has been beside every lane; to be asked in every step."""
    pose = actor.pose
    point = network.map.project(pose.x, pose.y, pose.z, driving=False)
    on_lane = point is not None and abs(point.offset) <= 0.5 * point.width
    if point is not None and on_lane and not network.is_void(point):
        actor.off_since = None
        return 0.0
    actor.off_since = t if actor.off_since is None else actor.off_since
    return t - actor.off_since


def time_past_road(actor: Actor, network: Network, t: float) -> float:
    """Returns how many s an actor has been at the end of a road; off its lane to be asked in every step."""
    if actor.driven_by_file and actor.track is None:
        return actor.at_end
    lane = network.place_of(actor.pose).lane
    if lane is not None:
        forward, _ = between(lane.pose, actor.pose.x, actor.pose.y)
        past = abs(forward) > PAST and network.ahead(lane, forward) is None
        since = t if actor.out_since is None else actor.out_since
        actor.out_since = since if past else None
    return 0.0 if actor.out_since is None else t - actor.out_since
