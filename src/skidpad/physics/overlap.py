"""Where two oriented boxes, or a box and a line, overlap in the plane, and along which normal."""

from __future__ import annotations

from math import cos, inf, sin, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel

Overlap = tuple[bool, float, float, float, float, float]  # touching, x, y, nx, ny, depth


class Boxes(NamedTuple):
    """Oriented boxes on the ground, arrays of shape (n,)."""

    x: Floats
    y: Floats
    yaw: Floats
    half_length: Floats
    half_width: Floats
    corners: Floats  # scratch: `corners_room`


def corners_room() -> Floats:
    """Returns arrays (2, 12, 2) for the two polygons between which one is clipped: `Boxes.corners`."""
    return np.empty((2, 12, 2))


@inner_kernel
def _clip(polygon: Floats, count: int, axis: int, limit: float, sign: float, out: Floats) -> int:
    """Writes the part of a convex polygon with sign * coordinate <= limit into `out`; returns its corners.

    polygon: its first `count` rows are valid; axis: 0 for x, 1 for y.
    """
    kept = 0
    for k in range(count):
        p, q = polygon[k], polygon[(k + 1) % count]
        inside_p, inside_q = sign * p[axis] <= limit, sign * q[axis] <= limit
        if inside_p:
            out[kept, 0], out[kept, 1] = p[0], p[1]
            kept += 1
        if inside_p != inside_q:
            t = (limit - sign * p[axis]) / (sign * (q[axis] - p[axis]))
            out[kept, 0] = p[0] + t * (q[0] - p[0])
            out[kept, 1] = p[1] + t * (q[1] - p[1])
            kept += 1
    return kept


@inner_kernel
def _middle(boxes: Boxes, i: int, j: int) -> tuple[float, float]:
    """Returns the mean corner of the overlap of boxes i and j, in the world; overwrites `boxes.corners`."""
    c, s = cos(boxes.yaw[j]), sin(boxes.yaw[j])
    ci, si = cos(boxes.yaw[i]), sin(boxes.yaw[i])
    here, there = boxes.corners[0], boxes.corners[1]
    for k in range(4):
        along = boxes.half_length[i] if k in (0, 3) else -boxes.half_length[i]
        across = boxes.half_width[i] if k < 2 else -boxes.half_width[i]
        dx = boxes.x[i] + along * ci - across * si - boxes.x[j]
        dy = boxes.y[i] + along * si + across * ci - boxes.y[j]
        here[k, 0], here[k, 1] = dx * c + dy * s, dy * c - dx * s
    count = _clip(here, 4, 0, boxes.half_length[j], 1.0, there)
    count = _clip(there, count, 0, boxes.half_length[j], -1.0, here)
    count = _clip(here, count, 1, boxes.half_width[j], 1.0, there)
    count = _clip(there, count, 1, boxes.half_width[j], -1.0, here)
    if count == 0:
        return 0.5 * (boxes.x[i] + boxes.x[j]), 0.5 * (boxes.y[i] + boxes.y[j])
    u, v = 0.0, 0.0
    for k in range(count):
        u += here[k, 0] / count
        v += here[k, 1] / count
    return boxes.x[j] + u * c - v * s, boxes.y[j] + u * s + v * c


@inner_kernel
def _radius(boxes: Boxes, i: int, nx: float, ny: float) -> float:
    """Returns half the extent of box i in m along a unit direction."""
    c, s = cos(boxes.yaw[i]), sin(boxes.yaw[i])
    along, across = abs(nx * c + ny * s), abs(ny * c - nx * s)
    return float(boxes.half_length[i] * along + boxes.half_width[i] * across)


@kernel
def box_box(boxes: Boxes, i: int, j: int) -> Overlap:
    """Returns the overlap of boxes i and j by separating axes; the normal pushes i away from j.

    All zeros and False where they do not touch.
    """
    dx, dy = boxes.x[i] - boxes.x[j], boxes.y[i] - boxes.y[j]
    depth, nx, ny = inf, 0.0, 0.0
    for k in range(4):
        yaw = boxes.yaw[i] if k < 2 else boxes.yaw[j]
        ux, uy = (cos(yaw), sin(yaw)) if k % 2 == 0 else (-sin(yaw), cos(yaw))
        gap = dx * ux + dy * uy
        inside = _radius(boxes, i, ux, uy) + _radius(boxes, j, ux, uy) - abs(gap)
        if inside <= 0.0:
            return False, 0.0, 0.0, 0.0, 0.0, 0.0
        if inside < depth - 1e-9:
            depth = inside
            nx, ny = (ux, uy) if gap >= 0.0 else (-ux, -uy)
    x, y = _middle(boxes, i, j)
    return True, x, y, nx, ny, depth


@inner_kernel
def _clipped_line(
    boxes: Boxes, i: int, line: tuple[float, float, float, float]
) -> tuple[float, float]:
    """Returns the shares of a line's length, 0 to 1, where it enters and leaves box i.

    line: ends (x0, y0, x1, y1) in the world. enter > leave: it misses.
    """
    c, s = cos(boxes.yaw[i]), sin(boxes.yaw[i])
    ax, ay = line[0] - boxes.x[i], line[1] - boxes.y[i]
    dx, dy = line[2] - line[0], line[3] - line[1]
    start = (ax * c + ay * s, ay * c - ax * s)
    along = (dx * c + dy * s, dy * c - dx * s)
    half = (boxes.half_length[i], boxes.half_width[i])
    enter, leave = 0.0, 1.0
    for axis in range(2):
        if abs(along[axis]) < 1e-12:
            if abs(start[axis]) > half[axis]:
                enter, leave = 1.0, 0.0
            continue
        t0 = (-half[axis] - start[axis]) / along[axis]
        t1 = (half[axis] - start[axis]) / along[axis]
        enter = max(enter, min(t0, t1))
        leave = min(leave, max(t0, t1))
    return enter, leave


@inner_kernel
def clipped_length(boxes: Boxes, i: int, line: tuple[float, float, float, float]) -> float:
    """Returns the length in m of the part of a line (x0, y0, x1, y1) inside box i."""
    enter, leave = _clipped_line(boxes, i, line)
    return sqrt((line[2] - line[0]) ** 2 + (line[3] - line[1]) ** 2) * max(leave - enter, 0.0)


@inner_kernel
def box_segment(
    boxes: Boxes,
    i: int,
    line: tuple[float, float, float, float],
    joined: tuple[bool, bool],
    back: tuple[float, float],
) -> Overlap:
    """Returns the overlap of box i with a line from (x0, y0) to (x1, y1); the normal pushes the box away.

    joined: whether a wall goes on beyond the line's begin and end; such an end does not stick out.
    back: where the box's centre was before the step. It tells the side of the line that the box
    came from, so that a fast car is thrown back and not drawn through a guardrail. All zeros and False
    where they do not touch. A line of no length divides by 0.
    """
    enter, leave = _clipped_line(boxes, i, line)
    if enter > leave:
        return False, 0.0, 0.0, 0.0, 0.0, 0.0
    dx, dy = line[2] - line[0], line[3] - line[1]
    middle = 0.5 * (enter + leave)
    x, y = line[0] + middle * dx, line[1] + middle * dy
    length = sqrt(dx * dx + dy * dy)
    nx, ny = -dy / length, dx / length
    before = (back[0] - line[0]) * nx + (back[1] - line[1]) * ny
    if before < 0.0:
        nx, ny, before = -nx, -ny, -before
    now = (boxes.x[i] - line[0]) * nx + (boxes.y[i] - line[1]) * ny
    depth = _radius(boxes, i, nx, ny) - now
    if now < 0.0:  # crossed within the step
        return True, x, y, nx, ny, depth
    for axis in range(2):  # the line's end may stick into the box's front or flank
        yaw = boxes.yaw[i]
        ux, uy = (cos(yaw), sin(yaw)) if axis == 0 else (-sin(yaw), cos(yaw))
        half = boxes.half_length[i] if axis == 0 else boxes.half_width[i]
        p0 = (line[0] - boxes.x[i]) * ux + (line[1] - boxes.y[i]) * uy
        p1 = (line[2] - boxes.x[i]) * ux + (line[3] - boxes.y[i]) * uy
        first_is_low = p0 < p1
        ahead, behind = half - min(p0, p1), half + max(p0, p1)
        if ahead < depth and not joined[0 if first_is_low else 1]:
            depth, nx, ny = ahead, -ux, -uy
        if behind < depth and not joined[1 if first_is_low else 0]:
            depth, nx, ny = behind, ux, uy
    return True, x, y, nx, ny, depth
