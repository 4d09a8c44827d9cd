"""What drivers must see at junctions: the sight triangles, which stay free of tall things."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable

EYE = 4.4  # m before the junction; AASHTO Green Book 2018, section 9.5.3, case B: 14.5 ft
GAP = 7.5  # s, the same, table 9-5, passenger car that turns left
SPEED = 50.0 / 3.6  # m/s, where a lane names no limit
FARTHEST = 60.0  # m along the other road; towns are built closer than the full 104 m (assumption)
DRIVEN = (LaneKind.DRIVING, LaneKind.RAMP)


def sight_triangles(samples: LaneSamples, lanes: LaneTable) -> list[shapely.Polygon]:
    """Returns the triangles that tall things must not meet: one per ordered pair of lanes into one junction.

    Pairs of lanes of the same road have none.
    """
    entries: dict[int, list[int]] = {}
    for lane in np.flatnonzero((lanes.junction < 0) & np.isin(lanes.kind, DRIVEN)).tolist():
        after = lanes.next_lane[lanes.next_start[lane] : lanes.next_start[lane + 1]]
        for junction in np.unique(lanes.junction[after]).tolist():
            if junction >= 0:
                entries.setdefault(junction, []).append(lane)
    return [
        shapely.Polygon(corners)
        for members in entries.values()
        for own in members
        for other in members
        if lanes.road[own] != lanes.road[other]
        for corners in [_triangle(samples, lanes, own, other)]
    ]


def _triangle(samples: LaneSamples, lanes: LaneTable, own: int, other: int) -> NDArray[np.float64]:
    """Returns corners (3, 2) in m: the eye on lane `own`, the end of lane `other`, a point up `other`.

    That point is as far back as one must see: GAP s at the limit (SPEED without one), at most FARTHEST m.
    """
    last = int(lanes.first[other] + lanes.size[other] - 1)
    limit = float(samples.limit[last])
    reach = min(GAP * (limit if np.isfinite(limit) else SPEED), FARTHEST)
    points = [
        _before_end(samples, lanes, lane, m)
        for lane, m in ((own, EYE), (other, 0.0), (other, reach))
    ]
    return np.array(points)


def _before_end(
    samples: LaneSamples, lanes: LaneTable, lane: int, distance: float
) -> tuple[float, float]:
    """Returns x and y in m of the point `distance` in m before the end of a lane, at most its begin."""
    part = slice(int(lanes.first[lane]), int(lanes.first[lane] + lanes.size[lane]))
    s = max(float(samples.s[part][-1]) - distance, 0.0)
    x, y = (float(np.interp(s, samples.s[part], v[part])) for v in (samples.x, samples.y))
    return x, y
