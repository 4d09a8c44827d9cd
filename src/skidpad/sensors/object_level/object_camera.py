"""Cameras at the object level: visible faces of boxes, cut into runs of pixels."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ActorStates
from skidpad.sensors.object_level.boxes import Boxes, Mount, boxes_in_view, place

NEAR = 0.1  # m, near clip
STRIP = 0.75  # m of a long face per strip
MIN_STRIPS = 6
MAX_STRIPS = 24
MAX_RUNS = 4  # vertical runs per strip
BIN = 2  # px per occlusion column
WIDEN = 1.3  # of the horizontal view before culling: a pitched camera sees wider at its edges
# A vehicle this far above or below the ego's level is on another road (grades are at most 6 %).
LEVEL_GAP = 1.5  # m
LEVEL_GRADE = 0.065


class Axis(NamedTuple):
    """A unit vector in the world."""

    x: float
    y: float
    z: float


class Camera(NamedTuple):
    """A camera placed in the world. Numbers alone: to hand arrays on costs as much as to use them."""

    x: float
    y: float
    z: float
    forward: Axis
    left: Axis
    up: Axis
    focal: float
    width: int
    height: int
    runs: int  # vertical runs per strip


class Block(NamedTuple):
    """One box: its foot, the cosine and sine of its yaw, and half its length and width."""

    x: float
    y: float
    z: float
    cos: float
    sin: float
    half_length: float
    half_width: float
    height: float


class Eye(NamedTuple):
    """A camera on the ego, and what it sees in the tick."""

    mount: Mount
    focal: float  # px
    width: int
    height: int
    runs: NDArray[np.float32]  # (5, m) u, width, top, bottom, depth
    classes: NDArray[np.uint8]  # (m,) SemanticClass


class CameraScratch(NamedTuple):
    """Arrays in which cameras work."""

    seat: Mount
    order: Ints  # (n,) boxes in sight, nearest first
    distance: Floats  # (n,) m, of these
    covered: Floats  # px, row below which a column of the image is hidden


@inner_kernel
def see_boxes(
    e: Eye,
    states: ActorStates,
    boxes: Boxes,
    labels: NDArray[np.uint8],
    limit: float,
    work: CameraScratch,
) -> int:
    """Writes what a camera on box 0 sees of the other boxes into `e`; returns how many runs.

    A run is an upright rectangle of pixels on a strip of a face; one box has many. What stands in `e`
    from the returned number on is not valid. limit: m. labels: (n,) SemanticClass of the boxes.
    Nearer boxes hide farther ones column by column.
    """
    place(e.mount, states, work.seat)
    camera = _camera(work.seat, e.focal, e.width, e.height)
    out, classes, order = e.runs, e.classes, work.order
    covered, columns = work.covered, e.width // BIN + 1
    for k in range(columns):
        covered[k] = e.height
    n = 0
    for m in range(_sort_boxes(camera, boxes, states.present, limit, work)):
        i = order[m]
        block = Block(
            boxes.x[i], boxes.y[i], boxes.z[i], np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i]),
            boxes.length[i] / 2.0, boxes.width[i] / 2.0, boxes.height[i],
        )  # fmt: skip
        first = n
        n = _box_runs(camera, block, False, covered, out, n)
        for k in range(first, n):
            classes[k] = labels[i]
        # Only now does this box hide others: its own faces do not hide each other. Seen from above,
        # its roof hides up to the far edge, which is where the back faces end.
        last = n
        if camera.z > block.z + block.height:
            last = _box_runs(camera, block, True, covered, out, n)
        for k in range(first, last):
            left = max(int((out[0, k] - out[1, k] / 2.0) / BIN), 0)
            right = min(int((out[0, k] + out[1, k] / 2.0) / BIN), columns - 1)
            for column in range(left, right + 1):
                covered[column] = min(covered[column], out[2, k])
    return n


@inner_kernel
def _camera(seat: Mount, focal: float, width: int, height: int) -> Camera:
    """Returns the camera at its mount in the world, of width by height pixels and focal length in pixels."""
    o, r = seat.origin, seat.rotation
    forward, left = Axis(r[0, 0], r[1, 0], r[2, 0]), Axis(r[0, 1], r[1, 1], r[2, 1])
    up = Axis(r[0, 2], r[1, 2], r[2, 2])
    # A camera that looks level sees an upright face at one depth; a pitched one at several.
    runs = min(1 + int(12.0 * abs(forward.z)), MAX_RUNS)
    return Camera(o[0], o[1], o[2], forward, left, up, focal, width, height, runs)


@inner_kernel
def _sort_boxes(
    camera: Camera, boxes: Boxes, present: NDArray[np.bool_], limit: float, work: CameraScratch
) -> int:
    """Writes the boxes in sight into `work.order`, nearest first; returns how many.

    Box 0 carries the camera and is left out, and so are those on another level of an overpass.
    """
    order, distance = work.order, work.distance
    yaw = np.arctan2(camera.forward.y, camera.forward.x)
    slope = WIDEN * camera.width / (2.0 * camera.focal)
    n = 0
    for m in range(boxes_in_view(work.seat.origin, yaw, slope, boxes, limit, order)):
        i = order[m]
        if i == 0 or not present[i]:
            continue
        d = np.hypot(boxes.x[i] - camera.x, boxes.y[i] - camera.y)
        reach = d - 0.5 * boxes.length[i]
        if reach < limit and abs(boxes.z[i] - boxes.z[0]) < LEVEL_GAP + LEVEL_GRADE * d:
            k = n  # insertion: at most m boxes were read, so nothing unread is overwritten
            while k > 0 and distance[k - 1] > d:
                order[k], distance[k] = order[k - 1], distance[k - 1]
                k -= 1
            order[k], distance[k] = i, d
            n += 1
    return n


@inner_kernel
def _box_runs(
    camera: Camera, box: Block, back: bool, covered: Floats, out: NDArray[np.float32], n: int
) -> int:
    """Adds runs of a box to `out` from column n on; returns the next free column.

    back: of the faces that look away, else of those that face the camera. Of a camera inside the box
    all count.
    """
    dx, dy = camera.x - box.x, camera.y - box.y
    along, across = (
        box.cos * dx + box.sin * dy,
        -box.sin * dx + box.cos * dy,
    )  # the camera from the box
    hl, hw = box.half_length, box.half_width
    inside = abs(along) < hl and abs(across) < hw and 0.0 < camera.z - box.z < box.height
    if inside or (along > hl) != back:
        n = _face_runs(camera, box, hl, -hw, hl, hw, covered, out, n)
    if inside or (along < -hl) != back:
        n = _face_runs(camera, box, -hl, -hw, -hl, hw, covered, out, n)
    if inside or (across > hw) != back:
        n = _face_runs(camera, box, -hl, hw, hl, hw, covered, out, n)
    if inside or (across < -hw) != back:
        n = _face_runs(camera, box, -hl, -hw, hl, -hw, covered, out, n)
    return n


@inner_kernel
def _face_runs(
    camera: Camera,
    box: Block,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    covered: Floats,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Adds the runs of the vertical face over (x0, y0)-(x1, y1), m in the box's frame, to `out`.

    covered: px by column of BIN px, rows from there down are hidden. Returns the next free column.
    """
    span = np.hypot(x1 - x0, y1 - y0)
    strips = min(max(ceil(span / STRIP), MIN_STRIPS), MAX_STRIPS)
    # Strip edges and centre at mid-height give the columns; a strip begins where the last one ended.
    _, _, end = _column(camera, box, x0, y0)
    for k in range(strips):
        begin = end
        f = (k + 0.5) / strips
        cx, cy, centre = _column(camera, box, x0 + f * (x1 - x0), y0 + f * (y1 - y0))
        f = (k + 1.0) / strips
        _, _, end = _column(camera, box, x0 + f * (x1 - x0), y0 + f * (y1 - y0))
        if np.isnan(begin) or np.isnan(centre) or np.isnan(end):
            continue
        lo, hi = max(min(begin, end), 0.0), min(max(begin, end), float(camera.width))
        if hi <= lo:
            continue
        middle = 0.5 * (lo + hi)
        n = _strip_runs(camera, box, cx, cy, middle, hi - lo, covered[int(middle / BIN)], out, n)
    return n


@inner_kernel
def _column(camera: Camera, box: Block, bx: float, by: float) -> tuple[float, float, float]:
    """Returns a box's point seen from the camera (x, y in m) and its column in px, NaN nearer than `NEAR`.

    bx, by: m in the box's frame.
    """
    px = box.x + box.cos * bx - box.sin * by - camera.x
    py = box.y + box.sin * bx + box.cos * by - camera.y
    pz = box.z + 0.5 * box.height - camera.z
    ahead, left = camera.forward, camera.left
    forward = ahead.x * px + ahead.y * py + ahead.z * pz
    if forward < NEAR:
        return px, py, np.nan
    aside = left.x * px + left.y * py + left.z * pz
    return px, py, camera.width / 2.0 - camera.focal * aside / forward


@inner_kernel
def _strip_runs(
    camera: Camera,
    box: Block,
    px: float,
    py: float,
    u: float,
    width: float,
    hidden: float,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Adds the vertical line over (px, py), m from the camera, to `out` in runs of rows above `hidden`.

    u, width: px, middle and width of the strip. Returns the next free column of `out`.
    """
    upper, f_upper = _row(camera, px, py, box.z + box.height * 0 / camera.runs - camera.z)
    for j in range(camera.runs):
        lower, f_lower = upper, f_upper
        upper, f_upper = _row(camera, px, py, box.z + box.height * (j + 1) / camera.runs - camera.z)
        if np.isnan(lower) or np.isnan(upper):
            continue
        top, bottom = max(upper, 0.0), min(lower, hidden)
        if bottom > top:
            out[0, n], out[1, n], out[2, n], out[3, n] = u, width, top, bottom
            out[4, n] = 0.5 * f_lower + 0.5 * f_upper
            n += 1
    return n


@inner_kernel
def _row(camera: Camera, px: float, py: float, pz: float) -> tuple[float, float]:
    """Returns row in px and depth in m of a point; the row is NaN for a depth below `NEAR`.

    px, py, pz: m from the camera's place, along the axes of the world.
    """
    ahead, up = camera.forward, camera.up
    forward = ahead.x * px + ahead.y * py + ahead.z * pz
    if forward < NEAR:
        return np.nan, forward
    above = up.x * px + up.y * py + up.z * pz
    return camera.height / 2.0 - camera.focal * above / forward, forward
