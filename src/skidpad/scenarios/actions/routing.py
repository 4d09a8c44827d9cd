"""Where to: places, routes and trajectories."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from random import Random

from skidpad.core.geometry import Pose
from skidpad.scenarios.actions.base import Following, note_bound
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.lines import Line
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.movement.steering import SteeredTrack
from skidpad.scenarios.movement.tracking import PacedTrack, TimedTrack
from skidpad.scenarios.places.positions import Position, position
from skidpad.scenarios.places.routes import (
    ScenarioRoute,
    compile_route,
    random_roads,
    roads_through,
)
from skidpad.scenarios.places.trajectories import Trajectory, compile_trajectory
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Entity
from skidpad.scenarios.scene import DONE, Actor, Running, Scene

SLACK = 1e-6  # s before the last point that is there


@dataclass(frozen=True, slots=True)
class Teleport:
    """Moves an actor to a position at once."""

    position: Position

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Puts the entity there at once, keeping the demanded speed; returns an action that is done."""
        actor.put(scene.network, self.position.place(scene), actor.guide.v)
        return DONE


def compile_teleport(node: Node, ctx: Context) -> Teleport:
    """Compiles a <TeleportAction> to the position of its node."""
    return Teleport(position(node.child("Position"), ctx))


@dataclass(frozen=True, slots=True)
class AssignRoute:
    """Take certain roads from now on."""

    route: ScenarioRoute

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Sets the route at once and returns an action that is done; it matters at the next fork."""
        del scene
        actor.guide.roads = self.route.roads
        return DONE


def compile_assign_route(node: Node, ctx: Context) -> AssignRoute:
    """Compiles an <AssignRouteAction> with the route of its node."""
    return AssignRoute(compile_route(node.only(), ctx))


@dataclass(frozen=True, slots=True)
class RandomRoute:
    """Take any way at forks from now on: drawn by the entity's name, the same in every run."""

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Sets a random route at once and returns an action that is done; it matters at the next fork.

        Off the road it sets none, with a notice.
        """
        place = actor.place(scene.network)
        here = place.lane
        if here is None:
            scene.notice(f"{actor.name} takes no random route: it is on no road")
        else:
            draw = Random(actor.name)
            actor.guide.roads = random_roads(scene.network, here, place.along, draw.choice)
        return DONE


def compile_random_route(node: Node, ctx: Context) -> RandomRoute:
    """Compiles a <RandomRouteAction>, which has no content of its own."""
    del node, ctx
    return RandomRoute()


@dataclass(frozen=True, slots=True)
class AcquirePosition:
    """Drive to a place: its roads from now on."""

    position: Position

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Sets the way to the position and returns an action that is done; it matters at the next fork."""
        actor.guide.roads = _way_there(scene.network, actor, self.position, scene)
        return DONE


def _way_there(network: Network, actor: Actor, goal: Position, scene: Scene) -> tuple[int, ...]:
    """Returns the road indices from the actor to the goal; empty, with a notice, where one is on no road."""
    here, there = actor.place(network).lane, goal.place(scene).lane
    if here is None or there is None:
        scene.notice(f"{actor.name} acquires no position: it or the place is on no road")
        return ()
    return roads_through(network, (here, there))


def compile_acquire(node: Node, ctx: Context) -> AcquirePosition:
    """Compiles an <AcquirePositionAction> to the position of its node."""
    return AcquirePosition(position(node.child("Position"), ctx))


@dataclass(frozen=True, slots=True)
class Timing:
    """How the times of a trajectory are read; relative: they count from the action's begin."""

    relative: bool
    scale: float
    offset: float


@dataclass(frozen=True, slots=True)
class FollowTrajectory:
    """Go along a line by its times, or at the own speed where timing is None."""

    trajectory: Trajectory
    timing: Timing | None
    s_begin: float
    following: Following = Following.POSITION

    def is_steered(self, entity: Entity) -> bool:
        """Returns whether the entity steers to the line from where it is; a walker is placed on it."""
        return self.following is Following.FOLLOW and entity.axles is not None

    def first_pose(self, scene: Scene, here: Pose, v: float) -> Pose:
        """Returns where an entity with speed v is led to at the begin of the scenario."""
        line = self.trajectory.trace(scene, here)
        if self.timing is None or line.t is None:
            return PacedTrack(line, self.s_begin, 0.0, self.trajectory.closed, v).at(0.0)[0]
        return line.at_time(-self._zero(line, self.timing, 0.0) / self.timing.scale)

    def _zero(self, line: Line, timing: Timing, t: float) -> float:
        """Returns the scenario time of line time 0 where the action begins at t s.

        As in esmini, relative times begin at the place on the line that the action asks for.
        """
        if not timing.relative:
            return timing.offset
        skipped = timing.scale * line.time_at(self.s_begin) if self.s_begin > 0.0 else 0.0
        return timing.offset + t - skipped

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Leads the actor along the line from now on and returns the running action.

        Absolute times count from the begin of the scenario.
        """
        line = self.trajectory.trace(scene, actor.pose)
        guide = actor.guide
        led: Paced | Timed | Steered
        if self.is_steered(actor.entity) and actor.placed_by_file:
            led = self._steer(scene, actor, line)
        elif self.timing is None or line.t is None:
            closed = self.trajectory.closed
            led = Paced(actor, PacedTrack(line, self.s_begin, scene.t, closed, guide.v))
        else:
            begin = self._zero(line, self.timing, scene.t)
            led = Timed(actor, TimedTrack(line, begin, self.timing.scale))
        actor.lead(led, led.track, scene.t)
        if actor.placed_by_file:  # what others in this step see
            actor.pose = led.track.at(scene.t)[0]
        return led

    def _steer(self, scene: Scene, actor: Actor, line: Line) -> Steered:
        """Returns the running action that steers the actor along the line, timed if the action is."""
        entity, closed = actor.entity, self.trajectory.closed
        assert entity.axles is not None
        times = None
        if self.timing is not None and line.t is not None:
            begin = self._zero(line, self.timing, scene.t)
            times = TimedTrack(line, begin, self.timing.scale)
        track = SteeredTrack(
            line, self.s_begin, actor.pose, actor.v_signed, scene.t, entity.axles, entity.performance,
            closed=closed, timed=times is not None,
        )  # fmt: skip
        return Steered(actor, track, times)


class Timed:
    """A timed trajectory under way."""

    def __init__(self, actor: Actor, track: TimedTrack) -> None:
        self.actor, self.track = actor, track

    def step(self, scene: Scene) -> bool:
        """Moves on until the last point is reached, then returns True; the entity drives on along its lane.

        True, too, once another action has taken its place.
        """
        if self.actor.track is not self.track:
            return True
        next_t = scene.t + scene.dt
        if next_t <= self.track.end + SLACK:
            self.actor.guide.v, self.actor.guide.a = self.track.at(next_t)[1], 0.0
        if next_t < self.track.end - SLACK:
            return False
        self.actor.v_after_track = self.track.v_end
        return True


class Paced:
    """A trajectory at the entity's own speed."""

    def __init__(self, actor: Actor, track: PacedTrack) -> None:
        self.actor, self.track = actor, track

    def step(self, scene: Scene) -> bool:
        """Moves on until the end is reached, then returns True; the entity drives on along its lane.

        True, too, once another action has taken its place.
        """
        if self.actor.track is not self.track:
            return True
        if not self.track.step(scene.t, self.actor.guide.v, scene.dt):
            return False
        self.actor.v_after_track = self.actor.guide.v
        return True


SETTLED = 0.1  # m/s beside the last speed of a line with times, at which it is driven to its end


class Steered:
    """A trajectory that a vehicle steers along, at its own speed or after its times."""

    def __init__(self, actor: Actor, track: SteeredTrack, times: TimedTrack | None) -> None:
        self.actor, self.track, self.times, self.noted = actor, track, times, False

    def step(self, scene: Scene) -> bool:
        """Steers until the end is reached, then returns True; the vehicle drives on along its lane.

        True, too, once another action has taken its place.
        """
        actor, track = self.actor, self.track
        if actor.track is not track:
            return True
        there = track.move_to(scene.t)
        v = actor.guide.v if self.times is None else self._pace(self.times, scene.t, scene.dt)
        track.aim_at(v, scene.dt)
        self._note(scene)
        v_end = actor.guide.v
        if self.times is not None:
            actor.guide.v, actor.guide.a, v_end = track.v, 0.0, self.times.v_end
            there = there and scene.t >= self.times.end - SLACK
            there = there and abs(v_end - track.v) < SETTLED
        if there:
            actor.v_after_track = v_end
            go_on_after_track(actor, scene.network)
        return there

    def _note(self, scene: Scene) -> None:
        """Notes once where the vehicle cannot turn as the line asks."""
        asked, most = abs(self.track.asked_curvature), abs(self.track.curvature)
        if most < asked < inf and not self.noted:
            self.noted = True
            of = "curvature, 1/m, maxSteering or 7 m/s^2 to the side"
            note_bound(scene, self.actor, "FollowTrajectoryAction", asked, most, of)

    def _pace(self, times: TimedTrack, t: float, dt: float) -> float:
        """Returns the speed of the coming step that the times of the line ask for."""
        beyond = max(t - times.end, 0.0) * abs(times.v_end)
        length = times.line.length_at((t - times.begin) / times.scale) + beyond
        _, v, _ = times.at(t + 0.5 * dt)
        return self.track.pace(v, length)


def go_on_after_track(actor: Actor, network: Network) -> None:
    """Makes an actor follow its lane where its track has ended; without a road it stands from then on.

    Nothing happens while its track has not ended.
    """
    v, actor.v_after_track = actor.v_after_track, None
    if v is None or actor.track is None:
        return
    if not actor.track.timed:
        v = actor.guide.v  # which an action of this step may have changed since the end was reached
    actor.follow_road(network, v)
    if network.stand_in:
        actor.guide = Guide(network, Place(actor.pose), v)
        actor.guide.at_end = True


def compile_follow(node: Node, ctx: Context) -> FollowTrajectory:
    """Compiles a <FollowTrajectoryAction>, with the places of its parts in 1.0 and since."""
    reference = node.find("Trajectory") or node.find("CatalogReference")
    if reference is None:
        reference = node.child("TrajectoryRef").only()
    trajectory = compile_trajectory(reference, ctx)
    mode = node.find("TrajectoryFollowingMode")
    following = Following.POSITION
    if mode is not None:
        following = mode.choice("followingMode", Following, Following.POSITION)
    timing = (node.find("TimeReference") or node).find("Timing")
    s = node.number("initialDistanceOffset", 0.0)
    if timing is None:
        return FollowTrajectory(trajectory, None, s, following)
    domain = timing.text("domainAbsoluteRelative")
    if domain not in ("absolute", "relative"):
        raise timing.error(f"domainAbsoluteRelative must be absolute or relative, got {domain!r}")
    scale = timing.number("scale", 1.0)
    if scale <= 0.0:
        raise timing.error(f"scale must be positive, got {scale:g}")
    how = Timing(domain == "relative", scale, timing.number("offset", 0.0))
    return FollowTrajectory(trajectory, how, s, following)
