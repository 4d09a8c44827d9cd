"""Lines of trajectories: polylines, clothoids and NURBS as points, followed by time or by length."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose, wrap_angle

STEP = 0.25  # m between the points of a curve
STEPS_MAX = 200_000
NEAR = 1e-9  # m, points closer than this are one place
CORNER = 2.0  # m before and behind a corner in which headings without a name turn, as in esmini


@dataclass(frozen=True, slots=True)
class Vertex:
    """A point of a line; what is not said is None. time: s; heading: rad.

    pitch, roll: of an entity there, rad, nose down and left side up; 0 and 0 are those of the road.
    A pitch of None is that of the line, by the heights of its points.
    """

    x: float
    y: float
    z: float
    heading: float | None = None
    time: float | None = None
    pitch: float | None = 0.0
    roll: float = 0.0


class Line:
    """Points with their lengths and headings, and with times where all have one.

    Headings that the vertices do not name are those of the motion from point to point, and so are
    pitches that are None. A closed line goes back to its first point, at a time that is not said: its
    times end before that.
    tangential: the headings of the vertices are those of the line, and say nothing about the entity.
    """

    def __init__(
        self, vertices: Sequence[Vertex], *, closed: bool = False, tangential: bool = False
    ) -> None:
        points = [*vertices, vertices[0]] if closed else vertices
        self.x = [v.x for v in points]
        self.y = [v.y for v in points]
        self.z = [v.z for v in points]
        self.pitch, self.roll = [v.pitch for v in points], [v.roll for v in points]
        self.named, self.tangential = [v.heading for v in points], tangential
        self._nearest: dict[tuple[float, float], float] = {}  # lengths by point, asked in each step
        self.s = [0.0]
        for k in range(1, len(points)):
            step = hypot(self.x[k] - self.x[k - 1], self.y[k] - self.y[k - 1])
            self.s.append(self.s[-1] + step)
        times = [v.time for v in vertices]
        self.t: list[float] | None = None
        if all(t is not None for t in times):
            self.t = [t for t in times if t is not None]

    @property
    def length(self) -> float:
        """Returns the length of the line in m."""
        return self.s[-1]

    def at_length(self, s: float) -> Pose:
        """Returns the pose at length s in m, clamped to the line."""
        return self._between(*self._find(self.s, s))

    def tangent(self, s: float) -> float:
        """Returns the direction in which the line runs at length s, rad, whatever headings it names."""
        k, _ = self._find(self.s, s)
        return self._course(k)

    def names_heading(self, s: float) -> bool:
        """Returns whether the vertices say how an entity looks at length s."""
        k, _ = self._find(self.s, s)
        return self.named[k] is not None and not self.tangential

    def rear_first(self, s: float) -> Pose:
        """Returns the pose at length s in m of an entity that goes backwards.

        It looks against the line where that names no heading, and then has the pitch of the climb the
        other way round.
        """
        pose = self.at_length(s)
        if self.names_heading(s):
            return pose
        k, _ = self._find(self.s, s)
        pitch = -pose.pitch if self.pitch[k] is None else pose.pitch
        return replace(pose, pitch=pitch, yaw=wrap_angle(pose.yaw + pi))

    def at_time(self, t: float) -> Pose:
        """Returns the pose at time t s, clamped to the line; linear between points."""
        assert self.t is not None
        return self._between(*self._find(self.t, t))

    def speed_at(self, t: float) -> float:
        """Returns the speed at time t s along the heading, m/s; that of the last segment beyond the end.

        Negative where the line is driven backwards; 0 where the segment takes no time.
        """
        assert self.t is not None
        k, _ = self._find(self.t, t)
        span = self.t[k + 1] - self.t[k] if k + 1 < len(self.t) else 0.0
        if span <= 0.0:
            return 0.0
        dx, dy = self.x[k + 1] - self.x[k], self.y[k + 1] - self.y[k]
        heading = self._between(k, 0.5).yaw
        distance = hypot(dx, dy)
        backwards = dx * cos(heading) + dy * sin(heading) < 0.0
        return (-distance if backwards else distance) / span

    def length_at(self, t: float) -> float:
        """Returns the length in m reached at time t s."""
        assert self.t is not None
        k, u = self._find(self.t, t)
        return self.s[k] + (u * (self.s[k + 1] - self.s[k]) if k + 1 < len(self.s) else 0.0)

    def nearest(self, x: float, y: float) -> float:
        """Returns the length at which the line is nearest to a point; the first of equals."""
        if (x, y) not in self._nearest:
            self._nearest[x, y] = self._find_nearest(x, y)
        return self._nearest[x, y]

    def _find_nearest(self, x: float, y: float) -> float:
        """Returns the arc length in m of the line's point nearest to (x, y); of equals the first."""
        best, found = float("inf"), 0.0
        for k in range(len(self.x) - 1):
            ex, ey = self.x[k + 1] - self.x[k], self.y[k + 1] - self.y[k]
            length_sq = ex * ex + ey * ey
            along = (x - self.x[k]) * ex + (y - self.y[k]) * ey
            u = min(max(along / length_sq, 0.0), 1.0) if length_sq > 0.0 else 0.0
            away = hypot(x - self.x[k] - u * ex, y - self.y[k] - u * ey)
            if away < best - NEAR:
                best, found = away, self.s[k] + u * (self.s[k + 1] - self.s[k])
        return found

    def time_at(self, s: float) -> float:
        """Returns the time in s at length s in m, clamped to the line."""
        assert self.t is not None
        k, u = self._find(self.s, s)
        return self.t[k] + (u * (self.t[k + 1] - self.t[k]) if k + 1 < len(self.t) else 0.0)

    @staticmethod
    def _find(values: Sequence[float], value: float) -> tuple[int, float]:
        """Returns the segment in which the value lies and its share 0..1 of that, cut at both ends."""
        last = len(values) - 1
        if last == 0 or value <= values[0]:
            return 0, 0.0
        if value >= values[last]:
            return last - 1, 1.0
        k = bisect_right(values, value) - 1
        return k, (value - values[k]) / (values[k + 1] - values[k])

    def _between(self, k: int, u: float) -> Pose:
        """Returns the pose at the share u (0..1) of the segment that begins at point k."""
        j = min(k + 1, len(self.x) - 1)
        return Pose(
            self.x[k] + u * (self.x[j] - self.x[k]),
            self.y[k] + u * (self.y[j] - self.y[k]),
            self.z[k] + u * (self.z[j] - self.z[k]),
            self.roll[k] + u * wrap_angle(self.roll[j] - self.roll[k]),
            self._angle(self.pitch, self._climb, k, j, u),
            self._angle(self.named, self._course, k, j, u),
        )

    def _angle(
        self,
        named: Sequence[float | None],
        course: Callable[[int], float],
        k: int,
        j: int,
        u: float,
    ) -> float:
        """Returns an angle in rad at share u from point k to j: as named, else tangential, corners rounded.

        course: that of the line from a point to the next.
        """
        a, b = named[k], named[j]
        if a is not None and b is not None:
            return wrap_angle(a + u * ((b - a + pi) % (2.0 * pi) - pi))
        if a is not None and u == 0.0:
            return wrap_angle(a)
        here = course(k)
        length = self.s[j] - self.s[k]
        radius = min(CORNER, 0.5 * length)
        before, after = u * length, (1.0 - u) * length
        if before < radius and k > 0 and named[k - 1] is None:
            return self._mix(course(k - 1), here, 0.5 + 0.5 * before / radius)
        if after < radius and j < len(self.x) - 1 and b is None:
            return self._mix(here, course(j), 0.5 - 0.5 * after / radius)
        return here

    @staticmethod
    def _mix(a: float, b: float, u: float) -> float:
        """Returns the angle in rad at the share u of the shorter turn from a to b."""
        return wrap_angle(a + u * wrap_angle(b - a))

    def _course(self, k: int) -> float:
        """Returns the direction in rad of the segment that begins at point k, or the nearest with a length.

        Where none has a length, the heading of the point, else 0.
        """
        k, j = self._apart(k)
        if hypot(self.x[j] - self.x[k], self.y[j] - self.y[k]) < NEAR:
            return wrap_angle(self.named[k] or 0.0)
        return atan2(self.y[j] - self.y[k], self.x[j] - self.x[k])

    def _climb(self, k: int) -> float:
        """Returns the pitch in rad of the segment at point k, nose down positive; 0 if none has a length."""
        k, j = self._apart(k)
        way = hypot(self.x[j] - self.x[k], self.y[j] - self.y[k])
        return atan2(self.z[k] - self.z[j], way) if way >= NEAR else 0.0

    def _apart(self, k: int) -> tuple[int, int]:
        """Returns the points of the segment that begins at point k, or of the nearest with a length."""
        j = min(k + 1, len(self.x) - 1)
        while j < len(self.x) - 1 and hypot(self.x[j] - self.x[k], self.y[j] - self.y[k]) < NEAR:
            j += 1
        while k > 0 and hypot(self.x[j] - self.x[k], self.y[j] - self.y[k]) < NEAR:
            k -= 1
        return k, j


def clothoid(
    start: Pose, curvature: float, rate: float, length: float, times: tuple[float, float] | None
) -> list[Vertex]:
    """Returns points of a curve whose curvature begins at `curvature` and grows by `rate` per m.

    times: s of the first and the last point, the others evenly between; None: without times.
    """
    count = min(max(int(length / STEP), 4), STEPS_MAX)
    s = np.linspace(0.0, length, count + 1)
    heading = start.yaw + s * (curvature + 0.5 * rate * s)
    x, y = _integrate(start.x, np.cos(heading), s), _integrate(start.y, np.sin(heading), s)
    t = [None] * len(s) if times is None else np.linspace(*times, len(s)).tolist()
    rows = zip(x.tolist(), y.tolist(), heading.tolist(), t, strict=True)
    return [Vertex(px, py, start.z, h, when) for px, py, h, when in rows]


def _integrate(
    start: float, rate: NDArray[np.float64], s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Returns the integral of samples over s by the rule of Gregory: trapezoids with their end slopes."""
    step = s[1] - s[0]
    trapezoids = 0.5 * step * (rate[1:] + rate[:-1])
    slope = np.gradient(rate, step, edge_order=2)
    corrected = trapezoids - step**2 / 12.0 * np.diff(slope)
    total: NDArray[np.float64] = start + np.concatenate(([0.0], np.cumsum(corrected)))
    return total


def nurbs(
    order: int, points: Sequence[Vertex], weights: Sequence[float], knots: Sequence[float]
) -> list[Vertex]:
    """Returns points of a rational B-spline; time is a dimension of it where every point has one.

    It runs evenly along the spline where only the ends have times, and has none without both. All
    points have the pitch of the first control point.
    """
    from scipy.interpolate import BSpline  # 20 MB that only a file with splines needs

    degree, n = order - 1, len(points)
    w = np.array(weights)
    homogeneous = np.column_stack(
        [w * [p.x for p in points], w * [p.y for p in points], w * [p.z for p in points], w]
    )
    spline = BSpline(np.array(knots), homogeneous, degree)
    reach = sum(hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(points))
    count = min(max(int(reach / STEP), 8 * n), STEPS_MAX)
    u = np.linspace(knots[degree], knots[n], count + 1)
    rows = spline(u)
    xyz = rows[:, :3] / rows[:, 3:]
    t0, t1 = points[0].time, points[-1].time
    if t0 is None or t1 is None or t1 <= t0:
        return [Vertex(x, y, z, pitch=points[0].pitch) for x, y, z in xyz.tolist()]
    times = [p.time for p in points if p.time is not None]
    if len(times) == n:
        t = BSpline(np.array(knots), w * times, degree)(u) / rows[:, 3]
    else:
        s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(xyz[:, :2], axis=0).T))))
        t = t0 + (t1 - t0) * s / max(float(s[-1]), NEAR)
    return [
        Vertex(x, y, z, None, when, points[0].pitch)
        for (x, y, z), when in zip(xyz.tolist(), t.tolist(), strict=True)
    ]


def even_knots(order: int, points: int) -> list[float]:
    """Returns the knots of a spline whose file gives none: clamped at its ends, even between them."""
    inside = points - order
    middle = [(k + 1) / (inside + 1) for k in range(inside)]
    return [0.0] * order + middle + [1.0] * order
