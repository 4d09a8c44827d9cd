"""How far walkers and lane boundaries are seen by the cameras: first and last distances, by direction.

On objects the cameras list the faces of road users and no markings, so that lane boundaries are measured
on pixels alone. Without the pair of cameras nothing is measured, and nothing is limited.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import atan2, cos, inf, radians, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.frames import SensorFrame
from skidpad.core.specs import CameraSpec, Modality, SensorSpec
from skidpad.core.vocabulary import SemanticClass
from skidpad.envelope.sight import FRONT, Way, locate_on

FORGET = 1.0  # s without a return after which a thing counts as lost
AHEAD = radians(10.0)  # to either side; beyond it is left or right
KEPT, LEAST, SHARE = (
    20,
    5,
    0.2,
)  # first distances, how many say something, and the quantile that counts
BESIDE = (
    4.0  # m from the lane's middle within which a walker may step before the car; our assumption
)
IN_WAY = 1.5  # m, within which it is in the way
WALKERS_FOR = 30.0  # s after the last one for which walkers are expected; our assumption
LINE_NEAR, LINE_FAR = 1.0, 2.6  # m from the lane's middle between which its boundaries lie
LINE_PIXELS = 3  # of a boundary between two places of the lane, fewer: not seen
LINE_GAP = 2  # places in a row without a boundary: the gap of a broken line; more: its end


class Direction(str, Enum):
    """Where something comes into sight."""

    LEFT = "left"
    AHEAD = "ahead"
    RIGHT = "right"


def direction_of(bearing: float) -> Direction:
    """Returns the direction of a bearing in rad, left positive."""
    if abs(bearing) <= AHEAD:
        return Direction.AHEAD
    return Direction.LEFT if bearing > 0.0 else Direction.RIGHT


@dataclass(slots=True)
class SeenDistances:
    """When things of one kind were first and last seen, in m, and how often sight of one broke off.

    Attributes:
        first: the newest distances of first sight, by direction.
        last: the newest distances at which one was lost, by direction.
        dropouts: times that one was out of sight for less than FORGET s.
        unseen: s since the last return.
    """

    dt: float
    first: dict[Direction, deque[float]] = field(default_factory=dict)
    last: dict[Direction, deque[float]] = field(default_factory=dict)
    dropouts: int = 0
    unseen: float = inf
    _held: tuple[float, Direction] | None = None

    def note(self, found: tuple[float, float] | None) -> None:
        """Takes the nearest thing of a tick, (distance in m, bearing in rad), None without one."""
        if found is None:
            self.unseen += self.dt
            if self._held is not None and self.unseen > FORGET:
                _add(self.last, *self._held)
                self._held = None
            return
        now = (found[0], direction_of(found[1]))
        if self._held is None:
            _add(self.first, *now)
        elif self.unseen > 1.5 * self.dt:
            self.dropouts += 1
        self._held, self.unseen = now, 0.0

    def reach(self, prior: float) -> float:
        """Returns the distance of first sight over all directions, its SHARE quantile.

        `prior` before LEAST were noted.
        """
        noted = [d for kept in self.first.values() for d in kept]
        return float(np.quantile(noted, SHARE)) if len(noted) >= LEAST else prior


def _add(kept: dict[Direction, deque[float]], distance: float, where: Direction) -> None:
    """Appends a distance to those of its direction, of which KEPT stay."""
    kept.setdefault(where, deque(maxlen=KEPT)).append(distance)


@dataclass(frozen=True, slots=True)
class Eyes:
    """The forward pair of cameras with one view that tells depths and classes."""

    depth: CameraSpec
    semantic: CameraSpec

    def points(self, frame: SensorFrame, wanted: SemanticClass) -> tuple[Floats, Floats]:
        """Returns m ahead of the origin and m to the left of what has the wanted class; empty: nothing."""
        segments = frame.segments.get(self.depth.id)
        if segments is not None:
            chosen = segments.label == wanted
            u, z = segments.u[chosen], segments.depth[chosen]
        else:
            images = (frame.images.get(self.depth.id), frame.images.get(self.semantic.id))
            if images[0] is None or images[1] is None:
                return np.empty(0), np.empty(0)
            assert images[0].inverse_depth is not None
            assert images[1].labels is not None
            shown: Flags = (images[1].labels == wanted) & (images[0].inverse_depth > 0.0)
            u = np.nonzero(shown)[1]
            z = 1.0 / images[0].inverse_depth[shown]
        ahead = np.asarray(z, dtype=np.float64)
        left = (self.depth.cx - np.asarray(u, dtype=np.float64)) * ahead / self.depth.focal
        return ahead + self.depth.mount.x, left + self.depth.mount.y


def forward_eyes(specs: Sequence[SensorSpec]) -> Eyes | None:
    """Returns the first pair of depth and semantic camera that looks forward from one place; else None."""
    cameras = [
        s for s in specs if isinstance(s, CameraSpec) and s.mount.yaw == s.mount.pitch == 0.0
    ]
    for depth in (c for c in cameras if c.modality is Modality.DEPTH):
        for semantic in (c for c in cameras if c.modality is Modality.SEMANTIC):
            if depth.view == semantic.view:
                return Eyes(depth, semantic)
    return None


class FurtherSight:
    """Sight of walkers and of the lane's boundaries by the forward cameras, one tick after the other.

    Attributes:
        walkers: when walkers beside and in the lane were first and last seen.
        lines: the same of the end of the lane's boundaries.
        walker: m along the lane to the nearest walker in the way; None without one.
    """

    def __init__(self, specs: Sequence[SensorSpec], dt: float, walkers: bool, lanes: bool) -> None:
        self.eyes = forward_eyes(specs)
        self.walkers = SeenDistances(dt) if walkers else None
        self.lines: deque[float] | None = deque(maxlen=KEPT) if lanes else None
        self.walker: float | None = None

    def look(self, frame: SensorFrame, way: Way) -> None:
        """Takes the frame of a tick. way: the lane ahead."""
        self.walker = None
        if self.eyes is None or len(way.s) < 2:
            return
        if self.walkers is not None:
            self._look_for_walkers(self.walkers, self.eyes, frame, way)
        if self.lines is not None and self.eyes.depth.id not in frame.segments:
            seen = boundary_end(
                *self._locate(self.eyes, frame, way, SemanticClass.ROAD_LINE)[:2], way
            )
            if seen is not None:
                self.lines.append(seen)

    @property
    def lane_reach(self) -> float | None:
        """M of the lane whose boundaries are seen, the middle of the newest; None: none was seen yet."""
        return float(np.median(self.lines)) if self.lines else None

    @property
    def walker_reach(self) -> float | None:
        """M at which walkers are first seen; None while none is expected.

        They are for WALKERS_FOR s after the last one, and once LEAST were seen.
        """
        if self.walkers is None or self.walkers.unseen > WALKERS_FOR:
            return None
        reach = self.walkers.reach(inf)
        return reach if reach < inf else None

    def numbers(self) -> dict[str, float]:
        """Returns what was seen as columns of a recording, NaN where nothing was."""
        walkers = self.walkers or SeenDistances(0.0)
        nothing = float("nan")
        lane = self.lane_reach
        told = {"lane_reach_m": nothing if lane is None else lane}
        told["walker_m"] = nothing if self.walker is None else self.walker
        told["walker_dropouts"] = float(walkers.dropouts)
        for name, kept in (("first", walkers.first), ("last", walkers.last)):
            for where in Direction:
                noted = kept.get(where)
                told[f"walker_{name}_{where.value}_m"] = noted[-1] if noted else nothing
        return told

    def _look_for_walkers(
        self, seen: SeenDistances, eyes: Eyes, frame: SensorFrame, way: Way
    ) -> None:
        """Notes the nearest walker within BESIDE m of the lane, and the nearest one in the way."""
        nearest, across, ahead, left = self._locate(eyes, frame, way, SemanticClass.PEDESTRIAN)
        near = np.abs(across) < BESIDE
        if not near.any():
            seen.note(None)
            return
        i = int(np.argmin(np.where(near, ahead, inf)))
        seen.note((float(ahead[i]), atan2(float(left[i]), float(ahead[i]))))
        in_way = np.abs(across) < IN_WAY
        if in_way.any():
            self.walker = float(max(way.s[nearest[in_way]].min() - FRONT, 0.0))

    def _locate(
        self, eyes: Eyes, frame: SensorFrame, way: Way, wanted: SemanticClass
    ) -> tuple[NDArray[np.intp], Floats, Floats, Floats]:
        """Returns of all that is seen of a class: place of the way, m across it, m ahead and to the left."""
        ahead, left = eyes.points(frame, wanted)
        if not len(ahead):
            return np.empty(0, dtype=np.intp), np.empty(0), ahead, left
        pose = frame.ego.pose
        c, s = cos(pose.yaw), sin(pose.yaw)
        x, y = pose.x + c * ahead - s * left, pose.y + s * ahead + c * left
        return *locate_on(way, x, y), ahead, left


def boundary_end(nearest: NDArray[np.intp], across: Floats, way: Way) -> float | None:
    """Returns the m to where the boundaries of the lane are no longer seen; None: none is seen.

    nearest, across: of what is seen of markings. The gaps of a broken line do not end it.
    """
    beside = (np.abs(across) > LINE_NEAR) & (np.abs(across) < LINE_FAR)
    places = np.flatnonzero(np.bincount(nearest[beside], minlength=1) >= LINE_PIXELS)
    if not len(places):
        return None
    gaps = np.flatnonzero(np.diff(places) > LINE_GAP + 1)
    last = places[gaps[0]] if len(gaps) else places[-1]
    return float(way.s[last])
