"""A channel that does not drive, against the one that does: what each plans to brake (C-010).

Needs no truth: the plans are in the recording, cycle by cycle, whichever channel drives.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.evidence.shadow import Pedals

AHEAD = 1.0  # s of a plan over which its braking is read
HARDEST = 8.0  # m/s^2 of a full brake; 0.15 of it, where braking begins, are 1.2 m/s^2


def planned_braking(frame: ChannelFrame | None) -> float:
    """Returns the share of a full brake that a channel plans for the next second; NaN for a shorter plan.

    The deceleration is the one under which the plan's way of AHEAD s begins at the channel's speed.
    """
    if frame is None or not len(frame.plan) or frame.plan[-1, 2] < AHEAD:
        return float("nan")
    steps = np.hypot(np.diff(frame.plan[:, 0]), np.diff(frame.plan[:, 1]))
    way = float(np.interp(AHEAD, frame.plan[:, 2], np.concatenate([[0.0], np.cumsum(steps)])))
    v = float(np.hypot(frame.ego[3], frame.ego[4]))
    a = 2.0 * (way - v * AHEAD) / AHEAD**2
    return float(np.clip(-a / HARDEST, 0.0, 1.0))


def plans_of(cycles: Iterable[Cycle], shadow: int) -> tuple[Floats, Pedals, Pedals]:
    """Returns (T,) times in s, and the braking that the driving channel and channel number `shadow` plan.

    Moments count while another channel drives; the others are NaN in both.
    """
    rows = []
    for cycle in cycles:
        led = cycle.driving is None or cycle.driving == shadow
        driver = np.nan if led else planned_braking(cycle.frames[cycle.driving or 0])
        rows.append((cycle.t, driver, np.nan if led else planned_braking(cycle.frames[shadow])))
    t, driving, riding = np.array(rows).reshape(-1, 3).T
    still = np.zeros(len(t))
    return t, Pedals(still, driving), Pedals(still, riding)
