"""Small top-down replays cut from a tick log, as data for assets/replay.js."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.recording.runlog import RunLog
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap

UNIT = 0.05  # m, coordinates are whole numbers of this
REACH = 90.0  # m around the event that is kept
STEP_S = 0.1  # s between frames
BEFORE_S, AFTER_S = 6.0, 3.0
BORDER_STEP = 4  # samples between the points of a lane border
SPAN = 70.0  # m across the picture
LEVEL = 4.0  # m of height within which things share a level


def replay(
    log: RunLog, road_map: RoadMap, row: int, before_s: float = BEFORE_S, after_s: float = AFTER_S
) -> dict[str, Any]:
    """The seconds around `row`, ego-centred: lanes, barriers and the actors near the ego."""
    dt = log.header.dt
    stride = max(round(STEP_S / dt), 1)
    first = max(row - round(before_s / dt) // stride * stride, row % stride)
    rows = np.arange(first, min(row + round(after_s / dt), len(log) - 1) + 1, stride)
    a = log.actors
    centre = np.array([a.x[row, 0], a.y[row, 0]], dtype=np.float64)
    height = float(a.z[row, 0])
    near = np.hypot(a.x[rows] - a.x[rows, :1], a.y[rows] - a.y[rows, :1]) < REACH
    level = np.abs(a.z[rows] - a.z[rows, :1]) < LEVEL
    shown = np.flatnonzero(np.any(near & level & log.present[rows], axis=0))
    frames = [[v for i in shown for v in _place(log, int(k), int(i), centre)] for k in rows]
    return {
        "dt": stride * dt,
        "unit": UNIT,
        "span": SPAN,
        "t0": round(float(log.t[first]), 2),
        "mark": int(np.searchsorted(rows, row)),
        "ego": int(np.searchsorted(shown, 0)),
        "size": [
            [round(float(log.table.length[i]), 2), round(float(log.table.width[i]), 2)]
            for i in shown
        ],
        "frames": frames,
        "lanes": lane_borders(road_map, centre, height),
        "walls": barriers(road_map, centre, height),
    }


def _place(log: RunLog, k: int, i: int, centre: NDArray[np.float64]) -> list[int | None]:
    if not log.present[k, i]:
        return [None, None, None]
    a = log.actors
    return [*_whole(np.array([a.x[k, i], a.y[k, i]]) - centre), round(float(a.yaw[k, i]) * 1000)]


def _whole(points: NDArray[np.float64]) -> list[int]:
    whole: list[int] = np.round(points.ravel() / UNIT).astype(int).tolist()
    return whole


def lane_borders(road_map: RoadMap, centre: NDArray[np.float64], height: float) -> list[list[int]]:
    """Both borders of every driving lane within reach, on the level of `height`."""
    s, lanes = road_map.samples, road_map.lanes
    near = (np.hypot(s.x - centre[0], s.y - centre[1]) < 1.3 * REACH) & (
        np.abs(s.z - height) < LEVEL
    )
    borders = []
    for lane in np.unique(s.lane[near]):
        if lanes.kind[lane] not in (LaneKind.DRIVING, LaneKind.RAMP, LaneKind.SHOULDER):
            continue
        first, size = int(lanes.first[lane]), int(lanes.size[lane])
        rows = np.arange(first, first + size)[near[first : first + size]]
        if rows.size < 2:
            continue
        rows = np.unique(np.append(rows[::BORDER_STEP], rows[-1]))
        for side in (0.5, -0.5):
            x = s.x[rows] - side * s.width[rows] * np.sin(s.heading[rows]) - centre[0]
            y = s.y[rows] + side * s.width[rows] * np.cos(s.heading[rows]) - centre[1]
            borders.append(_whole(np.column_stack([x, y])))
    return borders


def barriers(road_map: RoadMap, centre: NDArray[np.float64], height: float) -> list[list[int]]:
    """Stretches of barriers within reach, on the level of `height`."""
    stretches = []
    for barrier in road_map.roadside.barriers:
        near = (
            np.hypot(barrier.points[:, 0] - centre[0], barrier.points[:, 1] - centre[1])
            < 1.3 * REACH
        ) & (np.abs(barrier.points[:, 2] - height) < LEVEL)
        rows = np.flatnonzero(near)
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        stretches += [_whole(barrier.points[run, :2] - centre) for run in runs if run.size > 1]
    return stretches
