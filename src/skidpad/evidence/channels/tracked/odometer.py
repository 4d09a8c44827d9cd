"""Whether a channel's position follows its own odometry: the innovation of half a second."""

from __future__ import annotations

from collections import deque
from math import hypot, nan

import numpy as np

from skidpad.core.channels import ChannelFrame

WINDOW = 0.5  # s


class Odometer:
    """Call `update` once per cycle with the frame of one channel."""

    def __init__(self) -> None:
        self.before: tuple[float, float, float] | None = None  # t, vx, vy
        self.driven = (0.0, 0.0)  # m by odometry
        self.errors: deque[tuple[float, float, float]] = deque()  # t, position less odometry

    def update(self, t: float, frame: ChannelFrame | None) -> float:
        """m by which the position has moved beside odometry in the last half second; NaN: unknown."""
        if frame is None or not np.isfinite(frame.ego).all():
            self.before = None
            self.errors.clear()
            return nan
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
        return max(hypot(now[0] - ex, now[1] - ey) for _, ex, ey in self.errors)
