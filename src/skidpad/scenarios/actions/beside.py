"""Sideways: to a distance from another entity, across the lane or in the axes of that entity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import acos, asin, copysign, cos, inf, pi, sin, sqrt

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.roads.queries import LanePoint
from skidpad.scenarios.actions.base import ASIDE, note_bound
from skidpad.scenarios.actions.distance import SPRING
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import Axes, between
from skidpad.scenarios.movement.motion import SLOW
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Actor, Running, Scene

ASKEW = 0.1  # cosine between a lane and an entity, below which the one is not beside the other
REACHED = 0.01  # m from the distance asked for
MILD = 1.5  # largest curvature on the way to the line beside the other one, per mean
RADIUS_MIN = 0.5  # m of a turn
A_RANGE = 1e-3, 1e3  # m/s^2, within which an acceleration makes a turn
ELEMENT = "LateralDistanceAction"


class Side(Enum):
    """The side of the entity that a distance is kept to."""

    ANY = "any"
    LEFT = "leftToReferencedEntity"
    RIGHT = "rightToReferencedEntity"


@dataclass(frozen=True, slots=True)
class Bounds:
    """Limits of a motion to the side: m/s, m/s^2, m/s^3."""

    v: float = inf
    a: float = inf
    jerk: float = inf


@dataclass(frozen=True, slots=True)
class LateralDistance:
    """Keep a sideways distance to another entity.

    straight: from the line through it in its own direction, else along the own lane.
    """

    other: str
    distance: float
    free: bool
    continuous: bool
    side: Side
    straight: bool
    bounds: Bounds

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Returns the running action that keeps the lateral distance from now on."""
        actor.leave_track(scene.network)
        _, left = scene.between(self.other, actor.name)
        to_left = left >= 0.0 if self.side is Side.ANY else self.side is Side.LEFT
        sign = 1.0 if to_left else -1.0
        if self.straight and self.bounds.a < inf:
            return Approach(self, actor, sign, scene.t)
        actor.lateral = DistanceKept(self, actor, sign)
        return actor.lateral

    def size(self, scene: Scene, actor: Actor) -> float:
        """Returns the distance between the reference points, m."""
        if not self.free:
            return self.distance
        other = scene.actors[self.other]
        return self.distance + 0.5 * (actor.entity.box.width + other.entity.box.width)


def reference_pose(scene: Scene, other: Actor) -> Pose:
    """Returns where an entity is, with what actions of this step have moved it aside so far."""
    guide = other.guide
    if not other.placed_by_file or other.track is not None or guide.base is None:
        return other.pose
    return replace(scene.network.aside(guide.base, guide.offset), yaw=other.pose.yaw)


class DistanceKept:
    """A sideways distance being kept while the entity goes along its lane.

    A distance across the lane begins to be closed a step after the action begins, as in esmini.
    """

    def __init__(self, action: LateralDistance, actor: Actor, sign: float) -> None:
        self.action, self.actor, self.sign = action, actor, sign
        self.v = self.a = 0.0  # to the left of the lane as it runs
        self.waits, self.noted = not action.straight, False

    def step(self, scene: Scene) -> bool:
        """Moves the offset towards the distance as fast as is allowed; True once the action is over.

        It is over where another lateral action has taken its place, or at the distance unless continuous.
        """
        actor, guide, action = self.actor, self.actor.guide, self.action
        if actor.lateral is not self or guide.base is None:
            return True
        if self.waits:
            self.waits = False
            return False
        guide.adds_offset = False
        excess = self._end(scene, guide.base) - guide.offset
        there = abs(excess) < REACHED
        if action.bounds.v == action.bounds.a == inf and actor.placed_by_file:
            guide.aside = excess if action.straight else 0.0  # as esmini: part of its way
            guide.adds_offset = not action.straight
            guide.offset += excess
            guide.offset_rate = 0.0 if action.straight else excess / scene.dt
            return not action.continuous and (there or action.straight)
        self._choose_speed(scene, excess)
        guide.offset += self.v * scene.dt
        there = not action.continuous and (there or abs(excess - self.v * scene.dt) < 1e-3)
        guide.offset_rate = 0.0 if there else self.v
        return there

    def _choose_speed(self, scene: Scene, excess: float) -> None:
        """Sets the speed to the left: straight to the distance, or by a spring within an acceleration.

        excess: m to the left that are left to go.
        """
        bounds, dt = self.action.bounds, scene.dt
        own = max(abs(self.actor.guide.v) - SLOW, 0.0)
        if bounds.a == inf:
            self.v = self._limit_speed(scene, excess / dt, own)
            return
        other = scene.actors[self.action.other].motion  # whose drift counts in its own axes
        drift = other.vy * cos(other.yaw) - other.vx * sin(other.yaw)
        stiffness = SPRING * bounds.a
        a = stiffness * excess - 2.0 * sqrt(stiffness) * (self.v - drift)
        change = min(max(a - self.a, -bounds.jerk * dt), bounds.jerk * dt)
        self.a = min(max(self.a + change, -bounds.a), bounds.a)
        self.v = self._limit_speed(scene, self.v + self.a * dt, own)

    def _limit_speed(self, scene: Scene, v: float, own: float) -> float:
        """Returns a speed to the side within what the file allows and the own one; says the latter once."""
        asked = min(abs(v), self.action.bounds.v)
        applied = min(asked, own)
        if not self.noted:
            self.noted = note_bound(scene, self.actor, ELEMENT, asked, applied, ASIDE)
        return copysign(applied, v)

    def _end(self, scene: Scene, base: LanePoint) -> float:
        """Returns the offset in m at which the distance is kept; the sides are those of the other entity."""
        action, here = self.action, self.actor.guide.offset
        other = reference_pose(scene, scene.actors[action.other])
        size = action.size(scene, self.actor)
        near, left = scene.network.abreast(base, other.x, other.y)
        if not action.straight:
            along = 1.0 if cos(near.heading - other.yaw) >= 0.0 else -1.0
            return left + self.sign * along * size
        at = scene.network.aside(base, here)
        _, now = between(other, at.x, at.y)
        c = cos(base.heading - other.yaw)
        return here if abs(c) < ASKEW else here + (self.sign * size - now) / c


class Approach:
    """The way to the line beside another entity, in its axes and without regard to lanes.

    The entity turns towards the line, and along it once it is nearer than the radius that its speed
    and the allowed acceleration make, as in esmini. It is its own `Track`.
    """

    timed = steered = False

    def __init__(self, action: LateralDistance, actor: Actor, sign: float, t: float) -> None:
        self.action, self.actor, self.sign = action, actor, sign
        self.pose, self.t, self.v, self.noted = actor.pose, t, actor.guide.v, False
        actor.lead(self, self, t)

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Returns pose, speed and acceleration (0) at time t s, straight on from the last step's."""
        return self.pose.moved(forward=self.v * (t - self.t)), self.v, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns how far a place lies ahead of where it is at time t, m."""
        return between(self.at(t)[0], place.x, place.y)[0]

    def skip(self, way: float) -> None:
        """Moves the pose forward by `way` in m."""
        self.pose = self.pose.moved(forward=way)

    def step(self, scene: Scene) -> bool:
        """Takes a step along the way; True once another action has taken its place, or it is there.

        A continuous action is never there.
        """
        actor, action = self.actor, self.action
        if actor.track is not self:
            return True
        self.v, self.t = actor.guide.v, scene.t + scene.dt
        other = scene.actors[action.other].pose
        line = other.moved(left=self.sign * action.size(scene, actor))
        _, left = between(line, self.pose.x, self.pose.y)
        way = self.v * scene.dt
        yaw = self._aim(scene, line, left, way)
        self.pose = Pose(
            self.pose.x + cos(yaw) * way, self.pose.y + sin(yaw) * way, self.pose.z, yaw=yaw
        )
        if action.continuous or abs(left) > REACHED:
            return False
        actor.leave_track(scene.network)
        return True

    def _radius(self, scene: Scene) -> float:
        """Returns the radius of its turn, m; says once where that is not the allowed acceleration's."""
        asked = self.action.bounds.a
        a = min(max(asked, A_RANGE[0]), A_RANGE[1])
        radius = max(RADIUS_MIN, MILD * self.v**2 / a)
        applied = MILD * self.v**2 / radius
        if not self.noted:
            of = "maxAcceleration, m/s^2, 0.001 to 1000 m/s^2 and a turn of 0.5 m or more"
            self.noted = note_bound(scene, self.actor, ELEMENT, asked, applied, of)
        return radius

    def _aim(self, scene: Scene, line: Pose, left: float, way: float) -> float:
        """Returns the heading of a step of so many m, from `left` m beside the line."""
        away, size, dt = abs(left), abs(way), scene.dt
        if away < 1e-6 or size < SLOW:
            return line.yaw
        radius = self._radius(scene)
        if away < 0.5 * size and 0.5 * size > radius:
            return wrap_angle(line.yaw - copysign(asin(away / size), left))
        across = wrap_angle(line.yaw - copysign(0.5 * pi, left) - self.pose.yaw)
        along = wrap_angle(line.yaw - self.pose.yaw)
        if away > radius:
            turn = across
        else:
            step = size / radius  # rad of a round turn
            w = (2.0 * max(acos(1.0 - away / radius), 0.5 * step) - 0.5 * step) / pi
            w = w * w * (3.0 - 2.0 * w)
            turn = w * across + (1.0 - w) * along
        most = min(MILD * abs(self.v) * dt / radius, pi)
        turn = min(max(turn, -most), most)
        lean = wrap_angle(turn - along)
        steepest = asin(min(self.action.bounds.v / abs(self.v), 1.0))
        if steepest < abs(lean) < pi - steepest:
            lean = copysign(max(steepest, abs(along) - most), lean)
        return wrap_angle(line.yaw + lean)


def compile_lateral_distance(node: Node, ctx: Context) -> LateralDistance:
    """Compiles a <LateralDistanceAction> element; absent constraints are infinite."""
    found = node.find("DynamicConstraints")
    axes = node.choice("coordinateSystem", Axes, Axes.ENTITY)
    bounds = Bounds()
    if found is not None:
        names = ("maxSpeed", "maxAcceleration", "maxAccelerationRate")
        bounds = Bounds(*(found.limit(name, inf) for name in names))
    return LateralDistance(
        ctx.entity(node),
        node.number("distance", 0.0),
        node.flag("freespace", default=False),
        node.flag("continuous", default=False),
        node.choice("displacement", Side, Side.ANY),
        axes is Axes.ENTITY,
        bounds,
    )
