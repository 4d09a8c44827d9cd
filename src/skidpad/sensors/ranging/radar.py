"""A radar as exact ray samples: new random directions every tick, range rate from true motion."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.specs import RadarSpec
from skidpad.sensors.ranging.beam import Beam, direction
from skidpad.sensors.raster.live_scene import LiveScene
from skidpad.sensors.raster.rasteriser import Actors
from skidpad.sensors.raster.rays import Hits, Rays, make_hits, make_rays
from skidpad.sensors.raster.view import View, world_to_camera

CELLS = 16  # columns of cells over the horizontal field of view
MOST_ROWS = 8 * CELLS  # of cells; a narrow and tall field of view has fewer columns


class Radar:
    """One radar; `measure` once per tick."""

    def __init__(self, spec: RadarSpec, beam: Beam, range_limit: float) -> None:
        """beam: where its rays go. range_limit: m, what the weather leaves of the range."""
        self.spec, self.beam = spec, beam
        self.range = min(spec.range, range_limit)
        columns = min(float(CELLS), MOST_ROWS * beam.half_width / beam.half_height)
        self._focal = columns / (2.0 * beam.half_width)
        self._columns = max(1, ceil(columns))
        self._rows = max(1, ceil(2.0 * beam.half_height * self._focal))
        self._rays: Rays = make_rays(beam.rays, self._columns, self._rows)
        self._hits: Hits = make_hits(beam.rays)
        self._points = np.empty((4, beam.rays), dtype=np.float32)

    def view(self, pose_world_carrier: Pose) -> View:
        """Returns the view whose pyramid holds every ray of the radar."""
        pose = pose_world_carrier @ self.spec.mount
        return View(
            self._columns,
            self._rows,
            self._focal,
            self._columns / 2.0,
            self._rows / 2.0,
            world_to_camera(pose),
            np.array([pose.x, pose.y, pose.z]),
        )

    def measure(
        self, tick: int, pose_world_carrier: Pose, scene: LiveScene, carrier: int
    ) -> RadarPoints:
        """The returns of one tick. carrier: row of the actor that carries it unseen, or -1.

        The arrays stay valid until the next call.
        """
        view = self.view(pose_world_carrier)
        aim(self.beam, tick, view, self._rays)
        scene.cast(view, carrier, self.range, self._rays, self._hits)
        count = _returns(
            view,
            self._rays,
            self._hits,
            self.range,
            carrier,
            scene.motion,
            scene.actors,
            self._points,
        )
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
    carrier: int,
    motion: Floats,
    actors: Actors,
    out: NDArray[np.float32],
) -> int:
    """Write range, azimuth, altitude and range rate of all returns; say how many."""
    r = view.rotation
    count = 0
    antenna_x = antenna_y = antenna_z = 0.0
    if carrier >= 0:
        own = motion[carrier]
        antenna_x = own[0] - own[3] * (view.centre[1] - actors.position[carrier, 1])
        antenna_y = own[1] + own[3] * (view.centre[0] - actors.position[carrier, 0])
        antenna_z = own[2]
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
        vx, vy, vz = -antenna_x, -antenna_y, -antenna_z
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
