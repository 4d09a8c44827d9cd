"""How the surface of each lane slopes, and how much paved width lies above it: where rain comes from."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap

PAVED = (LaneKind.DRIVING, LaneKind.RAMP, LaneKind.SHOULDER)
# A file may draw straights without the crown that they have: a cross slope below LEAST_CROSS for more
# than CROWNED m, or on all of a road, is taken for that; our assumption.
LEAST_CROSS, CROWNED = 0.005, 100.0  # -, m


class CrossSlopes(NamedTuple):
    """The middles of lanes whose cross slope the file says, arrays (n,), in order along each lane."""

    lane: NDArray[np.int32]
    s_road: Floats  # m along the road
    cross: Floats  # magnitude of the cross slope
    grade: Floats
    above: Floats  # m of paved width from the high edge to the middle of the lane


def cross_slopes(map: RoadMap) -> CrossSlopes:
    """Returns the cross slopes that a map's superelevation says for the lanes that can be driven.

    Junctions are left out.
    """
    s, lanes = map.samples, map.lanes
    drivable = (map.arrays.drivable == 1) & (lanes.junction == -1)
    said = [_said_rows(map, int(lane)) for lane in np.flatnonzero(drivable)]
    rows = np.concatenate([np.zeros(0, dtype=np.intp), *said])
    above = np.full(len(s.x), np.nan)
    for section in sorted({(int(lanes.road[k]), int(lanes.section[k])) for k in s.lane[rows]}):
        _fill_widths(map, section, above)
    cross = np.abs(np.tan(s.bank[rows]))
    return CrossSlopes(s.lane[rows], s.s_road[rows], cross, s.grade[rows], above[rows])


def _said_rows(map: RoadMap, lane: int) -> NDArray[np.intp]:
    """Returns the samples of a lane without those where a level road stands for a crown."""
    first = int(map.lanes.first[lane])
    rows = np.arange(first, first + int(map.lanes.size[lane]))
    level = np.abs(np.tan(map.samples.bank[rows])) < LEAST_CROSS
    said = np.ones(len(rows), dtype=np.bool_)
    edges = [0, *(np.flatnonzero(np.diff(level)) + 1).tolist(), len(rows)]
    for low, high in pairwise(edges):
        along = map.samples.s[rows[high - 1]] - map.samples.s[rows[low]]
        if level[low] and (along > CROWNED or high - low == len(rows)):
            said[low:high] = False
    return rows[said]


def _fill_widths(map: RoadMap, section: tuple[int, int], above: Floats) -> None:
    """Writes the paved width above the middle of each lane of a section, m, into `above` by sample.

    section: road id and index. What is not paved, such as a median, lets no water pass.
    """
    s, lanes = map.samples, map.lanes
    found = np.flatnonzero((lanes.road == section[0]) & (lanes.section == section[1]))
    found = found[np.argsort(-lanes.lane_id[found])]  # from the left of the road to its right
    along = []  # samples of each lane by rising s of the road, which are as many for every lane
    for lane in found:
        own = np.arange(int(lanes.first[lane]), int(lanes.first[lane] + lanes.size[lane]))
        along.append(own if s.s_road[own[0]] <= s.s_road[own[-1]] else own[::-1])
    rows = np.array(along)
    backward = rows[:, :1] > rows[:, -1:]
    left_is_high = np.where(backward, -s.bank[rows], s.bank[rows]) > 0.0
    width, paved = s.width[rows], np.isin(lanes.kind[found], PAVED)
    for side, order in ((True, range(len(found))), (False, range(len(found) - 1, -1, -1))):
        gathered = np.zeros(rows.shape[1])
        for k in order:
            gathered = gathered * paved[k]
            here = left_is_high[k] == side
            above[rows[k][here]] = gathered[here] + 0.5 * width[k][here]
            gathered = gathered + width[k]
