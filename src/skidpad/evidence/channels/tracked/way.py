"""Path coordinates of one channel: where it came from, where it is, where it plans to go."""

from __future__ import annotations

from collections import deque
from math import cos, dist, isfinite, sin
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame

STEP = 1.0  # m between points
BEHIND = AHEAD = 80.0  # m
FAR = 1e7  # m from the origin: what lies beyond is no place of a car
LEAP = 4.0  # m of a position from one cycle to the next: what lay behind is forgotten


class Way:
    """Remembers where the channel's ego came from; it must be `usable`."""

    def __init__(self) -> None:
        self.past: deque[tuple[float, float]] = deque(maxlen=round(BEHIND / STEP))

    @staticmethod
    def usable(frame: ChannelFrame) -> bool:
        """Returns whether the ego has a finite place and an outline."""
        x, y, *rest = frame.ego.tolist()
        return len(frame.ego_polygon) > 2 and abs(x) + abs(y) < FAR and all(map(isfinite, rest))

    def update(self, frame: ChannelFrame) -> None:
        """Appends where the ego is, STEP or more from the last place; a move over LEAP drops all before."""
        place = (float(frame.ego[0]), float(frame.ego[1]))
        moved = dist(place, self.past[-1]) if self.past else STEP
        if moved > LEAP:
            self.past.clear()
        if moved >= STEP:
            self.past.append(place)

    def line(self, frame: ChannelFrame) -> Line:
        """Returns the line of this cycle; to be called after `update`."""
        return Line(list(self.past), frame)


class Placed(NamedTuple):
    """Where on the way something is."""

    s: float  # m along it from the ego
    offset: float  # m to the left of it
    turn: float  # rad against its direction
    v: float  # m/s along it


class Line:
    """Points a metre apart from behind the ego to the end of its plan and straight on."""

    def __init__(self, past: list[tuple[float, float]], frame: ChannelFrame) -> None:
        x, y, h = frame.ego[:3].tolist()
        place, forward = (x, y), (cos(h), sin(h))
        behind = past[:-1] if past and dist(past[-1], place) <= STEP else past
        ahead: list[tuple[float, float]] = []
        for px, py, t in frame.plan.tolist():
            near = abs(px) + abs(py) < FAR and isfinite(t)  # never with NaN
            if near and dist((px, py), ahead[-1] if ahead else place) > STEP:
                ahead.append((px, py))
        first = _unit(behind[0], behind[1] if len(behind) > 1 else place) if behind else forward
        last = _unit(ahead[-2] if len(ahead) > 1 else place, ahead[-1]) if ahead else forward
        start, end = (behind or [place])[0], (ahead or [place])[-1]
        knots = np.array(
            [
                (start[0] - BEHIND * first[0], start[1] - BEHIND * first[1]),
                *behind,
                place,
                *ahead,
                (end[0] + AHEAD * last[0], end[1] + AHEAD * last[1]),
            ]
        )
        steps = np.diff(knots, axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
        self.ego = float(s[len(behind) + 1])
        low, high = max(self.ego - BEHIND, 0.0), min(self.ego + AHEAD, s[-1])
        self.s = np.arange(low, high, STEP)
        self.points = np.column_stack([np.interp(self.s, s, knots[:, k]) for k in (0, 1)])
        ways = np.gradient(self.points, axis=0)
        self.heading = np.arctan2(ways[:, 1], ways[:, 0])

    def places(self, states: Floats) -> list[Placed]:
        """Returns where n > 0 states (n, 5) are on the line."""
        apart = states[:, None, :2] - self.points[None]
        k = np.argmin(apart[:, :, 0] ** 2 + apart[:, :, 1] ** 2, axis=1)
        h = self.heading[k]
        c, s = np.cos(h), np.sin(h)
        dx, dy = apart[np.arange(len(k)), k].T
        turn = (states[:, 2] - h + np.pi) % (2.0 * np.pi) - np.pi
        along = self.s[k] + c * dx + s * dy - self.ego
        found = [along, c * dy - s * dx, turn, c * states[:, 3] + s * states[:, 4]]
        return [Placed(*row) for row in np.column_stack(found).tolist()]


def _unit(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    """Returns the unit vector from a to b, which are more than STEP apart."""
    d = max(dist(a, b), 1e-9)
    return (b[0] - a[0]) / d, (b[1] - a[1]) / d
