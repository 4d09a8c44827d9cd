"""The way of an ego: where it came from and where it plans to go, and which vehicles are on it."""

from __future__ import annotations

from collections import deque

import numpy as np

from skidpad.core.arrays import Flags, Floats

SAME_PATH = np.radians(45.0)  # heading along the path (decision R-9)
REACH = 60.0  # m of the way behind and of its straight extensions
SPACING = 0.5  # m between places of a trail
LEAP = 5.0  # m between two cycles: the position leapt, and the trail begins anew


class Trail:
    """Where an ego came from."""

    def __init__(self) -> None:
        self.places: deque[tuple[float, float]] = deque(maxlen=round(REACH / SPACING))

    def add(self, ego: Floats) -> None:
        """Adds the present place of the ego (5,), when it is SPACING m or more from the last one.

        A move of more than LEAP m drops all earlier places.
        """
        x, y = float(ego[0]), float(ego[1])
        if self.places:
            moved = np.hypot(x - self.places[-1][0], y - self.places[-1][1])
            if moved > LEAP:
                self.places.clear()
            elif moved < SPACING:
                return
        self.places.append((x, y))

    @property
    def points(self) -> Floats:
        """Returns places of the way, (k, 2), oldest first."""
        return np.array(self.places).reshape(-1, 2)


class Corridor:
    """Trail, ego and plan as one line, straight on at both ends."""

    def __init__(self, trail: Floats, ego: Floats, plan: Floats, polygon: Floats) -> None:
        heading = np.array([np.cos(ego[2]), np.sin(ego[2])])
        place = ego[:2]
        behind = [
            p for p in trail if (place - p) @ heading > SPACING or np.hypot(*(place - p)) > 10
        ]
        ahead = [p for p in plan if np.hypot(*(p - place)) > SPACING]
        first = behind[0] if behind else place
        start = _direction(first, behind[1] if len(behind) > 1 else place, heading)
        last = ahead[-1] if ahead else place
        end = _direction(ahead[-2] if len(ahead) > 1 else place, last, heading)
        self.points = np.array(
            [first - REACH * start, *behind, place, *ahead, last + REACH * end], dtype=np.float64
        )
        self.s_of_ego = float(_lengths(self.points)[: len(behind) + 1].sum())
        self.half_width = float(np.abs(polygon[:, 1]).max(initial=0.0))

    def places(self, objects: Floats, polygons: Floats) -> tuple[Flags, Flags]:
        """Returns which objects are on the path, and which lie farther along it than the ego, (n,) bool.

        objects: (n, 5) x, y, heading, vx, vy; polygons: (n, k, 2) in m, each in its object's own axes. On
        the path are those that reach into it and head along it within SAME_PATH, none with NaN in its
        row. Those farther along need not be on it.
        """
        steps = np.diff(self.points, axis=0)
        length = np.maximum(_lengths(self.points), 1e-9)
        tangent = steps / length[:, None]
        offset = objects[:, None, :2] - self.points[None, :-1]
        along = np.clip(np.einsum("nmk,mk->nm", offset, tangent), 0.0, length)
        away = offset - along[:, :, None] * tangent[None]
        distance = np.hypot(away[:, :, 0], away[:, :, 1])
        nearest = np.argmin(np.nan_to_num(distance, nan=np.inf), axis=1)
        rows = np.arange(len(objects))
        t = tangent[nearest]
        heading = np.arctan2(t[:, 1], t[:, 0])
        turned = np.abs((objects[:, 2] - heading + np.pi) % (2.0 * np.pi) - np.pi)
        half = np.nan_to_num(np.abs(polygons[:, :, 1])).max(axis=1, initial=0.0)
        usable = np.isfinite(objects).all(axis=1)
        inside = distance[rows, nearest] < self.half_width + half
        s = np.concatenate([[0.0], np.cumsum(length)])[nearest] + along[rows, nearest]
        return usable & inside & (turned <= SAME_PATH), s > self.s_of_ego


def _direction(a: Floats, b: Floats, otherwise: Floats) -> Floats:
    """Returns the unit vector from a to b; `otherwise` where they are less than 1 um apart."""
    d = np.hypot(*(b - a))
    out: Floats = (b - a) / d if d > 1e-6 else otherwise
    return out


def _lengths(points: Floats) -> Floats:
    """Returns (n - 1,) the lengths of the steps between n points, in m."""
    lengths: Floats = np.hypot(*np.diff(points, axis=0).T)
    return lengths
