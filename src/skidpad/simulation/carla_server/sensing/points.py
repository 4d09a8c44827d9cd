"""Radar and lidar: exact rays against the scene, with CARLA's directions, noise and encodings.

Rays of a sensor lie in pyramids: one for a radar, four of 90 degrees for a lidar.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import ceil, pi, radians, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.lefthanded import angles_to_carla, vectors_to_carla
from skidpad.core.randomness import stream_key
from skidpad.sensors.beam import Beam
from skidpad.sensors.radar import aim
from skidpad.sensors.rays import cast, make_hits, make_rays
from skidpad.sensors.view import View, world_to_camera
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.sensing.scene import Scene

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.sensing.sensors import Sensor
    from skidpad.simulation.carla_server.world import World

Floats = NDArray[np.float64]
Messages = list[tuple[bytes | memoryview, ...]]
CELLS = 32  # columns of cells in a pyramid
MAX_POINTS = 2_000_000  # per second and sensor
MAX_CHANNELS = 256
STEEPEST = radians(80.0)  # of a lidar's rays
SECTORS = 4


@dataclass(frozen=True, slots=True)
class Met:
    """What n rays met."""

    hit: NDArray[np.bool_]
    distance: Floats  # m
    unit: Floats  # (n, 3) directions in the sensor's frame: forward, left, up
    row: NDArray[np.int64]  # of the scene, -1 for the map
    label: NDArray[np.int64]
    cosine: Floats


def _pyramid(pose: Pose, half_width: float, half_height: float) -> View:
    focal = CELLS / (2.0 * half_width)
    rows = max(1, min(4 * CELLS, ceil(2.0 * half_height * focal)))
    return View(
        CELLS,
        rows,
        focal,
        CELLS / 2.0,
        half_height * focal,
        world_to_camera(pose),
        np.array([pose.x, pose.y, pose.z]),
    )


def _shoot(scene: Scene, view: View, hidden: int, reach: float, u: Floats, v: Floats) -> Met:
    """Rays through slopes u (right) and v (down) of a pyramid."""
    rays, hits = make_rays(len(u), view.width, view.height), make_hits(len(u))
    rays.column[:] = view.cx + view.focal * u
    rays.row[:] = view.cy + view.focal * v
    cast(
        scene.static.chunks,
        scene.keys,
        scene.actors,
        hidden,
        view,
        reach,
        scene.scratch,
        rays,
        hits,
    )
    stretch = np.sqrt(u * u + v * v + 1.0)
    with np.errstate(divide="ignore"):
        distance = np.where(hits.inverse > 0.0, stretch / hits.inverse, np.inf)
    unit = np.column_stack((1.0 / stretch, -u / stretch, -v / stretch))
    key = hits.key.astype(np.int64)
    return Met(distance <= reach, distance, unit, (key >> 16) - 1, (key >> 8) & 0xFF, hits.cosine)


@dataclass(frozen=True, slots=True)
class RadarMake:
    """A radar's attributes."""

    half_width: float  # tangents of half the fields of view
    half_height: float
    range: float  # m
    rate: int  # points per second
    key: np.uint64


def make_radar(actor: Actor, seed: int) -> RadarMake:
    """From an actor's attributes."""
    a = actor.attributes
    horizontal, vertical = float(a["horizontal_fov"]), float(a["vertical_fov"])
    for name, value in (("horizontal_fov", horizontal), ("vertical_fov", vertical)):
        if not 0.1 <= value <= 170.0:
            raise wire.WireError(f"radar {name} must be between 0.1 and 170 deg, got {value:g}")
    return RadarMake(
        tan(radians(horizontal / 2.0)),
        tan(radians(vertical / 2.0)),
        float(a["range"]),
        wire.integer(int(a["points_per_second"]), "points_per_second", 0, MAX_POINTS),
        np.uint64(stream_key(seed, "radar", a["noise_seed"], actor.id)),
    )


def radar(world: World, sensor: Sensor) -> Messages:
    """Velocity, azimuth, altitude, depth of every return."""
    make: RadarMake = sensor.state
    scene = world.sensors.scene(world)
    pose = world.pose(sensor.actor)
    n = int(make.rate * max(world.episode.settings.step, sensor.period))
    if n == 0:
        return [(b"",)]
    view = _pyramid(pose, make.half_width, make.half_height)
    rays = make_rays(n, view.width, view.height)
    beam = Beam(make.key, n, make.half_width, make.half_height)
    aim(beam, world.episode.frame, view, rays)
    u, v = (rays.column - view.cx) / view.focal, (rays.row - view.cy) / view.focal
    carrier = scene.rows.get(sensor.actor.parent, -1)
    met = _shoot(scene, view, carrier, make.range, u, v)
    rate = _range_rate(scene, met, pose, carrier)
    out = np.column_stack(
        (
            rate,
            angles_to_carla(np.arctan2(met.unit[:, 1], met.unit[:, 0])),
            np.arcsin(np.clip(met.unit[:, 2], -1.0, 1.0)),
            met.distance,
        )
    )
    return [(out[met.hit].astype("<f4").tobytes(),)]


def _range_rate(scene: Scene, met: Met, pose: Pose, carrier: int) -> Floats:
    """(n,) m/s along the rays, negative closing."""
    along = met.unit @ pose.rotation().T
    velocity = np.zeros((len(along), 3))
    distance = np.where(met.hit, met.distance, 0.0)
    place = np.array([pose.x, pose.y, pose.z]) + along * distance[:, None]
    seen = met.row >= 0
    rows = met.row[seen]
    arm = place[seen] - scene.actors.position[rows]
    motion = scene.motion[rows]
    velocity[seen, 0] = motion[:, 0] - motion[:, 3] * arm[:, 1]
    velocity[seen, 1] = motion[:, 1] + motion[:, 3] * arm[:, 0]
    velocity[seen, 2] = motion[:, 2]
    if carrier >= 0:
        own = scene.motion[carrier]
        lever = np.array([pose.x, pose.y, pose.z]) - scene.actors.position[carrier]
        velocity -= (own[0] - own[3] * lever[1], own[1] + own[3] * lever[0], own[2])
    rate: Floats = np.einsum("ij,ij->i", velocity, along)
    return rate


@dataclass(slots=True, eq=False)
class LidarMake:
    """A lidar's attributes and where its head points."""

    elevations: Floats  # rad, of the channels, top down
    range: float  # m
    rate: int  # points per second
    rotation_hz: float
    fov: float  # deg, horizontal
    semantic: bool
    angle: float = 0.0  # deg, within the field of view


def make_lidar(actor: Actor) -> LidarMake:
    """From an actor's attributes."""
    a = actor.attributes
    channels = wire.integer(int(a["channels"]), "channels", 1, MAX_CHANNELS)
    upper, lower = float(a["upper_fov"]), float(a["lower_fov"])
    elevations = np.radians(np.linspace(upper, lower, channels))
    return LidarMake(
        np.clip(elevations, -STEEPEST, STEEPEST),
        float(a["range"]),
        wire.integer(int(a["points_per_second"]), "points_per_second", 0, MAX_POINTS),
        float(a["rotation_frequency"]),
        float(a["horizontal_fov"]),
        actor.blueprint.id.endswith("semantic"),
    )


def lidar(world: World, sensor: Sensor) -> Messages:
    """One tick's share of the sweep."""
    make: LidarMake = sensor.state
    dt = max(world.episode.settings.step, sensor.period)
    channels = len(make.elevations)
    per_channel = round(make.rate * dt / channels)
    swept = make.rotation_hz * make.fov * dt
    start = make.angle
    make.angle = (make.angle + swept) % make.fov if make.fov > 0.0 else 0.0
    steps = start + swept / max(per_channel, 1) * np.arange(per_channel)
    azimuths = np.radians(steps % make.fov - make.fov / 2.0)  # right positive, as CARLA sweeps
    fired = np.ones((channels, per_channel), dtype=np.bool_)
    if not make.semantic:
        general = sensor.number("dropoff_general_rate")
        if general > 0.0:
            fired = sensor.rng.random(fired.shape) >= general
    channel, column = np.nonzero(fired)
    met = _sweep(world, sensor, make, azimuths[column], make.elevations[channel])
    return (
        _semantic(world, make, channel, met)
        if make.semantic
        else _plain(sensor, make, channel, met)
    )


def _sweep(
    world: World, sensor: Sensor, make: LidarMake, azimuth: Floats, elevation: Floats
) -> Met:
    """Rays given by azimuth (right positive) and elevation, through four pyramids."""
    scene, pose = world.sensors.scene(world), world.pose(sensor.actor)
    hidden = scene.hidden_for(world, sensor.actor)
    n = len(azimuth)
    hit, distance = np.zeros(n, dtype=np.bool_), np.full(n, np.inf)
    unit, cosine = np.zeros((n, 3)), np.zeros(n)
    row, label = np.full(n, -1, dtype=np.int64), np.zeros(n, dtype=np.int64)
    sector = np.round(azimuth / (pi / 2.0)).astype(np.int64) % SECTORS
    half_height = tan(float(np.abs(make.elevations).max()) + 1e-3) * sqrt(2.0)
    for k in range(SECTORS):
        chosen = np.flatnonzero(sector == k)
        if not len(chosen):
            continue
        turned = pose @ Pose(0.0, 0.0, yaw=-k * pi / 2.0)
        inner = azimuth[chosen] - k * pi / 2.0
        u = np.tan(np.arctan2(np.sin(inner), np.cos(inner)))
        v = -np.tan(elevation[chosen]) * np.sqrt(1.0 + u * u)
        met = _shoot(scene, _pyramid(turned, 1.0 + 1e-6, half_height), hidden, make.range, u, v)
        back = Pose(0.0, 0.0, yaw=-k * pi / 2.0).rotation()
        hit[chosen], distance[chosen] = met.hit, met.distance
        unit[chosen] = met.unit @ back.T
        row[chosen], label[chosen], cosine[chosen] = met.row, met.label, met.cosine
    return Met(hit, distance, unit, row, label, cosine)


def _head(make: LidarMake, counts: NDArray[np.int64]) -> bytes:
    return struct.pack("<fI", radians(make.angle), len(counts)) + counts.astype("<u4").tobytes()


def _plain(sensor: Sensor, make: LidarMake, channel: NDArray[np.int64], met: Met) -> Messages:
    """x, y, z, intensity of what is left after drop-off, with noise along the ray."""
    attenuation = sensor.number("atmosphere_attenuation_rate")
    limit = sensor.number("dropoff_intensity_limit")
    zero = sensor.number("dropoff_zero_intensity")
    noise = sensor.number("noise_stddev")
    hit = np.flatnonzero(met.hit)
    distance = met.distance[hit]
    intensity = np.exp(-attenuation * distance)
    kept_share = np.where(intensity > limit, 1.0, zero / max(limit, 1e-9) * intensity + 1.0 - zero)
    kept = sensor.rng.random(len(hit)) < kept_share
    if noise > 0.0:
        distance = distance + sensor.rng.normal(0.0, noise, len(hit))
    points = vectors_to_carla(*(met.unit[hit] * distance[:, None])[kept].T)
    counts = np.bincount(channel[hit][kept], minlength=len(make.elevations))
    body = np.column_stack((points, intensity[kept])).astype("<f4").tobytes()
    return [(_head(make, counts), body)]


SEMANTIC_POINT = np.dtype(
    [("place", "<f4", 3), ("cosine", "<f4"), ("actor", "<u4"), ("tag", "<u4")]
)


def _semantic(world: World, make: LidarMake, channel: NDArray[np.int64], met: Met) -> Messages:
    """x, y, z, cosine of incidence, actor id, tag."""
    hit = np.flatnonzero(met.hit)
    out = np.zeros(len(hit), dtype=SEMANTIC_POINT)
    out["place"] = vectors_to_carla(*(met.unit[hit] * met.distance[hit][:, None]).T)
    out["cosine"] = met.cosine[hit]
    out["actor"] = world.sensors.scene(world).ids[met.row[hit] + 1]
    out["tag"] = met.label[hit]
    counts = np.bincount(channel[hit], minlength=len(make.elevations))
    return [(_head(make, counts), out.tobytes())]
