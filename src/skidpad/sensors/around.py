"""Rays in all directions: a turn is cut into four pyramids of 90 degrees, each cast as one view."""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.sensors.live_scene import LiveScene
from skidpad.sensors.rays import Hits, make_hits, make_rays
from skidpad.sensors.view import View, world_to_camera

Floats = NDArray[np.float64]
CELLS = 32  # columns of cells over a sector
SECTORS = 4
STEEPEST_DEG = 80.0  # a ray's elevation; straight up and down lie in no pyramid


class Seen(NamedTuple):
    """What n rays met; the other columns mean nothing where `met` is false."""

    met: NDArray[np.bool_]
    distance: Floats  # m
    direction: Floats  # (n, 3) unit vectors in the sensor's frame: forward, left, up
    cosine: Floats  # of the angle of incidence
    label: NDArray[np.int64]  # SemanticClass
    instance: NDArray[np.int64]  # row of the actor + 1; 0: the map


def sectors_of(azimuth: Floats) -> NDArray[np.int64]:
    """The quarter of the turn in which each azimuth (rad) lies; the first is around 0."""
    sector: NDArray[np.int64] = (
        np.round(azimuth * (SECTORS / (2.0 * pi))).astype(np.int64) % SECTORS
    )
    return sector


def look_around(
    scene: LiveScene, pose: Pose, azimuth: Floats, elevation: Floats, reach: float, hidden: int
) -> Seen:
    """The nearest surface along rays from `pose`, in the order of the rays.

    azimuth (n,): rad, left positive. elevation (n,): rad, up positive, within 80 deg. reach: m.
    hidden: row of the actor that no ray meets, or -1.
    """
    n = len(azimuth)
    sector = sectors_of(azimuth)
    distance, hits = np.full(n, np.inf), make_hits(n)
    for k in range(SECTORS):
        mine = np.flatnonzero(sector == k)
        if not len(mine):
            continue
        middle = k * 2.0 * pi / SECTORS
        facing = pose @ Pose(0.0, 0.0, yaw=middle)
        part, stretch = _cast_sector(
            scene, facing, azimuth[mine] - middle, elevation[mine], reach, hidden
        )
        distance[mine] = stretch / np.maximum(part.inverse, 1e-9)
        hits.inverse[mine], hits.key[mine], hits.cosine[mine] = part
    flat = np.cos(elevation)
    direction = np.stack(
        [np.cos(azimuth) * flat, np.sin(azimuth) * flat, np.sin(elevation)], axis=1
    )
    key = hits.key.astype(np.int64)
    met = (hits.inverse > 0.0) & (distance <= reach)
    return Seen(met, distance, direction, hits.cosine, key >> 8 & 0xFF, key >> 16)


def _cast_sector(
    scene: LiveScene, facing: Pose, azimuth: Floats, elevation: Floats, reach: float, hidden: int
) -> tuple[Hits, Floats]:
    """Hits of one pyramid, and each ray's length per metre along the pyramid's axis."""
    u, v = -np.tan(azimuth), -np.tan(elevation) / np.cos(azimuth)
    focal = CELLS / 2.0
    rows = 2 * ceil((float(np.abs(v).max()) + 1e-6) * focal)
    place = np.array([facing.x, facing.y, facing.z])
    view = View(CELLS, rows, focal, CELLS / 2.0, rows / 2.0, world_to_camera(facing), place)
    rays, hits = make_rays(len(u), CELLS, rows), make_hits(len(u))
    rays.column[:] = view.cx + focal * u
    rays.row[:] = view.cy + focal * v
    scene.cast(view, hidden, reach, rays, hits)
    return hits, np.sqrt(u * u + v * v + 1.0)
