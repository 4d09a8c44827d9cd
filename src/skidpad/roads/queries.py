"""The readable face of a baked map. Kernels do the work; see `roads.kernels`."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, nan
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, hold
from skidpad.core.objects.slots import fill_slots
from skidpad.core.setup import LanePosition
from skidpad.roads import along, entries, kernels
from skidpad.roads.baked import BakedMap
from skidpad.roads.edge import RoadEdge
from skidpad.roads.lanes import LaneSamples, LaneTable, SignalKind, SignalTable
from skidpad.roads.packing import lane_arrays
from skidpad.roads.roadside import Roadside

Table = TypeVar("Table", LaneSamples, LaneTable, SignalTable, kernels.LaneArrays)


@fill_slots
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
        """Pose on the centre line along the driving direction, without roll and pitch."""
        return Pose(self.x, self.y, self.z, yaw=self.heading)


@dataclass(frozen=True, slots=True)
class SignalAhead:
    """A signal on the path: its row in the signal table and the way to its stop line."""

    row: int
    signal: int  # OpenDRIVE id
    distance: float  # m along the lanes


class RoadMap:
    """One map, and questions about it.

    Attributes:
        name: The name of the map.
        content_hash: SHA-256 over all baked arrays (decision L-6).
        samples: Points along the centre of each lane.
        lanes: What holds for a whole lane, one row each.
        signals: Traffic lights and signs, one row each.
        roadside: Barriers, crosswalks and objects beside the lanes.
        arrays: What kernels of other packages take.
        geo_reference: The file's projection text.
        ego_start: Where the ego starts unless told otherwise, or None.

    Example:
        >>> here = map.project(frame.ego.pose.x, frame.ego.pose.y, frame.ego.pose.z)
        >>> aim = map.ahead(here, 20.0) if here else None
    """

    name: str
    content_hash: str
    samples: LaneSamples
    lanes: LaneTable
    signals: SignalTable
    roadside: Roadside
    arrays: kernels.LaneArrays
    geo_reference: str
    ego_start: LanePosition | None

    def __init__(self, baked: BakedMap) -> None:
        self.name = baked.name
        self.samples, self.lanes, self.signals = baked.samples, baked.lanes, baked.signals
        self.roadside = baked.roadside
        self.geo_reference, self.ego_start = baked.geo_reference, baked.ego_start
        self.content_hash = baked.content_hash()
        self.arrays = self._arrays = lane_arrays(baked)
        self._names = list(zip(self.lanes.road.tolist(), self.lanes.lane_id.tolist(), strict=True))

    @cached_property
    def _lengths(self) -> list[float]:
        """Returns the length in m of every lane, as a list of Python floats."""
        lengths: list[float] = self._arrays.length.tolist()
        return lengths

    @cached_property
    def held(self) -> Held[kernels.LaneArrays]:
        """The `arrays` for entry kernels, made at first use: a command that only names a map needs none."""
        return hold(self._arrays)

    def read_only(self) -> RoadMap:
        """Returns the same map for others to read: writing into its arrays raises.

        Kernels go on with the arrays behind it, so that they see one type of array.
        """
        shown = copy(self)
        shown.samples, shown.lanes = lock_table(self.samples), lock_table(self.lanes)
        shown.signals, shown.arrays = lock_table(self.signals), lock_table(self._arrays)
        side = self.roadside
        shown.roadside = replace(
            side,
            barriers=tuple(replace(b, points=_lock_array(b.points)) for b in side.barriers),
            crosswalks=tuple(_lock_array(c) for c in side.crosswalks),
        )
        return shown

    @cached_property
    def edge(self) -> RoadEdge:
        """The edge of the map's roads, made at first use."""
        return RoadEdge(self.samples, self.lanes)

    def project(self, x: float, y: float, z: float, driving: bool = True) -> LanePoint | None:
        """Returns the nearest lane centre at about this height; None beyond 20 m, and for NaN or inf.

        driving: only driving lanes and ramps.
        """
        return self._make_point(*entries.project(self.held, float(x), float(y), float(z), driving))

    def name_of(self, lane: int) -> tuple[int, int]:
        """Returns the ids of road and lane of a lane, given by its index."""
        return self._names[lane]

    def _make_point(self, lane: int, s: float, offset: float, *place: float) -> LanePoint | None:
        """Returns the point of a kernel's answer, None for lane -1.

        place: x, y, z, heading, curvature, lane's width.
        """
        if lane < 0:
            return None
        x, y, z, heading, curvature, width = place
        road, lane_id = self._names[lane]
        return LanePoint(lane, s, x, y, z, heading, curvature, width, road, lane_id, offset)

    def at(self, lane: int, s: float, offset: float = 0.0) -> LanePoint:
        """Returns the place `s` m along a lane, given by its index.

        Beyond its ends the coordinates of the end.
        offset: only noted in the point, which stays on the centre line.
        """
        x, y, z, heading, curvature, width, _, _, _ = entries.sample(self.held, int(lane), float(s))
        road, lane_id = self._names[lane]
        return LanePoint(
            int(lane), float(s), x, y, z, heading, curvature, width, road, lane_id, float(offset)
        )

    def ahead(
        self, point: LanePoint, distance: float, heading: float | None = None
    ) -> LanePoint | None:
        """Returns the place `distance` m further along the lane; at forks the straightest path (A-148).

        heading: what "straight" is measured against; None: the lane's own. None where the road ends.
        """
        measured = nan if heading is None else heading
        return self._make_point(
            *entries.advance(self.held, point.lane, point.s, float(distance), measured)
        )

    def trace_ahead(
        self, point: LanePoint, step: float, steps: int, heading: float | None = None
    ) -> NDArray[np.float64]:
        """Returns (n, 4) x, y, z, curvature of the places that `ahead` gives at each step, in one call.

        step: m; n is less than `steps` where the road ends.
        """
        out = np.empty((steps, 4))
        measured = nan if heading is None else heading
        n = entries.trace_lane(self.held, point.lane, point.s, float(step), measured, out)
        return out[:n]

    def behind(self, point: LanePoint, distance: float) -> LanePoint | None:
        """Returns the place `distance` m back along straightest predecessors; None where the road begins."""
        return self.ahead(point, -distance)

    def all_ahead(self, point: LanePoint, distance: float) -> list[LanePoint]:
        """Returns the places `distance` m further on, one per lane reached; empty at a dead end."""
        found: dict[int, LanePoint] = {}
        seen = set()
        frontier = [(point.lane, point.s + distance)]
        while frontier:
            lane, s = frontier.pop()
            length = float(self.lanes.length[lane])
            if s <= length:
                found.setdefault(lane, self.at(lane, s))
                continue
            for following in self.successors(lane):
                step = (following, s - length)
                drives_on = self.arrays.drivable[following] or not self.arrays.drivable[lane]
                if drives_on and step not in seen:
                    seen.add(step)
                    frontier.append(step)
        return [found[lane] for lane in sorted(found)]

    def successors(self, lane: int) -> list[int]:
        """Returns the indices of the lanes that follow a lane."""
        start = self.lanes.next_start
        return [int(i) for i in self.lanes.next_lane[start[lane] : start[lane + 1]]]

    def predecessors(self, lane: int) -> list[int]:
        """Returns the indices of the lanes that lead into a lane."""
        start = self.lanes.prev_start
        return [int(i) for i in self.lanes.prev_lane[start[lane] : start[lane + 1]]]

    def left(self, point: LanePoint) -> LanePoint | None:
        """Returns the place abreast on the driving lane to the left, same direction; None without one."""
        return self._beside(point, int(self.lanes.left[point.lane]))

    def right(self, point: LanePoint) -> LanePoint | None:
        """Returns the place abreast on the driving lane to the right, same direction; None without one."""
        return self._beside(point, int(self.lanes.right[point.lane]))

    def _beside(self, point: LanePoint, lane: int) -> LanePoint | None:
        """Returns the point beside a point on the neighbour lane; None for a lane of -1."""
        if lane < 0:
            return None
        return self.at(lane, kernels.neighbour_s(self._arrays, point.lane, lane, point.s))

    def shifted(self, point: LanePoint, lanes_left: int) -> LanePoint | None:
        """Returns the place `lanes_left` lanes to the left (negative: right); None when a lane is missing."""
        place: LanePoint | None = point
        for _ in range(abs(lanes_left)):
            if place is None:
                return None
            place = self.left(place) if lanes_left > 0 else self.right(place)
        return place

    def s_road(self, point: LanePoint) -> float:
        """Returns the OpenDRIVE s in m of a place."""
        return float(kernels.s_road_kernel(self._arrays, point.lane, point.s))

    def limit(self, point: LanePoint) -> float | None:
        """Returns the speed limit in m/s at a place of a lane; None where the map gives none."""
        value = float(entries.sample(self.held, point.lane, point.s)[8])
        return None if value != value else value

    def bank(self, point: LanePoint) -> float:
        """Returns how far the road leans to the right at a place of a lane, rad."""
        return float(entries.sample(self.held, point.lane, point.s)[7])

    def on_lane(self, road: int, lane_id: int, s_road: float) -> LanePoint:
        """Returns the place of OpenDRIVE coordinates; ConfigError when there is no such lane.

        It says where the lane's sections run. s_road: m.
        """
        lanes = ((self.lanes.road == road) & (self.lanes.lane_id == lane_id)).nonzero()[0]
        spans = []
        for lane in lanes:
            first = self.lanes.first[lane]
            ends = self.samples.s_road[[first, first + self.lanes.size[lane] - 1]]
            if ends.min() - 1e-3 <= s_road <= ends.max() + 1e-3:
                return self.at(lane, kernels.lane_s_kernel(self._arrays, int(lane), float(s_road)))
            spans.append(f"{ends.min():.1f} to {ends.max():.1f}")
        has = f"s from {', '.join(spans)}" if spans else "no such lane"
        raise ConfigError(
            f"map {self.name}: road {road} lane {lane_id} at s = {s_road:g} is not there ({has})"
        )

    def place(self, position: LanePosition) -> LanePoint:
        """Returns the place of a lane position; its lateral offset is only kept in `offset`.

        ConfigError when there is no such lane.
        """
        point = self.on_lane(position.road, position.lane, position.s)
        return self.at(point.lane, point.s, position.offset)

    def signal_ahead(
        self, point: LanePoint, distance: float, kind: SignalKind = SignalKind.LIGHT
    ) -> SignalAhead | None:
        """Returns the first signal of a kind on the straightest path, with the way to its stop line.

        None where there is none within `distance` m.
        """
        row, gap = entries.signal_ahead(self.held, point.lane, point.s, float(distance), int(kind))
        return None if row < 0 else SignalAhead(int(row), int(self.signals.id[row]), float(gap))

    def traced_roads(
        self, start: LanePoint, distance: float = 5000.0, step: float = 5.0
    ) -> frozenset[int]:
        """Returns the road ids met when driving on from `start` (highway tracing, A-212), its own included.

        Ends after `distance` m or at a dead end; roads shorter than `step` m may be missed.
        """
        roads = {start.road}
        lane, s = start.lane, start.s
        for _ in range(ceil(distance / step)):
            if 0.0 <= s + step <= self._lengths[lane]:  # the same lane still
                s += step
                continue
            lane, s = along.advance_kernel(self._arrays, lane, s, step)
            if lane < 0:
                break
            roads.add(int(self.lanes.road[lane]))
        return frozenset(roads)


def lock_table(table: Table) -> Table:
    """Returns the same columns; its arrays are shared and cannot be written through it."""
    kind: Any = type(table)
    shown: Table = kind._make(_lock_array(c) if isinstance(c, np.ndarray) else c for c in table)
    return shown


def _lock_array(array: NDArray[Any]) -> NDArray[Any]:
    """Returns a view of the array that cannot be written to."""
    view: NDArray[Any] = array.view()
    view.flags.writeable = False
    return view
