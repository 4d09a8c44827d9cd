"""Which road, lane and junction a point of a map is at."""

from __future__ import annotations

import numpy as np

from skidpad.core.environment.localities import Locality, RoadKind, kind_of_limit
from skidpad.roads.queries import RoadMap

NEAR = 20.0  # m beyond which a point is on no road


class Localities:
    """Finds the places of points on one map, seen from above: heights of bridges are not told apart."""

    def __init__(self, map: RoadMap) -> None:
        samples, lanes = map.samples, map.lanes
        rows = np.flatnonzero(map.arrays.drivable[samples.lane] == 1)
        self._map = map
        self._x, self._y, self._limit = samples.x[rows], samples.y[rows], samples.limit[rows]
        self._lane = samples.lane[rows]
        self._junction = lanes.junction[self._lane]

    def find(self, x: float, y: float) -> Locality | None:
        """Returns the place of the nearest driving lane; None when none is within NEAR m.

        Lanes count from 1 at the right. Outside of junctions, `junction` and `distance` are those of the
        nearest.
        """
        away = np.hypot(self._x - x, self._y - y)
        if not away.size or away.min() > NEAR:
            return None
        row = int(np.argmin(away))
        lane = int(self._lane[row])
        to_right, to_left = (self._count_beside(lane, side) for side in ("right", "left"))
        limit = float(self._limit[row])
        is_inside = bool(self._junction[row] >= 0)
        junction, distance = self._nearest_junction(away)
        return Locality(
            road=int(self._map.lanes.road[lane]),
            lane=to_right + 1,
            lanes=to_right + 1 + to_left,
            kind=RoadKind.JUNCTION
            if is_inside
            else kind_of_limit(None if np.isnan(limit) else limit),
            junction=int(self._junction[row]) if is_inside else junction,
            distance=0.0 if is_inside else distance,
        )

    def _nearest_junction(self, away: np.ndarray) -> tuple[int | None, float | None]:
        """Returns id and distance in m of the nearest junction; (None, None) on a map without one.

        away (k,): m to each drivable sample.
        """
        inside = np.flatnonzero(self._junction >= 0)
        if not inside.size:
            return None, None
        row = int(inside[np.argmin(away[inside])])
        return int(self._junction[row]), float(away[row])

    def _count_beside(self, lane: int, side: str) -> int:
        """Returns how many driving lanes of its direction lie beside a lane on a side, "left" or "right"."""
        beside, count = getattr(self._map.lanes, side), 0
        while (lane := int(beside[lane])) >= 0:
            count += 1
        return count
