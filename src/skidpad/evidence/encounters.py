"""Whether two actors of a run came into play with each other, and how their ways crossed.

They did when one of these held at any moment from the beginning of the interaction on:
(a) both would have met within 3 s, had they kept their velocities;
(b) one had the other ahead, would still have had it ahead on arrival, and was within 3 s or 20 m;
(c) one came within 2 s to a place that the other had left;
(d) their ways never crossed, and both went along the same line, or one stood, within 20 m.
Who crosses long before or after the other is no encounter, however near the two stand later.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.evidence.bodies import Body, body, corner_distance
from skidpad.evidence.pairs import following, together
from skidpad.recording.run.log import RunLog

TIME, DISTANCE = 3.0, 20.0  # s, m: farther apart is no interaction
LEFT = 2.0  # s after which a place that was left is no matter any more, as for PET (C-094)
STANDING = 0.1  # m/s
ALONG = cos(pi / 4.0)  # of the angle between headings, below which one crosses the other's line
SPACING = 0.5  # m between the places of a way that are compared
PLACES = 400  # at most, of each way


@dataclass(frozen=True, slots=True)
class Encounter:
    """How near the ego and another actor came to an interaction."""

    met: bool
    distance: float  # m between the boxes, least
    crossed_after: float | None  # s, ego behind (+) or before (-) at the same place; None: no place


def encounter(log: RunLog, ego: int, other: int, since: float = 0.0) -> Encounter | None:
    """Returns how two actors met; None when they were never there together.

    ego, other: columns of the log. since: s, when the interaction began; it limits only what counts
    as in play for `met`. `distance` and `crossed_after`, which also decides `met`, are of the whole
    time together.
    """
    both = together(log, ego, other)
    if not both.any():
        return None
    one, two = body(log, ego).select(both), body(log, other).select(both)
    crossed = crossing(one, two, log.t[both])
    later = log.t[both] >= since - 1e-9
    met = (crossed is not None and abs(crossed) <= LEFT) or _in_play(
        one.select(later), two.select(later), crossed is None
    )
    return Encounter(met, float(box_distance(one, two).min()), crossed)


def _in_play(one: Body, two: Body, ways_apart: bool) -> bool:
    """Return True when two bodies nearly meet, follow or, if `ways_apart`, come near side by side."""
    if bool((time_to_meet(one, two) <= TIME).any()) or _follows(one, two) or _follows(two, one):
        return True
    near = _alongside(one, two) & (box_distance(one, two) <= DISTANCE)
    return ways_apart and bool(near.any())


def _axes(one: Body) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Return the unit vectors forward and left of a body, each as (x, y) arrays."""
    c, s = np.cos(one.yaw), np.sin(one.yaw)
    return (c, s), (-s, c)


def _reach(one: Body, axis: tuple[Floats, Floats]) -> Floats:
    """Returns (T,) m, half of what a box covers along an axis."""
    long, wide = _axes(one)
    along = np.abs(axis[0] * long[0] + axis[1] * long[1])
    across = np.abs(axis[0] * wide[0] + axis[1] * wide[1])
    reach: Floats = 0.5 * (one.length * along + one.width * across)
    return reach


def time_to_meet(one: Body, other: Body) -> Floats:
    """Returns (T,) s until two boxes touch when both keep velocity and heading; 0: they do, inf: never.

    By separating axes: on each of the four edge normals the boxes overlap in one interval of time.
    """
    dx, dy = other.x - one.x, other.y - one.y
    vx, vy = other.vx - one.vx, other.vy - one.vy
    low, high = np.zeros_like(dx), np.full_like(dx, np.inf)
    for axis in (*_axes(one), *_axes(other)):
        at, rate = axis[0] * dx + axis[1] * dy, axis[0] * vx + axis[1] * vy
        reach = _reach(one, axis) + _reach(other, axis)
        moving = np.abs(rate) > 1e-9
        safe = np.where(moving, rate, 1.0)
        ends = np.sort(np.stack([(-reach - at) / safe, (reach - at) / safe]), axis=0)
        still = np.where(np.abs(at) <= reach, np.inf, -np.inf)  # always, or never
        low = np.maximum(low, np.where(moving, ends[0], -np.inf))
        high = np.minimum(high, np.where(moving, ends[1], still))
    time: Floats = np.where(low <= high, low, np.inf)
    return time


def _follows(behind: Body, ahead: Body) -> bool:
    """Return whether the one was ever close behind the other and would have stayed behind it."""
    f = following(behind, ahead)
    seen = ~np.isnan(f.gap)
    v = np.maximum(f.v, STANDING)
    arrival = np.minimum(np.where(seen, f.gap, 0.0) / v, TIME)
    c, s = np.cos(behind.yaw), np.sin(behind.yaw)
    aside = ahead.vy * c - ahead.vx * s
    stays = np.abs(f.left + aside * arrival) < f.wide
    near = (f.gap <= DISTANCE) | (f.gap <= TIME * f.v)
    return bool((seen & stays & near).any())


def _alongside(one: Body, other: Body) -> Flags:
    """Return (n,) True where both lie along one line or one of them stands."""
    same_line = np.abs(np.cos(other.yaw - one.yaw)) > ALONG
    stands = (np.hypot(one.vx, one.vy) < STANDING) | (np.hypot(other.vx, other.vy) < STANDING)
    mask: Flags = same_line | stands
    return mask


def box_distance(one: Body, other: Body) -> Floats:
    """Returns the distance between two boxes, (T,) m; 0 while they overlap."""
    apart = corner_distance(one, other)
    distance: Floats = np.where(time_to_meet(one, other) <= 0.0, 0.0, apart)
    return distance


def crossing(one: Body, other: Body, t: Floats) -> float | None:
    """Returns the least s between both at the same place, positive where `one` comes later; None: no place.

    t: (T,) s.
    """
    a, b = _places(one), _places(other)
    first, second = one.select(a), other.select(b)
    x, y, yaw = first.x[:, None], first.y[:, None], first.yaw[:, None]
    shared = overlap_along(x, y, yaw, second.x, second.y, second.yaw, one, other)
    shared &= overlap_along(second.x, second.y, second.yaw, x, y, yaw, other, one)
    if not shared.any():
        return None
    apart = np.where(shared, t[a][:, None] - t[b][None, :], np.inf)
    return float(apart.ravel()[np.abs(apart).argmin()])


def _places(one: Body) -> NDArray[np.int64]:
    """Returns rows at which a body has gone on by SPACING or more, the first and the last one among them."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(one.x), np.diff(one.y)))])
    spacing = max(SPACING, way[-1] / PLACES)
    rows = np.flatnonzero(np.diff(np.floor(way / spacing), prepend=-1.0) > 0.0)
    return np.unique(np.append(rows, len(way) - 1))


class Sized(Protocol):
    """A thing with a box on the ground, m."""

    @property
    def length(self) -> float:
        """The size of the box along its heading."""

    @property
    def width(self) -> float:
        """The size of the box across its heading."""


def overlap_along(
    x: Floats, y: Floats, yaw: Floats, x2: Floats, y2: Floats, yaw2: Floats, box: Sized, box2: Sized
) -> Flags:
    """Returns where boxes at all these places overlap along both edges of the first one.

    x, y, yaw and x2, y2, yaw2 broadcast; together with the call with both exchanged it says that the
    boxes overlap.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    along, across = np.abs(np.cos(yaw2 - yaw)), np.abs(np.sin(yaw2 - yaw))
    forward = np.abs((x2 - x) * c + (y2 - y) * s)
    left = np.abs((y2 - y) * c - (x2 - x) * s)
    mask: Flags = forward <= 0.5 * (box.length + box2.length * along + box2.width * across)
    mask &= left <= 0.5 * (box.width + box2.length * across + box2.width * along)
    return mask
