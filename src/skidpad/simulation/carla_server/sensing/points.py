"""Radar and lidar: exact rays against the scene, with CARLA's directions, noise and encodings."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import radians, tan

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import angles_to_carla, vectors_to_carla
from skidpad.core.maths.randomness import stream_key
from skidpad.core.specs import RadarSpec
from skidpad.core.vocabulary import RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.optics import extinction, radar_range
from skidpad.sensors.ranging.around import STEEPEST_DEG, Fan, RayHits, look_around
from skidpad.sensors.ranging.beam import Beam
from skidpad.sensors.ranging.radar import Radar
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing.additions import read_addition
from skidpad.simulation.carla_server.sensing.echoes import Echoes, make_echoes
from skidpad.simulation.carla_server.sensing.lidar_air import Returns, make_returns
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

MAX_POINTS = 2_000_000  # per second and sensor
MAX_CHANNELS = 256
SEMANTIC_POINT = np.dtype(
    [("place", "<f4", 3), ("cosine", "<f4"), ("actor", "<u4"), ("tag", "<u4")]
)


def alone(_: Surroundings, sensor: Sensor) -> int:
    """Returns what no other sensor looks at: its rays are its own."""
    return sensor.actor.id


@dataclass(slots=True, eq=False)
class RadarMake:
    """A radar as its attributes describe it."""

    spec: RadarSpec
    key: np.uint64
    feels_air: bool
    echoes: Echoes | None  # None: it returns what its rays meet
    readings: int = 0
    radar: Radar | None = None  # for the present number of rays per reading

    def with_rays(self, n: int, weather: Weather) -> Radar:
        """Returns the radar that sends n rays per reading; made anew when n changes."""
        reach = self.spec.range
        if self.radar is None or self.radar.beam.rays != n:
            half_width = tan(radians(self.spec.horizontal_fov_deg / 2.0))
            half_height = tan(radians(self.spec.vertical_fov_deg / 2.0))
            self.radar = Radar(self.spec, Beam(self.key, n, half_width, half_height), reach)
        self.radar.range = radar_range(weather, reach) if self.feels_air else reach
        return self.radar


def make_radar(actor: Actor, seed: int) -> RadarMake:
    """Returns a radar made from an actor's attributes; WireError when they are unusable."""
    a = actor.attributes
    spec = RadarSpec(
        str(actor.id),
        Pose(0.0, 0.0),
        float(a["horizontal_fov"]),
        float(a["vertical_fov"]),
        float(a["range"]),
        wire.integer(int(a["points_per_second"]), "points_per_second", 0, MAX_POINTS),
    )
    for name, value in (
        ("horizontal_fov", spec.horizontal_fov_deg),
        ("vertical_fov", spec.vertical_fov_deg),
    ):
        if not 0.1 <= value <= 170.0:
            raise wire.WireError(f"radar {name} must be between 0.1 and 170 deg, got {value:g}")
    key = np.uint64(stream_key(seed, "radar", a["noise_seed"]))
    feels_air = read_addition(actor, "range_model") is RangeModel.PHYSICAL
    return RadarMake(spec, key, feels_air, make_echoes(actor, spec, seed))


def radar(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one message: velocity in m/s, azimuth and altitude in rad, depth in m of every return.

    It is empty where a reading has no ray; a physical radar has cells instead.
    """
    make: RadarMake = sensor.equipment
    actor, share = sensor.actor, sensor.share(clock)
    n = int(make.spec.points_per_second * share)
    if n == 0 and make.echoes is None:
        return [(b"",)]
    make.readings += 1
    if make.echoes is not None:
        seen = make.echoes.measure(around, actor, make.readings, share)
    else:
        carrier, pose = around.carrier_row(actor), around.actors.pose(actor)
        radar = make.with_rays(n, around.weather)
        seen = radar.measure(make.readings, pose, around.picture().live, carrier)
    azimuth = angles_to_carla(seen.azimuth.astype(np.float64))
    columns = (seen.velocity, azimuth, seen.altitude, seen.range)
    return [(np.column_stack(columns).astype("<f4").tobytes(),)]


@dataclass(slots=True, eq=False)
class LidarMake:
    """A lidar's attributes and where its head points."""

    elevations: Floats  # rad, of the channels, top down
    range: float  # m
    rate: int  # points per second
    rotation_hz: float
    fov: float  # deg, horizontal
    feels_air: bool
    returns: Returns | None  # None: every surface returns, by CARLA's law
    angle: float = 0.0  # deg, within the field of view

    def turn(self, dt: float) -> Floats:
        """Turns the head by dt s and returns (n,) azimuths in rad of what it swept, left positive.

        CARLA's lidars turn right.
        """
        n = round(self.rate * dt / len(self.elevations))
        swept, start = self.rotation_hz * self.fov * dt, self.angle
        self.angle = (self.angle + swept) % self.fov if self.fov > 0.0 else 0.0
        steps = start + swept / max(n, 1) * np.arange(n)
        return angles_to_carla(np.radians(steps % self.fov - self.fov / 2.0))

    def head(self, channel: NDArray[np.int64]) -> bytes:
        """Returns the message's beginning: angle of the head and points by channel.

        channel (n,): of the points that are sent.
        """
        counts = np.bincount(channel, minlength=len(self.elevations)).astype("<u4")
        return struct.pack("<fI", radians(self.angle), len(counts)) + counts.tobytes()


def make_lidar(actor: Actor, seed: int) -> LidarMake:
    """Returns a lidar made from an actor's attributes; WireError when they are unusable."""
    a = actor.attributes
    channels = wire.integer(int(a["channels"]), "channels", 1, MAX_CHANNELS)
    degrees = np.linspace(float(a["upper_fov"]), float(a["lower_fov"]), channels)
    reach = float(a["range"])
    return LidarMake(
        np.radians(np.clip(degrees, -STEEPEST_DEG, STEEPEST_DEG)),
        reach,
        wire.integer(int(a["points_per_second"]), "points_per_second", 0, MAX_POINTS),
        float(a["rotation_frequency"]),
        float(a["horizontal_fov"]),
        read_addition(actor, "range_model") is RangeModel.PHYSICAL,
        make_returns(actor, reach, seed),
    )


@dataclass(frozen=True, slots=True)
class _Scan:
    """The returns of a tick."""

    channel: NDArray[np.int64]
    seen: RayHits

    def places(self, distance: Floats) -> Floats:
        """Returns (n, 3) m in the sensor's frame, CARLA's axes, of the returns at (n,) distances."""
        return vectors_to_carla(*(self.seen.direction * distance[:, None]).T)


def _scan(around: Surroundings, clock: Clock, sensor: Sensor, drop_off: float) -> _Scan:
    """Returns the returns of one reading's share of the sweep; a share `drop_off` of rays is not sent."""
    make: LidarMake = sensor.equipment
    azimuth = make.turn(sensor.share(clock))
    sent = np.ones((len(make.elevations), len(azimuth)), dtype=np.bool_)
    if drop_off > 0.0:
        sent = sensor.rng.random(sent.shape) >= drop_off
    channel, column = np.nonzero(sent)
    seen = look_around(
        around.picture().live,
        around.actors.pose(sensor.actor),
        Fan(azimuth, make.elevations, column, channel),
        make.range,
        around.hidden_for(sensor.actor),
    )
    return _Scan(channel[seen.ray], seen)


def plain_lidar(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns x, y, z, intensity of what is left after drop-off, with noise along the ray, as a message."""
    make: LidarMake = sensor.equipment
    if make.returns is not None:
        return _scan_air(around, clock, sensor, make.returns)
    scan = _scan(around, clock, sensor, sensor.number("dropoff_general_rate"))
    limit, zero = sensor.number("dropoff_intensity_limit"), sensor.number("dropoff_zero_intensity")
    distance = scan.seen.distance
    rate = sensor.number("atmosphere_attenuation_rate")
    if make.feels_air:
        rate = extinction(around.weather)
    intensity = np.exp(-rate * distance)
    share = np.where(intensity > limit, 1.0, zero / max(limit, 1e-9) * intensity + 1.0 - zero)
    kept = sensor.rng.random(len(distance)) < share
    distance = with_noise(sensor, distance)
    points = np.empty((len(distance), 4), dtype="<f4")
    points[:, :3], points[:, 3] = scan.places(distance), intensity
    return [(make.head(scan.channel[kept]), points[kept].tobytes())]


def with_noise(sensor: Sensor, distance: Floats) -> Floats:
    """Returns distances in m with the sensor's `noise_stddev` along the ray."""
    noise = sensor.number("noise_stddev")
    return distance + sensor.rng.normal(0.0, noise, len(distance)) if noise > 0.0 else distance


def _scan_air(
    around: Surroundings, clock: Clock, sensor: Sensor, returns: Returns
) -> list[Message]:
    """Returns x, y, z, intensity of what a physical lidar notices, with noise along the ray, as a message."""
    make: LidarMake = sensor.equipment
    azimuth = make.turn(sensor.share(clock))
    found = returns.scan(around, sensor.actor, azimuth, make.elevations)
    distance = with_noise(sensor, found.distance)
    points = np.empty((len(distance), 4), dtype="<f4")
    points[:, :3] = vectors_to_carla(*(found.direction * distance[:, None]).T)
    points[:, 3] = found.intensity
    return [(make.head(found.channel), points.tobytes())]


def semantic_lidar(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns x, y, z, cosine of incidence, actor id and tag of all returns as a message."""
    scan = _scan(around, clock, sensor, 0.0)
    seen = scan.seen
    out = np.zeros(len(seen.distance), dtype=SEMANTIC_POINT)
    out["place"] = scan.places(seen.distance)
    out["cosine"] = seen.cosine
    out["actor"] = around.picture().ids[seen.instance]
    out["tag"] = seen.label
    return [(sensor.equipment.head(scan.channel), out.tobytes())]
