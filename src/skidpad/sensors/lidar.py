"""A rotating lidar as exact ray samples, with the class and actor that every ray met.

No noise and no drop-off: intensity falls with the air's extinction only.
"""

from __future__ import annotations

from math import pi

import numpy as np

from skidpad.core.errors import ConfigError
from skidpad.core.frames import LidarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import LidarSpec
from skidpad.sensors.around import SECTORS, STEEPEST_DEG, Fan, look_around, sectors_of
from skidpad.sensors.live_scene import LiveScene


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

    def measure(
        self, tick: int, pose_world_carrier: Pose, scene: LiveScene, carrier: int
    ) -> LidarPoints:
        """The returns of one tick. carrier: row of the actor that carries it unseen, or -1."""
        turn = -(tick * self._sweep + self._sweep * np.arange(self._columns) / self._columns)
        azimuth = (turn + pi / SECTORS) % (2.0 * pi) - pi / SECTORS
        azimuth = azimuth[np.argsort(sectors_of(azimuth), kind="stable")]
        columns, channels = len(azimuth), len(self._elevation)
        column, channel = np.divmod(np.arange(columns * channels), channels)
        fan = Fan(azimuth, self._elevation, column, channel)
        pose = pose_world_carrier @ self.spec.mount
        seen = look_around(scene, pose, fan, self.spec.range, carrier)
        return LidarPoints(
            (seen.direction * seen.distance[:, None]).astype(np.float32),
            np.exp(-self._extinction * seen.distance).astype(np.float32),
            seen.cosine.astype(np.float32),
            seen.label.astype(np.uint8),
            seen.instance.astype(np.uint16),
        )
