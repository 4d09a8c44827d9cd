"""Labels for a driver that sees, from the truth: where the lane runs, and which vehicle is in it."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import wrap_angle
from skidpad.core.states import ActorStates, ActorTable
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.stack.camera.codes import AHEAD, Label

Floats = NDArray[np.float64]
REACH = 70.0  # m of lane ahead in which a lead is looked for
STEP = 2.0  # m between the places of that lane
SPARE = 0.15  # m beside the ego's body that belongs to its way
EGO = 0


def label_of(
    map: RoadMap, table: ActorTable, states: ActorStates, place: LanePoint | None = None
) -> Label | None:
    """The label of a moment; None off every lane or at its end. place: the ego's on its lane."""
    pose = states.pose(EGO)
    place = map.project(pose.x, pose.y, pose.z) if place is None else place
    if place is None:
        return None
    offsets = []
    for distance in AHEAD:
        point = map.ahead(place, distance, pose.yaw)
        if point is None:
            return None
        offsets.append(_in_ego(states, point.x, point.y)[1])
    return Label(tuple(offsets), _gap(map, table, states, place))


def _in_ego(states: ActorStates, x: float, y: float) -> tuple[float, float]:
    """A place ahead and left of the ego."""
    dx, dy = x - states.x[EGO], y - states.y[EGO]
    c, s = cos(states.yaw[EGO]), sin(states.yaw[EGO])
    return float(c * dx + s * dy), float(c * dy - s * dx)


def _gap(map: RoadMap, table: ActorTable, states: ActorStates, place: LanePoint) -> float | None:
    """From the ego's front along the lane to the first body that reaches into its way."""
    way = _way(map, place, float(states.yaw[EGO]))
    half = 0.5 * float(table.width[EGO]) + SPARE
    front = 0.5 * float(table.length[EGO])
    nearest: float | None = None
    for i in range(1, len(table)):
        if not states.present[i] or abs(states.z[i] - states.z[EGO]) > 4.0:
            continue
        s, d = _along(way, _outline(table, states, i))
        inside = (np.abs(d) < half) & (s > 0.0)
        if d.min() < 0.0 < d.max() and s.max() > 0.0:  # it lies across
            inside |= s > 0.0
        if inside.any():
            gap = max(float(s[inside].min()) - front, 0.0)
            nearest = gap if nearest is None else min(nearest, gap)
    return nearest


def _way(map: RoadMap, place: LanePoint, yaw: float) -> Floats:
    """(n, 4) x, y, heading and length of the lane ahead."""
    rows = [(place.x, place.y, place.heading, 0.0)]
    for k in range(1, int(REACH / STEP) + 1):
        point = map.ahead(place, k * STEP, yaw)
        if point is None or abs(wrap_angle(point.heading - rows[-1][2])) > 0.5:
            break
        rows.append((point.x, point.y, point.heading, k * STEP))
    return np.array(rows)


def _outline(table: ActorTable, states: ActorStates, i: int) -> Floats:
    """(8, 2) corners and middles of the sides of a body."""
    l, w = 0.5 * float(table.length[i]), 0.5 * float(table.width[i])
    c, s = cos(states.yaw[i]), sin(states.yaw[i])
    local = np.array([(a, b) for a in (-l, 0.0, l) for b in (-w, 0.0, w) if (a, b) != (0.0, 0.0)])
    placed: Floats = local @ np.array([(c, s), (-s, c)]) + np.array([states.x[i], states.y[i]])
    return placed


def _along(way: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Length along the way and distance left of it, of each place; nothing lies beyond its end."""
    dx, dy = places[:, :1] - way[:, 0], places[:, 1:] - way[:, 1]
    k = np.argmin(dx**2 + dy**2, axis=1)
    rows = np.arange(len(places))
    c, s = np.cos(way[k, 2]), np.sin(way[k, 2])
    along = way[k, 3] + dx[rows, k] * c + dy[rows, k] * s
    left = dy[rows, k] * c - dx[rows, k] * s
    return np.where(along > way[-1, 3] + STEP, -1.0, along), left
