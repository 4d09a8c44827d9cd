"""Upright boxes, walls and mounted sensors as arrays for kernels: the geometry of the object level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.roads.roadside import Roadside

GROUP = 16  # walls
ROUNDING = 1e-3  # m, more than any sum of coordinates is rounded by


class Boxes(NamedTuple):
    """n upright boxes standing at z; arrays (n,)."""

    x: Floats
    y: Floats
    z: Floats
    yaw: Floats
    length: Floats
    width: Floats
    height: Floats


class Walls(NamedTuple):
    """n vertical rectangles over ground segments; arrays (n,)."""

    x0: Floats
    y0: Floats
    z0: Floats
    x1: Floats
    y1: Floats
    z1: Floats
    height: Floats


class WallGroups(NamedTuple):
    """Walls in groups of GROUP that follow one another, as barriers do; arrays (groups,), m."""

    x_min: Floats  # of the first ends
    x_max: Floats
    y_min: Floats
    y_max: Floats
    longest: Floats  # |dx| + |dy| of the longest wall


class Mount(NamedTuple):
    """A sensor on the ego: origin (3,) and rotation (3, 3) in the ego's frame."""

    origin: Floats
    rotation: Floats


def empty_mount() -> Mount:
    """Returns arrays that `place` can fill."""
    return Mount(np.empty(3), np.empty((3, 3)))


def mount_of(pose: Pose) -> Mount:
    """Returns a mounting pose as arrays for kernels."""
    return Mount(np.array([pose.x, pose.y, pose.z]), np.ascontiguousarray(pose.rotation()))


@inner_kernel
def place(mount: Mount, states: ActorStates, seat: Mount) -> None:
    """Writes the ego's sensor seen from the world into `seat`, body pitch and roll included."""
    cr, sr = np.cos(states.roll[0]), np.sin(states.roll[0])
    cp, sp = np.cos(states.pitch[0]), np.sin(states.pitch[0])
    cy, sy = np.cos(states.yaw[0]), np.sin(states.yaw[0])
    body = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    centre = (states.x[0], states.y[0], states.z[0])
    for i in range(3):
        seat.origin[i] = centre[i]
        for k in range(3):
            seat.origin[i] += body[i][k] * mount.origin[k]
            seat.rotation[i, k] = 0.0
            for m in range(3):
                seat.rotation[i, k] += body[i][m] * mount.rotation[m, k]


@inner_kernel
def placed(mount: Mount, states: ActorStates) -> Mount:
    """Returns the ego's sensor seen from the world, in arrays of its own; `place` needs none."""
    seat = Mount(np.empty(3), np.empty((3, 3)))
    place(mount, states, seat)
    return seat


def walls_of(roadside: Roadside) -> Walls:
    """Returns every stretch of barrier as a vertical rectangle."""
    rows = [
        np.column_stack([b.points[:-1], b.points[1:], np.full(len(b.points[1:]), b.height)])
        for b in roadside.barriers
    ]
    return Walls(*np.concatenate([np.empty((0, 7)), *rows]).T.copy())


def group_walls(walls: Walls) -> WallGroups:
    """Returns where the walls of each group are, so that far ones are passed over together."""
    starts = np.arange(0, len(walls.x0), GROUP)
    if not len(starts):
        return WallGroups(*np.empty((5, 0)))
    length = np.abs(walls.x1 - walls.x0) + np.abs(walls.y1 - walls.y0)
    low, high = np.minimum.reduceat, np.maximum.reduceat
    return WallGroups(
        low(walls.x0, starts),
        high(walls.x0, starts),
        low(walls.y0, starts),
        high(walls.y0, starts),
        high(length, starts),
    )


def posts_of(roadside: Roadside) -> Boxes:
    """Returns every box of the roadside as arrays."""
    rows = [(b.x, b.y, b.z, b.yaw, b.length, b.width, b.height) for b in roadside.boxes]
    return Boxes(*np.array(rows, dtype=np.float64).reshape(-1, 7).T.copy())


@inner_kernel
def walls_in_view(
    origin: Floats,
    yaw: float,
    slope: float,
    walls: Walls,
    groups: WallGroups,
    reach: float,
    keep: Ints,
) -> int:
    """Writes the walls that may be in view into `keep`; returns how many.

    Of those a part may lie within `reach` m and |left| <= slope * forward.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    n = 0
    for g in range(groups.x_min.size):
        if is_group_far(groups, g, origin, reach):
            continue
        if _is_out_of_view(origin, c, s, slope, groups, g):
            continue
        for w in range(GROUP * g, min(GROUP * (g + 1), walls.x0.size)):
            ax, ay = walls.x0[w] - origin[0], walls.y0[w] - origin[1]
            bx, by = walls.x1[w] - origin[0], walls.y1[w] - origin[1]
            if abs(ax) + abs(ay) > 1.5 * reach + abs(bx - ax) + abs(by - ay):
                continue
            af, al = c * ax + s * ay, -s * ax + c * ay
            bf, bl = c * bx + s * by, -s * bx + c * by
            behind = af < 0.0 and bf < 0.0
            left = al > slope * af and bl > slope * bf
            right = -al > slope * af and -bl > slope * bf
            if not (behind or left or right):
                keep[n] = w
                n += 1
    return n


@inner_kernel
def is_group_far(groups: WallGroups, g: int, origin: Floats, reach: float) -> bool:
    """Returns whether all of a group lies beyond 1.5 times `reach` m, along the axes in sum."""
    aside = max(groups.x_min[g] - origin[0], origin[0] - groups.x_max[g], 0.0)
    aside += max(groups.y_min[g] - origin[1], origin[1] - groups.y_max[g], 0.0)
    return bool(aside > 1.5 * reach + groups.longest[g] + ROUNDING)


@inner_kernel
def _is_out_of_view(
    origin: Floats, c: float, s: float, slope: float, groups: WallGroups, g: int
) -> bool:
    """Returns whether a rectangle about all walls of a group lies behind, or beyond one side of the view."""
    x = 0.5 * (groups.x_min[g] + groups.x_max[g]) - origin[0]
    y = 0.5 * (groups.y_min[g] + groups.y_max[g]) - origin[1]
    half_x = 0.5 * (groups.x_max[g] - groups.x_min[g]) + groups.longest[g] + ROUNDING
    half_y = 0.5 * (groups.y_max[g] - groups.y_min[g]) + groups.longest[g] + ROUNDING
    farthest = c * x + s * y + abs(c) * half_x + abs(s) * half_y
    nearest = abs(c * y - s * x) - abs(s) * half_x - abs(c) * half_y
    return bool(farthest < 0.0 or nearest > slope * farthest)


@inner_kernel
def boxes_in_view(
    origin: Floats, yaw: float, slope: float, boxes: Boxes, reach: float, keep: Ints
) -> int:
    """Writes the boxes that may be in view into `keep`; returns how many.

    Of those a part may lie within `reach` m and |left| <= slope * forward.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    stretch = np.hypot(1.0, slope)
    n = 0
    for b in range(boxes.x.size):
        half = 0.5 * np.hypot(boxes.length[b], boxes.width[b])
        dx, dy = boxes.x[b] - origin[0], boxes.y[b] - origin[1]
        forward, left = c * dx + s * dy, -s * dx + c * dy
        if -half < forward < reach + half and abs(left) - slope * forward < half * stretch:
            keep[n] = b
            n += 1
    return n
