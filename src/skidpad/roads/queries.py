"""The readable face of a baked map. Kernels do the work; see `roads.kernels`."""
# Interface for the roads author and all users of it (signatures are settled, bodies are not).

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.geometry import Pose
from skidpad.roads.lanes import LaneSamples, LaneTable, SignalTable


@dataclass(frozen=True, slots=True)
class LanePoint:
    """A place on a lane centre line."""

    lane: int  # index into the lane table
    s: float  # m along the lane
    x: float
    y: float
    z: float
    heading: float
    curvature: float
    width: float
    road: int
    lane_id: int
    offset: float = 0.0  # m by which the queried position lies left of the centre line

    @property
    def pose(self) -> Pose:
        """Pose on the centre line along the driving direction (flat)."""
        return Pose(self.x, self.y, self.z, yaw=self.heading)


class RoadMap:
    """One map: `samples`, `lanes`, `signals`, `roadside`, and questions about them.

    name: str; content_hash: str (SHA-256 over all baked arrays, decision L-6).
    """

    name: str
    content_hash: str
    samples: LaneSamples
    lanes: LaneTable
    signals: SignalTable

    def project(
        self, x: float, y: float, z: float, hint: int = -1, driving: bool = True
    ) -> LanePoint | None:
        """Nearest (driving) lane centre at about this height; None beyond 20 m.

        hint: a lane index near which to search first; the answer does not depend on it.
        """
        raise NotImplementedError

    def ahead(
        self, point: LanePoint, distance: float, heading: float | None = None
    ) -> LanePoint | None:
        """The place `distance` m further along the lane; at forks the straightest path (A-148).

        heading: what "straight" is measured against; None: the lane's own. None where the road ends.
        """
        raise NotImplementedError

    def behind(self, point: LanePoint, distance: float) -> LanePoint | None:
        """The place `distance` m back along the straightest predecessor."""
        raise NotImplementedError

    def all_ahead(self, point: LanePoint, distance: float) -> list[LanePoint]:
        """Every place that lies `distance` m further, one per branch."""
        raise NotImplementedError

    def left(self, point: LanePoint) -> LanePoint | None:
        """The neighbouring driving lane on the left, same direction."""
        raise NotImplementedError

    def right(self, point: LanePoint) -> LanePoint | None:
        """The neighbouring driving lane on the right, same direction."""
        raise NotImplementedError

    def on_lane(self, road: int, lane_id: int, s_road: float) -> LanePoint:
        """OpenDRIVE coordinates to a place; ConfigError when there is no such lane."""
        raise NotImplementedError

    def traced_roads(
        self, start: LanePoint, distance: float = 5000.0, step: float = 5.0
    ) -> frozenset[int]:
        """Road ids met when driving on from `start` (highway tracing, A-212)."""
        raise NotImplementedError
