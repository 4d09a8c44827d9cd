"""Baked lanes: every lane of a map as samples in arrays, ready for kernels.

A *lane* here is one lane of one lane section. Its samples run in driving direction; `s` is the
length along the lane's own centre line from its first sample. World frame, ISO 8855, SI.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints32


class LaneKind(IntEnum):
    """OpenDRIVE lane types that matter to us."""

    DRIVING = 0
    SHOULDER = 1
    SIDEWALK = 2
    BIKING = 3
    PARKING = 4
    BORDER = 5
    MEDIAN = 6
    RAMP = 7  # entry, exit, onRamp, offRamp, connectingRamp: may be driven
    OTHER = 8


class Marking(IntEnum):
    """Lane markings at the outer border of a lane."""

    NONE = 0
    BROKEN = 1
    SOLID = 2
    SOLID_SOLID = 3
    SOLID_BROKEN = 4
    BROKEN_SOLID = 5
    OTHER = 6
    CURB = 7  # a kerb stone: no paint; what lies beyond it and is no carriageway lies higher


class LaneSamples(NamedTuple):
    """N samples, spaced at most 1 m, of all lanes one after the other; arrays (N,)."""

    x: Floats
    y: Floats
    z: Floats
    heading: Floats  # rad, driving direction
    s: Floats  # m from the lane's first sample
    s_road: Floats  # m, OpenDRIVE s
    curvature: Floats  # 1/m, left positive in driving direction
    grade: Floats  # dz/ds in driving direction
    bank: Floats  # rad, left side up positive
    width: Floats  # m
    limit: Floats  # m/s, NaN where the map gives none
    marking_left: NDArray[np.uint8]  # Marking, seen in driving direction
    marking_right: NDArray[np.uint8]
    lane: Ints32  # index into LaneTable


class LaneTable(NamedTuple):
    """L lanes; arrays (L,) unless said otherwise. Index -1 means none."""

    road: Ints32  # OpenDRIVE road id
    lane_id: Ints32  # OpenDRIVE lane id, sign as in the file
    section: Ints32
    first: Ints32  # first sample
    size: Ints32  # number of samples, >= 2
    length: Floats  # m
    kind: NDArray[np.uint8]  # LaneKind
    junction: Ints32  # OpenDRIVE junction id or -1
    left: Ints32  # neighbour lane of the same direction that can be driven, or -1
    right: Ints32
    opposite: Ints32  # innermost lane across the centre line when this one is innermost, or -1
    next_start: (
        Ints32  # (L + 1,) successors of lane i are next_lane[next_start[i]:next_start[i + 1]]
    )
    next_lane: Ints32
    prev_start: Ints32  # (L + 1,) predecessors likewise
    prev_lane: Ints32


class SignalTable(NamedTuple):
    """K signals (lights, stop lines, limits, yields) as they act on lanes; arrays (K,).

    One row per signal and lane on which it is valid.
    """

    id: Ints32  # OpenDRIVE signal id
    kind: NDArray[np.uint8]  # SignalKind
    x: Floats  # position of the signal head or sign
    y: Floats
    z: Floats
    heading: Floats  # direction of the traffic that it governs
    lane: Ints32  # index into LaneTable
    s: Floats  # m along that lane: the stop line, or where the sign takes effect
    value: Floats  # limit in m/s for SPEED_LIMIT, else NaN
    group: Ints32  # controller or junction that it belongs to, -1: alone


class SignalKind(IntEnum):
    """What a signal demands of drivers."""

    LIGHT = 0
    STOP = 1
    YIELD = 2
    SPEED_LIMIT = 3
    CROSSWALK = 4
    OTHER = 5
