"""Where the road ends: how far a place lies beyond it, and whether a car has left it (decision R-6).

Road is what vehicles may stand or roll on by the file's own words: driving, ramp, bidirectional,
parking, stop and shoulder lanes, and cycle lanes, which belong to the carriageway. Sidewalk, border,
median and whatever is of no such type are not.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable

Numbers = NDArray[np.floating[Any]]

ROAD = (
    LaneKind.DRIVING,
    LaneKind.RAMP,
    LaneKind.SHOULDER,
    LaneKind.PARKING,
    LaneKind.BIKING,
)
LEVEL = 4.0  # m: whatever is farther above or below is on another road (decision M-12)
REACH = 8.0  # m beyond the road up to which distances are told
NOWHERE = 1e12  # m, for places that are no numbers
SLACK = 0.05  # m along a lane by which pieces overlap, so that bends have no seams
AXLE = 0.3  # of a car's length, from its middle to each axle; assumption
TRACK = 0.42  # of its width, from its middle to each wheel's centre; assumption


class RoadEdge:
    """The surface of a map's roads as one rectangle for each pair of neighbouring samples."""

    def __init__(self, samples: LaneSamples, lanes: LaneTable) -> None:
        from scipy.spatial import (
            cKDTree,  # large, and a command that only names a map needs no edge
        )

        first = np.isin(lanes.kind[samples.lane], ROAD)
        first[lanes.first + lanes.size - 1] = False
        i = np.flatnonzero(first)
        j = i + 1
        dx, dy = samples.x[j] - samples.x[i], samples.y[j] - samples.y[i]
        long = np.hypot(dx, dy)
        kept = long > 0.0
        i, j, dx, dy, long = i[kept], j[kept], dx[kept], dy[kept], long[kept]
        self._cos, self._sin = dx / long, dy / long
        self._long = 0.5 * long + SLACK
        self._wide = 0.25 * (samples.width[i] + samples.width[j])
        self._middle = 0.5 * np.column_stack(
            [samples.x[i] + samples.x[j], samples.y[i] + samples.y[j], samples.z[i] + samples.z[j]]
        )
        self._tree = cKDTree(self._middle[:, :2])
        self._radius = float(np.hypot(self._long, self._wide).max(initial=0.0)) + REACH

    def beyond(self, x: Numbers, y: Numbers, z: Numbers) -> Floats:
        """Returns (n,) m from each place to the nearest road less than LEVEL m above or below.

        0 on it; inf beyond REACH m and for places that are no numbers.
        """
        places = np.column_stack([x, y]).astype(np.float64)
        places[~np.isfinite(places).all(axis=1)] = NOWHERE
        out = np.full(len(places), inf)
        if not len(self._long):  # a map may be all pavement
            return out
        _, nearest = self._tree.query(places)
        self._lower(out, np.arange(len(places)), nearest, places, z)
        rest = np.flatnonzero(out > 0.0)  # another piece may reach farther than the nearest one
        found = self._tree.query_ball_point(places[rest], self._radius)
        sizes = [len(pieces) for pieces in found]
        if sum(sizes):
            self._lower(
                out,
                np.repeat(rest, sizes),
                np.concatenate([np.asarray(pieces, dtype=np.int64) for pieces in found]),
                places,
                z,
            )
        out[out > REACH] = inf
        return out

    def _lower(
        self, out: Floats, rows: NDArray[Any], pieces: NDArray[Any], places: Floats, z: Numbers
    ) -> None:
        """Lowers `out` at each of `rows` to the distance from its place to its piece, where that is less."""
        x, y, height = self._middle[pieces].T
        dx, dy = places[rows, 0] - x, places[rows, 1] - y
        c, s = self._cos[pieces], self._sin[pieces]
        along = np.maximum(np.abs(dx * c + dy * s) - self._long[pieces], 0.0)
        across = np.maximum(np.abs(dy * c - dx * s) - self._wide[pieces], 0.0)
        near = np.abs(np.asarray(z)[rows] - height) < LEVEL
        np.minimum.at(out, rows, np.where(near, np.hypot(along, across), inf))

    def off(
        self, x: Numbers, y: Numbers, z: Numbers, yaw: Numbers, length: float, width: float
    ) -> Flags:
        """Returns (n,) whether a car of this size at these places has its middle and all wheels off the road.

        x, y, z, yaw (n,): m and rad; length, width: m of the one car.
        """
        off = self.beyond(x, y, z) > 0.0
        rows = np.flatnonzero(off)
        c, s = np.cos(yaw[rows]), np.sin(yaw[rows])
        for ahead in (AXLE * length, -AXLE * length):
            for left in (TRACK * width, -TRACK * width):
                wheel_x = x[rows] + ahead * c - left * s
                wheel_y = y[rows] + ahead * s + left * c
                off[rows] &= self.beyond(wheel_x, wheel_y, z[rows]) > 0.0
        return off
