"""Trajectories under way: where an actor is led, by time or by its own speed."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, sin
from typing import Protocol

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.scenarios.movement.lines import Line
from skidpad.simulation.scripted import Demand, Motion

NEAR = 1e-6  # m, nothing moves
JUST = 1e-9  # s before a vertex, whose speed is that of the stretch that ends there
SQUARE = 1e-6  # cosine between heading and line that still is not against the line


class Track(Protocol):
    """Where an actor is led, instead of along its lane.

    timed: at its own times; steered: as its steering and pedals allow, not exactly there.
    """

    timed: bool
    steered: bool

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Returns pose, speed and acceleration at scenario time t s."""
        ...

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        ...

    def skip(self, way: float) -> None:
        """Puts it `way` m further along the line."""
        ...


class TimedTrack:
    """A line by its times: `begin` is the scenario time of line time 0, `scale` stretches it."""

    timed, steered = True, False

    def __init__(self, line: Line, begin: float, scale: float) -> None:
        assert line.t is not None
        self.line, self.begin, self.scale = line, begin, scale
        self.end = begin + scale * line.t[-1]
        self.first = begin + scale * line.t[0]

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Returns pose, speed and acceleration (0) at time t s; beyond the end straight on at its speed."""
        own = (t - self.begin) / self.scale
        pose = self.line.at_time(own)
        if t > self.end:
            return pose.moved(forward=self.v_end * (t - self.end)), self.v_end, 0.0
        moving = self.first < t <= self.end + 1e-9
        return pose, self.line.speed_at(own - JUST) / self.scale if moving else 0.0, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        here = self.line.length_at((t - self.begin) / self.scale)
        return self.line.nearest(place.x, place.y) - here

    def skip(self, way: float) -> None:
        """Does nothing: its times alone say where it is."""

    @property
    def v_end(self) -> float:
        """Returns the speed in m/s at the end of the line, kept beyond it."""
        assert self.line.t is not None
        return self.line.speed_at(self.line.t[-1]) / self.scale


class PacedTrack:
    """A line at the speed that the actor is asked for when its turn comes in a step.

    sense: -1 for an actor that looks against the line, else 1. It comes from the headings that the
    line names, else from the sign of the first speed that is not 0: rear first along the line.
    """

    timed, steered = False, False

    def __init__(self, line: Line, s: float, t: float, closed: bool, v: float) -> None:
        s = s if closed else min(s, line.length)
        self.line, self.s, self.t, self.closed, self.v = line, s, t, closed, v
        self.moved, self.sense = False, self._sense_at(s, v)

    def _sense_at(self, s: float, v: float) -> float:
        """Returns -1 for motion against the line (by named headings, else by the sign of v), else 1."""
        if self.line.names_heading(s):
            against = cos(self.line.at_length(s).yaw - self.line.tangent(s)) <= -SQUARE
            return -1.0 if against else 1.0
        return -1.0 if v < 0.0 else 1.0

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Returns pose, speed and acceleration (0) at time t s, for this step's speed.

        Straight on from its end, not before its begin. Both as in esmini.
        """
        v = self.v
        s = self.s + self.sense * v * (t - self.t)
        if self.closed:
            s %= self.line.length
        pose = self.line.rear_first(s) if self.sense < 0.0 else self.line.at_length(s)
        beyond = max(s - self.line.length, 0.0)
        return (pose.moved(forward=self.sense * beyond) if beyond else pose), v, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        way = self.line.nearest(place.x, place.y) - self.s - self.sense * self.v * (t - self.t)
        return way % self.line.length if self.closed else way

    def skip(self, way: float) -> None:
        """Puts it `way` m further along the line."""
        self.s += way

    def step(self, t: float, v: float, dt: float) -> bool:
        """Goes on to time t s, from there at v m/s; True if the next step of dt s reaches an end.

        Its begin is one, too, when it goes back; a closed line has none.
        """
        if not self.moved and self.v * (t - self.t) == 0.0:  # a speed of the same event counts
            self.sense = self._sense_at(self.s, v)
        move = self.sense * self.v * (t - self.t)
        self.moved = self.moved or move != 0.0
        self.s, self.t, self.v = self.s + move, t, v
        if self.closed:
            self.s %= self.line.length
            return False
        move = self.sense * v * dt
        if move > 0.0:
            return self.s + move > self.line.length - NEAR
        return move < 0.0 and self.s + move < NEAR


def course(track: Track, t: float, dt: float) -> float:
    """Returns the way that it runs at time t s, rad; where nothing moves, the heading that it asks for."""
    (a, _, _), (b, _, _) = track.at(t - 0.5 * dt), track.at(t + 0.5 * dt)
    if hypot(b.x - a.x, b.y - a.y) < NEAR:
        return track.at(t)[0].yaw
    return atan2(b.y - a.y, b.x - a.x)


def track_demand(
    track: Track, motion: Motion, t: float, dt: float, centre: Callable[[Pose], Pose]
) -> Demand:
    """Returns a driver's task to be at the track's place: the way to go enters as speed.

    centre: gives the pose of the box's centre for that of the reference point.
    """
    pose, v, a = track.at(t)
    after, _, _ = track.at(t + dt)
    place = centre(pose)
    c, s = cos(pose.yaw), sin(pose.yaw)
    dx, dy = motion.x - place.x, motion.y - place.y
    behind = -(dx * c + dy * s)
    drift = motion.vy * c - motion.vx * s
    turn = wrap_angle(after.yaw - pose.yaw)
    curvature = turn / max(abs(v) * dt, 0.05)
    if v < 0.0:  # the box's centre swings out beside the way of the reference point
        curvature = -curvature
        drift -= ((place.x - pose.x) * c + (place.y - pose.y) * s) * turn / dt
    return Demand(v + behind, a, curvature, dy * c - dx * s, drift, 0.0, reverse=v < 0.0)
