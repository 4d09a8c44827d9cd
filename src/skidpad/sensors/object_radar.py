"""Radar at the object level: rays against boxes, barriers and the road's plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import Held, inner_kernel, kernel
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates
from skidpad.core.weather import Weather
from skidpad.physics.optics import radar_range
from skidpad.roads.kernels import LaneArrays, project_kernel, sample_kernel
from skidpad.sensors.beam import Beam, beam_of, direction
from skidpad.sensors.boxes import (
    Boxes,
    Mount,
    Walls,
    boxes_in_view,
    mount_of,
    placed,
    walls_in_view,
)

Floats = NDArray[np.float64]

NEAR = 0.1  # m, near clip


class Antenna(NamedTuple):
    """One radar: where it sits, where it looks, and how far it hears in m."""

    mount: Mount
    beam: Beam
    reach: float


def antenna_of(spec: RadarSpec, seed: int, dt: float, weather: Weather | None) -> Antenna:
    """A radar in a run; weather: shortens its range, None: it does not."""
    reach = spec.range if weather is None else radar_range(weather, spec.range)
    return Antenna(mount_of(spec.mount), beam_of(spec, seed, dt), reach)


@inner_kernel
def cast_radar(
    radar: Antenna,
    tick: int,
    boxes: Boxes,
    states: ActorStates,
    walls: Walls,
    posts: Boxes,
    slope: Floats,
) -> NDArray[np.float32]:
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
    returns: NDArray[np.float32] = out[:n].copy()
    return returns


@kernel
def road_slope(map: Held[LaneArrays], x: float, y: float, z: float) -> Floats:
    """(2,) dz/dx and dz/dy of the road at a place; level where there is no lane."""
    lanes, slope = map.value, np.zeros(2)
    lane, s, _ = project_kernel(lanes, x, y, z, True)
    if lane >= 0:
        _, _, _, heading, _, _, grade, bank, _ = sample_kernel(lanes, lane, s)
        tilt = np.tan(bank)
        slope[0] = grade * np.cos(heading) - tilt * np.sin(heading)
        slope[1] = grade * np.sin(heading) + tilt * np.cos(heading)
    return slope


@inner_kernel
def _ray_wall(origin: Floats, dx: float, dy: float, dz: float, walls: Walls, w: int) -> float:
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


@inner_kernel
def _box_directions(boxes: Boxes, chosen: NDArray[np.int64]) -> Floats:
    """(k, 2) cosine and sine of the chosen boxes' yaw: once per tick, not once per ray."""
    out = np.empty((chosen.size, 2))
    for j, b in enumerate(chosen):
        out[j, 0], out[j, 1] = np.cos(boxes.yaw[b]), np.sin(boxes.yaw[b])
    return out


@inner_kernel
def _ray_box(
    origin: Floats, dx: float, dy: float, dz: float, boxes: Boxes, b: int, turned: Floats
) -> float:
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
