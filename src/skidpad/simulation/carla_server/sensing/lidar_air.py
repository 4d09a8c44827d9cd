"""A lidar whose beams know the air: lost and false returns, with `lidar_model` physical.

The model of returns (`sensors.ranging.lidar_returns`) takes the place of CARLA's attenuation and drop-off.
The attribute `range` is where a surface of 90 % reflectivity is just noticed in clear air.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.environment.lidar_effects import LidarEffects
from skidpad.core.maths.randomness import stream_key
from skidpad.core.vocabulary import LidarModel, RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.fog import with_fog
from skidpad.physics.grip import rain_rate, road_surface
from skidpad.physics.optics import LidarAir, lidar_air
from skidpad.physics.wetted import water_cover, window_loss
from skidpad.sensors.ranging.around import Fan, RayHits, directions, look_around
from skidpad.sensors.ranging.clouds import SprayClouds, Sprayed, no_spray
from skidpad.sensors.ranging.lidar_returns import ReturnModel, find_returns, lost_depths
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing.additions import read_addition
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

SHORTEST = 1.0  # m of range, below which no drop and no fog is far enough to be noticed


class Noticed(NamedTuple):
    """What n beams brought back, by channel."""

    channel: Ints  # (n,)
    direction: Floats  # (n, 3) unit vectors in the sensor's frame: forward, left, up
    distance: Floats  # (n,) m
    intensity: Floats  # (n,) 0 to 1


def make_returns(actor: Actor, reach: float, seed: int) -> Returns | None:
    """Returns the returns of a physical lidar, None for any other; WireError for unusable attributes.

    reach: m, its range.
    """
    made = Returns(actor, reach, seed)
    if read_addition(actor, "lidar_model") is not LidarModel.PHYSICAL:
        return None
    if reach < SHORTEST:
        raise wire.WireError(
            f"{actor.blueprint.id}: range must be at least {SHORTEST:g} m with lidar_model physical, "
            f"got {reach:g}"
        )
    return made


class Returns:
    """The returns of one lidar; `scan` once per reading."""

    def __init__(self, actor: Actor, reach: float, seed: int) -> None:
        """reach: m. seed: of the server. WireError for attributes that cannot be used."""
        self._reach, self._reading = reach, 0
        self._feels_air = read_addition(actor, "range_model") is RangeModel.PHYSICAL
        names = {"fog": "lidar_fog", "wet_ground": "lidar_wet_ground", "dirt": "lidar_dirt"}
        names |= {"drops_s": "lidar_drops_s"}
        told = {field: read_addition(actor, name) for field, name in names.items()}
        self._effects = LidarEffects(**{k: v for k, v in told.items() if v is not None})
        self._sprays = bool(read_addition(actor, "spray"))
        self._key = np.uint64(stream_key(seed, "lidar", actor.attributes.get("noise_seed", "0")))
        self._weather: Weather | None = None

    def _look_out(self, weather: Weather) -> None:
        """Makes the model of returns for a weather."""
        self._weather = weather
        air = with_fog(lidar_air(weather), self._effects.fog) if self._feels_air else LidarAir()
        self._film = road_surface(weather).film_mm
        covered = water_cover(self._film) if self._effects.wet_ground else 0.0
        self._model = ReturnModel(air, self._reach, covered)

    def scan(
        self, around: Surroundings, sensor: Actor, azimuth: Floats, elevation: Floats
    ) -> Noticed:
        """Returns what is noticed along (m,) azimuths, left positive, and (c,) elevations in rad."""
        self._reading += 1
        weather = around.weather
        if self._weather is not weather:
            self._look_out(weather)
        column, channel = np.divmod(np.arange(len(azimuth) * len(elevation)), len(elevation))
        fan, pose = Fan(azimuth, elevation, column, channel), around.actors.pose(sensor)
        seen = look_around(around.picture().live, pose, fan, self._reach, around.hidden_for(sensor))
        n = len(column)
        distance, label, cosine = np.full(n, np.inf), np.zeros(n, np.int64), np.zeros(n)
        distance[seen.ray], label[seen.ray] = seen.distance, seen.label
        cosine[seen.ray] = seen.cosine
        speed, effects = around.speed_of_carrier(sensor), self._effects
        window = window_loss(effects.dirt, rain_rate(weather), speed, effects.drops_s)
        spray = self._meet_spray(around, sensor, fan, seen, window)
        found = find_returns(
            self._model.air, distance, label, cosine, window, self._key, self._reading, spray
        )
        ray = np.flatnonzero(found.distance < np.inf)
        ray = ray[np.argsort(channel[ray], kind="stable")]
        intensity = np.minimum(found.intensity[ray], 1.0)
        return Noticed(channel[ray], directions(fan, ray), found.distance[ray], intensity)

    def _meet_spray(
        self, around: Surroundings, sensor: Actor, fan: Fan, seen: RayHits, window: float
    ) -> Sprayed:
        """Returns what the clouds behind vehicles do to the beams of a reading."""
        if not self._sprays:
            return no_spray()
        scene, n, least = around.picture(), len(fan.column), self._model.least / window
        distance = np.full(n, self._reach)
        distance[seen.ray] = seen.distance
        air = self._model.air
        lost = lost_depths(air, seen.ray, seen.distance, seen.label, least, n)
        return SprayClouds(scene.bodies, self._film / 1000.0).of_beams(
            scene.states, around.actors.pose(sensor), fan.azimuth, fan.elevation, distance, lost,
            least, self._key, self._reading,
        )  # fmt: skip
