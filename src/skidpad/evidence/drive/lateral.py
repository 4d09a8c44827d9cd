"""Lane keeping: distance from the lane centre, markings crossed, lane changes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Flags
from skidpad.core.states import LaneInvasion
from skidpad.evidence.drive.prepared import Drive

V_MIN = 5.0 / 3.6  # m/s, slower the offset says nothing
CHANGE_COOL_DOWN = 12.0  # s


class Offsets(NamedTuple):
    """Distance from the lane centre in m; None when the ego never drove."""

    mean: float | None
    max: float | None
    std: float | None


class Invasions(NamedTuple):
    """Markings that the ego's outline crossed (A-030 to A-032, A-248)."""

    solid: int  # infractions
    any: int
    solid_on_highway: int
    lane_changes: int


def lateral_offset(drive: Drive, where: Flags) -> Offsets:
    """Returns statistics of |offset| above V_MIN in `where`, outside recovery and warm-up (A-245)."""
    offset = np.abs(drive.place.offset)
    use = where & drive.free & (drive.v > V_MIN) & ~np.isnan(offset)
    values = offset[use]
    if not values.size:
        return Offsets(None, None, None)
    return Offsets(float(values.mean()), float(values.max()), float(values.std()))


def count_invasions(
    invasions: Iterable[LaneInvasion], highway: frozenset[int], dt: float
) -> Invasions:
    """Counts solid markings as infractions and broken ones as lane changes, at most one per 12 s.

    highway: ids of roads; dt: s per tick.
    """
    solid = total = on_highway = changes = 0
    last_change = -np.inf
    for invasion in sorted(invasions, key=lambda i: i.tick):
        total += 1
        if invasion.marking.startswith("solid"):
            solid += 1
            on_highway += invasion.road in highway
        elif (
            invasion.marking.startswith("broken")
            and (invasion.tick - last_change) * dt >= CHANGE_COOL_DOWN
        ):
            changes += 1
            last_change = invasion.tick
    return Invasions(solid, total, on_highway, changes)
