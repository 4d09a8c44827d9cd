"""Places of a whole log on the lanes of a map: batches, where `roads.queries` answers one by one."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from skidpad.core.arrays import Floats, Ints
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable

Numbers = NDArray[np.floating[Any]]
DRIVEN = (LaneKind.DRIVING, LaneKind.RAMP)
CANDIDATES = 4  # nearest samples whose segments are tried
REACH = 20.0  # m, farther from every centre line is on no lane
HEIGHT = 3.0  # m, so that an overpass is another road (decision M-12)


class LaneMatch(NamedTuple):
    """Where n points are on lanes; arrays (n,)."""

    lane: Ints  # index into the lane table, -1: on none
    s: Floats  # m along the lane
    offset: Floats  # m left of the centre line; NaN on no lane
    heading: Floats  # rad, of the lane in driving direction
    curvature: Floats  # 1/m, left positive

    def at(self, rows: Ints | NDArray[np.bool_]) -> LaneMatch:
        """Returns the match of the points of these rows only."""
        return LaneMatch._make(column[rows] for column in self)


class LaneIndex:
    """Nearest driving lane for batches of points, and distances along lanes."""

    def __init__(self, samples: LaneSamples, lanes: LaneTable) -> None:
        self.samples, self.lanes = samples, lanes
        self._rows = np.flatnonzero(np.isin(lanes.kind[samples.lane], DRIVEN))
        here = np.column_stack([samples.x, samples.y, samples.z])[self._rows]
        self._tree = cKDTree(here)

    def match(self, x: Numbers, y: Numbers, z: Numbers) -> LaneMatch:
        """Matches each point (n,) to the lane at its height whose centre line is nearest in x and y.

        Lane -1 and NaN where none of the CANDIDATES nearest samples has one within REACH and HEIGHT.
        """
        points = np.column_stack([x, y, z]).astype(np.float64)
        k = min(CANDIDATES, len(self._rows))
        _, near = self._tree.query(points, k=k)
        rows = self._rows[near.reshape(len(points), k)]
        starts = np.concatenate([rows - 1, rows], axis=1)  # segments on both sides of a sample
        distance, s, offset = self._on_segments(points, starts)
        best = np.argmin(distance, axis=1)
        pick = (np.arange(len(points)), best)
        sample = rows[pick[0], best % rows.shape[1]]
        found = distance[pick] < REACH
        return LaneMatch(
            lane=np.where(found, self.samples.lane[sample], -1).astype(np.int64),
            s=np.where(found, s[pick], np.nan),
            offset=np.where(found, offset[pick], np.nan),
            heading=np.where(found, self.samples.heading[sample], np.nan),
            curvature=np.where(found, self.samples.curvature[sample], np.nan),
        )

    def _on_segments(self, points: Floats, starts: Ints) -> tuple[Floats, Floats, Floats]:
        """Returns distance, s and offset in m of points (n, 3) on the segments that begin at samples (n, k).

        The distance is inf where no segment begins there or it is at another height.
        """
        a = self.samples
        last = len(a.x) - 1
        i, j = np.clip(starts, 0, last), np.clip(starts + 1, 0, last)
        joined = (a.lane[i] == a.lane[j]) & (i != j)
        dx, dy = a.x[j] - a.x[i], a.y[j] - a.y[i]
        px, py = points[:, :1] - a.x[i], points[:, 1:2] - a.y[i]
        length = np.where(joined, np.hypot(dx, dy), 1.0)
        part = np.clip((px * dx + py * dy) / length**2, 0.0, 1.0)
        offset = (dx * py - dy * px) / length
        distance = np.hypot(px - part * dx, py - part * dy)
        level = np.abs(points[:, 2:] - a.z[i]) < HEIGHT
        distance = np.where(joined & level, distance, np.inf)
        return distance, a.s[i] + part * (a.s[j] - a.s[i]), offset

    def starts_ahead(self, lane: int, horizon: float) -> Floats:
        """Returns (L,) m from the start of `lane` to the start of each lane that follows it.

        Every branch counts, as for the radar's lane check (A-078); inf where none leads within
        `horizon` m of the end of `lane`.
        """
        table = self.lanes
        start = np.full(len(table.length), np.inf)
        start[lane] = 0.0
        queue = [lane]
        limit = float(table.length[lane]) + horizon
        while queue:
            here = queue.pop()
            end = start[here] + table.length[here]
            for follower in table.next_lane[table.next_start[here] : table.next_start[here + 1]]:
                if end <= limit and end < start[follower]:
                    start[follower] = end
                    queue.append(int(follower))
        return start

    def distance_ahead(self, behind: LaneMatch, ahead: LaneMatch, horizon: float) -> Floats:
        """Returns (n,) m along the lanes from `behind` to `ahead`; inf where no lane leads there.

        horizon: m, as in `starts_ahead`.
        """
        out = np.full(len(behind.lane), np.inf)
        known = (behind.lane >= 0) & (ahead.lane >= 0)
        for lane in np.unique(behind.lane[known]):
            here = known & (behind.lane == lane)
            starts = self.starts_ahead(int(lane), horizon)
            out[here] = starts[ahead.lane[here]] + ahead.s[here] - behind.s[here]
        return np.where(out > 0.0, out, np.inf)
