"""The road of a scenario: places by lane and by road coordinates, lanes side by side, ways ahead."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import atan, cos, sin

import numpy as np

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.objects.slots import fill_slots
from skidpad.roads.bundled import map_file
from skidpad.roads.lanes import LaneKind
from skidpad.roads.opendrive.document import RoadRecord, parse
from skidpad.roads.opendrive.signals import road_place
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.roads.routing import shortest_route

ON_LANE = 1.0  # m beyond a lane's edge that still is on it
SLOPE_STEP = 0.5  # m to either side, over which a slope is taken
ABREAST, ABREAST_STEPS = 1e-3, 6  # m ahead that still is abreast, and tries to get there
STEP = 1e-3  # m into the next lane
END_SLACK = 0.5  # m beyond the end of a road that still is its end
EVEN = 1e-3  # rad, between two turns at a fork that are as far from straight


@fill_slots
@dataclass(frozen=True, slots=True)
class Place:
    """A pose and, where it was given by lane, the lane's point with the offset from it."""

    pose: Pose
    lane: LanePoint | None = None

    @property
    def along(self) -> bool:
        """Returns whether the place faces as its lane runs; True off every lane."""
        return self.lane is None or cos(self.pose.yaw - self.lane.heading) >= 0.0


@dataclass(frozen=True, slots=True)
class RoadCoordinates:
    """OpenDRIVE s and t of a place, and its heading relative to increasing s."""

    road: int
    s: float
    t: float
    turn: float


class Network:
    """One map. `name` is a bundled map's, or a file's path; stand_in: the file has no road."""

    def __init__(self, map: RoadMap, name: str, *, stand_in: bool = False) -> None:
        self.map, self.name, self.stand_in = map, name, stand_in
        self._route_lengths: dict[tuple[int, int], float | None] = {}
        self._default_next: dict[int, int | None] = {}

    @cached_property
    def roads(self) -> dict[int, RoadRecord]:
        """Returns the roads of the file by id, read only where a file asks for road coordinates."""
        file = map_file(self.name)
        return parse(file.read_bytes(), file.name).roads

    @cached_property
    def labels(self) -> dict[int, str]:
        """Returns the ids of the roads as the file writes them, by their numbers."""
        if map_file(self.name).suffix == ".npz":  # a baked map keeps the numbers only
            return {road: str(road) for road in np.unique(self.map.lanes.road).tolist()}
        return {road.id: road.label for road in self.roads.values()}

    def place_of(self, pose: Pose) -> Place:
        """Returns a pose with the lane under it: a driving lane where there is one, else any.

        Beside all lanes it is the nearest driving lane's point, None where that is out of reach.
        """
        for driving in (True, False):
            point = self._project(pose, driving)
            if point is not None and abs(point.offset) <= 0.5 * point.width + ON_LANE:
                return Place(replace(pose, z=point.z), point)
        return Place(pose, self._project(pose, True))

    def _project(self, pose: Pose, driving: bool) -> LanePoint | None:
        """Returns the nearest lane's point, with the offset across the road, banked as it is."""
        point = self.map.project(pose.x, pose.y, pose.z, driving=driving)
        if point is None or not self.is_banked:
            return point
        return replace(point, offset=point.offset / self.lean(point))

    @cached_property
    def is_banked(self) -> bool:
        """Tells whether any lane of the map is banked."""
        return bool(np.any(self.map.samples.bank))

    def lean(self, point: LanePoint) -> float:
        """Returns how long a metre across the road is, seen from above."""
        return cos(self.map.bank(point)) if self.is_banked else 1.0

    def aside(self, point: LanePoint, left: float) -> Pose:
        """Returns the pose `left` m beside a lane's centre, measured across the road."""
        return point.pose.moved(left=left * self.lean(point))

    def on_lane(self, road: int, lane: int, s: float, offset: float) -> Place:
        """Returns a place on a lane, `offset` m to the left of increasing s; ConfigError where none is."""
        point = self.map.on_lane(road, lane, s)
        left = offset if self.forward(point) else -offset
        point = replace(point, offset=left)
        return Place(self.aside(point, left), point)

    def within(self, road: int, lane: int, s: float) -> float:
        """Returns s, or the nearest end of the lane where the lane does not reach to s, as esmini does."""
        of_lane = (self.map.lanes.road == road) & (self.map.lanes.lane_id == lane)
        ends = [self._ends(int(i)) for i in np.flatnonzero(of_lane)]
        nearest = [min(max(s, low), high) for low, high in ends]
        return min(nearest, key=lambda at: abs(at - s), default=s)

    def _ends(self, lane: int) -> tuple[float, float]:
        """Returns the least and the greatest road coordinate s in m of a lane's samples."""
        first = int(self.map.lanes.first[lane])
        last = first + int(self.map.lanes.size[lane]) - 1
        a, b = float(self.map.samples.s_road[first]), float(self.map.samples.s_road[last])
        return min(a, b), max(a, b)

    def on_road(self, road: int, s: float, t: float) -> Place:
        """Returns the place at (s, t) of a road, looking along increasing s."""
        record = self.roads.get(road)
        if record is None or not 0.0 <= s <= record.length + END_SLACK:
            has = "no such road" if record is None else f"s from 0 to {record.length:.1f}"
            raise ConfigError(f"map {self.map.name}: road {road} at s = {s:g} is not there ({has})")
        at = road_place(record, min(s, record.length), t)
        return self.place_of(Pose(at.x, at.y, at.z, yaw=wrap_angle(at.heading)))

    def coordinates(self, pose: Pose) -> RoadCoordinates | None:
        """Returns the road coordinates of a pose; None off the map."""
        point = self.place_of(pose).lane
        if point is None:
            return None
        s = self.map.s_road(point)
        at = road_place(self.roads[point.road], s, 0.0)
        dx, dy = pose.x - at.x, pose.y - at.y
        t = (dy * cos(at.heading) - dx * sin(at.heading)) / self.lean(point)
        return RoadCoordinates(point.road, float(s), float(t), wrap_angle(pose.yaw - at.heading))

    def is_void(self, point: LanePoint) -> bool:
        """Returns whether a lane is of OpenDRIVE's type `none`: space beside the road, with nothing."""
        if (
            self.map.lanes.kind[point.lane] != LaneKind.OTHER
            or map_file(self.name).suffix == ".npz"
        ):
            return False
        s = self.map.s_road(point)
        sections = self.roads[point.road].sections
        section = next((one for one in sections if s <= one.s_end), sections[-1])
        return any(one.id == point.lane_id and one.type == "none" for one in section.lanes)

    def slopes(self, pose: Pose) -> tuple[float, float]:
        """Returns pitch (nose down) and roll (left side up) of a body on the road there, rad; 0 off it."""
        at = self.coordinates(pose)
        if at is None:
            return 0.0, 0.0
        road = self.roads[at.road]
        s = min(max(at.s, SLOPE_STEP), max(road.length - SLOPE_STEP, SLOPE_STEP))
        low, high = (road_place(road, s + d, at.t).z for d in (-SLOPE_STEP, SLOPE_STEP))
        right, left = (road_place(road, s, at.t + d).z for d in (-SLOPE_STEP, SLOPE_STEP))
        along, across = (high - low) / (2.0 * SLOPE_STEP), (left - right) / (2.0 * SLOPE_STEP)
        c, d = cos(at.turn), sin(at.turn)
        return -atan(along * c + across * d), atan(across * c - along * d)

    def forward(self, point: LanePoint) -> bool:
        """Returns whether the traffic of this lane runs with increasing road s."""
        first = int(self.map.lanes.first[point.lane])
        s = self.map.samples.s_road
        return bool(s[first + 1] > s[first])

    def route_length(self, start: int, goal: int) -> float | None:
        """Returns the length from the begin of one lane to that of another, m; None without a way."""
        key = start, goal
        if key not in self._route_lengths:
            route = shortest_route(self.map, self.map.at(start, 0.0), self.map.at(goal, 0.0))
            self._route_lengths[key] = None if route is None else route.length
        return self._route_lengths[key]

    def beside(self, point: LanePoint, lane_id: int) -> LanePoint | None:
        """Returns the same place across the road on another lane of it; None where there is no such lane."""
        lanes = self.map.lanes
        same = (lanes.road == point.road) & (lanes.section == lanes.section[point.lane])
        found = np.flatnonzero(same & (lanes.lane_id == lane_id))
        if len(found) == 0:
            return None
        try:
            return self.map.on_lane(point.road, lane_id, self.map.s_road(point))
        except ConfigError:
            return None

    def abreast(self, point: LanePoint, x: float, y: float) -> tuple[LanePoint, float]:
        """Returns the place of a point's lane abreast of (x, y), and how many m left of it these lie."""
        near = point
        for _ in range(ABREAST_STEPS):
            dx, dy = x - near.x, y - near.y
            forward = dx * cos(near.heading) + dy * sin(near.heading)
            further = self.ahead(near, forward) if abs(forward) > ABREAST else None
            if further is None:
                break
            near = further
        dx, dy = x - near.x, y - near.y
        return near, (dy * cos(near.heading) - dx * sin(near.heading)) / self.lean(near)

    def ahead(
        self, point: LanePoint, distance: float, roads: tuple[int, ...] = ()
    ) -> LanePoint | None:
        """Returns the place `distance` m further along, negative: back; at forks towards the given roads.

        Without roads it goes straight on at forks, see `even_forks`. None at the end of the road.
        """
        if not roads:
            return self._ahead_by_default(point, distance)
        while True:
            length = float(self.map.lanes.length[point.lane])
            s = point.s + distance
            if 0.0 <= s <= length:
                return self.map.at(point.lane, s)
            forward = s > length
            following = self._next_lane(point.lane, forward, roads)
            if following is None:
                return self._ahead_by_default(point, distance)
            entry = 0.0 if forward else float(self.map.lanes.length[following])
            distance = s - length if forward else s
            point = self.map.at(following, entry)

    @cached_property
    def even_forks(self) -> dict[int, int]:
        """Returns, by the lane before it, the lane that is taken at a fork without a straightest way.

        Where two lanes turn as far to either side, it is the right one in right-hand traffic, else the
        left one (OpenSCENARIO XML 6.8.1).
        """
        found = {}
        starts = self.map.arrays.next_start
        for lane in np.flatnonzero(np.diff(starts) > 1).tolist():
            turns = {following: self._turn(lane, following) for following in self._exits(lane)}
            if not turns:  # no drivable lane follows: the end of the road
                continue
            least = min(map(abs, turns.values()))
            even = [k for k, turn in turns.items() if abs(turn) < least + EVEN]
            if min(turns[k] for k in even) < -EVEN and max(turns[k] for k in even) > EVEN:
                left_hand = (self.map.lanes.lane_id[lane] > 0) == self.forward(
                    self.map.at(lane, 0.0)
                )
                found[lane] = (max if left_hand else min)(even, key=lambda k: turns[k])
        return found

    def _exits(self, lane: int) -> list[int]:
        """Returns the lanes after one: drivable ones, if it is drivable itself."""
        drivable = self.map.arrays.drivable
        return [k for k in map(int, self.map.successors(lane)) if drivable[k] or not drivable[lane]]

    def _turn(self, lane: int, following: int) -> float:
        """Returns the angle in rad from the end of a lane to the end of one after it, left positive."""
        ends = [self.map.at(k, float(self.map.lanes.length[k])).heading for k in (lane, following)]
        return wrap_angle(ends[1] - ends[0])

    def _ahead_by_default(self, point: LanePoint, distance: float) -> LanePoint | None:
        """Returns the place `distance` m further along without a route; None at the end of the road."""
        if distance <= 0.0 or not self.even_forks:
            return self.map.ahead(point, distance)
        while (left := float(self.map.lanes.length[point.lane]) - point.s) < distance:
            following = self._next_by_default(point.lane)
            if following is None:
                return None
            point, distance = self.map.at(following, 0.0), distance - left
        return self.map.at(point.lane, point.s + distance)

    def _next_by_default(self, lane: int) -> int | None:
        """Returns the lane that is taken after another one without a route; None at the end of the road."""
        if lane not in self._default_next:
            end = self.map.at(lane, float(self.map.lanes.length[lane]))
            further = self.map.ahead(end, STEP)
            straight = None if further is None else further.lane
            self._default_next[lane] = self.even_forks.get(lane, straight)
        return self._default_next[lane]

    def ahead_on_roads(
        self, point: LanePoint, distance: float, roads: tuple[int, ...]
    ) -> LanePoint:
        """Returns the place so many m of road s further along a lane's traffic, at most the end of the lane.

        A negative distance goes back.
        """
        sense, left = (1.0, distance) if distance >= 0.0 else (-1.0, -distance)
        while True:
            s, ends = self.map.s_road(point), self._ends(point.lane)
            up = self.forward(point) == (sense > 0.0)
            way = min(left, ends[1] - s if up else s - ends[0])
            there = s + way if up else s - way
            left -= way
            point = self.map.on_lane(point.road, point.lane_id, min(max(there, ends[0]), ends[1]))
            further = self.ahead(point, sense * STEP, roads) if left > STEP else None
            if further is None or further.lane == point.lane:
                return point
            point, left = further, left - STEP

    def _next_lane(self, lane: int, forward: bool, roads: tuple[int, ...]) -> int | None:
        """Returns the lane after this one that is on the way; else one through a junction to a road of it.

        forward: after in the sense of the traffic, else before. None where neither is.
        """
        step = self.map.successors if forward else self.map.predecessors
        found, road = step(lane), self.map.lanes.road
        here = int(road[lane])
        at = roads.index(here) if here in roads else -1
        ways = {i: {int(road[i])} for i in found}
        if not any(way & set(roads) for way in ways.values()):
            ways = {i: {int(road[j]) for j in step(i)} for i in found}
        later = {road: k for k, road in reversed(list(enumerate(roads))) if k >= at}
        ranks = {
            i: min(later.get(r, len(roads)) for r in way)
            for i, way in ways.items()
            if way & set(roads)
        }
        if at >= 0 or len(ranks) < 2:
            return min(ranks, key=lambda i: ranks[i], default=None)
        return min(ranks, key=lambda i: (self._turns_back(i, roads, ranks[i], step), ranks[i]))

    def _turns_back(
        self, lane: int, roads: tuple[int, ...], k: int, step: Callable[[int], Sequence[int]]
    ) -> bool:
        """Returns whether a lane that leads to roads[k] comes there against the way of the roads."""
        road = self.map.lanes.road
        reached = {lane} if int(road[lane]) == roads[k] else set(map(int, step(lane)))
        reached = {i for i in reached if int(road[i]) == roads[k]}
        seen: set[int] = set()
        while reached:
            seen |= reached
            further = {int(j) for i in reached for j in step(i)}
            if any(int(road[j]) in roads[k + 1 : k + 2] for j in further):
                return False
            reached = {j for j in further - seen if int(road[j]) == roads[k]}
        return k + 1 < len(roads)


def next_lane_id(lane: int, change: int) -> int:
    """Returns the id `change` lanes towards higher ids; the centre line has id 0 and is no lane."""
    target = lane + change
    if target == 0 or (target > 0) != (lane > 0):
        target += 1 if change > 0 else -1
    return target


@lru_cache(maxsize=8)
def network_of(map: RoadMap, name: str, *, stand_in: bool = False) -> Network:
    """Returns the network of a loaded map, made once."""
    return Network(map, name, stand_in=stand_in)
