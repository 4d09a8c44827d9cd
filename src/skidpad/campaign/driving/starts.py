"""Where the ego starts on a map that does not say so itself."""

from __future__ import annotations

import numpy as np

from skidpad.core.errors import ConfigError, NoLaneError
from skidpad.core.maths.lefthanded import lanes_left_from_carla, vector_from_carla
from skidpad.core.setup import LanePosition
from skidpad.roads.queries import LanePoint, RoadMap

# By map: x and y near which the ego starts, and lanes to shift, both as published: CARLA axes.
PUBLISHED = {"Town04": (310.0, 5.0, -2)}
WAY = 2000.0  # m that one should be able to drive on from a start that nobody named
FIRST_S = 20.0  # m from the beginning of its lane


def start_of(map: RoadMap) -> LanePosition:
    """Returns where the ego starts: the map's own place, the published one (A-004), or the longest lane."""
    if map.ego_start is not None:
        return map.ego_start
    point = _published_start(map) or _longest(map)
    return LanePosition(point.road, point.lane_id, map.s_road(point))


def _published_start(map: RoadMap) -> LanePoint | None:
    """Returns the published start on a known map; None for any other map."""
    if map.name not in PUBLISHED:
        return None
    x, y, lanes = PUBLISHED[map.name]
    x, y, _ = vector_from_carla(x, y, 0.0)
    point = map.project(x, y, 0.0)
    moved = None if point is None else map.shifted(point, lanes_left_from_carla(lanes))
    if moved is None:
        raise ConfigError(f"map {map.name} has no lane at the published start")
    return moved


def _longest(map: RoadMap) -> LanePoint:
    """Returns a place near the begin of the longest driving lane from which the road goes on for WAY m.

    Raises NoLaneError without a driving lane.
    """
    lanes = np.flatnonzero((map.arrays.drivable == 1) & (map.lanes.junction < 0))
    if not len(lanes):
        lanes = np.flatnonzero(map.arrays.drivable == 1)
    if not len(lanes):
        raise NoLaneError(f"map {map.name} has no driving lane on which the ego could start")
    order = lanes[np.argsort(-map.lanes.length[lanes], kind="stable")]
    places = [
        map.at(int(lane), min(FIRST_S, 0.25 * float(map.lanes.length[lane]))) for lane in order
    ]
    return next((p for p in places if map.ahead(p, WAY) is not None), places[0])
