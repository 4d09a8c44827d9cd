"""Replays of a hazard record from above, in the world of every channel, for assets/worlds.js."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.recording.hazards.records import HazardRecord

UNIT = 0.05  # m
STRIDE = 2  # cycles between pictures
REACH = 70.0  # m around the ego
PREDICTION_POINTS = 5
PLAN_POINTS = 12
SPAN = 92.0  # m across a panel


def worlds_replay(record: HazardRecord) -> dict[str, Any] | None:
    """Returns the record's worlds as whole numbers for the page's script; None without a known ego."""
    cycles = with_intentions(record.worlds)[::STRIDE]
    origin = next((_ego(c) for c in cycles if _ego(c) is not None), None)
    if origin is None:
        return None
    times = np.array([c.t for c in cycles])

    def find_shown(t: float) -> int:  # a drive may end between two shown cycles
        return min(int(np.searchsorted(times, t)), len(times) - 1)

    return {
        "dt": 0.1 * STRIDE,
        "unit": UNIT,
        "span": SPAN,
        "t0": round(float(times[0]), 2),
        "mark": find_shown(record.t_worst),
        "hazard": [
            find_shown(record.t_start),
            find_shown(record.t_end),
        ],
        "names": list(record.channels),
        "driving": None if record.driving is None else record.channels.index(record.driving),
        "involved": [_point(np.array([o.x, o.y]) - origin) for o in record.objects],
        "cycles": [[_world(frame, origin) for frame in c.frames] for c in cycles],
    }


def with_intentions(cycles: Sequence[Cycle]) -> list[Cycle]:
    """Returns the cycles with each channel's last plan and predictions kept until it is silent.

    A record has them each 0.5 s only. What is filled in is of the earlier frame: its times count from
    that frame, and rows of `predictions` are its objects; `prediction_t` is not filled in.
    """
    newest: dict[int, ChannelFrame] = {}
    out = []
    for cycle in cycles:
        frames: list[ChannelFrame | None] = []
        for c, frame in enumerate(cycle.frames):
            if frame is None:
                newest.pop(c, None)
            elif len(frame.plan) or frame.predictions.size:
                newest[c] = frame
            elif c in newest:
                frame = frame._replace(plan=newest[c].plan, predictions=newest[c].predictions)
            frames.append(frame)
        out.append(cycle._replace(frames=tuple(frames)))
    return out


def _ego(cycle: Cycle) -> NDArray[np.float64] | None:
    """Returns (2,) the ego's place in m in the first frame that knows it; None where no frame does."""
    frame = next((f for f in cycle.frames if f is not None and np.isfinite(f.ego[:2]).all()), None)
    return None if frame is None else frame.ego[:2]


def _world(frame: ChannelFrame | None, origin: NDArray[np.float64]) -> list[Any] | None:
    """Returns [ego box, plan, objects, predictions] within REACH m, in UNIT; None for a silent channel.

    A box is x, y, yaw in mrad, length, width.
    """
    if frame is None or not np.isfinite(frame.ego).all():
        return None
    offset = frame.objects[:, :2] - frame.ego[:2]
    near = np.flatnonzero(np.hypot(offset[:, 0], offset[:, 1]) < REACH)
    step = max(1, len(frame.plan) // PLAN_POINTS)
    far = max(1, frame.predictions.shape[1] // PREDICTION_POINTS)
    return [
        _box(frame.ego, frame.ego_polygon, origin),
        _points(frame.plan[::step, :2] - origin),
        [_box(frame.objects[i], frame.polygons[i, : frame.polygon_size[i]], origin) for i in near],
        [_points(p[::far] - origin) for p in frame.predictions if _within(p, frame.ego)],
    ]


def _within(path: NDArray[np.float64], ego: NDArray[np.float64]) -> bool:
    """Returns True when the first point of `path` lies within REACH m of the ego."""
    offset = path[:1] - ego[:2]
    return bool((np.hypot(offset[:, 0], offset[:, 1]) < REACH).any())


def _box(
    state: NDArray[np.float64], polygon: NDArray[np.float64], origin: NDArray[np.float64]
) -> list[int]:
    """Returns a box's centre x, y, yaw in mrad, length and width; lengths in UNIT, from `origin`."""
    low, high = (polygon.min(axis=0), polygon.max(axis=0)) if len(polygon) else (np.zeros(2),) * 2
    c, s = np.cos(state[2]), np.sin(state[2])
    x, y = 0.5 * (low + high)
    centre = state[:2] - origin + np.array([c * x - s * y, s * x + c * y])
    return [*_point(centre), round(float(state[2]) * 1000), *_point(high - low)]


def _point(p: NDArray[np.float64]) -> list[int]:
    """Returns the coordinates of a point in m as whole multiples of UNIT."""
    return [round(float(v) / UNIT) for v in p]


def _points(points: NDArray[np.float64]) -> list[int]:
    """Returns the finite ones of (n, 2) points in m as flat whole multiples of UNIT."""
    finite = points[np.isfinite(points).all(axis=1)]
    whole: list[int] = np.round(finite.ravel() / UNIT).astype(int).tolist()
    return whole
