"""Boxes of actors over time, as a log has them: their axes, corners and distances."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.recording.run.log import RunLog


class Body(NamedTuple):
    """One actor over time, arrays (T,): m, rad, m/s, m/s^2 in its own axes."""

    x: Floats
    y: Floats
    yaw: Floats
    vx: Floats  # world
    vy: Floats
    ax: Floats  # body
    ay: Floats
    length: float
    width: float

    def select(self, rows: Any) -> Body:
        """Returns the body at these rows alone."""
        return Body._make((*(column[rows] for column in self[:7]), *self[7:]))

    def project(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Returns points of the world, (..., T), in the axes of the body: m forward and m left."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        dx, dy = x - self.x, y - self.y
        return dx * c + dy * s, dy * c - dx * s

    def corners(self) -> tuple[Floats, Floats]:
        """Returns x and y in m of the corners of the box, (4, T) each."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        ends = product((0.5, -0.5), repeat=2)
        places = [(i * self.length, j * self.width) for i, j in ends]
        x = np.stack([self.x + along * c - left * s for along, left in places])
        return x, np.stack([self.y + along * s + left * c for along, left in places])


def body(log: RunLog, i: int) -> Body:
    """Returns the columns of actor i of the log."""
    a = log.actors
    x, y, yaw, vx, vy, ax, ay = (
        v[:, i].astype(np.float64) for v in (a.x, a.y, a.yaw, a.vx, a.vy, a.ax, a.ay)
    )
    length, width = float(log.table.length[i]), float(log.table.width[i])
    return Body(x, y, yaw, vx, vy, ax, ay, length, width)


def corner_distance(one: Body, other: Body) -> Floats:
    """Returns (T,) m from the nearest corner of either box to the other box, 0 inside."""
    found = []
    for box, points in ((other, one.corners()), (one, other.corners())):
        forward, left = box.project(*points)
        along = np.maximum(np.abs(forward) - 0.5 * box.length, 0.0)
        found.append(np.hypot(along, np.maximum(np.abs(left) - 0.5 * box.width, 0.0)))
    distance: Floats = np.concatenate(found).min(axis=0)
    return distance
