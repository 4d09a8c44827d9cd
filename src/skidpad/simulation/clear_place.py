"""Where on its lane the ego is put: no other vehicle is there or just ahead (A-184)."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, sin

import numpy as np

from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import ActorKind, Clearance
from skidpad.roads.queries import LanePoint, RoadMap

CLEAR_AHEAD = 15.0  # m, A-184
CLEAR_ASIDE = 2.5  # m
SHIFT_BACK = 8.0  # m
SHIFTS = 4
LEVEL = 4.0  # m: whatever is farther above or below is on another road (decision M-12)
MARGIN = 0.3  # m around the ego's own box where it is put


def find_clear_place(
    map: RoadMap, nearest: LanePoint, truth: WorldTruth, clearance: Clearance
) -> tuple[LanePoint, float, bool]:
    """Returns the place, the m moved back to it, and whether it is clear (A-184, D-080).

    Where none is, the last one looked at.
    """
    place, shift = nearest, 0.0
    if clearance is Clearance.NONE:
        return place, shift, _is_clear(place, truth, clearance)
    for candidate in _candidates(map, nearest):
        place, shift = candidate
        if _is_clear(place, truth, clearance):
            return place, shift, True
    return place, shift, False


def _candidates(map: RoadMap, nearest: LanePoint) -> Iterator[tuple[LanePoint, float]]:
    """Yields (lane point, shift back in m) from the nearest point on, while the lane goes back."""
    yield nearest, 0.0
    place = nearest
    for k in range(1, SHIFTS + 1):
        behind = map.behind(place, SHIFT_BACK)
        if behind is None:
            return
        place = behind
        yield place, k * SHIFT_BACK


def _is_clear(place: LanePoint, truth: WorldTruth, clearance: Clearance) -> bool:
    """Returns whether no other vehicle is in the box ahead of the place, nor where the ego would be."""
    states, table = truth.states, truth.table
    vehicle = states.present & (table.kind <= ActorKind.MOTORCYCLE)
    vehicle &= np.abs(states.z - place.z) < LEVEL
    dx, dy = states.x - place.x, states.y - place.y
    forward = dx * cos(place.heading) + dy * sin(place.heading)
    aside = np.abs(dy * cos(place.heading) - dx * sin(place.heading))
    blocking = vehicle & (forward > 0.0) & (forward < CLEAR_AHEAD) & (aside < CLEAR_ASIDE)
    if clearance is Clearance.LISTING:
        return not bool(blocking.any())
    touching = vehicle & (np.abs(forward) < 0.5 * (table.length + table.length[0]) + MARGIN)
    touching &= aside < 0.5 * (table.width + table.width[0]) + MARGIN
    return not bool((blocking | touching)[1:].any())
