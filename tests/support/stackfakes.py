"""A road in closed form and scenes drawn by hand: no baked map, no renderer."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin
from types import SimpleNamespace

import numpy as np

from skidpad.core.frames import CameraImage, RadarPoints, Segments, SensorFrame
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.kernels.jit import Held, hold
from skidpad.core.specs import CameraSpec, Modality, RadarSpec
from skidpad.core.states import EgoEstimate
from skidpad.core.vocabulary import LightState, SemanticClass, Supervision
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.lanes import LaneSamples, LaneTable, SignalKind, SignalTable
from skidpad.roads.packing import lane_arrays
from skidpad.roads.queries import LanePoint

LANE_WIDTH = 3.5
MOUNT = Pose(0.0, 0.0)
ROOF_DEPTH = CameraSpec("depth_roof", Modality.DEPTH, 800, 600, 90.0, MOUNT)
ROOF_SEMANTIC = CameraSpec("semantic_roof", Modality.SEMANTIC, 800, 600, 90.0, MOUNT)
BUMPER_SEMANTIC = CameraSpec("semantic_bumper", Modality.SEMANTIC, 400, 300, 100.0, MOUNT)
BUMPER_DEPTH = CameraSpec("depth_bumper", Modality.DEPTH, 400, 300, 100.0, MOUNT)
SPECS = (ROOF_DEPTH, ROOF_SEMANTIC, BUMPER_SEMANTIC, BUMPER_DEPTH, RadarSpec("radar_front", MOUNT))


@dataclass
class ArcMap:
    """A road of constant curvature through the origin along x, cut into pieces of equal length.

    Lane i = piece * lanes + k with k = 0 the rightmost lane. Each
    piece has its own road id, lane ids run -lanes .. -1 from right to left.
    """

    curvature: float = 0.0
    lanes_count: int = 3
    piece: float = 1000.0
    pieces: int = 8
    off_highway: frozenset[int] = frozenset()
    lights: tuple[tuple[int, int, float], ...] = ()  # id, lane index, s
    forks: bool = False  # each lane leads on into the next piece's lane to the right, too
    rightmost: float = 0.0  # m by which the centre of the rightmost lane lies left of the origin
    leads_on: bool = True  # each piece into the next
    name: str = "arc"
    content_hash: str = "-"

    def __post_init__(self) -> None:
        n = self.lanes_count * self.pieces
        self.start = 0.0  # road s of piece 0's beginning
        piece, k = np.divmod(np.arange(n), self.lanes_count)
        self.lanes = LaneTable(
            road=(piece + 1).astype(np.int32),
            lane_id=(k - self.lanes_count).astype(np.int32),
            section=np.zeros(n, np.int32),
            first=np.zeros(n, np.int32),
            size=np.full(n, 2, np.int32),
            length=self.piece * (1.0 - self.curvature * self._left(k)),
            kind=np.zeros(n, np.uint8),
            junction=np.full(n, -1, np.int32),
            left=np.where(k < self.lanes_count - 1, np.arange(n) + 1, -1).astype(np.int32),
            right=np.where(k > 0, np.arange(n) - 1, -1).astype(np.int32),
            opposite=np.full(n, -1, np.int32),
            next_start=np.zeros(n + 1, np.int32),
            next_lane=np.zeros(0, np.int32),
            prev_start=np.zeros(n + 1, np.int32),
            prev_lane=np.zeros(0, np.int32),
        )
        heads = [self._at(lane, s) for _, lane, s in self.lights]
        self.signals = SignalTable(
            id=np.array([i for i, _, _ in self.lights], np.int32),
            kind=np.full(len(heads), SignalKind.LIGHT, np.uint8),
            x=np.array([h.x for h in heads]),
            y=np.array([h.y for h in heads]),
            z=np.full(len(heads), 5.0),
            heading=np.array([h.heading for h in heads]),
            lane=np.array([lane for _, lane, _ in self.lights], np.int32),
            s=np.array([s for _, _, s in self.lights]),
            value=np.full(len(heads), np.nan),
            group=np.full(len(heads), -1, np.int32),
        )

    def _left(self, k):
        """m by which the centre of the k-th lane from the right lies left of the origin."""
        return self.rightmost + k * LANE_WIDTH

    def _point(self, s: float, left: float) -> tuple[float, float, float]:
        """x, y, heading at road s, `left` m left of the line through the origin."""
        k = self.curvature
        if k == 0.0:
            return s, left, 0.0
        heading = k * s
        return sin(heading) * (1 / k - left), 1 / k - cos(heading) * (1 / k - left), heading

    def _at(self, lane: int, s: float, offset: float = 0.0) -> LanePoint:
        piece, k = divmod(lane, self.lanes_count)
        left = self._left(k)
        stretch = 1.0 - self.curvature * left
        x, y, heading = self._point(piece * self.piece + s / stretch, left)
        return LanePoint(
            lane, s, x, y, 0.0, wrap_angle(heading), self.curvature / stretch, LANE_WIDTH,
            int(self.lanes.road[lane]), int(self.lanes.lane_id[lane]), offset,
        )  # fmt: skip

    @property
    def arrays(self) -> LaneArrays:
        """The lanes as kernels read them."""
        if getattr(self, "_packed", None) is not self.lanes:
            self._packed, self._arrays = self.lanes, lane_arrays(self._baked())
            self._held = hold(self._arrays)
        return self._arrays

    @property
    def held(self) -> Held[LaneArrays]:
        """The same behind a pointer."""
        assert self.arrays
        return self._held

    def _baked(self) -> SimpleNamespace:
        n, size = len(self.lanes.road), int(self.piece) + 2
        lane = np.repeat(np.arange(n), size)
        piece, k = np.divmod(lane, self.lanes_count)
        share = np.tile(np.linspace(0.0, 1.0, size), n)
        stretch = 1.0 - self.curvature * self._left(k)
        road_s = (piece + share) * self.piece
        x, y, heading = np.array(
            [self._point(*place) for place in zip(road_s, self._left(k), strict=True)]
        ).T
        flat = np.zeros(len(lane))
        marking = flat.astype(np.uint8)
        samples = LaneSamples(
            x, y, flat, heading, share * self.piece * stretch, road_s, self.curvature / stretch,
            flat, flat, np.full(len(lane), LANE_WIDTH), np.full(len(lane), np.nan), marking,
            marking, lane.astype(np.int32),
        )  # fmt: skip
        first = np.arange(n) * size
        ways = [self._successors(i) if self.leads_on else [] for i in range(n)]
        following = np.array([i for way in ways for i in way], np.int32)
        ends = np.cumsum([0, *map(len, ways)])
        lanes = self.lanes._replace(
            first=first.astype(np.int32), size=np.full(n, size, np.int32),
            next_start=ends.astype(np.int32), next_lane=following,
        )  # fmt: skip
        return SimpleNamespace(samples=samples, lanes=lanes, signals=self.signals)

    def _successors(self, lane: int) -> list[int]:
        straight = lane + self.lanes_count
        if straight >= len(self.lanes.road):
            return []
        return [straight, straight - 1] if self.forks and lane % self.lanes_count else [straight]

    def project(self, x, y, z, driving=True):
        if abs(z) > 4.0:
            return None
        k = self.curvature
        if k == 0.0:
            s, left = x, y
        else:
            sign = 1.0 if k > 0 else -1.0
            heading = atan2(sign * x, sign * (1 / k - y))
            s, left = heading / k, 1 / k - sign * hypot(x, 1 / k - y)
        lane = min(max(round((left - self.rightmost) / LANE_WIDTH), 0), self.lanes_count - 1)
        piece = int(s // self.piece)
        if not 0 <= piece < self.pieces or abs(left - self._left(lane)) > 20.0:
            return None
        stretch = 1.0 - k * self._left(lane)
        return self._at(
            piece * self.lanes_count + lane,
            (s - piece * self.piece) * stretch,
            left - self._left(lane),
        )

    def traced_roads(self, start, distance=5000.0, step=5.0):
        return frozenset(int(r) for r in self.lanes.road) - self.off_highway


def ego_at(x=0.0, y=0.0, yaw=0.0, v=0.0) -> EgoEstimate:
    return EgoEstimate(Pose(x, y, 0.0, yaw=yaw), v, 0.0, 0.0, 0.0, (v, v, v, v), 1)


@dataclass
class Car:
    """A rear face: at a depth, `left` m left of the camera, as wide as a car."""

    depth: float
    left: float = 0.0
    width: float = 1.8
    top: float = 0.6  # m above the optical axis
    bottom: float = -0.6
    label: int = int(SemanticClass.CAR)
    instance: int = 2

    def box(self, camera: CameraSpec) -> tuple[float, float, float, float]:
        """u0, u1, row0, row1 in px, not clipped."""
        f = camera.focal / self.depth
        return (
            camera.cx - (self.left + self.width / 2) * f,
            camera.cx - (self.left - self.width / 2) * f,
            camera.cy - self.top * f,
            camera.cy - self.bottom * f,
        )


def draw(cars, camera: CameraSpec) -> CameraImage:
    """Depth, labels and instances of rear faces; pixel u covers u - 0.5 .. u + 0.5."""
    inverse = np.zeros((camera.height, camera.width), np.float32)
    labels = np.zeros(inverse.shape, np.uint8)
    instances = np.zeros(inverse.shape, np.uint16)
    for car in sorted(cars, key=lambda c: -c.depth):
        u0, u1, r0, r1 = car.box(camera)
        columns = slice(max(int(np.ceil(u0)), 0), max(int(np.floor(u1)) + 1, 0))
        rows = slice(max(int(np.ceil(r0)), 0), max(int(np.floor(r1)) + 1, 0))
        inverse[rows, columns] = 1.0 / car.depth
        labels[rows, columns] = car.label
        instances[rows, columns] = car.instance
    return CameraImage(inverse_depth=inverse, labels=labels, instances=instances)


def as_segments(cars, camera: CameraSpec, column: float = 2.0) -> Segments:
    """The same faces as runs of pixels; nearer faces hide farther ones whole columns at a time."""
    rows = []
    free = np.ones(camera.width, bool)
    for car in sorted(cars, key=lambda c: c.depth):
        u0, u1, r0, r1 = car.box(camera)
        for u in np.arange(u0 + column / 2, u1, column):
            if 0 <= u < camera.width and free[int(u)]:
                rows.append((u, column, max(r0, 0), min(r1, camera.height), car.depth, car.label))
        free[max(int(u0), 0) : max(int(u1), 0)] = False
    columns = list(zip(*rows, strict=True)) if rows else [[]] * 6
    u, width, top, bottom, depth = (np.array(c, np.float32) for c in columns[:5])
    return Segments(u, width, top, bottom, depth, np.array(columns[5], np.uint8))


def radar_points(*points) -> RadarPoints:
    """(range, azimuth, altitude, velocity) each."""
    if not points:
        return RadarPoints.none()
    return RadarPoints(*np.array(points, np.float32).T)


def frame(
    tick=0,
    cars=(),
    ego=None,
    radar=(),
    lights=None,
    supervision=Supervision.NONE,
    level="objects",
    rgb=None,
) -> SensorFrame:
    """A frame in which both camera pairs see the same cars."""
    images, segments = {}, {}
    if level == "pixels":
        roof, bumper = draw(cars, ROOF_DEPTH), draw(cars, BUMPER_DEPTH)
        for name, image in (("roof", roof), ("bumper", bumper)):
            images[f"depth_{name}"] = CameraImage(inverse_depth=image.inverse_depth)
            images[f"semantic_{name}"] = CameraImage(labels=image.labels)
    else:
        segments = {
            "depth_roof": as_segments(cars, ROOF_DEPTH),
            "depth_bumper": as_segments(cars, BUMPER_DEPTH),
        }
    if rgb is not None:
        images["rgb_front"] = CameraImage(rgb=rgb)
    return SensorFrame(
        tick, ego or ego_at(), images, segments, radar_points(*radar),
        lights or {}, supervision=supervision,
    )  # fmt: skip


RED, YELLOW, GREEN = LightState.RED, LightState.YELLOW, LightState.GREEN
