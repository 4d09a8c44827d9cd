"""Trajectories under way: where an actor is led, by time or by its own speed."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, hypot, sin
from typing import Protocol

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.scenarios.lines import Line
from skidpad.simulation.scripted import Demand, Motion

NEAR = 1e-6  # m, nothing moves


class Track(Protocol):
    """Where an actor is led, instead of along its lane; timed: at its own times."""

    timed: bool

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Pose, speed and acceleration at scenario time t."""
        ...

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        ...

    def skip(self, way: float) -> None:
        """Be `way` m further along the line."""
        ...


class TimedTrack:
    """A line by its times: `begin` is the scenario time of line time 0, `scale` stretches it."""

    timed = True

    def __init__(self, line: Line, begin: float, scale: float) -> None:
        assert line.t is not None
        self.line, self.begin, self.scale = line, begin, scale
        self.end = begin + scale * line.t[-1]
        self.first = begin + scale * line.t[0]

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Pose, speed and acceleration (0) at time t; beyond the end straight on at its speed."""
        own = (t - self.begin) / self.scale
        pose = self.line.at_time(own)
        if t > self.end:
            return pose.moved(forward=self.v_end * (t - self.end)), self.v_end, 0.0
        moving = self.first < t <= self.end + 1e-9
        return pose, self.line.speed_at(own) / self.scale if moving else 0.0, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        here = self.line.length_at((t - self.begin) / self.scale)
        return self.line.nearest(place.x, place.y) - here

    def skip(self, way: float) -> None:
        """Do nothing: its times alone say where it is."""

    @property
    def v_end(self) -> float:
        """Speed on its last stretch, m/s."""
        assert self.line.t is not None
        return self.line.speed_at(self.line.t[-1]) / self.scale


class PacedTrack:
    """A line at the speed that the actor is asked for: `s` grows by its steps."""

    timed = False

    def __init__(
        self, line: Line, s: float, t: float, closed: bool, v: Callable[[], float]
    ) -> None:
        self.line, self.s, self.t, self.closed, self.v = line, s, t, closed, v

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Pose and speed at time t, for the moment's speed."""
        v = self.v()
        s = self.s + v * (t - self.t)
        if self.closed:
            s %= self.line.length
        return self.line.at_length(s), v, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        del t
        way = self.line.nearest(place.x, place.y) - self.s
        return way % self.line.length if self.closed else way

    def skip(self, way: float) -> None:
        """Be `way` m further along the line."""
        self.s += way

    def step(self, t: float) -> bool:
        """Go on to time t; True at the end of the line."""
        self.s += self.v() * (t - self.t)
        self.t = t
        if self.closed:
            self.s %= self.line.length
            return False
        return self.s >= self.line.length - 1e-6


def course(track: Track, t: float, dt: float) -> float:
    """The way that it runs at time t, rad; where nothing moves, the heading that it asks for."""
    (a, _, _), (b, _, _) = track.at(t - 0.5 * dt), track.at(t + 0.5 * dt)
    if hypot(b.x - a.x, b.y - a.y) < NEAR:
        return track.at(t)[0].yaw
    return atan2(b.y - a.y, b.x - a.x)


def track_demand(
    track: Track, motion: Motion, t: float, dt: float, centre: Callable[[Pose], Pose]
) -> Demand:
    """A driver's task to be at the track's place: the way to go enters as speed."""
    pose, v, a = track.at(t)
    after, _, _ = track.at(t + dt)
    place = centre(pose)
    c, s = cos(pose.yaw), sin(pose.yaw)
    dx, dy = motion.x - place.x, motion.y - place.y
    behind = -(dx * c + dy * s)
    drift = motion.vy * c - motion.vx * s
    turn = wrap_angle(after.yaw - pose.yaw)
    curvature = turn / max(abs(v) * dt, 0.05)
    return Demand(v + behind, a, curvature, dy * c - dx * s, drift, 0.0)
