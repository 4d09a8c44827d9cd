"""A radar as exact ray samples: new random directions every tick, range rate from true motion."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.jit import kernel
from skidpad.core.specs import RadarSpec
from skidpad.sensors.beam import Beam, beam_of, direction
from skidpad.sensors.projection import Floats, Ints, Scratch
from skidpad.sensors.rasteriser import Actors
from skidpad.sensors.rays import Hits, Rays, cast, make_hits, make_rays
from skidpad.sensors.scene import Chunks
from skidpad.sensors.view import View, world_to_camera

CELLS = 16  # columns of cells over the horizontal field of view


class Radar:
    """One radar with its own random stream; `measure` once per tick."""

    def __init__(self, spec: RadarSpec, seed: int, dt: float, range_limit: float) -> None:
        """range_limit: m, what the weather leaves of the nominal range."""
        self.spec = spec
        self.range = min(spec.range, range_limit)
        self.beam = beam_of(spec, seed, dt)
        self._focal = CELLS / (2.0 * self.beam.half_width)
        self._rows = max(1, ceil(2.0 * self.beam.half_height * self._focal))
        self._rays: Rays = make_rays(self.beam.rays, CELLS, self._rows)
        self._hits: Hits = make_hits(self.beam.rays)
        self._points = np.empty((4, self.beam.rays), dtype=np.float32)

    def view(self, pose_world_ego: Pose) -> View:
        """The pyramid that holds every ray."""
        pose = pose_world_ego @ self.spec.mount
        return View(
            CELLS,
            self._rows,
            self._focal,
            CELLS / 2.0,
            self._rows / 2.0,
            world_to_camera(pose),
            np.array([pose.x, pose.y, pose.z]),
        )

    def measure(
        self,
        tick: int,
        pose_world_ego: Pose,
        motion: Floats,
        chunks: Chunks,
        static_key: Ints,
        actors: Actors,
        scratch: Scratch,
    ) -> RadarPoints:
        """The returns of one tick. motion: (n, 4) vx, vy, vz in m/s and yaw rate of the actors.

        The arrays stay valid until the next call.
        """
        view = self.view(pose_world_ego)
        aim(self.beam, tick, view, self._rays)
        cast(chunks, static_key, actors, 0, view, self.range, scratch, self._rays, self._hits)
        count = _returns(view, self._rays, self._hits, self.range, motion, actors, self._points)
        return RadarPoints(*(row[:count] for row in self._points))


@kernel
def aim(beam: Beam, tick: int, view: View, rays: Rays) -> None:
    """Point the rays where the beam looks in this tick."""
    for i in range(rays.column.size):
        right, down = direction(beam, tick, i)
        rays.column[i] = view.cx + view.focal * right
        rays.row[i] = view.cy + view.focal * down


@kernel
def _returns(
    view: View,
    rays: Rays,
    hits: Hits,
    max_range: float,
    motion: Floats,
    actors: Actors,
    out: NDArray[np.float32],
) -> int:
    """Write range, azimuth, altitude and range rate of all returns; say how many."""
    r = view.rotation
    count = 0
    arm = view.centre - actors.position[0]
    antenna_x = motion[0, 0] - motion[0, 3] * arm[1]
    antenna_y = motion[0, 1] + motion[0, 3] * arm[0]
    for i in range(rays.column.size):
        if hits.inverse[i] <= 0.0:
            continue
        u = (rays.column[i] - view.cx) / view.focal
        v = (rays.row[i] - view.cy) / view.focal
        stretch = np.sqrt(u * u + v * v + 1.0)
        distance = stretch / hits.inverse[i]
        if distance > max_range:
            continue
        dx = (r[0, 0] * u + r[1, 0] * v + r[2, 0]) / stretch
        dy = (r[0, 1] * u + r[1, 1] * v + r[2, 1]) / stretch
        dz = (r[0, 2] * u + r[1, 2] * v + r[2, 2]) / stretch
        vx, vy, vz = -antenna_x, -antenna_y, -motion[0, 2]
        n = (hits.key[i] >> 16) - 1
        if n >= 0:
            px = view.centre[0] + distance * dx - actors.position[n, 0]
            py = view.centre[1] + distance * dy - actors.position[n, 1]
            vx += motion[n, 0] - motion[n, 3] * py
            vy += motion[n, 1] + motion[n, 3] * px
            vz += motion[n, 2]
        out[0, count] = distance
        out[1, count] = np.arctan2(-u, 1.0)
        out[2, count] = np.arctan2(-v, np.sqrt(u * u + 1.0))
        out[3, count] = vx * dx + vy * dy + vz * dz
        count += 1
    return count
