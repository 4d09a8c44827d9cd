"""What a scenario demands of one actor: a speed over time, a path, a sideways shift."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import atan2, cos, hypot, pi, sin, tau
from typing import Protocol

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.scripted import Demand, Motion


class Shape(str, Enum):
    """How a quantity goes from one value to another."""

    STEP = "step"
    LINEAR = "linear"
    SINUSOIDAL = "sinusoidal"
    CUBIC = "cubic"


def progress(shape: Shape, u: float) -> tuple[float, float, float]:
    """Share covered at u in [0, 1] and its first two derivatives by u."""
    if shape is Shape.LINEAR:
        return u, 1.0, 0.0
    if shape is Shape.SINUSOIDAL:
        return 0.5 - 0.5 * cos(pi * u), 0.5 * pi * sin(pi * u), 0.5 * pi * pi * cos(pi * u)
    return u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u), 6.0 - 12.0 * u


@dataclass(frozen=True, slots=True)
class Transition:
    """From `start` to `end` in `duration` s."""

    start: float
    end: float
    duration: float
    shape: Shape

    def at(self, t: float) -> tuple[float, float, float]:
        """Value, rate and second derivative `t` s after the begin."""
        if self.shape is Shape.STEP or self.duration <= 0.0 or t >= self.duration:
            return self.end, 0.0, 0.0
        share, rate, bend = progress(self.shape, t / self.duration)
        span = self.end - self.start
        return (
            self.start + share * span,
            rate * span / self.duration,
            bend * span / self.duration**2,
        )

    def over(self, t: float) -> bool:
        """The end is reached."""
        return self.shape is Shape.STEP or t >= self.duration


class Track(Protocol):
    """Where an actor is led, instead of along its lane."""

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Pose, speed and acceleration at scenario time t."""
        ...


class Lane:
    """Keeps to a lane at a demanded speed; a change of lane is a sideways shift over time."""

    def __init__(self, map: RoadMap, pose: Pose, v: float) -> None:
        place = map.project(pose.x, pose.y, pose.z)
        self.map = map
        self.base = place
        self.free = pose  # where there is no lane: straight on
        self.v, self.a = v, 0.0
        self.offset = 0.0 if place is None else place.offset
        self.offset_rate = self.offset_bend = 0.0
        self.along = 1.0 if place is None or cos(place.heading - pose.yaw) >= 0.0 else -1.0

    def advance(self, motion: Motion) -> None:
        """Move the reference point abreast of the actor."""
        if self.base is None:
            return
        dx, dy = motion.x - self.base.x, motion.y - self.base.y
        forward = dx * cos(self.base.heading) + dy * sin(self.base.heading)
        further = self.map.ahead(self.base, forward)
        self.base = further or self.base

    def change(self, lanes_left: int) -> float | None:
        """Make the lane so many to the left the reference; returns the shift to it, in m."""
        if self.base is None:
            return None
        target = self.map.shifted(self.base, lanes_left)
        if target is None:
            return None
        dx, dy = target.x - self.base.x, target.y - self.base.y
        shift = dy * cos(self.base.heading) - dx * sin(self.base.heading)
        self.base = target
        self.offset -= shift
        return shift

    def demand(self, motion: Motion) -> Demand:
        """What the driver has to do now."""
        self.advance(motion)
        if self.base is None:
            return Demand(self.v, self.a, 0.0, 0.0, 0.0, 0.0)
        c, s = cos(self.base.heading), sin(self.base.heading)
        dx, dy = motion.x - self.base.x, motion.y - self.base.y
        left = dy * c - dx * s
        drift = motion.vy * c - motion.vx * s
        return Demand(
            v=self.v,
            a=self.a,
            curvature=self.base.curvature,
            error=left - self.offset,
            error_rate=drift - self.offset_rate,
            a_lateral=self.offset_bend,
        )

    def ideal(self, dt: float) -> Pose:
        """The pose of an actor that does exactly as demanded, one step on."""
        distance = self.v * dt
        if self.base is None:
            self.free = self.free.moved(forward=distance)
            return self.free
        self.base = self.map.ahead(self.base, distance * self.along) or self._beyond(distance)
        turn = atan2(self.offset_rate, self.v) if self.v > 0.5 else 0.0
        pose = self.base.pose.moved(left=self.offset)
        yaw = pose.yaw + turn if self.along > 0.0 else pose.yaw + pi + turn
        return replace(pose, yaw=wrap_angle(yaw))

    def _beyond(self, distance: float) -> LanePoint:
        """Straight on where the road ends."""
        assert self.base is not None
        c, s = cos(self.base.heading), sin(self.base.heading)
        return replace(self.base, x=self.base.x + distance * c, y=self.base.y + distance * s)


class Polyline:
    """A trajectory with a time at every vertex; beyond the last one the actor stands."""

    def __init__(self, rows: list[tuple[float, Pose]]) -> None:
        self.t = [t for t, _ in rows]
        self.poses = [pose for _, pose in rows]

    @property
    def end(self) -> float:
        """Time of the last vertex."""
        return self.t[-1]

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Pose, speed and acceleration (0) at time t, linear between vertices."""
        if t <= self.t[0] or len(self.t) == 1:
            return self.poses[0], 0.0, 0.0
        if t >= self.end:
            return self.poses[-1], 0.0, 0.0
        k = self._segment(t)
        a, b = self.poses[k], self.poses[k + 1]
        span = self.t[k + 1] - self.t[k]
        u = (t - self.t[k]) / span
        turn = (b.yaw - a.yaw + pi) % tau - pi
        pose = Pose(
            a.x + u * (b.x - a.x),
            a.y + u * (b.y - a.y),
            a.z + u * (b.z - a.z),
            yaw=wrap_angle(a.yaw + u * turn),
        )
        distance = hypot(b.x - a.x, b.y - a.y)
        forward = (b.x - a.x) * cos(pose.yaw) + (b.y - a.y) * sin(pose.yaw)
        return pose, (distance if forward >= 0.0 else -distance) / span, 0.0

    def _segment(self, t: float) -> int:
        low, high = 0, len(self.t) - 1
        while high - low > 1:
            middle = (low + high) // 2
            if self.t[middle] <= t:
                low = middle
            else:
                high = middle
        return low


def track_demand(track: Track, motion: Motion, t: float, dt: float) -> Demand:
    """A driver's task to be at the track's place: the way to go enters as speed."""
    pose, v, a = track.at(t)
    after, _, _ = track.at(t + dt)
    c, s = cos(pose.yaw), sin(pose.yaw)
    dx, dy = motion.x - pose.x, motion.y - pose.y
    behind = -(dx * c + dy * s)
    drift = motion.vy * c - motion.vx * s
    turn = wrap_angle(after.yaw - pose.yaw)
    curvature = turn / max(abs(v) * dt, 0.05)
    return Demand(v + behind, a, curvature, dy * c - dx * s, drift, 0.0)
