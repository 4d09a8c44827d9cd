"""What can be seen from one point of the plane: a depth buffer over bearings, filled by boxes.

For channels, whose world is 2-D (C-021): a box hides what lies behind it, whatever its height;
only bodies on another level of an overpass are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.object_level.boxes import Boxes

BEARINGS = 720  # of half a degree: a pedestrian at 60 m still fills one
LEVEL_GAP = 1.5  # m above or below the eye's road, beyond which a body is on another road
LEVEL_GRADE = 0.065  # and this much more per metre of distance: grades are at most 6 %


class Sight(NamedTuple):
    """Depth buffer over bearings; bearing k looks along -pi + (k + 0.5) * 2 pi / BEARINGS."""

    depth: Floats  # (BEARINGS,) m, inf: nothing
    owner: Ints32  # (BEARINGS,) actor index; n + j: fixed box j; -1: nothing
    share: Floats  # (n,) of the bearings that an actor fills, those on which it is nearest


@inner_kernel
def ray_box(dx: float, dy: float, c: float, s: float, half_l: float, half_w: float,
            ux: float, uy: float) -> float:  # fmt: skip
    """Returns the m along a unit ray (ux, uy) to a box centred at (dx, dy) and turned by (c, s).

    inf: it misses; 0 from inside. c, s: cosine and sine of the box's yaw. Slab method in the box's
    frame (Kay and Kajiya 1986).
    """
    ox, oy = -(c * dx + s * dy), -(-s * dx + c * dy)
    vx, vy = c * ux + s * uy, -s * ux + c * uy
    near, far = 0.0, np.inf
    for o, v, half in ((ox, vx, half_l), (oy, vy, half_w)):
        if abs(v) < 1e-12:
            if abs(o) > half:
                return np.inf
            continue
        a, b = (-half - o) / v, (half - o) / v
        near, far = max(near, min(a, b)), min(far, max(a, b))
    return near if near <= far else np.inf


@inner_kernel
def _draw(boxes: Boxes, i: int, owner: int, eye: Floats, half_angle: float, sight: Sight) -> int:
    """Draws box i into the buffer as `owner`; returns how many bearings in view it fills, hidden or not."""
    c, s = np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i])
    dx, dy = boxes.x[i] - eye[0], boxes.y[i] - eye[1]
    half_l, half_w = 0.5 * boxes.length[i], 0.5 * boxes.width[i]
    middle = np.arctan2(dy, dx)
    low = high = 0.0
    along, across = c * dx + s * dy, -s * dx + c * dy
    if abs(along) <= half_l and abs(across) <= half_w:
        low, high = -np.pi, np.pi
    else:
        for a, b in ((half_l, half_w), (half_l, -half_w), (-half_l, half_w), (-half_l, -half_w)):
            px, py = dx + c * a - s * b, dy + s * a + c * b
            turn = (np.arctan2(py, px) - middle + np.pi) % (2.0 * np.pi) - np.pi
            low, high = min(low, turn), max(high, turn)
    step = 2.0 * np.pi / BEARINGS
    first = int(np.floor((middle + low + np.pi) / step))
    last = int(np.floor((middle + high + np.pi) / step))
    filled = 0
    for k in range(first, last + 1):
        bearing = -np.pi + (k + 0.5) * step
        off = (bearing - eye[3] + np.pi) % (2.0 * np.pi) - np.pi
        if abs(off) > half_angle:
            continue
        d = ray_box(dx, dy, c, s, half_l, half_w, np.cos(bearing), np.sin(bearing))
        if d == np.inf:
            continue
        filled += 1
        bin = k % BEARINGS
        if d < sight.depth[bin]:
            sight.depth[bin] = d
            sight.owner[bin] = owner
    return filled


@kernel
def look(
    eye: Floats,
    half_angle: float,
    actors: Boxes,
    present: NDArray[np.bool_],
    reach: Floats,
    fixed: Boxes,
    fixed_reach: float,
    sight: Sight,
) -> None:
    """Fills `sight` as seen from `eye` (4,): x, y, z and viewing direction; actor 0 is the eye's own.

    half_angle in rad to both sides; reach (n,) in m per actor, beyond which it is not there at all.
    """
    sight.depth[:] = np.inf
    sight.owner[:] = -1
    n = actors.x.size
    filled = np.zeros(n)
    for i in range(1, n):
        sight.share[i] = 0.0
        if not present[i]:
            continue
        d = np.hypot(actors.x[i] - eye[0], actors.y[i] - eye[1])
        if not d < reach[i] or abs(actors.z[i] - eye[2]) > LEVEL_GAP + LEVEL_GRADE * d:
            continue
        filled[i] = _draw(actors, i, i, eye, half_angle, sight)
    for j in range(fixed.x.size):
        d = np.hypot(fixed.x[j] - eye[0], fixed.y[j] - eye[1])
        if d - 0.5 * np.hypot(fixed.length[j], fixed.width[j]) < fixed_reach:
            _draw(fixed, j, n + j, eye, half_angle, sight)
    for k in range(BEARINGS):
        owner = sight.owner[k]
        if 0 <= owner < n:
            sight.share[owner] += 1.0 / filled[owner]


@kernel
def sees_point(
    eye: Floats, eye_height: float, point: Floats, heights: Floats, sight: Sight
) -> bool:
    """Returns whether a point (3,) in the air is above or before the nearest body on its bearing.

    heights: (n + fixed,) m of all bodies, by owner.
    """
    dx, dy = point[0] - eye[0], point[1] - eye[1]
    d = np.hypot(dx, dy)
    k = int((np.arctan2(dy, dx) + np.pi) / (2.0 * np.pi) * BEARINGS) % BEARINGS
    if sight.depth[k] >= d - 0.5:
        return True
    rise = point[2] - eye[2] - eye_height
    return bool(heights[sight.owner[k]] < eye_height + rise * sight.depth[k] / d)


def empty_sight(n: int) -> Sight:
    """Returns an empty buffer of sight for n actors."""
    return Sight(np.full(BEARINGS, np.inf), np.full(BEARINGS, -1, dtype=np.int32), np.zeros(n))
