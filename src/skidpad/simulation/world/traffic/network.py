"""What drivers know of the map: lanes, speed caps, stop lines and the straight way on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Ints32
from skidpad.core.geometry import mps_from_kmh
from skidpad.roads.lanes import (
    LaneKind,
    LaneSamples,
    LaneTable,
    SignalKind,
    SignalTable,
)

DRIVABLE = (LaneKind.DRIVING, LaneKind.RAMP)
UNSIGNED_LIMIT = mps_from_kmh(50.0)  # where the map gives none: urban default, Vienna Convention
STRAIGHT_WINDOW = 20.0  # m along which two branches are compared


POINT = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("s", "f8"),  # m along the lane
        ("heading", "f8"),
        ("curvature", "f8"),  # 1/m, left positive
        ("grade", "f8"),
        ("half_width", "f8"),
        ("limit", "f8"),  # m/s, no gaps
        ("patch", "f8"),  # share of the friction that drivers see a patch leave, 1: none
        ("marking_left", "u1"),
        ("marking_right", "u1"),
        ("sign", "?"),  # a speed-limit sign takes effect here
    ],
    align=True,
)
LANE = np.dtype(
    [
        ("length", "f8"),
        ("first", "i4"),  # first point
        ("size", "i4"),
        ("kind", "i4"),  # LaneKind
        ("left", "i4"),
        ("right", "i4"),
        ("ahead", "i4"),  # straightest drivable successor or -1
        ("behind", "i4"),  # straightest drivable predecessor or -1
        ("stop_first", "i4"),  # stop rows are stop_first:stop_first + stops
        ("stops", "i4"),
        ("next_first", "i4"),  # successors likewise
        ("nexts", "i4"),
        ("prev_first", "i4"),
        ("prevs", "i4"),
    ],
    align=True,
)
STOP = np.dtype([("s", "f8"), ("row", "i4")], align=True)  # m along the lane; row of SignalTable


class Network(NamedTuple):
    """Lanes for the traffic kernels: few arrays of records, since every array costs at each call."""

    point: NDArray[np.void]  # (N,) POINT
    lane: NDArray[np.void]  # (L,) LANE
    stop: NDArray[np.void]  # (M,) STOP
    next_lane: Ints32
    prev_lane: Ints32


def network(samples: LaneSamples, lanes: LaneTable, signals: SignalTable) -> Network:
    """Returns the drivers' view of a baked map; UNSIGNED_LIMIT where it gives no limit."""
    point = np.zeros(len(samples.x), dtype=POINT)
    for name in ("x", "y", "s", "heading", "curvature", "grade", "marking_left", "marking_right"):
        point[name] = getattr(samples, name)
    point["half_width"] = samples.width / 2.0
    point["limit"] = np.where(np.isnan(samples.limit), UNSIGNED_LIMIT, samples.limit)
    point["patch"] = 1.0
    point["sign"] = _signs(samples, lanes, signals)
    lane = np.zeros(len(lanes.first), dtype=LANE)
    for name in ("length", "first", "size", "kind", "left", "right"):
        lane[name] = getattr(lanes, name)
    drivable = np.isin(lanes.kind, DRIVABLE)
    lane["ahead"] = _straightest(
        samples, lanes, lanes.next_start, lanes.next_lane, drivable, forward=True
    )
    lane["behind"] = _straightest(
        samples, lanes, lanes.prev_start, lanes.prev_lane, drivable, forward=False
    )
    first, stop = _stops(lanes, signals)
    for name, start in (("stop", first), ("next", lanes.next_start), ("prev", lanes.prev_start)):
        lane[f"{name}_first"], lane[f"{name}s"] = start[:-1], np.diff(start)
    return Network(point, lane, stop, lanes.next_lane, lanes.prev_lane)


def _sample_at(samples: LaneSamples, lanes: LaneTable, lane: int, s: float) -> int:
    """Returns the row of a lane's first sample at or after s in m, at most its last."""
    first, size = int(lanes.first[lane]), int(lanes.size[lane])
    return first + min(int(np.searchsorted(samples.s[first : first + size], s)), size - 1)


def _signs(samples: LaneSamples, lanes: LaneTable, signals: SignalTable) -> NDArray[np.bool_]:
    """Returns the mask (samples,) of the samples at which a speed limit sign stands."""
    sign = np.zeros(len(samples.x), dtype=np.bool_)
    for row in np.flatnonzero(signals.kind == SignalKind.SPEED_LIMIT):
        sign[_sample_at(samples, lanes, int(signals.lane[row]), float(signals.s[row]))] = True
    return sign


def _straightest(
    samples: LaneSamples,
    lanes: LaneTable,
    start: Ints32,
    branches: Ints32,
    drivable: NDArray[np.bool_],
    *,
    forward: bool,
) -> Ints32:
    """Returns (L,) for each lane the branch whose heading changes least within STRAIGHT_WINDOW, or -1.

    forward: among successors, else predecessors; start, branches: of the lane table.
    """
    best = np.full(len(lanes.first), -1, dtype=np.int32)
    for lane in range(len(best)):
        end = lanes.first[lane] + (lanes.size[lane] - 1 if forward else 0)
        smallest = np.inf
        for other in branches[start[lane] : start[lane + 1]]:
            if not drivable[other]:
                continue
            s = STRAIGHT_WINDOW if forward else float(lanes.length[other]) - STRAIGHT_WINDOW
            turn = samples.heading[_sample_at(samples, lanes, int(other), s)] - samples.heading[end]
            turn = abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
            if turn < smallest:
                smallest, best[lane] = turn, other
    return best


def _stops(lanes: LaneTable, signals: SignalTable) -> tuple[Ints32, NDArray[np.void]]:
    """Returns the first stop of each lane (lanes + 1,) and the stops at lights, sorted by lane and s."""
    rows = np.flatnonzero(signals.kind == SignalKind.LIGHT)
    rows = rows[np.lexsort((signals.s[rows], signals.lane[rows]))]
    first = np.searchsorted(signals.lane[rows], np.arange(len(lanes.first) + 1)).astype(np.int32)
    stop = np.zeros(len(rows), dtype=STOP)
    stop["s"], stop["row"] = signals.s[rows], rows
    return first, stop
