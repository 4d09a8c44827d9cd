"""Where the lane ahead leads over a bridge of the map."""

from __future__ import annotations

from skidpad.core.geometry import Pose
from skidpad.envelope.sight import REACH
from skidpad.roads.queries import LanePoint, RoadMap

STEP = 10.0  # m between the places that are looked at; shorter bridges may be missed


class BridgesAhead:
    """The bridges of a map, seen from a car on its lanes."""

    def __init__(self, map: RoadMap) -> None:
        self.map, self.stretches = map, map.roadside.bridges

    def find_next(self, pose: Pose) -> float | None:
        """Returns the m to the next bridge of the lane ahead, 0 on one; None without one within REACH m."""
        here = self.map.project(pose.x, pose.y, pose.z) if self.stretches else None
        if here is None:
            return None
        distance, place = 0.0, here
        while distance <= REACH:
            if self._is_bridge(place):
                return distance
            distance += STEP
            further = self.map.ahead(here, distance, pose.yaw)
            if further is None:
                break
            place = further
        return None

    def _is_bridge(self, place: LanePoint) -> bool:
        """Returns whether a bridge carries the lane at this place."""
        s = self.map.s_road(place)
        return any(
            b.road == place.road
            and b.s_from <= s <= b.s_to
            and (b.lanes is None or b.lanes[0] <= place.lane_id <= b.lanes[1])
            for b in self.stretches
        )
