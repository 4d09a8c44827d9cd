"""Keeping a distance to another entity along the road."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import copysign, cos, inf, sqrt

from skidpad.scenarios.actions.base import note_bound
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import Axes, along_road, between, extents_along_road
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Performance, read_limits
from skidpad.scenarios.scene import Actor, Running, Scene

SPRING = 0.4  # 1/m, of the controller that closes a gap (esmini's, so that files play alike)
REACHED = 0.1  # m
STEADY = 0.1  # m/s beside the other one's speed


class Displacement(Enum):
    """The side of the other entity on which to be."""

    ANY = "any"
    TRAILING = "trailingReferencedEntity"
    LEADING = "leadingReferencedEntity"


@dataclass(frozen=True, slots=True)
class KeepGap:
    """Keep a distance or a time behind or before another entity, along the road.

    limits: of the approach; none of acceleration and braking: it simply is where it should be.
    """

    other: str
    distance: float | None
    time_gap: float | None
    free: bool
    continuous: bool
    side: Displacement
    road: bool
    limits: Performance

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Returns the running action that keeps the gap from now on."""
        own = actor.entity.performance
        limits = self.limits.within(own)
        for name, unit, asked, has in (
            ("maxSpeed", "m/s", self.limits.v_max, own.v_max),
            ("maxAcceleration", "m/s^2", self.limits.a_max, own.a_max),
            ("maxDeceleration", "m/s^2", self.limits.b_max, own.b_max),
            ("maxAccelerationRate", "m/s^3", self.limits.a_rate, own.a_rate),
            ("maxDecelerationRate", "m/s^3", self.limits.b_rate, own.b_rate),
        ):
            if has < asked < inf:
                of = f"{name}, {unit}, that of its <Performance>"
                note_bound(scene, actor, "LongitudinalDistanceAction", asked, has, of)
        if self.limits.is_boundless and not actor.placed_by_file:
            scene.notice(
                f"<LongitudinalDistanceAction> of {actor.name}: at once asked, at most "
                f"{limits.a_max:g} m/s^2 faster and {limits.b_max:g} m/s^2 slower applied: "
                "it drives on its tyres"
            )
        going = GapKept(self, actor, self.resolved_side(scene, actor), limits)
        actor.pace_by(going, scene)
        return going

    def resolved_side(self, scene: Scene, actor: Actor) -> Displacement:
        """Returns the side of the other entity; the one where the entity is, where any will do."""
        if self.side is not Displacement.ANY:
            return self.side
        ahead = self.ahead(scene, actor)
        return Displacement.TRAILING if ahead >= 0.0 else Displacement.LEADING

    def excess(self, scene: Scene, actor: Actor, side: Displacement) -> float:
        """Returns by how much the entity is too far back, m."""
        return self.ahead(scene, actor) - self.wanted_gap(scene, side)

    def ahead(self, scene: Scene, actor: Actor) -> float:
        """Returns how far the other one is ahead, m; between the outlines if free, 0 abreast."""
        other = scene.actors[self.other]
        found = along_road(scene.network, actor.pose, other.pose) if self.road else None
        gap = found[0] if found else scene.between(actor.name, self.other)[0]
        if not self.free:
            return gap
        on_road = self._free_on_road(scene, actor, other) if self.road else None
        if on_road is not None:
            return on_road
        own = actor.entity.box
        shift = gap - scene.between(actor.name, self.other)[0]  # of a road that is not straight
        its = [between(actor.pose, x, y)[0] + shift for x, y in other.outline()]
        if gap >= 0.0:
            return max(min(its) - own.forward - own.length / 2.0, 0.0)
        return min(max(its) - own.forward + own.length / 2.0, 0.0)

    def _free_on_road(self, scene: Scene, actor: Actor, other: Actor) -> float | None:
        """Returns how far the other outline is ahead along the road of both, m; None off one road."""
        a, b = (
            extents_along_road(scene.network, one.outline(), one.pose) for one in (actor, other)
        )
        if a is None or b is None or a[0] != b[0]:
            return None
        here = scene.network.coordinates(actor.pose)
        sign = 1.0 if here is None or cos(here.turn) >= 0.0 else -1.0
        own, its = ([sign * s for s in found[1]] for found in (a, b))
        if sum(its) >= sum(own):
            return max(min(its) - max(own), 0.0)
        return min(max(its) - min(own), 0.0)

    def wanted_gap(self, scene: Scene, side: Displacement) -> float:
        """Returns how far the other one should be ahead, m; negative where the entity is to lead."""
        v = abs(scene.actors[self.other].v_told)
        size = abs(self.distance if self.distance is not None else (self.time_gap or 0.0) * v)
        return -size if side is Displacement.LEADING else size


class GapKept:
    """A gap being kept: a critically damped spring, within the limits."""

    def __init__(
        self, action: KeepGap, actor: Actor, side: Displacement, limits: Performance
    ) -> None:
        self.action, self.actor, self.side, self.limits = action, actor, side, limits

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; True once the action is over."""
        if self.actor.longitudinal is not self:
            return True
        action, guide = self.action, self.actor.guide
        v_other = scene.actors[action.other].v_told
        excess = action.excess(scene, self.actor, self.side)
        if action.limits.is_boundless and self.actor.placed_by_file:
            guide.v, guide.a = v_other, 0.0
            self.actor.leap(excess)
            return not action.continuous
        if not action.continuous and abs(excess) < REACHED and self._is_steady(v_other):
            guide.a = 0.0
            return True
        limits = self.limits
        tension = limits.a_max if excess < 0.0 else limits.b_max
        stiffness = min(tension, 1e3) * SPRING
        a = excess * stiffness - (guide.v - v_other) * 2.0 * sqrt(stiffness)
        guide.a = self._limit_jerk(guide.a, min(max(a, -limits.b_max), limits.a_max), scene.dt)
        v = guide.v + guide.a * scene.dt
        guide.v = copysign(min(abs(v), limits.v_max), v)
        return False

    def _is_steady(self, v_other: float) -> bool:
        """Returns whether its speed is the other one's; asked only of a gap without limits on tyres.

        True for every gap with limits.
        """
        return (
            not self.action.limits.is_boundless or abs(self.actor.motion.speed - v_other) < STEADY
        )

    def _limit_jerk(self, now: float, wanted: float, dt: float) -> float:
        """Returns an acceleration that grows no faster than the file allows; it may end at once.

        now, wanted: m/s^2 before and as asked for; dt: s. As in esmini.
        """
        rates = self.limits
        if wanted < 0.0:
            return max(wanted, now - rates.b_rate * dt)
        return min(wanted, now + rates.a_rate * dt)


def compile_gap(node: Node, ctx: Context) -> KeepGap:
    """Compiles a <LongitudinalDistanceAction> with either a distance in m or a time gap in s."""
    if node.has("distance") == node.has("timeGap"):
        raise node.error("needs either distance or timeGap")
    axes = node.choice("coordinateSystem", Axes, Axes.ENTITY)
    return KeepGap(
        ctx.entity(node),
        node.number("distance") if node.has("distance") else None,
        node.number("timeGap") if node.has("timeGap") else None,
        node.flag("freespace", default=False),
        node.flag("continuous", default=False),
        node.choice("displacement", Displacement, Displacement.ANY),
        axes in (Axes.ROAD, Axes.LANE),
        read_limits(node.find("DynamicConstraints")),
    )
