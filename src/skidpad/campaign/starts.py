"""Where the ego starts on a map that does not say so itself."""

from __future__ import annotations

from skidpad.core.errors import ConfigError
from skidpad.core.lefthanded import lanes_left_from_carla, vector_from_carla
from skidpad.core.setup import LanePosition
from skidpad.roads.queries import RoadMap

# By map: x and y near which the ego starts, and lanes to shift, both as published: CARLA axes.
PUBLISHED = {"Town04": (310.0, 5.0, -2)}


def start_of(map: RoadMap) -> LanePosition:
    """The map's own place, else the published one (A-004); ConfigError when there is neither."""
    if map.ego_start is not None:
        return map.ego_start
    if map.name not in PUBLISHED:
        raise ConfigError(f"map {map.name} names no place for the ego to start")
    x, y, lanes = PUBLISHED[map.name]
    x, y, _ = vector_from_carla(x, y, 0.0)
    point = map.project(x, y, 0.0)
    moved = None if point is None else map.shifted(point, lanes_left_from_carla(lanes))
    if moved is None:
        raise ConfigError(f"map {map.name} has no lane at the published start")
    return LanePosition(moved.road, moved.lane_id, map.s_road(moved))
