"""Rays in all directions: a turn is cut into four pyramids of 90 degrees, each cast as one view."""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.sensors.raster.live_scene import LiveScene
from skidpad.sensors.raster.rays import Hits, make_hits, make_rays
from skidpad.sensors.raster.view import View, world_to_camera

CELLS = 128  # columns of cells over a sector
SECTORS = 4
STEEPEST_DEG = 80.0  # a ray's elevation; straight up and down lie in no pyramid


class Fan(NamedTuple):
    """n rays of a turning head: ray i goes to azimuth[column[i]] and elevation[channel[i]]."""

    azimuth: Floats  # (columns,) rad, left positive
    elevation: Floats  # (channels,) rad, up positive, within STEEPEST_DEG
    column: Ints  # (n,)
    channel: Ints  # (n,)


class RayHits(NamedTuple):
    """What m of the rays met, in their order."""

    ray: Ints  # (m,) which they are
    distance: Floats  # m
    direction: Floats  # (m, 3) unit vectors in the sensor's frame: forward, left, up
    cosine: Floats  # of the angle of incidence
    label: Ints  # SemanticClass
    instance: Ints  # row of the actor + 1; 0: the map


def sectors_of(azimuth: Floats) -> Ints:
    """Returns the quarter of the turn, 0 to 3, in which each azimuth (rad) lies; the first is around 0."""
    sector: Ints = np.round(azimuth * (SECTORS / (2.0 * pi))).astype(np.int64) % SECTORS
    return sector


def look_around(scene: LiveScene, pose: Pose, fan: Fan, reach: float, hidden: int) -> RayHits:
    """Returns the nearest surfaces along rays from `pose`; rays that meet none within `reach` m are left out.

    hidden: row of the actor that no ray meets, or -1.
    """
    quarter = sectors_of(fan.azimuth)
    turn = fan.azimuth - quarter * 2.0 * pi / SECTORS
    aside, ahead, up = -np.tan(turn), np.cos(turn), -np.tan(fan.elevation)
    start, ray, u, v = _sort_rays(fan, quarter, aside, ahead, up)
    distance, hits = np.full(len(ray), np.inf), make_hits(len(ray))
    for k in range(SECTORS):
        some = slice(start[k], start[k + 1])
        if some.start == some.stop:
            continue
        facing = pose @ Pose(0.0, 0.0, yaw=k * 2.0 * pi / SECTORS)
        part = _cast_sector(scene, facing, u[some], v[some], reach, hidden)
        _settle(part, u[some], v[some], ray[some], hits, distance)
    flat, rise = np.cos(fan.elevation), np.sin(fan.elevation)
    return _gather(fan, np.cos(fan.azimuth), np.sin(fan.azimuth), flat, rise, hits, distance, reach)


@kernel
def _sort_rays(
    fan: Fan, quarter: Ints, aside: Floats, ahead: Floats, up: Floats
) -> tuple[Ints, Ints, Floats, Floats]:
    """Returns the rays sector by sector: where each sector starts, which rays, m right and down per m ahead.

    quarter, aside, ahead: by column; up: by channel.
    """
    n = fan.column.size
    start = np.zeros(SECTORS + 1, dtype=np.int64)
    ray, u, v = np.empty(n, dtype=np.int64), np.empty(n), np.empty(n)
    for i in range(n):
        start[quarter[fan.column[i]] + 1] += 1
    for k in range(SECTORS):
        start[k + 1] += start[k]
    free = start.copy()
    for i in range(n):
        column = fan.column[i]
        at = free[quarter[column]]
        free[quarter[column]] += 1
        ray[at], u[at], v[at] = i, aside[column], up[fan.channel[i]] / ahead[column]
    return start, ray, u, v


@kernel
def _gather(
    fan: Fan, c: Floats, s: Floats, flat: Floats, rise: Floats, hits: Hits, distance: Floats,
    reach: float,
) -> RayHits:  # fmt: skip
    """Returns what rays met within `reach` m.

    c, s: cosines and sines of azimuth; flat, rise: of elevation.
    """
    m = 0
    for i in range(distance.size):
        m += distance[i] <= reach
    out = RayHits(
        np.empty(m, dtype=np.int64), np.empty(m), np.empty((m, 3)), np.empty(m),
        np.empty(m, dtype=np.int64), np.empty(m, dtype=np.int64),
    )  # fmt: skip
    m = 0
    for i in range(distance.size):
        if distance[i] <= reach:
            column, channel = fan.column[i], fan.channel[i]
            out.ray[m], out.distance[m], out.cosine[m] = i, distance[i], hits.cosine[i]
            out.direction[m, 0] = c[column] * flat[channel]
            out.direction[m, 1] = s[column] * flat[channel]
            out.direction[m, 2] = rise[channel]
            out.label[m], out.instance[m] = hits.key[i] >> 8 & 0xFF, hits.key[i] >> 16
            m += 1
    return out


def directions(fan: Fan, ray: Ints) -> Floats:
    """Returns unit vectors of these rays, (m, 3): forward, left, up. ray: (m,) indices in the fan."""
    column, channel = fan.column[ray], fan.channel[ray]
    flat = np.cos(fan.elevation)[channel]
    direction = np.empty((len(ray), 3))
    direction[:, 0] = np.cos(fan.azimuth)[column] * flat
    direction[:, 1] = np.sin(fan.azimuth)[column] * flat
    direction[:, 2] = np.sin(fan.elevation)[channel]
    return direction


def _cast_sector(
    scene: LiveScene, facing: Pose, u: Floats, v: Floats, reach: float, hidden: int
) -> Hits:
    """Returns the hits of one pyramid's rays, which go u right and v down per metre along its axis."""
    focal = CELLS / 2.0
    rows = 8 * ceil((float(np.abs(v).max()) + 1e-6) * focal / 4.0)
    place = np.array([facing.x, facing.y, facing.z])
    view = View(CELLS, rows, focal, CELLS / 2.0, rows / 2.0, world_to_camera(facing), place)
    rays, hits = make_rays(len(u), CELLS, rows), make_hits(len(u))
    rays.column[:] = view.cx + focal * u
    rays.row[:] = view.cy + focal * v
    scene.cast(view, hidden, reach, rays, hits)
    return hits


@kernel
def _settle(part: Hits, u: Floats, v: Floats, mine: Ints, hits: Hits, distance: Floats) -> None:
    """Writes what the rays `mine` met into `hits`, and their lengths in m into `distance`.

    u, v: m right and down per m ahead. `distance` stays as it was where nothing was met.
    """
    for i in range(mine.size):
        to = mine[i]
        if part.inverse[i] > 0.0:
            stretch = np.sqrt(u[i] * u[i] + v[i] * v[i] + 1.0)
            distance[to] = stretch / max(part.inverse[i], 1e-9)
        hits.key[to] = part.key[i]
        hits.cosine[to] = part.cosine[i]
