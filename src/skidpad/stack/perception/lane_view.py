"""Where the ego is on the map, and how the lane ahead bends (A-043, A-147, A-148)."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.roads.queries import LanePoint, RoadMap

REFERENCE_DISTANCE = 30.0  # m, the one point at which curvature is read
MAX_SHIFTS = 8  # lanes to look sideways for the highway


class LaneView(NamedTuple):
    """The ego against its lane; left positive throughout."""

    ego: LanePoint | None  # where it is; None: off every lane
    reference: LanePoint | None  # the lane that it is to follow
    yaw_error: float  # rad, heading minus lane heading; 0 off every lane
    curvature: float  # 1/m at the reference point ahead; 0 off every lane
    highway: frozenset[int] = frozenset()  # ids of the traced roads

    @property
    def kappa(self) -> float:
        """Coefficient in 1/m of the parabola kappa Z^2: half the curvature (D-063)."""
        return 0.5 * self.curvature


class Place(NamedTuple):
    """The ego on its lane, as kernels take it."""

    x: float  # world frame
    y: float
    z: float
    yaw: float
    v: float  # m/s
    lane: int  # index; -1: off every lane
    s: float  # m along it
    yaw_error: float  # as in LaneView
    kappa: float  # 1/m, half the curvature ahead


class RouteRule(Protocol):
    """Which way to take (D-058)."""

    def reference(self, map: RoadMap, point: LanePoint, highway: frozenset[int]) -> LanePoint:
        """Returns the place to steer by when the ego is at `point`; highway: road ids."""
        ...

    def ahead(
        self, map: RoadMap, point: LanePoint, distance: float, heading: float
    ) -> LanePoint | None:
        """Returns the place `distance` m further; None where the road ends."""
        ...


class HighwayRoute:
    """Stay on the traced highway and take the straightest path."""

    def reference(self, map: RoadMap, point: LanePoint, highway: frozenset[int]) -> LanePoint:
        """Returns the nearest lane sideways whose road is on the highway; `point` if there is none."""
        left: LanePoint | None = point
        right: LanePoint | None = point
        for _ in range(MAX_SHIFTS):
            for candidate in (left, right):
                if candidate is not None and candidate.road in highway:
                    return candidate
            left = map.left(left) if left else None
            right = map.right(right) if right else None
        return point

    def ahead(
        self, map: RoadMap, point: LanePoint, distance: float, heading: float
    ) -> LanePoint | None:
        """Returns the place `distance` m further along the branch that turns least from `heading`.

        None where the road ends.
        """
        return map.ahead(point, distance, heading)


class FirstBranchRoute:
    """A route as printed: stay in the lane and take whichever branch comes first."""

    def reference(self, map: RoadMap, point: LanePoint, highway: frozenset[int]) -> LanePoint:  # noqa: ARG002
        """Returns the point itself: the reference is the ego's own lane."""
        return point

    def ahead(
        self,
        map: RoadMap,
        point: LanePoint,
        distance: float,
        heading: float,  # noqa: ARG002
    ) -> LanePoint | None:
        """Returns the place `distance` m further along the map's first branch; None where the road ends."""
        places = map.all_ahead(point, distance)
        return places[0] if places else None


class LaneTracker:
    """Follows the ego on the map; traces the highway once, from where it first meets a lane."""

    def __init__(self, map: RoadMap, route: RouteRule) -> None:
        self.map, self.route = map, route
        self.highway: frozenset[int] | None = None
        self.on_highway = np.zeros(len(map.lanes.road), dtype=np.bool_)  # by lane

    def update(self, pose: Pose) -> LaneView:
        """Returns the view from `pose` (world frame, ego's origin).

        The first on a lane traces the highway.
        """
        point = self.map.project(pose.x, pose.y, pose.z)
        if point is None:
            return LaneView(None, None, 0.0, 0.0, self.highway or frozenset())
        if self.highway is None:
            self.highway = self.map.traced_roads(point)
            self.on_highway = np.isin(self.map.lanes.road, list(self.highway))
        reference = self.route.reference(self.map, point, self.highway)
        ahead = self.route.ahead(self.map, reference, REFERENCE_DISTANCE, pose.yaw)
        return LaneView(
            ego=point,
            reference=reference,
            yaw_error=wrap_angle(pose.yaw - point.heading),
            curvature=ahead.curvature if ahead is not None else 0.0,
            highway=self.highway,
        )

    def ahead(self, view: LaneView, distance: float, heading: float) -> LanePoint | None:
        """Returns the place `distance` m further along the lane that is followed.

        None without a lane or where the road ends. heading: rad, which the route may choose a branch by.
        """
        if view.reference is None:
            return None
        return self.route.ahead(self.map, view.reference, distance, heading)
