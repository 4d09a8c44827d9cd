"""The road's grip by what the vehicle asked for and what it got.

Plans say which acceleration is wanted, odometry says which one came. Where a car gets much less than
every plan asks, for as long as no actuator is slow, its tyres are at their limit: braking shows the
grip of all wheels, accelerating that of the driven axle. A car that later gets more than the limit
allows disproves it. What no manoeuvre has shown is not known.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import hypot

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame
from skidpad.core.maths.constants import G
from skidpad.evidence.channels.tracked.distance import GRIPS

WINDOW = 0.8  # s over which an acceleration is measured
SHORT = 0.6  # share of the wanted acceleration below which a car gets too little
ASK_BRAKE, ASK_DRIVE = -1.5, 0.8  # m/s^2 that every plan asks for at least
LEAST_BRAKE, LEAST_DRIVE = -0.2, 0.05  # m/s^2 that come at least, else the car stands or is held
HELD_BRAKE, HELD_DRIVE = 0.5, 1.0  # s, longer than pedals and a gear take
V_BRAKE, V_DRIVE = 2.0, (1.0, 8.0)  # m/s; above, an engine may have no more to give
AXLE_SHARE = 0.5  # of the weight, on the driven axle (assumed: level car, two driven wheels)
BRAKE_SHARE = 0.85  # of the grip that brakes use before the first wheel slips too much (assumed)
FADE = 0.005  # share per cycle by which a lower estimate is followed; a higher one counts at once
DISPROVED, DISPROOF_TIME = 1.3, 0.3  # times the limit, s
PLAN_POINTS = slice(1, 6)  # of a plan: the first lies at the ego, which has its own error


class OwnGrip:
    """Call `update` once per cycle with usable frames; None: nothing has shown the limit."""

    def __init__(self) -> None:
        self.grip: float | None = None
        self.rows: deque[tuple[float, float, float]] = deque()  # t, speed, wanted acceleration
        self.short_since: float | None = None
        self.over_since: float | None = None

    def update(self, t: float, frames: Sequence[ChannelFrame | None]) -> float | None:
        """Takes in a cycle and returns the grip at t s, within GRIPS; None while nothing has shown it."""
        speeds = [hypot(*f.ego[3:].tolist()) for f in frames if f is not None]
        wanted = [a for f in frames if f is not None and (a := planned_acceleration(f)) is not None]
        if not speeds or not wanted or not np.isfinite([*speeds, *wanted]).all():
            return self.grip
        ask = min(wanted, key=abs) if min(wanted) * max(wanted) > 0.0 else 0.0
        self.rows.append((t, sum(speeds) / len(speeds), ask))
        while t - self.rows[0][0] > WINDOW + 1e-6 or self.rows[0][0] > t:
            self.rows.popleft()
        if t - self.rows[0][0] >= WINDOW - 1e-6:
            self._judge(t)
        return self.grip

    def _judge(self, t: float) -> None:
        """Learns from the last speeds in m/s what grip they show at `t` s, or forgets a grip disproved."""
        rows = np.array(self.rows)
        a, ask, v = slope(rows[:, 0], rows[:, 1]), float(np.median(rows[:, 2])), rows[-1, 1]
        shown = limit_shown(v, a, ask)
        self.short_since = None if shown is None else _start(self.short_since, t)
        held = HELD_DRIVE if a > 0.0 else HELD_BRAKE
        if shown is not None and t - _start(self.short_since, t) >= held - 1e-6:
            self._learn(min(max(shown, GRIPS[0]), GRIPS[1]))
        beyond = self.grip is not None and abs(a) > DISPROVED * self.grip * G
        self.over_since = _start(self.over_since, t) if beyond else None
        if beyond and t - _start(self.over_since, t) >= DISPROOF_TIME - 1e-6:
            self.grip = self.over_since = None

    def _learn(self, shown: float) -> None:
        """Takes over a grip that was shown; one below the known grip moves it a part of the way."""
        known = self.grip
        self.grip = shown if known is None or shown > known else known + FADE * (shown - known)


def _start(since: float | None, t: float) -> float:
    """Returns `since`, or `t` where it is None."""
    return t if since is None else since


def planned_acceleration(frame: ChannelFrame) -> float | None:
    """Returns the m/s^2 with which a plan begins; None where it is too short or its times do not rise.

    Of the plan, PLAN_POINTS count, at least four of them.
    """
    plan = frame.plan[PLAN_POINTS]
    if len(plan) < 4:
        return None
    steps = np.diff(plan, axis=0)
    if not (steps[:, 2] > 0.0).all():
        return None
    speeds = np.hypot(steps[:, 0], steps[:, 1]) / steps[:, 2]
    return slope(0.5 * (plan[1:, 2] + plan[:-1, 2]), speeds)


def slope(t: Floats, values: Floats) -> float:
    """Returns the slope of the straight line through the values (k,) at times (k,)."""
    dt = t - t.mean()
    return float(dt @ values / (dt @ dt))


def limit_shown(v: float, a: float, ask: float) -> float | None:
    """Returns the grip that a car at v m/s shows which asks for `ask` and gets a, in m/s^2; None: none."""
    if v > V_BRAKE and ask < ASK_BRAKE and SHORT * ask < a < LEAST_BRAKE:
        return -a / (BRAKE_SHARE * G)
    if V_DRIVE[0] < v < V_DRIVE[1] and ask > ASK_DRIVE and LEAST_DRIVE < a < SHORT * ask:
        return a / (AXLE_SHARE * G)
    return None
