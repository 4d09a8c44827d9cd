"""Radar at the object level: rays against boxes, barriers and the road's plane."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.specs import RadarSpec
from skidpad.core.states import ActorStates
from skidpad.core.weather import Weather
from skidpad.physics.optics import radar_range
from skidpad.roads.kernels import LaneArrays, project_kernel, sample_kernel
from skidpad.sensors.object_level.boxes import (
    Boxes,
    Mount,
    WallGroups,
    Walls,
    boxes_in_view,
    empty_mount,
    group_walls,
    mount_of,
    place,
    walls_in_view,
)
from skidpad.sensors.ranging.beam import Beam, beam_of, direction

NEAR = 0.1  # m, near clip
CERTAIN = 1e-9  # a share of a wall this far below its first end, or above its last, is beyond it
MARGIN = 1e-4  # m by which a ray must pass beside a box to be left out
# A ray whose slope (left by forward) is this far outside a wall's misses it whatever is rounded; so
# it is where rays and both ends of the wall lie ahead of the antenna: by a share and by m.
ASIDE = 1e-4
AHEAD = 0.1
BINS = 128  # of slopes across the beam
NARROWEST = 1e-6  # half width of a beam, for its bins


class Antenna(NamedTuple):
    """One radar: where it sits, where it looks, and how far it hears in m."""

    mount: Mount
    beam: Beam
    reach: float


def antenna_of(spec: RadarSpec, seed: int, dt: float, weather: Weather | None) -> Antenna:
    """A radar in a run; weather: shortens its range, None: it does not."""
    reach = spec.range if weather is None else radar_range(weather, spec.range)
    return Antenna(mount_of(spec.mount), beam_of(spec, seed, dt), reach)


class Rays(NamedTuple):
    """The rays of one tick, and what each has met so far; arrays (n,) by ray."""

    x: Floats  # unit vector in the world
    y: Floats
    z: Floats
    right: Floats  # tangents
    down: Floats
    best: Floats  # m to what was met, or the reach
    hit: Ints  # row of the actor, 0: road, wall or post, -1: nothing
    bin: Ints  # of the slope
    order: Ints  # rays by bin
    ends: Ints  # (BINS,) where each bin ends in `order`


class NearBoxes(NamedTuple):
    """The boxes in view of a radar in their own order, with what does not change from ray to ray."""

    row: Ints  # (n,) in `Boxes`
    x: Floats  # m, the antenna seen from the box's foot
    y: Floats
    z: Floats  # m, the antenna over the box's middle
    cos: Floats  # of the box's yaw
    sin: Floats
    half: Floats  # (n, 3) m, half of length, width and height
    radius: Floats  # m, a little more than half the diagonal


class RadarScratch(NamedTuple):
    """Arrays in which a radar works, and its echoes of the tick."""

    seat: Mount
    rays: Rays
    groups: WallGroups
    walls: Ints  # (walls,) those in view
    posts: NearBoxes
    boxes: NearBoxes
    slope: Floats  # (2,) of the road
    echoes: NDArray[np.float32]  # (4, n) range, azimuth, altitude, range rate


def _make_near(n: int) -> NearBoxes:
    """Returns uninitialised arrays for n boxes near the radar."""
    x, y, z, cos, sin = np.empty((5, n))
    return NearBoxes(np.empty(n, np.int64), x, y, z, cos, sin, np.empty((n, 3)), np.empty(n))


def make_scratch(rays: int, walls: Walls, posts: int, boxes: int) -> RadarScratch:
    """Returns arrays for these walls, and for so many rays, posts and actors."""
    x, y, z, right, down, best = np.empty((6, rays))
    hit, bin, order = np.empty((3, rays), np.int64)
    return RadarScratch(
        empty_mount(),
        Rays(x, y, z, right, down, best, hit, bin, order, np.empty(BINS, np.int64)),
        group_walls(walls),
        np.empty(len(walls.x0), np.int64),
        _make_near(posts),
        _make_near(boxes),
        np.zeros(2),
        np.empty((4, rays), np.float32),
    )


@inner_kernel
def cast_radar(
    radar: Antenna,
    tick: int,
    boxes: Boxes,
    states: ActorStates,
    walls: Walls,
    posts: Boxes,
    work: RadarScratch,
) -> int:
    """Rays that hit something in reach into `work.echoes`; returns how many.

    The road is a plane through the ego's wheels of slope `work.slope`; a nose that dives does not tilt
    it.
    """
    beam, reach, slope, rays, out = radar.beam, radar.reach, work.slope, work.rays, work.echoes
    place(radar.mount, states, work.seat)
    origin, rotation = work.seat.origin, work.seat.rotation
    yaw, edge = np.arctan2(rotation[1, 0], rotation[0, 0]), beam.half_width
    near_posts, near_boxes = work.posts, work.boxes
    m_posts = boxes_in_view(origin, yaw, edge, posts, reach, near_posts.row)
    m_boxes = boxes_in_view(origin, yaw, edge, boxes, reach, near_boxes.row)
    _measure_boxes(origin, posts, m_posts, near_posts)
    _measure_boxes(origin, boxes, m_boxes, near_boxes)
    ox, oy = origin[0] - boxes.x[0], origin[1] - boxes.y[0]
    height = origin[2] - boxes.z[0] - slope[0] * ox - slope[1] * oy
    vx0 = states.vx[0] - states.yaw_rate[0] * oy
    vy0 = states.vy[0] + states.yaw_rate[0] * ox
    are_ahead = _aim(beam, tick, rotation, reach, rays)
    for k in range(beam.rays):
        fall = rays.z[k] - slope[0] * rays.x[k] - slope[1] * rays.y[k]
        if fall < 0.0 and -height / fall < reach:  # the road
            rays.best[k], rays.hit[k] = -height / fall, 0
    m_walls = walls_in_view(origin, yaw, edge, walls, work.groups, reach, work.walls)
    _meet_walls(rays, are_ahead, beam.half_width, origin, yaw, walls, work.walls, m_walls)
    n = 0
    for k in range(beam.rays):
        dx, dy, dz, best, hit = rays.x[k], rays.y[k], rays.z[k], rays.best[k], rays.hit[k]
        for j in range(m_posts):
            if not _is_aside(dx, dy, near_posts.x[j], near_posts.y[j], near_posts.radius[j], best):
                t = _ray_box(dx, dy, dz, near_posts, j)
                if t < best:
                    best, hit = t, 0
        for j in range(m_boxes):
            i = near_boxes.row[j]
            if i == 0 or not states.present[i]:
                continue
            if not _is_aside(dx, dy, near_boxes.x[j], near_boxes.y[j], near_boxes.radius[j], best):
                t = _ray_box(dx, dy, dz, near_boxes, j)
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
        right, down = rays.right[k], rays.down[k]
        out[0, n], out[1, n] = best, np.arctan2(-right, 1.0)
        out[2, n] = np.arctan2(-down, sqrt(1.0 + right * right))
        out[3, n] = vx * dx + vy * dy
        n += 1
    return n


@inner_kernel
def find_slope(lanes: LaneArrays, x: float, y: float, z: float, slope: Floats) -> None:
    """dz/dx and dz/dy of the road at a place into `slope` (2,); level where there is no lane."""
    slope[0] = slope[1] = 0.0
    lane, s, _ = project_kernel(lanes, x, y, z, True)
    if lane >= 0:
        _, _, _, heading, _, _, grade, bank, _ = sample_kernel(lanes, lane, s)
        tilt = np.tan(bank)
        slope[0] = grade * np.cos(heading) - tilt * np.sin(heading)
        slope[1] = grade * np.sin(heading) + tilt * np.cos(heading)


@inner_kernel
def _aim(beam: Beam, tick: int, rotation: Floats, reach: float, rays: Rays) -> bool:
    """Draws the rays of a tick and sorts them by the bin of their slope; whether all look ahead."""
    n = beam.rays
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    are_ahead = True
    for b in range(BINS):
        rays.ends[b] = 0
    for k in range(n):
        right, down = direction(beam, tick, k)
        fx = 1.0 / sqrt(1.0 + right * right + down * down)
        fy, fz = -right * fx, -down * fx
        dx = rotation[0, 0] * fx + rotation[0, 1] * fy + rotation[0, 2] * fz
        dy = rotation[1, 0] * fx + rotation[1, 1] * fy + rotation[1, 2] * fz
        rays.x[k], rays.y[k] = dx, dy
        rays.z[k] = rotation[2, 0] * fx + rotation[2, 1] * fy + rotation[2, 2] * fz
        rays.right[k], rays.down[k], rays.best[k], rays.hit[k] = right, down, reach, -1
        forward = c * dx + s * dy
        is_ahead = forward > AHEAD
        are_ahead = are_ahead and is_ahead
        slope = (c * dy - s * dx) / forward if is_ahead else 0.0
        rays.bin[k] = _bin_of(slope, beam.half_width)
        rays.ends[rays.bin[k]] += 1
    begin = 0
    for b in range(BINS):
        size = rays.ends[b]
        rays.ends[b] = begin
        begin += size
    for k in range(n):
        b = rays.bin[k]
        rays.order[rays.ends[b]] = k
        rays.ends[b] += 1
    return are_ahead


@inner_kernel
def _bin_of(slope: float, half_width: float) -> int:
    """Of BINS across a beam; it never falls as the slope rises, and the outer ones have no end."""
    half = max(half_width, NARROWEST)
    return int(min(max((slope + half) * (0.5 * BINS / half), 0.0), BINS - 1.0))


@inner_kernel
def _meet_walls(
    rays: Rays,
    are_ahead: bool,
    half_width: float,
    origin: Floats,
    yaw: float,
    walls: Walls,
    chosen: Ints,
    count: int,
) -> None:
    """A wall is compared with the rays in the bins from one of its ends to the other."""
    c, s = np.cos(yaw), np.sin(yaw)
    n = rays.x.size
    for m in range(count):
        w = chosen[m]
        px, py = walls.x0[w] - origin[0], walls.y0[w] - origin[1]
        qx, qy = walls.x1[w] - origin[0], walls.y1[w] - origin[1]
        ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
        across = ex * py - ey * px
        p, q = c * px + s * py, c * qx + s * qy
        first, end = 0, n
        if are_ahead and p > AHEAD and q > AHEAD:
            one, other = (c * py - s * px) / p, (c * qy - s * qx) / q
            low = _bin_of(min(one, other) - ASIDE, half_width)
            first = rays.ends[low - 1] if low > 0 else 0
            end = rays.ends[_bin_of(max(one, other) + ASIDE, half_width)]
        for j in range(first, end):
            k = rays.order[j]
            t, f = _ray_line(rays.x[k], rays.y[k], px, py, ex, ey, across)
            if t < rays.best[k]:
                rise = origin[2] + t * rays.z[k] - (walls.z0[w] + f * (walls.z1[w] - walls.z0[w]))
                if 0.0 <= rise <= walls.height[w]:
                    rays.best[k], rays.hit[k] = t, 0


@inner_kernel
def _ray_line(
    dx: float, dy: float, px: float, py: float, ex: float, ey: float, across: float
) -> tuple[float, float]:
    """Distance along the ray to a wall's line, and the share of the wall there; inf when it misses.

    Most rays pass beside most walls: signs tell so without a division.
    """
    det = ex * dy - ey * dx
    along = dx * py - dy * px  # det times the share
    if det > 0.0:
        if along < -CERTAIN or along > det * (1.0 + CERTAIN):
            return np.inf, 0.0
    elif det < 0.0:
        if along > CERTAIN or along < det * (1.0 + CERTAIN):
            return np.inf, 0.0
    else:
        return np.inf, 0.0
    t, f = across / det, along / det
    if t < NEAR or f < 0.0 or f > 1.0:
        return np.inf, 0.0
    return t, f


@inner_kernel
def _is_aside(dx: float, dy: float, x: float, y: float, radius: float, best: float) -> bool:
    """Whether a ray surely passes beside a box, or meets it beyond `best` m; x, y as in `NearBoxes`."""
    return abs(dx * y - dy * x) > radius or -dx * x - dy * y - radius > best


@inner_kernel
def _measure_boxes(origin: Floats, boxes: Boxes, count: int, near: NearBoxes) -> None:
    """Fills in the boxes that `near.row` names."""
    for j in range(count):
        b = near.row[j]
        near.x[j], near.y[j] = origin[0] - boxes.x[b], origin[1] - boxes.y[b]
        near.z[j] = origin[2] - boxes.z[b] - boxes.height[b] / 2.0
        near.cos[j], near.sin[j] = np.cos(boxes.yaw[b]), np.sin(boxes.yaw[b])
        near.half[j, 0], near.half[j, 1] = boxes.length[b] / 2.0, boxes.width[b] / 2.0
        near.half[j, 2] = boxes.height[b] / 2.0
        near.radius[j] = 0.5 * (boxes.length[b] + boxes.width[b]) + MARGIN


@inner_kernel
def _ray_box(dx: float, dy: float, dz: float, near: NearBoxes, j: int) -> float:
    """Distance along the ray to the surface of a box, from outside or inside; inf when it misses."""
    c, s = near.cos[j], near.sin[j]
    px, py = near.x[j], near.y[j]
    o = (c * px + s * py, -s * px + c * py, near.z[j])
    d = (c * dx + s * dy, -s * dx + c * dy, dz)
    half = (near.half[j, 0], near.half[j, 1], near.half[j, 2])
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
