"""Whether a channel's position follows its own odometry: the innovation of half a second."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import dist, hypot, nan

import numpy as np

from skidpad.core.channels import ChannelFrame

WINDOW = 0.5  # s


class Odometer:
    """Call `update` once per cycle with the frame of one channel."""

    def __init__(self) -> None:
        self.before: tuple[float, float, float] | None = None  # t, vx, vy
        self.driven = (0.0, 0.0)  # m by odometry
        self.errors: deque[tuple[float, float, float]] = deque()  # t, position less odometry

    def update(self, t: float, frame: ChannelFrame | None) -> None:
        """Takes in the cycle at t s; None, or an ego that is not finite, forgets all before."""
        if frame is None or not np.isfinite(frame.ego).all():
            self.before = None
            self.errors.clear()
            return
        x, y, _, vx, vy = frame.ego.tolist()
        if self.before is not None:
            t0, vx0, vy0 = self.before
            half = 0.5 * (t - t0)
            self.driven = (self.driven[0] + half * (vx0 + vx), self.driven[1] + half * (vy0 + vy))
        self.before = (t, vx, vy)
        now = (x - self.driven[0], y - self.driven[1])
        self.errors.append((t, *now))
        while t - self.errors[0][0] > WINDOW + 1e-6:
            self.errors.popleft()

    def moves(self) -> dict[float, tuple[float, float]]:
        """Returns m in x and y by which the position has moved beside odometry, by the time in s since when.

        The times are those of the last WINDOW s; {} after a cycle without a message.
        """
        if not self.errors:
            return {}
        _, x, y = self.errors[-1]
        return {t: (x - ex, y - ey) for t, ex, ey in self.errors}


def greatest_leap(odometers: Sequence[Odometer]) -> float:
    """Returns the m by which one channel's position left odometry and the others'; NaN: all are silent.

    What all positions do alike is an error of the odometry, as of a car that slides sideways.
    """
    known = [moves for o in odometers if (moves := o.moves())]
    return max((_own_leap(i, known) for i in range(len(known))), default=nan)


def _own_leap(i: int, known: Sequence[dict[float, tuple[float, float]]]) -> float:
    """Returns the largest move of channel `i` in m or, if less, its largest difference from another's.

    known: moves of all channels that have any.
    """
    own, rest = known[i], [*known[:i], *known[i + 1 :]]
    apart = [max(dist(own[t], other[t]) for t in own.keys() & other.keys()) for other in rest]
    return min([max(hypot(*move) for move in own.values()), *apart])
