"""What a map offers and what its bends ask of grip (decision M-6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from skidpad.core.maths.constants import G
from skidpad.roads.lanes import LaneKind, SignalKind
from skidpad.roads.queries import RoadMap

BEND_RADIUS = 300.0  # m; 90 km/h asks for 0.21 g there


@dataclass(frozen=True, slots=True)
class Bend:
    """A stretch of a road that is curved tighter than BEND_RADIUS."""

    road: int
    s_from: float  # OpenDRIVE s
    s_to: float
    radius: float  # m, of the innermost driving lane at its tightest
    limit: float | None  # m/s, lowest in the bend

    def grip(self, v: float) -> float:
        """Returns the friction that a point mass needs at speed v in m/s: v^2 / (R g)."""
        return v * v / (self.radius * G)


@dataclass(frozen=True, slots=True)
class MapSummary:
    """Counts and lengths of one map."""

    roads: int
    lanes: int
    lane_length: dict[LaneKind, float]  # m
    junctions: int
    signals: dict[SignalKind, int]  # signals, not rows
    limits: tuple[float, ...]  # m/s, ascending
    bends: tuple[Bend, ...]  # outside junctions, tightest first
    dead_ends: tuple[tuple[int, int], ...]  # (road, lane) of driving lanes that lead nowhere
    steepest: float  # largest |dz/ds| of a driving lane


def summarise(map: RoadMap) -> MapSummary:
    """Returns counts, lengths, bends and dead ends of a map, from its arrays."""
    lanes = map.lanes
    driving = map.arrays.drivable[map.samples.lane] == 1
    limits = map.samples.limit[driving]
    return MapSummary(
        roads=len(np.unique(lanes.road)),
        lanes=len(lanes.road),
        lane_length={
            LaneKind(k): float(lanes.length[lanes.kind == k].sum())
            for k in np.unique(lanes.kind).tolist()
        },
        junctions=len(np.unique(lanes.junction[lanes.junction >= 0])),
        signals={
            SignalKind(k): len(np.unique(map.signals.id[map.signals.kind == k]))
            for k in np.unique(map.signals.kind).tolist()
        },
        limits=tuple(np.unique(np.round(limits[~np.isnan(limits)], 4)).tolist()),
        bends=tuple(sorted(_bends(map), key=lambda bend: bend.radius)),
        dead_ends=tuple(_dead_ends(map)),
        steepest=float(np.abs(map.samples.grade[driving]).max(initial=0.0)),
    )


def _dead_ends(map: RoadMap) -> Iterator[tuple[int, int]]:
    """Yields (road id, lane id) of each drivable lane without a drivable successor."""
    for lane in np.flatnonzero(map.arrays.drivable).tolist():
        if not any(map.arrays.drivable[following] for following in map.successors(lane)):
            yield int(map.lanes.road[lane]), int(map.lanes.lane_id[lane])


def _bends(map: RoadMap) -> Iterator[Bend]:
    """Yields runs of samples tighter than BEND_RADIUS, on each road merged over lanes by OpenDRIVE s."""
    samples, lanes = map.samples, map.lanes
    curved = (
        (map.arrays.drivable[samples.lane] == 1)
        & (lanes.junction[samples.lane] < 0)
        & (np.abs(samples.curvature) > 1.0 / BEND_RADIUS)
    )
    for road in np.unique(lanes.road[samples.lane[curved]]).tolist():
        rows = np.flatnonzero(curved & (lanes.road[samples.lane] == road))
        rows = rows[np.argsort(samples.s_road[rows], kind="stable")]
        turn = np.sign(samples.curvature[rows] * np.where(_against(map, rows), -1.0, 1.0))
        gaps = (np.diff(samples.s_road[rows]) > 2.0) | (np.diff(turn) != 0.0)
        for run in np.split(rows, np.flatnonzero(gaps) + 1):
            limits = samples.limit[run]
            s = samples.s_road[run]
            yield Bend(
                road=road,
                s_from=float(s[0]),
                s_to=float(s[-1]),
                radius=float(1.0 / np.abs(samples.curvature[run]).max()),
                limit=None if np.isnan(limits).all() else float(np.nanmin(limits)),
            )


def _against(map: RoadMap, rows: np.ndarray) -> np.ndarray:
    """Returns (n,) whether the samples' lanes run against the road's s."""
    first = map.lanes.first[map.samples.lane[rows]]
    result: np.ndarray = map.samples.s_road[first + 1] < map.samples.s_road[first]
    return result
