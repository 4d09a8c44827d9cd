"""Arriving somewhere together with another entity: the courses of speed are those of esmini.

Without a final speed the acceleration is the one that arrives in time. With one, the speed goes
straight to it, or first away from it and then straight (both at the same rate), or to a stop first.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from math import cos, hypot, inf, sqrt

from skidpad.roads.queries import LanePoint
from skidpad.scenarios.actions.base import note_bound
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.places.positions import Position, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Actor, Running, Scene

ARRIVED = 0.0  # m, where a file gives no tolerance
V_LEAST = 1e-6  # m/s
NEAR_LINE = 0.1  # m/s from the straight course that is on it
B_STOP = 8.0  # m/s^2, where there is not half of the way left to stop in
LEAST = 1e-6  # m
PASSED = 0.01  # m that a way has grown again when its goal lies behind


@dataclass(frozen=True, slots=True)
class Steady:
    """A last stretch at the final speed: its length in m, or its duration in s."""

    distance: float = 0.0
    time: float = 0.0


@dataclass(frozen=True, slots=True)
class Synchronize:
    """Be at a place when another entity is at its own; v_end: speed then, perhaps relative."""

    other: str
    other_goal: Position
    goal: Position
    tolerance: float
    other_tolerance: float
    v_end: float | None
    relative: bool
    steady: Steady = Steady()

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Aims for the meeting from now on; returns the running action."""
        goals = self.goal.place(scene), self.other_goal.place(scene)
        going = Synchronized(self, actor, *goals)
        actor.pace_by(going, scene)
        return going


class Phase(Enum):
    """Where on its course the speed is."""

    BEGIN = auto()
    AWAY = auto()  # faster or slower than the straight course, to come onto it
    STRAIGHT = auto()
    STOPPING = auto()
    STANDING = auto()
    WAITING = auto()  # for the other one to move
    STEADY = auto()


class Synchronized:
    """An entity on its way to a meeting."""

    def __init__(self, action: Synchronize, actor: Actor, goal: Place, other_goal: Place) -> None:
        self.action, self.actor = action, actor
        self.goal, self.other_goal = goal, other_goal  # as they were when it began
        self.least = inf, inf  # m, of both ways so far
        self.phase, self.rising = Phase.BEGIN, False
        v = actor.guide.v or action.v_end or 0.0
        self.sense = -1.0 if v < 0.0 else 1.0  # backwards, or ahead
        self.v_moved = abs(actor.guide.v)  # m/s, of the step before
        self.noted = False

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; True once either is at its goal.

        True, too, once another action has taken its place.
        """
        if self.actor.longitudinal is not self:
            return True
        action, guide, dt = self.action, self.actor.guide, scene.dt
        other = scene.actors[action.other]
        own = way_to(scene, self.actor, self.goal)
        its = way_to(scene, other, self.other_goal)
        over = own < action.tolerance + LEAST or its < action.other_tolerance + LEAST
        over = over or own > self.least[0] + PASSED or its > self.least[1] + PASSED
        self.least = min(own, self.least[0]), min(its, self.least[1])
        own, its = max(own - action.tolerance, LEAST), max(its - action.other_tolerance, LEAST)
        pace = abs(other.v_told)
        v_end = action.v_end
        if v_end is not None and action.relative:
            v_end += other.v_told
        if over or (pace > V_LEAST and its / pace < dt):
            guide.v, guide.a = guide.v if v_end is None else v_end, 0.0
            return True
        before = self.sense * guide.v
        if pace <= V_LEAST:
            self.phase, guide.v, guide.a = Phase.WAITING, 0.0, 0.0
            return False
        if v_end is None:
            v = before + 2.0 * (own * pace / its - before) / (its / pace) * dt
        else:
            asked = self._speed(before, own, its / pace, self.sense * v_end, scene)
            v = max(asked, 0.0)
            if self.phase is Phase.STRAIGHT:
                self._note(scene, asked, v, "speed, m/s, it does not turn round")
            self.v_moved = before
        guide.a, guide.v = self.sense * (v - before) / dt, self.sense * v
        return False

    def _speed(self, v: float, own: float, time: float, v_end: float, scene: Scene) -> float:
        """Returns the speed at the end of this step, `own` m and `time` s before the end with v_end.

        v: m/s now. It may be below zero, which the caller cuts.
        """
        steady, dt = self.action.steady, scene.dt
        last = max(steady.distance, steady.time * v_end)
        if last > 0.0 and v_end > 0.0:
            if self.phase is Phase.STEADY or own <= last or time <= last / v_end:
                self.phase = Phase.STEADY
                return v_end
            own, time = own - last, time - last / v_end
        if self.phase is Phase.STOPPING:
            self.phase = Phase.STANDING if v - B_STOP * dt < 0.0 else Phase.STOPPING
            return v - B_STOP * dt
        if self.phase is Phase.STANDING:
            if v_end <= 0.0 or time >= 2.0 * own / v_end:
                return 0.0
            self.phase = Phase.STRAIGHT
        line = 2.0 * own / time - v_end  # the speed now of the straight course
        if self.phase is Phase.STRAIGHT:
            return line
        if self.phase is Phase.AWAY and abs(v - line) < NEAR_LINE:
            self.phase = Phase.STRAIGHT
            return v
        if self.phase in (Phase.BEGIN, Phase.WAITING):
            self.phase, self.rising = Phase.AWAY, 0.5 * (v_end + v) < own / time
        v_road = (v if self.actor.track is None else self.v_moved) * self._share_of_road(scene)
        a, turn = away(v_road, v_end, own, time)
        if (a < 0.0) is self.rising and a != 0.0:
            self.phase = Phase.STRAIGHT
            return v
        return self._stopping(scene, v, v_road, own, v_end) if turn < 0.0 else v + a * dt

    def _note(self, scene: Scene, asked: float, applied: float, of: str) -> None:
        """Notes once what bounds the synchronised course."""
        if not self.noted:
            self.noted = note_bound(scene, self.actor, "SynchronizeAction", asked, applied, of)

    def _share_of_road(self, scene: Scene) -> float:
        """Returns abs(cos) of the angle between the actor's yaw and its lane; 1 off every lane.

        The course of `away` is planned with the actor's speed times this share, as in esmini.
        """
        pose = self.actor.pose
        lane = scene.network.place_of(pose).lane
        return 1.0 if lane is None else abs(cos(pose.yaw - lane.heading))

    def _stopping(self, scene: Scene, v: float, v_road: float, own: float, v_end: float) -> float:
        """Returns the speed of a step on the way to a stop, which replaces a course that would go backwards.

        v: m/s now; v_road: that along the road; own: m to go; v_end: m/s at the end.
        """
        dt, time = scene.dt, 2.0 * v_road * own / (v_road * v_road + v_end * v_end)
        if time * v_road / 2.0 > own / 2.0:
            self.phase = Phase.STOPPING
            needed = (v_road * v_road + v_end * v_end) / (2.0 * own)
            if needed > B_STOP:
                of = "deceleration, m/s^2, of an entity that stops on the way"
                self._note(scene, needed, B_STOP, of)
            return v - B_STOP * dt
        slower = v - (v_road / time if time > LEAST else 0.0) * dt
        if slower < 0.0:
            self.phase = Phase.STANDING
        return slower


def away(v: float, v_end: float, own: float, time: float) -> tuple[float, float]:
    """Returns the acceleration of a course that goes away from the straight one and back at the same rate.

    Besides, the speed at the turn, so that `own` m take `time` s and end at v_end; (0, 0) without one.
    """
    if abs(v_end - v) < LEAST:
        turn = 2.0 * own / time - v
        return (turn - v) / (time / 2.0), turn
    inside = 2.0 * own * own - 2.0 * (v_end + v) * time * own + (v_end**2 + v**2) * time * time
    root = sqrt(2.0) * sqrt(max(inside, 0.0))
    for sign in (1.0, -1.0):
        x = -(sign * root + 2.0 * own - 2.0 * v_end * time) / (2.0 * (v_end - v))
        if 0.0 < x < time:
            turn = (2.0 * own - sign * root) / (2.0 * time)
            return (turn - v) / x, turn
    return 0.0, 0.0


def compile_synchronize(node: Node, ctx: Context) -> Synchronize:
    """Compiles a <SynchronizeAction>, with or without a final speed in m/s."""
    v_end, relative, steady = None, False, Steady()
    found = node.find("FinalSpeed")
    if found is not None:
        speed = found.only()
        relative = speed.tag == "RelativeSpeedToMaster"
        if not relative and speed.tag != "AbsoluteSpeed":
            raise speed.unsupported_fault()
        v_end = speed.number("value")
        steady = _steady(speed)
    master = "masterEntityRef" if node.has("masterEntityRef") else "entityRef"
    return Synchronize(
        ctx.entity(node, master),
        position(node.child("TargetPositionMaster"), ctx),
        position(node.child("TargetPosition"), ctx),
        node.number("targetTolerance", ARRIVED),
        node.number("targetToleranceMaster", ARRIVED),
        v_end,
        relative,
        steady,
    )


def _steady(speed: Node) -> Steady:
    """Returns the last stretch at final speed, as length in m or duration in s; zeros where none is given."""
    for name in ("distance", "time"):
        found = speed.find(f"Target{name.title()}SteadyState")
        if found is not None:
            value = found.number(name)
            return Steady(distance=value) if name == "distance" else Steady(time=value)
    return Steady()


# Lengths of the ways that entities take: along a trajectory, along lanes, else straight.


def way_to(scene: Scene, actor: Actor, goal: Place) -> float:
    """Returns how far an entity has to go to a place on the way that it takes, m.

    A trajectory that leads it comes first, then its lane and those that follow. Where neither
    leads to the place the distance is straight. As in esmini, what is led along a trajectory has made
    this step already when its other actions have their turn.
    """
    if actor.track is not None:
        return abs(actor.track.way_to(goal.pose, scene.t + scene.dt))
    here = actor.place(scene.network).lane
    if here is not None and goal.lane is not None:
        way = lane_way(scene.network, here, goal.lane)
        if way is not None:
            return abs(way)
    return hypot(goal.pose.x - actor.pose.x, goal.pose.y - actor.pose.y)


def lane_way(network: Network, here: LanePoint, there: LanePoint) -> float | None:
    """Returns the length along lanes from one place to another, m, negative against the traffic.

    Lane changes count nothing. Between lanes of opposite traffic on one road it is the difference
    of the road's s. None where no way leads from either place to the other.
    """
    lengths, sections = network.map.lanes.length, network.map.lanes.section
    abreast = here.road == there.road and sections[here.lane] == sections[there.lane]
    same = network.forward(here) == network.forward(there)
    if abreast and same:
        return there.s - here.s * float(lengths[there.lane]) / float(lengths[here.lane])
    if here.road == there.road and not same:
        way = network.map.s_road(there) - network.map.s_road(here)
        return way if network.forward(here) else -way
    ahead = network.route_length(here.lane, there.lane)
    behind = network.route_length(there.lane, here.lane)
    ways = [] if ahead is None else [ahead - here.s + there.s]
    if behind is not None:
        ways.append(-(behind - there.s + here.s))
    return min(ways, key=abs, default=None)
