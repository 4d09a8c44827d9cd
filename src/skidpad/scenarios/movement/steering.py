"""Vehicles that steer to a line within their own limits, instead of being placed on it.

This is `followingMode="follow"` of what is moved without tyres: the rear axle goes along an arc of
the curvature that the front wheels allow, and changes its speed as `<Performance>` allows.
Source of the aim: Coulter (1992), Implementation of the pure pursuit path tracking algorithm.
"""

from __future__ import annotations

from dataclasses import replace
from math import copysign, cos, inf, sin, sqrt, tan

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.scenarios.movement.lines import Line
from skidpad.scenarios.movement.measures import between
from skidpad.scenarios.movement.motion import SLOW, Guide
from skidpad.scenarios.reading.entities import Axles, Performance
from skidpad.simulation.scripted import A_LATERAL_MAX

LOOK_TIME = 0.8  # s that a driver looks ahead, at least one wheelbase; assumption
CATCH_UP = 1.0  # s in which a driver makes up for being late or early; assumption
STRAIGHT = 1e-9  # 1/m
SEARCH = 1.0  # m by which the nearest place of a line may move in a step, beside the way driven
THERE = 0.01  # m beside the demanded offset, at which it is reached
IN_LINE = 0.004  # rad against the lane, likewise


def curvature_max(axles: Axles, v: float) -> float:
    """Returns the largest curvature at speed v, 1/m, with the sideways acceleration of a driver."""
    return min(tan(axles.steering_max) / axles.wheelbase, A_LATERAL_MAX / max(v * v, SLOW))


def look_ahead(axles: Axles, v: float) -> float:
    """Returns how far ahead of its rear axle a vehicle aims, m."""
    return max(LOOK_TIME * abs(v), axles.wheelbase)


def aim(axles: Axles, pose: Pose, target: Pose, v: float) -> float:
    """Returns the curvature of the arc from the rear axle through a target, 1/m, within the limits.

    A target on the other side of the axle is turned to at full lock.
    """
    forward, left = between(pose, target.x, target.y)
    most = curvature_max(axles, v)
    if forward * copysign(1.0, v) <= 0.0:
        return copysign(most, left)
    return min(max(arc_to(forward, left), -most), most)


def arc_to(forward: float, left: float) -> float:
    """Returns the curvature of the arc from the rear axle through a place, 1/m."""
    return 2.0 * left / max(forward * forward + left * left, STRAIGHT)


def move_on_arc(pose: Pose, way: float, curvature: float) -> Pose:
    """Returns a pose `way` m further along an arc that it is tangent to; backwards where negative."""
    turn = way * curvature
    if abs(curvature) < STRAIGHT:
        return pose.moved(forward=way)
    moved = pose.moved(forward=sin(turn) / curvature, left=(1.0 - cos(turn)) / curvature)
    return replace(moved, yaw=wrap_angle(pose.yaw + turn))


class SteeredTrack:
    """A line that a vehicle steers along from where it is.

    s: length abreast of which it is, beyond the ends of the line along their tangents; v: its speed,
    negative rear first. It goes along the line in the sense of its first speed, back in the other one.
    """

    steered = True

    def __init__(
        self,
        line: Line,
        s: float,
        pose: Pose,
        v: float,
        t: float,
        axles: Axles,
        most: Performance,
        *,
        closed: bool = False,
        timed: bool = False,
    ) -> None:
        self.line, self.s, self.begin, self.closed, self.timed = line, s, s, closed, timed
        self.pose, self.v, self.t, self.curvature = pose, v, t, 0.0
        self.axles, self.most, self.asked_curvature = axles, most, 0.0
        self.first = v  # m/s, the first speed that is not 0
        self._project(SEARCH + line.length)

    @property
    def sense(self) -> float:
        """Returns 1 along the line, -1 back to its begin; by its times it goes along the line."""
        return 1.0 if self.timed or self.v * self.first >= 0.0 else -1.0

    def at(self, t: float) -> tuple[Pose, float, float]:
        """Returns pose, speed and acceleration (0) at time t, on the arc of this step."""
        pose = move_on_arc(self.pose, self.v * (t - self.t), self.curvature)
        z = self.point(self.s + self.sense * abs(self.v) * (t - self.t)).z
        return replace(pose, z=z), self.v, 0.0

    def way_to(self, place: Pose, t: float) -> float:
        """Returns the way along the line from its place at time t to the point nearest to a place, m."""
        here = self.s + self.sense * abs(self.v) * (t - self.t)
        way = self.line.nearest(place.x, place.y) - here
        return way % self.line.length if self.closed else way

    def skip(self, way: float) -> None:
        """Puts it `way` m further along the line, onto the line, with its yaw unchanged."""
        self.s += way
        yaw = self.pose.yaw
        self.pose = replace(self.point(self.s), yaw=yaw)

    def point(self, s: float) -> Pose:
        """Returns the point of the line at length s in the sense of the line, straight on at its ends."""
        s = s % self.line.length if self.closed and self.line.length > 0.0 else s
        on = min(max(s, 0.0), self.line.length)
        pose = replace(self.line.at_length(on), yaw=self.line.tangent(on))
        return pose.moved(forward=s - on) if s != on else pose

    def move_to(self, t: float) -> bool:
        """Goes on to time t s; True at the end of the line, which a closed one has not."""
        self.pose, _, _ = self.at(t)
        self._project(SEARCH + 2.0 * abs(self.v) * (t - self.t))
        self.t = t
        if self.sense < 0.0:
            return not self.closed and self.s <= SLOW
        return not self.closed and self.s >= self.line.length - SLOW

    def aim_at(self, v: float, dt: float) -> None:
        """Turns the wheels to the line and changes its speed towards v m/s in the coming step of dt s."""
        self.v = self._reachable(v, dt)
        self.first = self.first or self.v
        way = look_ahead(self.axles, self.v)
        ahead = max(self.s, self.begin) + way if self.sense > 0.0 else self.s - way
        sense = self.v if abs(self.v) > SLOW else v
        target = self.point(ahead)
        self.curvature = aim(self.axles, self.pose, target, sense)
        forward, left = between(self.pose, target.x, target.y)
        is_ahead = forward * copysign(1.0, sense) > 0.0
        self.asked_curvature = arc_to(forward, left) if is_ahead else copysign(inf, left)

    def pace(self, line_speed: float, line_length: float) -> float:
        """Returns the speed that brings it to where its times want it, m/s, without going back.

        line_speed, line_length: m/s and m that the times ask for. It is no faster than it can turn to
        where it aims.
        """
        late = line_length - self.s
        brake = sqrt(2.0 * self.most.b_max * abs(late)) if self.most.b_max < inf else inf
        v = abs(line_speed) + copysign(min(abs(late) / CATCH_UP, brake), late)
        asked = min(abs(self.asked_curvature), tan(self.axles.steering_max) / self.axles.wheelbase)
        turn = sqrt(A_LATERAL_MAX / max(asked, STRAIGHT))
        return copysign(min(max(v, 0.0), self.most.v_max, turn), line_speed)

    def _reachable(self, v: float, dt: float) -> float:
        """Returns the speed nearest to v that it can have after dt s."""
        v = copysign(min(abs(v), self.most.v_max), v)
        faster = abs(v) > abs(self.v) and v * self.v >= 0.0
        most = (self.most.a_max if faster else self.most.b_max) * dt
        return self.v + min(max(v - self.v, -most), most)

    def _project(self, reach: float) -> None:
        """Moves the length on to abreast of the vehicle, by no more than `reach` m."""
        near = self.point(self.s)
        along = (self.pose.x - near.x) * cos(near.yaw) + (self.pose.y - near.y) * sin(near.yaw)
        self.s += min(max(along, -reach), reach)


class LaneSteering:
    """A vehicle that steers to the lane of its guide.

    offset: the one to aim at, m; None for that of the guide. settled: it is there.
    """

    def __init__(self, axles: Axles) -> None:
        self.axles, self.settled = axles, False
        self.offset: float | None = None

    def step(self, guide: Guide, pose: Pose, dt: float) -> Pose:
        """Returns the pose a step of dt s on; moves the guide's point along and sets `settled`."""
        v = guide.v_now
        guide.advance(pose)
        offset, self.offset = guide.offset if self.offset is None else self.offset, None
        target = guide.preview(look_ahead(self.axles, v), offset)
        if target is None or guide.base is None:
            self.settled = True
            return pose.moved(forward=0.0 if guide.at_end else v * dt)
        _, left = between(guide.base.pose, pose.x, pose.y)
        askew = abs(sin(pose.yaw - guide.base.heading))
        self.settled = abs(left - guide.offset) < THERE and askew < IN_LINE
        curvature = aim(self.axles, pose, target, v) if abs(v) > SLOW else 0.0
        return replace(move_on_arc(pose, v * dt, curvature), z=guide.base.z)
