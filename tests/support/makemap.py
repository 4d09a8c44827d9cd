"""Small maps for tests of evidence: straight parallel lanes along x, and a ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidpad.roads.edge import RoadEdge
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable
from skidpad.roads.queries import LanePoint

WIDTH = 3.5


@dataclass
class Lane:
    """One lane of a test map: its centre line (n, 2), height, ids and followers."""

    points: np.ndarray
    road: int
    lane_id: int
    next: tuple[int, ...] = ()
    z: float = 0.0
    curvature: float = 0.0


class TestMap:
    __test__ = False
    name = "test"
    content_hash = "test"

    def __init__(self, lanes: list[Lane], highway: frozenset[int] = frozenset()) -> None:
        self.highway = highway
        per_lane = [_samples(number, lane) for number, lane in enumerate(lanes)]
        self.samples = LaneSamples(*(np.concatenate(c) for c in zip(*per_lane, strict=True)))
        size = np.array([len(lane.points) for lane in lanes], np.int32)
        first = np.concatenate([[0], np.cumsum(size)[:-1]]).astype(np.int32)
        none = np.full(len(lanes), -1, np.int32)
        followers = [f for lane in lanes for f in lane.next]
        starts = np.cumsum([0, *(len(lane.next) for lane in lanes)]).astype(np.int32)
        self.lanes = LaneTable(
            road=np.array([lane.road for lane in lanes], np.int32),
            lane_id=np.array([lane.lane_id for lane in lanes], np.int32),
            section=np.zeros(len(lanes), np.int32),
            first=first,
            size=size,
            length=self.samples.s[first + size - 1],
            kind=np.full(len(lanes), LaneKind.DRIVING, np.uint8),
            junction=none,
            left=none,
            right=none,
            opposite=none,
            next_start=starts,
            next_lane=np.array(followers, np.int32),
            prev_start=np.zeros(len(lanes) + 1, np.int32),
            prev_lane=np.zeros(0, np.int32),
        )

    @property
    def edge(self) -> RoadEdge:
        return RoadEdge(self.samples, self.lanes)

    def project(self, x: float, y: float, z: float) -> LanePoint:
        return LanePoint(0, x, x, 0.0, 0.0, 0.0, 0.0, WIDTH, 1, -1)

    def traced_roads(self, start: LanePoint) -> frozenset[int]:
        return self.highway


def _samples(number: int, lane: Lane) -> LaneSamples:
    p = lane.points
    n = len(p)
    step = np.diff(p, axis=0)
    heading = np.arctan2(step[:, 1], step[:, 0])
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*step.T))])
    zero = np.zeros(n)
    return LaneSamples(
        x=p[:, 0],
        y=p[:, 1],
        z=np.full(n, lane.z),
        heading=np.append(heading, heading[-1]),
        s=s,
        s_road=s,
        curvature=np.full(n, lane.curvature),
        grade=zero,
        bank=zero,
        width=np.full(n, WIDTH),
        limit=np.full(n, np.nan),
        marking_left=np.zeros(n, np.uint8),
        marking_right=np.zeros(n, np.uint8),
        lane=np.full(n, number, np.int32),
    )


def line(x_from: float, x_to: float, y: float = 0.0) -> np.ndarray:
    x = np.arange(x_from, x_to + 0.5, 1.0)
    return np.column_stack([x, np.full_like(x, y)])


def straight_map(length: float = 1000.0, cut: float = 200.0) -> TestMap:
    """Two lanes along x at y 0 and 3.5; at `cut` road 1 ends and road 2 begins."""
    return TestMap(
        [
            Lane(line(0.0, cut), 1, -1, (2,)),
            Lane(line(0.0, cut, WIDTH), 1, -2, (3,)),
            Lane(line(cut, length), 2, -1),
            Lane(line(cut, length, WIDTH), 2, -2),
        ],
        highway=frozenset({1}),
    )


def ring_map(radius: float = 100.0) -> TestMap:
    """One lane, a circle about the origin, driven counter-clockwise from (radius, 0)."""
    angle = np.linspace(0.0, 2.0 * np.pi, round(2.0 * np.pi * radius) + 1)
    points = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return TestMap([Lane(points, 1, -1, (0,), curvature=1.0 / radius)])
