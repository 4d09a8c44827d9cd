"""Oriented boxes in motion along plans and predictions, sampled (C-091)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.evidence.channels.paths import sample_path, sample_plan

HORIZON = 4.0  # s, also the time to collision without risk (C-094)
STEP = 0.1  # s between samples; between them boxes go straight on
SAMPLES = round(HORIZON / STEP) + 1
V_STANDING = 0.5  # m/s, slower motion does not turn the heading


class Movers(NamedTuple):
    """n oriented boxes in motion, for kernels."""

    motion: Floats  # (n, SAMPLES, 4) x, y of the box centre, cos and sin of the heading
    half: Floats  # (n, 2) half length and half width
    bounds: Floats  # (n, 4) x_min, x_max, y_min, y_max swept by the boxes


@inner_kernel
def box_of(polygon: Floats, size: int) -> tuple[float, float, float, float]:
    """Returns centre x, y and half length, half width in m of the box around a polygon in its own frame.

    Only the first `size` vertices count, those that are not finite are left out; all 0.0 without any.
    """
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    for i in range(size):
        if np.isfinite(polygon[i, 0] + polygon[i, 1]):
            x0, x1 = min(x0, polygon[i, 0]), max(x1, polygon[i, 0])
            y0, y1 = min(y0, polygon[i, 1]), max(y1, polygon[i, 1])
    if x1 < x0:
        return 0.0, 0.0, 0.0, 0.0
    return 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0), 0.5 * (y1 - y0)


@inner_kernel
def _orient_box(
    points: Floats, heading: float, polygon: Floats, size: int, movers: Movers, i: int
) -> None:
    """Fills row i of `movers` with the box of `polygon` carried along points (SAMPLES, 2).

    heading: rad at the first point; it follows the motion, but is kept below V_STANDING and in reverse.
    """
    cx, cy, half_l, half_w = box_of(polygon, size)
    movers.half[i, 0], movers.half[i, 1] = half_l, half_w
    c, s = np.cos(heading), np.sin(heading)
    reach = np.hypot(half_l, half_w)
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    n = points.shape[0]
    for k in range(n):
        if k < n - 1:  # the direction of the step that begins here
            dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
            d = np.hypot(dx, dy)
            if d >= V_STANDING * STEP:
                sign = -1.0 if dx * c + dy * s < 0.0 else 1.0  # in reverse the heading stays
                c, s = sign * dx / d, sign * dy / d
        x = points[k, 0] + c * cx - s * cy
        y = points[k, 1] + s * cx + c * cy
        row = movers.motion[i, k]
        row[0], row[1], row[2], row[3] = x, y, c, s
        x0, x1 = min(x0, x - reach), max(x1, x + reach)
        y0, y1 = min(y0, y - reach), max(y1, y + reach)
    bounds = movers.bounds[i]
    bounds[0], bounds[1], bounds[2], bounds[3] = x0, x1, y0, y1


@kernel
def _move_plan(ego: Floats, polygon: Floats, plan: Floats, movers: Movers) -> int:
    """Fills mover 0 with the ego's box along its plan; returns how many samples lie within the plan."""
    points = np.empty((SAMPLES, 2))
    inside = sample_plan(plan, ego, 0.0, STEP, points)
    _orient_box(points, ego[2], polygon, polygon.shape[0], movers, 0)
    return inside


@kernel
def _move_objects(
    objects: Floats,
    polygons: Floats,
    size: NDArray[np.int64],
    predictions: Floats,
    prediction_t: Floats,
    movers: Movers,
) -> None:
    """Fills the movers with the boxes of all objects along their predictions."""
    points = np.empty((SAMPLES, 2))
    for i in range(objects.shape[0]):
        sample_path(prediction_t, predictions[i], objects[i], 0.0, STEP, points)
        _orient_box(points, objects[i, 2], polygons[i], size[i], movers, i)


def ego_movers(frame: ChannelFrame | None) -> Movers | None:
    """Returns the ego's box along its plan as one row; None without a frame, a finite pose or a plan."""
    if frame is None or not np.isfinite(frame.ego).all():
        return None
    movers = _movers(1)
    if _move_plan(frame.ego, frame.ego_polygon, frame.plan, movers) == 0:
        return None  # without a plan there is nothing to judge
    return movers


def world_movers(frame: ChannelFrame | None) -> Movers | None:
    """Returns the boxes of all objects of a channel along their predictions; None without a frame."""
    if frame is None:
        return None
    movers = _movers(len(frame.objects))
    _move_objects(
        frame.objects,
        frame.polygons,
        frame.polygon_size,
        frame.predictions,
        frame.prediction_t,
        movers,
    )
    return movers


def _movers(n: int) -> Movers:
    """Returns movers for `n` boxes; their arrays are not filled yet."""
    return Movers(np.empty((n, SAMPLES, 4)), np.empty((n, 2)), np.empty((n, 4)))
