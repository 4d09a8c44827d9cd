"""A driver that does not drive, against the one that does: when each brakes, and before what.

Pure functions of both drivers' commands on the same moments. The shadow answers what it sees in a
world that the other driver shapes: after the two have parted, its later commands answer situations
into which it would not have come. So the first difference counts, and what follows does not.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats

BRAKING = 0.15  # of full brake, from which a driver counts as braking
BEFORE = 6.0  # s before an event in which braking belongs to it
SHORTEST = 0.5  # s that a difference lasts at least to be listed


class Pedals(NamedTuple):
    """What one driver asks for, arrays (T,); NaN where it was not asked."""

    throttle: Floats
    brake: Floats


class Parting(NamedTuple):
    """A stretch in which one driver brakes and the other does not."""

    begin: float  # s
    end: float  # s
    shadow_brakes: bool  # else the driver does


class Foresight(NamedTuple):
    """One event of the drive, and how long before it each driver was braking; None: not at all."""

    t: float  # s
    driver: float | None  # s before
    shadow: float | None  # s before


def is_braking(pedals: Pedals) -> NDArray[np.bool_]:
    """Returns (T,) whether a driver brakes, BRAKING or more."""
    return pedals.brake >= BRAKING


def partings(t: Floats, driver: Pedals, shadow: Pedals) -> list[Parting]:
    """Returns the stretches of at least SHORTEST in which exactly one of both brakes, in order of time."""
    asked = np.isfinite(driver.brake) & np.isfinite(shadow.brake)
    apart = np.where(asked, is_braking(shadow).astype(int) - is_braking(driver).astype(int), 0)
    edges: list[int] = np.flatnonzero(np.diff(apart, prepend=0, append=0)).tolist()
    found = []
    for first, end in pairwise(edges):
        begin, last = float(t[first]), float(t[min(end, len(t) - 1)])
        if apart[first] and last - begin >= SHORTEST:
            found.append(Parting(begin, last, bool(apart[first] > 0)))
    return found


def foresight(t: Floats, events: Floats, driver: Pedals, shadow: Pedals) -> list[Foresight]:
    """Returns how long before each event (s) each driver was first braking, at most BEFORE."""
    return [Foresight(float(e), _ahead(t, e, driver), _ahead(t, e, shadow)) for e in events]


def _ahead(t: Floats, event: float, pedals: Pedals) -> float | None:
    """Returns the s from the first braking within BEFORE of the event; None: no braking there."""
    near = (t >= event - BEFORE) & (t <= event) & is_braking(pedals)
    return float(event - t[np.argmax(near)]) if near.any() else None


def share_apart(driver: Pedals, shadow: Pedals) -> float:
    """Returns the share of the moments at which both were asked and exactly one braked; 0 of none."""
    asked = np.isfinite(driver.brake) & np.isfinite(shadow.brake)
    if not asked.any():
        return 0.0
    return float(np.mean((is_braking(driver) != is_braking(shadow))[asked]))
