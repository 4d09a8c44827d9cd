"""A rotating lidar as exact ray samples, with the class and actor that every ray met.

Without a model of returns there is no noise and no drop-off: intensity falls with the air's extinction
only, one way, as with CARLA's `atmosphere_attenuation_rate`. With one (`lidar_returns`) that law is
replaced, never applied beside it: intensity falls with reflectivity and the extinction of both ways,
which is CARLA's law at twice the rate, and a threshold takes the place of CARLA's drop-off.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.frames import LidarPoints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.specs import LidarSpec
from skidpad.core.states import ActorStates
from skidpad.sensors.ranging.around import (
    SECTORS,
    STEEPEST_DEG,
    Fan,
    RayHits,
    look_around,
    sectors_of,
)
from skidpad.sensors.ranging.clouds import SprayClouds, Sprayed, no_spray
from skidpad.sensors.ranging.lidar_returns import BeamAir, ReturnModel, find_returns, lost_depths
from skidpad.sensors.raster.live_scene import LiveScene


def clean(speed: float) -> float:
    """Returns the share of power that a clean window leaves: all of it."""
    del speed
    return 1.0


class Lidar:
    """One lidar; `measure` returns the part of the turn that one tick covers."""

    def __init__(
        self,
        spec: LidarSpec,
        dt: float,
        extinction: float = 0.0,
        returns: ReturnModel | None = None,
        key: int = 0,
        spray: SprayClouds | None = None,
        window: Callable[[float], float] = clean,
    ) -> None:
        """extinction: of light in the air, 1/m. returns: instead of it. key: of their random numbers.

        spray: behind vehicles, with `returns`. window: share of power left, by speed in m/s; likewise.
        """
        steepest = max(abs(spec.upper_fov_deg), abs(spec.lower_fov_deg))
        if steepest > STEEPEST_DEG:
            raise ConfigError(
                f"lidar {spec.id}: vertical angles must be within +-{STEEPEST_DEG:g} deg, "
                f"got {spec.lower_fov_deg:g} to {spec.upper_fov_deg:g}"
            )
        self.spec, self._extinction = spec, extinction
        self._returns, self._key, self._spray, self._window = returns, key, spray, window
        self._sweep = 2.0 * pi * spec.rotation_hz * dt
        self._columns = max(1, round(spec.points_per_second * dt / spec.channels))
        angles = np.linspace(spec.upper_fov_deg, spec.lower_fov_deg, spec.channels)
        self._elevation = np.radians(angles)

    def measure(
        self,
        tick: int,
        pose_world_carrier: Pose,
        scene: LiveScene,
        carrier: int,
        states: ActorStates | None = None,
    ) -> LidarPoints:
        """Returns the points of one tick.

        carrier: row of the actor that carries it unseen, or -1. states: of all, for spray and window.
        """
        turn = -(tick * self._sweep + self._sweep * np.arange(self._columns) / self._columns)
        azimuth = (turn + pi / SECTORS) % (2.0 * pi) - pi / SECTORS
        azimuth = azimuth[np.argsort(sectors_of(azimuth), kind="stable")]
        columns, channels = len(azimuth), len(self._elevation)
        column, channel = np.divmod(np.arange(columns * channels), channels)
        fan = Fan(azimuth, self._elevation, column, channel)
        pose = pose_world_carrier @ self.spec.mount
        seen = look_around(scene, pose, fan, self.spec.range, carrier)
        if self._returns is not None:
            speed = (
                0.0 if states is None else float(np.hypot(states.vx[carrier], states.vy[carrier]))
            )
            window, spray = self._window(speed), no_spray()
            if self._spray is not None and states is not None:
                least = self._returns.least / window
                spray = self._meet_spray(
                    self._spray, self._returns, states, pose, fan, seen, tick, least
                )
            return self._through_weather(self._returns, fan, seen, tick, spray, window)
        return LidarPoints(
            (seen.direction * seen.distance[:, None]).astype(np.float32),
            np.exp(-self._extinction * seen.distance).astype(np.float32),
            seen.cosine.astype(np.float32),
            seen.label.astype(np.uint8),
            seen.instance.astype(np.uint16),
        )

    def _meet_spray(
        self,
        clouds: SprayClouds,
        model: ReturnModel,
        states: ActorStates,
        eye: Pose,
        fan: Fan,
        seen: RayHits,
        tick: int,
        least: float,
    ) -> Sprayed:
        """Returns what spray does to every beam of a tick; least: power that is just noticed."""
        distance = np.full(len(fan.column), self.spec.range)
        distance[seen.ray] = seen.distance
        lost = lost_depths(model.air, seen.ray, seen.distance, seen.label, least, len(distance))
        return clouds.of_beams(
            states,
            eye,
            fan.azimuth,
            fan.elevation,
            distance,
            lost,
            least,
            np.uint64(self._key),
            tick,
        )

    def _through_weather(
        self,
        model: ReturnModel,
        fan: Fan,
        seen: RayHits,
        tick: int,
        spray: Sprayed,
        window: float,
    ) -> LidarPoints:
        """Returns what is noticed of the beams of a tick; false returns have class 0 and no actor."""
        n = len(fan.column)
        out = LidarPoints(
            np.empty((n, 3), np.float32), np.empty(n, np.float32), np.empty(n, np.float32),
            np.empty(n, np.uint8), np.empty(n, np.uint16),
        )  # fmt: skip
        aside = np.column_stack([np.cos(fan.azimuth), np.sin(fan.azimuth)])
        up = np.column_stack([np.cos(fan.elevation), np.sin(fan.elevation)])
        m = scan_weather(
            model.air, fan, seen, aside, up, np.uint64(self._key), tick, out, spray, window
        )
        return LidarPoints._make(column[:m] for column in out)


@kernel
def scan_weather(
    air: BeamAir, fan: Fan, seen: RayHits, aside: Floats, up: Floats, key: np.uint64, tick: int,
    out: LidarPoints, spray: Sprayed, window: float,
) -> int:  # fmt: skip
    """Writes the beams of a tick of which something came back into `out`; returns their number.

    aside, up: cosine and sine of the fan's azimuths and elevations.
    """
    distance, label = np.full(fan.column.size, np.inf), np.zeros(fan.column.size, np.int64)
    cosine = np.zeros(fan.column.size)
    for k in range(seen.ray.size):
        distance[seen.ray[k]], label[seen.ray[k]] = seen.distance[k], seen.label[k]
        cosine[seen.ray[k]] = seen.cosine[k]
    found = find_returns(air, distance, label, cosine, window, key, tick, spray)
    m, k = 0, 0
    for i in range(distance.size):
        met = distance[i] < np.inf
        far = found.distance[i]
        if far < np.inf:
            column, channel = fan.column[i], fan.channel[i]
            out.xyz[m, 0] = aside[column, 0] * up[channel, 0] * far
            out.xyz[m, 1] = aside[column, 1] * up[channel, 0] * far
            out.xyz[m, 2] = up[channel, 1] * far
            out.intensity[m] = min(found.intensity[i], 1.0)
            real = not found.false[i]
            out.cosine[m] = seen.cosine[k] if real else 0.0
            out.label[m] = label[i] if real else 0
            out.instance[m] = seen.instance[k] if real else 0
            m += 1
        k += met
    return m
