"""The object sensors as they were before they were made fast: the oracle of test_fast_objects.py.

Every wall and box is met by every ray, and every array is made where it is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from skidpad.sensors.object_level.object_camera import (
    BIN,
    LEVEL_GAP,
    LEVEL_GRADE,
    MAX_RUNS,
    MAX_STRIPS,
    MIN_STRIPS,
    STRIP,
    WIDEN,
)
from skidpad.sensors.object_level.object_radar import NEAR
from skidpad.sensors.ranging.beam import direction

compiled = njit(error_model="numpy")


class Camera(NamedTuple):
    """A camera placed in the world."""

    origin: np.ndarray  # (3,)
    rotation: np.ndarray  # (3, 3), columns forward, left, up
    focal: float
    width: int
    height: int
    runs: int


class Seat(NamedTuple):
    """A sensor placed in the world."""

    origin: np.ndarray  # (3,)
    rotation: np.ndarray  # (3, 3)


@compiled
def cast_radar(radar, tick, boxes, states, walls, posts, slope):
    """(m, 4) range, azimuth, altitude, range rate of the rays that hit something in reach.

    slope: (2,) dz/dx and dz/dy of the road, a plane through the ego's wheels; a nose that dives does
    not tilt it.
    """
    beam, reach, seat = radar.beam, radar.reach, placed(radar.mount, states)
    origin, rotation = seat.origin, seat.rotation
    yaw, edge = np.arctan2(rotation[1, 0], rotation[0, 0]), beam.half_width
    near_walls = walls_in_view(origin, yaw, edge, walls, reach)
    near_posts = boxes_in_view(origin, yaw, edge, posts, reach)
    near_boxes = boxes_in_view(origin, yaw, edge, boxes, reach)
    ox, oy = origin[0] - boxes.x[0], origin[1] - boxes.y[0]
    height = origin[2] - boxes.z[0] - slope[0] * ox - slope[1] * oy
    turned_posts, turned_boxes = (
        _box_directions(posts, near_posts),
        _box_directions(boxes, near_boxes),
    )
    vx0 = states.vx[0] - states.yaw_rate[0] * oy
    vy0 = states.vy[0] + states.yaw_rate[0] * ox
    out = np.empty((beam.rays, 4), np.float32)
    n = 0
    for k in range(beam.rays):
        right, down = direction(beam, tick, k)
        fx = 1.0 / np.sqrt(1.0 + right * right + down * down)
        fy, fz = -right * fx, -down * fx
        dx = rotation[0, 0] * fx + rotation[0, 1] * fy + rotation[0, 2] * fz
        dy = rotation[1, 0] * fx + rotation[1, 1] * fy + rotation[1, 2] * fz
        dz = rotation[2, 0] * fx + rotation[2, 1] * fy + rotation[2, 2] * fz
        best, hit = reach, -1
        fall = dz - slope[0] * dx - slope[1] * dy
        if fall < 0.0 and -height / fall < best:  # the road
            best, hit = -height / fall, 0
        for w in near_walls:
            t = _ray_wall(origin, dx, dy, dz, walls, w)
            if t < best:
                best, hit = t, 0
        for j, p in enumerate(near_posts):
            t = _ray_box(origin, dx, dy, dz, posts, p, turned_posts[j])
            if t < best:
                best, hit = t, 0
        for j, i in enumerate(near_boxes):
            if i > 0 and states.present[i]:
                t = _ray_box(origin, dx, dy, dz, boxes, i, turned_boxes[j])
                if t < best:
                    best, hit = t, i
        if hit < 0:
            continue
        vx, vy = -vx0, -vy0
        if hit > 0:
            hx = origin[0] + best * dx - boxes.x[hit]
            hy = origin[1] + best * dy - boxes.y[hit]
            vx += states.vx[hit] - states.yaw_rate[hit] * hy
            vy += states.vy[hit] + states.yaw_rate[hit] * hx
        out[n, 0], out[n, 1] = best, np.arctan2(-right, 1.0)
        out[n, 2] = np.arctan2(-down, np.sqrt(1.0 + right * right))
        out[n, 3] = vx * dx + vy * dy
        n += 1
    return out[:n].copy()


@compiled
def _ray_wall(origin, dx, dy, dz, walls, w):
    """Distance along the ray to wall w; inf when it misses."""
    ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
    det = ex * dy - ey * dx
    if det == 0.0:
        return np.inf
    px, py = walls.x0[w] - origin[0], walls.y0[w] - origin[1]
    t = (ex * py - ey * px) / det
    f = (dx * py - dy * px) / det
    if t < NEAR or f < 0.0 or f > 1.0:
        return np.inf
    rise = origin[2] + t * dz - (walls.z0[w] + f * (walls.z1[w] - walls.z0[w]))
    return t if 0.0 <= rise <= walls.height[w] else np.inf


@compiled
def _box_directions(boxes, chosen):
    """(k, 2) cosine and sine of the chosen boxes' yaw: once per tick, not once per ray."""
    out = np.empty((chosen.size, 2))
    for j, b in enumerate(chosen):
        out[j, 0], out[j, 1] = np.cos(boxes.yaw[b]), np.sin(boxes.yaw[b])
    return out


@compiled
def _ray_box(origin, dx, dy, dz, boxes, b, turned):
    """Distance along the ray to the surface of box b, from outside or inside; inf when it misses.

    turned: cosine and sine of its yaw.
    """
    c, s = turned[0], turned[1]
    px, py = origin[0] - boxes.x[b], origin[1] - boxes.y[b]
    o = (c * px + s * py, -s * px + c * py, origin[2] - boxes.z[b] - boxes.height[b] / 2.0)
    d = (c * dx + s * dy, -s * dx + c * dy, dz)
    half = (boxes.length[b] / 2.0, boxes.width[b] / 2.0, boxes.height[b] / 2.0)
    enter, leave = -np.inf, np.inf
    for axis in range(3):
        if d[axis] == 0.0:
            if abs(o[axis]) > half[axis]:
                return np.inf
            continue
        t0 = (-half[axis] - o[axis]) / d[axis]
        t1 = (half[axis] - o[axis]) / d[axis]
        enter, leave = max(enter, min(t0, t1)), min(leave, max(t0, t1))
    if leave < max(enter, NEAR):
        return np.inf
    return enter if enter > NEAR else leave


@compiled
def see(states, boxes, labels, mount, focal, width, height, limit):
    """(m, 5) u, width, top, bottom, depth and (m,) label of what a camera on box 0 sees."""
    seat = placed(mount, states)
    # A camera that looks level sees an upright face at one depth; a pitched one at several.
    runs = 1 + int(12.0 * abs(seat.rotation[2, 0]))
    camera = Camera(seat.origin, seat.rotation, focal, width, height, min(runs, MAX_RUNS))
    present = states.present
    order = _near_to_far(camera, boxes, present, limit)
    covered = np.full(camera.width // BIN + 1, float(camera.height))
    out = np.empty((order.size * 4 * MAX_STRIPS * camera.runs, 5), np.float32)
    classes = np.empty(out.shape[0], np.uint8)
    n = 0
    for i in order:
        first = n
        n = _box_runs(camera, boxes, i, False, covered, out, n)
        for k in range(first, n):
            classes[k] = labels[i]
        # Only now does this box hide others: its own faces do not hide each other. Seen from above,
        # its roof hides up to the far edge, which is where the back faces end.
        last = n
        if camera.origin[2] > boxes.z[i] + boxes.height[i]:
            last = _box_runs(camera, boxes, i, True, covered, out, n)
        for k in range(first, last):
            left = max(int((out[k, 0] - out[k, 1] / 2.0) / BIN), 0)
            right = min(int((out[k, 0] + out[k, 1] / 2.0) / BIN), covered.size - 1)
            for column in range(left, right + 1):
                covered[column] = min(covered[column], out[k, 2])
    return out[:n].copy(), classes[:n].copy()


@compiled
def _near_to_far(camera, boxes, present, limit):
    origin, n = camera.origin, boxes.x.size
    distance = np.full(n, np.inf)
    yaw = np.arctan2(camera.rotation[1, 0], camera.rotation[0, 0])
    slope = WIDEN * camera.width / (2.0 * camera.focal)
    for i in boxes_in_view(origin, yaw, slope, boxes, limit):
        if i == 0 or not present[i]:
            continue
        d = np.hypot(boxes.x[i] - origin[0], boxes.y[i] - origin[1])
        reach = d - 0.5 * boxes.length[i]
        if reach < limit and abs(boxes.z[i] - boxes.z[0]) < LEVEL_GAP + LEVEL_GRADE * d:
            distance[i] = d
    order = np.argsort(distance, kind="mergesort")  # boxes at one distance: the first one first
    return order[: np.sum(np.isfinite(distance))]


@compiled
def _box_runs(camera, boxes, i, back, covered, out, n):
    """Append runs of box i to `out` from row n on: of its faces in sight, or of those at the back."""
    c, s = np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i])
    dx, dy = camera.origin[0] - boxes.x[i], camera.origin[1] - boxes.y[i]
    along, across = c * dx + s * dy, -s * dx + c * dy  # the camera seen from the box
    hl, hw = boxes.length[i] / 2.0, boxes.width[i] / 2.0
    rise = camera.origin[2] - boxes.z[i]
    inside = abs(along) < hl and abs(across) < hw and 0.0 < rise < boxes.height[i]
    if inside or (along > hl) != back:
        n = _face_runs(camera, boxes, i, hl, -hw, hl, hw, covered, out, n)
    if inside or (along < -hl) != back:
        n = _face_runs(camera, boxes, i, -hl, -hw, -hl, hw, covered, out, n)
    if inside or (across > hw) != back:
        n = _face_runs(camera, boxes, i, -hl, hw, hl, hw, covered, out, n)
    if inside or (across < -hw) != back:
        n = _face_runs(camera, boxes, i, -hl, -hw, hl, -hw, covered, out, n)
    return n


@compiled
def _face_runs(camera, boxes, i, x0, y0, x1, y1, covered, out, n):
    """Runs of the vertical face over the box-frame segment (x0, y0)-(x1, y1)."""
    c, s = np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i])
    span = np.hypot(x1 - x0, y1 - y0)
    strips = min(max(int(np.ceil(span / STRIP)), MIN_STRIPS), MAX_STRIPS)
    r = camera.rotation
    for k in range(strips):
        # Strip edges and centre at mid-height give the columns.
        u = np.empty(3)
        valid = True
        for e in range(3):
            f = (k + 0.5 * e) / strips
            bx, by = x0 + f * (x1 - x0), y0 + f * (y1 - y0)
            px = boxes.x[i] + c * bx - s * by - camera.origin[0]
            py = boxes.y[i] + s * bx + c * by - camera.origin[1]
            pz = boxes.z[i] + 0.5 * boxes.height[i] - camera.origin[2]
            forward = r[0, 0] * px + r[1, 0] * py + r[2, 0] * pz
            if forward < NEAR:
                valid = False
                break
            left = r[0, 1] * px + r[1, 1] * py + r[2, 1] * pz
            u[e] = camera.width / 2.0 - camera.focal * left / forward
            if e == 1:
                cx, cy = px, py
        if not valid:
            continue
        lo, hi = max(min(u[0], u[2]), 0.0), min(max(u[0], u[2]), float(camera.width))
        if hi <= lo:
            continue
        middle = 0.5 * (lo + hi)
        hidden = covered[int(middle / BIN)]
        n = _strip_runs(
            camera, cx, cy, boxes.z[i], boxes.height[i], middle, hi - lo, hidden, out, n
        )
    return n


@compiled
def _strip_runs(camera, px, py, z, height, u, width, hidden, out, n):
    """Cut the vertical line over (px, py), relative to the camera, into runs of rows."""
    r = camera.rotation
    for j in range(camera.runs):
        rows = np.empty(2)
        depth = 0.0
        valid = True
        for e in range(2):
            pz = z + height * (j + e) / camera.runs - camera.origin[2]
            forward = r[0, 0] * px + r[1, 0] * py + r[2, 0] * pz
            if forward < NEAR:
                valid = False
                break
            up = r[0, 2] * px + r[1, 2] * py + r[2, 2] * pz
            rows[e] = camera.height / 2.0 - camera.focal * up / forward
            depth += 0.5 * forward
        if not valid:
            continue
        top = max(rows[1], 0.0)
        bottom = min(rows[0], hidden)
        if bottom > top:
            out[n, 0], out[n, 1], out[n, 2], out[n, 3], out[n, 4] = u, width, top, bottom, depth
            n += 1
    return n


@compiled
def placed(mount, states):
    """The ego's sensor seen from the world, body pitch and roll included (`Pose.rotation`)."""
    cr, sr = np.cos(states.roll[0]), np.sin(states.roll[0])
    cp, sp = np.cos(states.pitch[0]), np.sin(states.pitch[0])
    cy, sy = np.cos(states.yaw[0]), np.sin(states.yaw[0])
    body = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    origin = np.empty(3)
    rotation = np.empty((3, 3))
    centre = (states.x[0], states.y[0], states.z[0])
    for i in range(3):
        origin[i] = centre[i]
        for k in range(3):
            origin[i] += body[i, k] * mount.origin[k]
            rotation[i, k] = 0.0
            for m in range(3):
                rotation[i, k] += body[i, m] * mount.rotation[m, k]
    return Seat(origin, rotation)


@compiled
def walls_in_view(origin, yaw, slope, walls, reach):
    """Walls of which a part may lie within `reach` and |left| <= slope * forward."""
    c, s = np.cos(yaw), np.sin(yaw)
    keep = np.empty(walls.x0.size, np.int64)
    n = 0
    for w in range(walls.x0.size):
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
    return keep[:n]


@compiled
def boxes_in_view(origin, yaw, slope, boxes, reach):
    """Boxes of which a part may lie within `reach` and |left| <= slope * forward."""
    c, s = np.cos(yaw), np.sin(yaw)
    stretch = np.hypot(1.0, slope)
    keep = np.empty(boxes.x.size, np.int64)
    n = 0
    for b in range(boxes.x.size):
        half = 0.5 * np.hypot(boxes.length[b], boxes.width[b])
        dx, dy = boxes.x[b] - origin[0], boxes.y[b] - origin[1]
        forward, left = c * dx + s * dy, -s * dx + c * dy
        if -half < forward < reach + half and abs(left) - slope * forward < half * stretch:
            keep[n] = b
            n += 1
    return keep[:n]
