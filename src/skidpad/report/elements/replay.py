"""Small top-down replays cut from a tick log, as data for assets/replay.js."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.roads.surface_outlines import outline_patches

UNIT = 0.05  # m, coordinates are whole numbers of this
REACH = 90.0  # m around the event that is kept
STEP_S = 0.1  # s between frames
BEFORE_S, AFTER_S = 6.0, 3.0
BORDER_STEP = 4  # samples between the points of a lane border
SPAN = 70.0  # m across the picture
LEVEL = 4.0  # m of height within which things share a level
FRAMES = 900  # of a whole run


def replay(
    log: RunLog,
    road_map: RoadMap,
    row: int,
    laid: Sequence[LaidSurface] = (),
) -> dict[str, Any]:
    """Returns the s around tick row `row` for the page's script, centred on the ego's place there.

    Lanes, patches, barriers and actors within REACH m. Times in s.
    """
    dt = log.header.dt
    stride = max(round(STEP_S / dt), 1)
    first = max(row - round(BEFORE_S / dt) // stride * stride, row % stride)
    rows = np.arange(first, min(row + round(AFTER_S / dt), len(log) - 1) + 1, stride)
    return _cut_log(log, road_map, rows, row, np.array([row]), laid)


def replay_run(
    log: RunLog,
    road_map: RoadMap,
    mark: int | None = None,
    laid: Sequence[LaidSurface] = (),
) -> dict[str, Any]:
    """Returns a whole run for the page's script, with FRAMES frames at most, lanes along its way.

    mark: the row that is shown first and marked.
    """
    stride = max(round(STEP_S / log.header.dt), -(-len(log) // FRAMES))
    rows = np.arange(0, len(log), stride)
    return _cut_log(log, road_map, rows, mark, rows, laid)


def replay_stretch(
    log: RunLog,
    road_map: RoadMap,
    begin_s: float,
    end_s: float,
    mark_s: float,
    laid: Sequence[LaidSurface] = (),
) -> dict[str, Any]:
    """Returns the part of a run between two times in s for the page's script; mark_s: shown first."""
    stride = max(round(STEP_S / log.header.dt), 1)
    first, last = np.searchsorted(log.t, (begin_s - 1e-9, end_s + 1e-9))
    rows = np.arange(first, last, stride)
    mark = int(np.argmin(np.abs(log.t[rows] - mark_s)))
    return _cut_log(log, road_map, rows, int(rows[mark]), rows, laid)


def _cut_log(
    log: RunLog,
    road_map: RoadMap,
    rows: NDArray[np.int64],
    mark: int | None,
    stops: NDArray[np.int64],
    laid: Sequence[LaidSurface],
) -> dict[str, Any]:
    """Returns these rows of a log for the page's script, lanes and barriers near the places in `stops`.

    mark: the row that is shown first. stops: rows of the log.
    """
    a = log.actors
    way = _stations(np.column_stack([v[stops, 0] for v in (a.x, a.y, a.z)]).astype(np.float64))
    centre = way[0, :2]
    near = np.hypot(a.x[rows] - a.x[rows, :1], a.y[rows] - a.y[rows, :1]) < REACH
    level = np.abs(a.z[rows] - a.z[rows, :1]) < LEVEL
    shown = np.flatnonzero(np.any(near & level & log.present[rows], axis=0))
    frames = [[v for i in shown for v in _place(log, int(k), int(i), centre)] for k in rows]
    return {
        "dt": round(float(log.t[rows[1]] - log.t[rows[0]]), 6) if len(rows) > 1 else STEP_S,
        "unit": UNIT,
        "span": SPAN,
        "t0": round(float(log.t[rows[0]]), 2),
        "mark": None if mark is None else int(np.searchsorted(rows, mark)),
        "ego": int(np.searchsorted(shown, 0)),
        "size": [
            [round(float(log.table.length[i]), 2), round(float(log.table.width[i]), 2)]
            for i in shown
        ],
        "frames": frames,
        "lanes": lane_borders(road_map, way),
        "walls": barriers(road_map, way),
        **patches(road_map, laid, way, log.header.dt),
    }


def _stations(way: Floats) -> Floats:
    """Returns the places of a way (n, 3) that lie a quarter of REACH apart, the first one among them."""
    gone = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way[:, :2], axis=0).T))])
    return way[np.flatnonzero(np.diff(np.floor(gone / (0.25 * REACH)), prepend=-1.0) > 0.0)]


def _near(points: Floats, way: Floats) -> NDArray[np.bool_]:
    """Returns (n,) True for points (n, 3) within 1.3 REACH of a station of the way, on its level."""
    near = np.zeros(len(points), bool)
    for x, y, z in way:
        far = np.hypot(points[:, 0] - x, points[:, 1] - y)
        near |= (far < 1.3 * REACH) & (np.abs(points[:, 2] - z) < LEVEL)
    return near


def _place(log: RunLog, k: int, i: int, centre: Floats) -> list[int | None]:
    """Returns actor `i` at tick `k`: x, y in UNIT from `centre`, yaw in mrad; None each if absent."""
    if not log.present[k, i]:
        return [None, None, None]
    a = log.actors
    return [*_whole(np.array([a.x[k, i], a.y[k, i]]) - centre), round(float(a.yaw[k, i]) * 1000)]


def _whole(points: Floats) -> list[int]:
    """Returns points in m flattened to whole multiples of UNIT."""
    whole: list[int] = np.round(points.ravel() / UNIT).astype(int).tolist()
    return whole


def lane_borders(road_map: RoadMap, way: Floats) -> list[list[int]]:
    """Returns both borders of every lane for vehicles near a way (n, 3), [x, y, ...] in UNIT.

    From the way's first place; sidewalks and the like are left out.
    """
    s, lanes = road_map.samples, road_map.lanes
    near, centre = _near(np.column_stack([s.x, s.y, s.z]), way), way[0]
    borders = []
    for lane in np.unique(s.lane[near]):
        if lanes.kind[lane] not in (LaneKind.DRIVING, LaneKind.RAMP, LaneKind.SHOULDER):
            continue
        first, size = int(lanes.first[lane]), int(lanes.size[lane])
        rows = np.arange(first, first + size)[near[first : first + size]]
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            if run.size < 2:
                continue
            some = np.unique(np.append(run[::BORDER_STEP], run[-1]))
            for side in (0.5, -0.5):
                x = s.x[some] - side * s.width[some] * np.sin(s.heading[some]) - centre[0]
                y = s.y[some] + side * s.width[some] * np.cos(s.heading[some]) - centre[1]
                borders.append(_whole(np.column_stack([x, y])))
    return borders


def barriers(road_map: RoadMap, way: Floats) -> list[list[int]]:
    """Returns stretches of barriers near a way (n, 3), [x, y, ...] in UNIT from its first place."""
    stretches = []
    for barrier in road_map.roadside.barriers:
        rows = np.flatnonzero(_near(barrier.points, way))
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        stretches += [_whole(barrier.points[run, :2] - way[0, :2]) for run in runs if run.size > 1]
    return stretches


def patches(
    road_map: RoadMap, laid: Sequence[LaidSurface], way: Floats, dt: float
) -> dict[str, Any]:
    """Returns what lies on the road within reach of a way (n, 3); nothing without a surface.

    `patches` holds [kind, [x, y, ...]] of each polygon, from the way's first place; where events have
    laid others, also from and to when it lies there, s.
    """
    starts = [one.tick * dt for one in laid]
    found: list[list[Any]] = []
    for k, lying in enumerate(laid):
        times = [round(t, 3) for t in starts[k : k + 2]] if len(laid) > 1 else []
        found += [
            [outline.kind, _whole(outline.corners[:, :2] - way[0, :2]), *times]
            for outline in outline_patches(road_map, lying.surface)
            if _near(outline.corners, way).any()
            or _near(outline.corners.mean(axis=0)[None], way)[0]
        ]
    return {"patches": found} if found else {}
