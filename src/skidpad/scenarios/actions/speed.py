"""Changes of speed: to a value, or to that of another entity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import copysign, inf

from skidpad.scenarios.actions.base import Dimension, Dynamics, Following, dynamics, note_bound
from skidpad.scenarios.actions.jerk import (
    Jerk,
    Piece,
    SmoothProfile,
    pieces_over,
    settle,
    smooth_pieces,
)
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.motion import SLOW, STEEPEST, Shape, Transition
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Performance
from skidpad.scenarios.scene import Actor, Running, Scene

ELEMENT = "SpeedAction"
MAX_SPEED = "speed, m/s, maxSpeed"


class Relation(Enum):
    """How a relative speed is meant."""

    DELTA = "delta"
    FACTOR = "factor"


@dataclass(frozen=True, slots=True)
class Target:
    """A speed, perhaps of another entity."""

    value: float
    other: str | None = None
    relation: Relation = Relation.DELTA
    continuous: bool = False

    def speed(self, scene: Scene) -> float:
        """Returns the target as it is now, m/s."""
        if self.other is None:
            return self.value
        v = scene.actors[self.other].v_told
        return v * self.value if self.relation is Relation.FACTOR else v + self.value


@dataclass(frozen=True, slots=True)
class Speed:
    """Change of the demanded speed."""

    dynamics: Dynamics
    target: Target

    @property
    def at_once(self) -> bool:
        """Returns whether the change takes no time: a step, or a duration or distance of 0 or less."""
        d = self.dynamics
        return d.shape is Shape.STEP or (d.dimension is not Dimension.RATE and d.value <= 0.0)

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Begins the change from the speed demanded so far; returns it running."""
        finish_step(scene, actor)
        v, limits = actor.guide.v, actor.entity.performance
        asked = self.target.speed(scene)
        end = limit_speed(asked, limits)
        noted = note_bound(scene, actor, ELEMENT, asked, end, MAX_SPEED)
        if self.dynamics.following is Following.FOLLOW:
            bound = limits.a_max if end > v else limits.b_max
            if jerk_of(limits).is_limited or (self.dynamics.shape is Shape.STEP and bound < inf):
                return self._smooth(scene, actor, end, bound)
        if self.dynamics.dimension is Dimension.DISTANCE:
            span = over_distance(v, end, self.dynamics)
        else:
            span = self.dynamics.span(end - v)
        least = least_span(end - v, span, self.dynamics.shape, limits)
        if least > span:
            noted |= note_bound(scene, actor, ELEMENT, span, least, duration_bound(end - v))
        span = max(span, least)
        change = Transition(v, end, span, self.dynamics.shape)
        if self.at_once and self.target.other is not None:
            actor.guide.v = end
        going = ChangeOfSpeed(actor, change, scene.t, self)
        going.noted = noted
        actor.pace_by(going, scene)
        return going

    def _smooth(self, scene: Scene, actor: Actor, end: float, bound: float) -> Running:
        """Begins the change within the limits of the entity: its acceleration rises, stays and falls.

        end: m/s; bound: m/s^2.
        """
        guide, change, jerk = actor.guide, self.dynamics, jerk_of(actor.entity.performance)
        first = settle(guide.v, acceleration_under_way(actor), jerk)
        v, _ = first.at(first.duration)
        duration: float | None = None
        most = bound
        if change.shape is not Shape.STEP and change.dimension is Dimension.RATE and change.value:
            most = min(bound, abs(change.value))
        elif change.shape is not Shape.STEP and change.dimension is Dimension.TIME:
            duration = max(change.value - first.duration, 0.0)
        pieces = list(smooth_pieces(v, end, most, jerk, duration))
        if change.shape is not Shape.STEP and change.dimension is Dimension.DISTANCE:
            way = max(change.value - abs(first.way), 0.0)
            if v * end >= 0.0:
                pieces = pieces_over(v, end, most, jerk, way)
            else:
                duration = over_distance(v, end, replace(change, value=way))
                pieces = list(smooth_pieces(v, end, most, jerk, duration))
        if duration is not None:
            took = sum(piece.duration for piece in pieces)
            if took > duration:
                note_bound(
                    scene, actor, ELEMENT, duration, took, "duration, s, limits of <Performance>"
                )
        follow = self.target if self.target.continuous else None
        going = SmoothChange(actor, scene.t, [first, *pieces], end, follow)
        actor.pace_by(going, scene)
        return going


def finish_step(scene: Scene, actor: Actor) -> None:
    """Sets the speed of a change at once that has begun in this step, for an action that begins after it."""
    going = actor.longitudinal
    if isinstance(going, ChangeOfSpeed) and going.action.at_once and going.began == scene.t:
        actor.guide.v = going.change.end


def acceleration_under_way(actor: Actor) -> float:
    """Returns the acceleration in m/s^2 that a replaced change has reached.

    That of the demand; where it is 0, the measured one, if a limit of the entity allows it.
    """
    limits = actor.entity.performance
    most = limits.a_max if actor.a > 0.0 else limits.b_max
    if actor.guide.a or most == inf or abs(actor.a) > most * (1.0 + ROUNDING):
        return actor.guide.a
    return actor.a


ROUNDING = 1e-6  # of an acceleration that is measured over a step


def duration_bound(size: float) -> str:
    """Returns what bounds the duration of a change of speed by `size` m/s, for its note."""
    return f"duration, s, {'maxAcceleration' if size > 0.0 else 'maxDeceleration'}"


def jerk_of(limits: Performance) -> Jerk:
    """Returns how fast the acceleration of an entity may change."""
    return Jerk(limits.a_rate, limits.b_rate)


def limit_speed(v: float, limits: Performance) -> float:
    """Returns the speed nearest to v m/s that the entity can reach."""
    return copysign(min(abs(v), limits.v_max), v)


def over_distance(v: float, end: float, change: Dynamics) -> float:
    """Returns the s that a change over a distance takes: it takes place at the mean of both speeds."""
    if change.shape is Shape.STEP or abs(end - v) < SLOW:
        return 0.0
    way = max(change.value, 0.0)
    if v * end >= 0.0:
        return 2.0 * way / abs(v + end)
    share = v * v / (v * v + end * end)  # of the way until it stands; then it goes the other way
    return 2.0 * way * share / abs(v) + 2.0 * way * (1.0 - share) / abs(end)


def least_span(size: float, span: float, shape: Shape, limits: Performance) -> float:
    """Returns the s that the entity needs at least for a change by `size` m/s; 0 for a step."""
    most = limits.a_max if size > 0.0 else limits.b_max
    if span <= 0.0 or shape is Shape.STEP or most == inf:
        return 0.0
    return abs(size) * STEEPEST[shape] / most


class ChangeOfSpeed:
    """A speed action under way; the speed of another entity is looked at in every step, as in esmini."""

    def __init__(self, actor: Actor, change: Transition, began: float, action: Speed) -> None:
        self.actor, self.change, self.began, self.action = actor, change, began, action
        self.late = 0.0  # s that the entity has lost to its own limits
        self.noted = False

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; True once the action is over.

        A continuous one is over only when another action has taken its place.
        """
        if self.actor.longitudinal is not self:
            return True
        t, guide = scene.t + scene.dt - self.began - self.late, self.actor.guide
        if self.action.target.other is None:
            guide.v, guide.a, _ = self.change.at(t)
            return self.change.over(t)
        end = self._aim(scene)
        v, a, _ = self.change.at(t)
        limited, self.noted = reachable(scene, self.actor, guide.v, v, self.noted)
        if limited != v and not self.change.over(t):
            self.late += scene.dt * (1.0 - (limited - guide.v) / (v - guide.v))
        guide.v, guide.a = limited, a
        return self.change.over(t) and limited == end and not self.action.target.continuous

    def _aim(self, scene: Scene) -> float:
        """Returns the speed asked for, as it is now, which becomes the end of the change."""
        dynamics, limits = self.action.dynamics, self.actor.entity.performance
        asked, span = self.action.target.speed(scene), self.change.span
        end = limit_speed(asked, limits)
        self.noted = self.noted or note_bound(scene, self.actor, ELEMENT, asked, end, MAX_SPEED)
        if dynamics.dimension is Dimension.RATE:
            size = end - self.change.start
            span = dynamics.span(size)
            span = max(span, least_span(size, span, dynamics.shape, limits))
        self.change = replace(self.change, end=end, span=span)
        return end


def reachable(scene: Scene, actor: Actor, now: float, v: float, noted: bool) -> tuple[float, bool]:
    """Returns the speed nearest to v m/s that can follow `now` a step later, and whether a bound is noted.

    noted: whether it was before; it is noted once.
    """
    limits, dt = actor.entity.performance, scene.dt
    limited = min(max(v, now - limits.b_max * dt), now + limits.a_max * dt)
    if not noted:
        asked, applied = abs(v - now) / dt, abs(limited - now) / dt
        of = f"acceleration, m/s^2, {'maxAcceleration' if v > now else 'maxDeceleration'}"
        noted = note_bound(scene, actor, ELEMENT, asked, applied, of)
    return limited, noted


class SmoothChange(SmoothProfile):
    """A speed action under way within limits of jerk; follow: a target that is kept to afterwards."""

    def __init__(
        self, actor: Actor, began: float, pieces: list[Piece], end: float, follow: Target | None
    ) -> None:
        super().__init__(actor, began, pieces, end)
        self.follow, self.noted = follow, False

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; afterwards that of the target, within limits.

        True once the action is over, which with a target to follow is only when another replaces it.
        """
        actor, before = self.actor, self.actor.guide.v
        over = super().step(scene)
        if not over or self.follow is None or actor.longitudinal is not self:
            return over
        wish = limit_speed(self.follow.speed(scene), actor.entity.performance)
        v, self.noted = reachable(scene, actor, before, wish, self.noted)
        actor.guide.v, actor.guide.a = v, (v - before) / scene.dt
        return False


def compile_speed(node: Node, ctx: Context) -> Speed:
    """Compiles a <SpeedAction> with an absolute or relative target speed."""
    change = dynamics(node.child("SpeedActionDynamics"))
    target = node.child("SpeedActionTarget").only()
    if target.tag == "AbsoluteTargetSpeed":
        return Speed(change, Target(target.number("value")))
    if target.tag != "RelativeTargetSpeed":
        raise target.unsupported_fault()
    relation = target.choice("speedTargetValueType", Relation)
    continuous = target.flag("continuous", default=False)
    other = ctx.entity(target)
    return Speed(change, Target(target.number("value"), other, relation, continuous))
