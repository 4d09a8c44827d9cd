"""A rotating lidar as exact ray samples, with the class and actor that every ray met.

A turn is cut into four pyramids of 90 degrees, each cast like a radar's. Rays steeper than 80
degrees are not sent. No noise and no drop-off: intensity falls with the air's extinction only.
"""

from __future__ import annotations

from math import ceil, pi, radians, tan

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.frames import LidarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import LidarSpec
from skidpad.sensors.projection import Ints, Scratch
from skidpad.sensors.rasteriser import Actors
from skidpad.sensors.rays import cast, make_hits, make_rays
from skidpad.sensors.scene import Chunks
from skidpad.sensors.view import View, world_to_camera

CELLS = 32  # columns of cells over a sector
SECTORS = 4
STEEPEST_DEG = 80.0


class Lidar:
    """One lidar; `measure` returns the part of the turn that one tick covers."""

    def __init__(self, spec: LidarSpec, dt: float, extinction: float = 0.0) -> None:
        """extinction: of light in the air, 1/m."""
        steepest = max(abs(spec.upper_fov_deg), abs(spec.lower_fov_deg))
        if steepest > STEEPEST_DEG:
            raise ConfigError(
                f"lidar {spec.id}: vertical angles must be within +-{STEEPEST_DEG:g} deg, "
                f"got {spec.lower_fov_deg:g} to {spec.upper_fov_deg:g}"
            )
        self.spec, self._extinction = spec, extinction
        self._sweep = 2.0 * pi * spec.rotation_hz * dt
        self._columns = max(1, round(spec.points_per_second * dt / spec.channels))
        angles = np.linspace(spec.upper_fov_deg, spec.lower_fov_deg, spec.channels)
        self._elevation = np.radians(angles)
        half_height = tan(radians(steepest)) * np.sqrt(2.0) + 1e-6  # at a sector's edge
        self._focal = CELLS / 2.0
        self._rows = 2 * ceil(half_height * self._focal)

    def measure(
        self,
        tick: int,
        pose_world_carrier: Pose,
        chunks: Chunks,
        static_key: Ints,
        actors: Actors,
        hidden: int,
        scratch: Scratch,
    ) -> LidarPoints:
        """The returns of one tick. hidden: index of the carrier, or -1."""
        pose = pose_world_carrier @ self.spec.mount
        turn = -(tick * self._sweep + self._sweep * np.arange(self._columns) / self._columns)
        azimuth = (turn + pi / SECTORS) % (2.0 * pi) - pi / SECTORS
        parts = []
        for sector in range(SECTORS):
            middle = sector * 2.0 * pi / SECTORS
            here = azimuth[np.abs(azimuth - middle) <= pi / SECTORS] - middle
            if len(here):
                facing = pose @ Pose(0.0, 0.0, 0.0, yaw=middle)
                scene = (chunks, static_key, actors, hidden)
                parts.append(self._sector(here, middle, facing, scene, scratch))
        return LidarPoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _sector(
        self,
        azimuth: NDArray[np.float64],
        middle: float,
        facing: Pose,
        scene: tuple[Chunks, Ints, Actors, int],
        scratch: Scratch,
    ) -> LidarPoints:
        """Rays at (k,) azimuths, left positive from the sector's middle."""
        a, e = (g.ravel() for g in np.meshgrid(azimuth, self._elevation, indexing="ij"))
        u, v = -np.tan(a), -np.tan(e) / np.cos(a)
        view = View(
            CELLS,
            self._rows,
            self._focal,
            CELLS / 2.0,
            self._rows / 2.0,
            world_to_camera(facing),
            np.array([facing.x, facing.y, facing.z]),
        )
        rays, hits = make_rays(len(u), CELLS, self._rows), make_hits(len(u))
        rays.column[:] = view.cx + view.focal * u
        rays.row[:] = view.cy + view.focal * v
        chunks, static_key, actors, hidden = scene
        cast(chunks, static_key, actors, hidden, view, self.spec.range, scratch, rays, hits)
        stretch = np.sqrt(u * u + v * v + 1.0)
        distance = stretch / np.maximum(hits.inverse, 1e-9)
        met = (hits.inverse > 0.0) & (distance <= self.spec.range)
        d, a, e, key = distance[met], a[met] + middle, e[met], hits.key[met]
        xyz = np.stack([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)], axis=1)
        return LidarPoints(
            (xyz * d[:, None]).astype(np.float32),
            np.exp(-self._extinction * d).astype(np.float32),
            hits.cosine[met].astype(np.float32),
            (key >> 8 & 255).astype(np.uint8),
            (key >> 16).astype(np.uint16),
        )
