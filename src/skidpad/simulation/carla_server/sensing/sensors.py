"""All sensors of the world. Only those that somebody listens to, and whose time has come, work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import sleep
from typing import TYPE_CHECKING, Any

import numpy as np

from skidpad.core.randomness import stream
from skidpad.physics.vehicle import G
from skidpad.simulation.carla_server import snapshot, wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.sensing import events, images, inertial, points
from skidpad.simulation.carla_server.sensing.scene import Scene, visible
from skidpad.simulation.carla_server.snapshot import SensorType

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

# s. Every stream has a connection of its own, and the client's threads race: a collision gets ahead
# of what its tick sends afterwards, so that a client that waits for that has the collision too.
EVENT_PAUSE = 0.002
EARLY = 1e-4  # s, so that a period of whole ticks is met in spite of rounding
Message = tuple[bytes | memoryview, ...]
Produce = Callable[["World", "Sensor"], list[Message]]


@dataclass(slots=True, eq=False)
class Sensor:
    """One sensor at work."""

    actor: Actor
    type: SensorType
    produce: Produce
    period: float  # s; 0: every tick
    rng: np.random.Generator
    due: float = 0.0  # s of simulated time
    state: Any = None  # what the producer remembers

    def number(self, attribute: str) -> float:
        """A numeric attribute."""
        return float(self.actor.attributes[attribute])


PRODUCERS: dict[str, tuple[SensorType, Produce]] = {
    "sensor.camera.rgb": (SensorType.RGB, images.image),
    "sensor.camera.depth": (SensorType.DEPTH, images.image),
    "sensor.camera.semantic_segmentation": (SensorType.SEMANTIC, images.image),
    "sensor.camera.instance_segmentation": (SensorType.INSTANCE, images.image),
    "sensor.other.radar": (SensorType.RADAR, points.radar),
    "sensor.lidar.ray_cast": (SensorType.LIDAR, points.lidar),
    "sensor.lidar.ray_cast_semantic": (SensorType.SEMANTIC_LIDAR, points.lidar),
    "sensor.other.imu": (SensorType.IMU, inertial.imu),
    "sensor.other.gnss": (SensorType.GNSS, inertial.gnss),
    "sensor.other.collision": (SensorType.COLLISION, events.collision),
    "sensor.other.obstacle": (SensorType.OBSTACLE, events.obstacle),
}


class SensorSet:
    """Sensors by actor id."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._sensors: dict[int, Sensor] = {}
        self.gravity = G  # m/s^2, as set by clients
        self._scene: Scene | None = None

    def scene(self, world: World) -> Scene:
        """What sensors see in the world's frame."""
        if self._scene is None or self._scene.members != visible(world):
            self._scene = Scene(world)
        self._scene.update(world)
        return self._scene

    def add(self, actor: Actor) -> None:
        """A new sensor; kinds that we cannot produce stay silent (listed in the coverage table)."""
        entry = PRODUCERS.get(actor.blueprint.id)
        if entry is None:
            return
        noise_seed = actor.attributes.get("noise_seed", "0")
        rng = stream(self._seed, "carla_server", actor.blueprint.id, actor.id, noise_seed)
        period = float(actor.attributes.get("sensor_tick", "0"))
        state = self._equip(actor)
        self._sensors[actor.id] = Sensor(actor, entry[0], entry[1], period, rng, state=state)

    def _equip(self, actor: Actor) -> Any:
        """What a producer needs, from the attributes; an error when they cannot be used."""
        if actor.blueprint.id in images.MODALITIES:
            return images.make_camera(actor)
        if actor.blueprint.id == "sensor.other.radar":
            return points.make_radar(actor, self._seed)
        if actor.blueprint.id.startswith("sensor.lidar"):
            return points.make_lidar(actor)
        return None

    def forget(self, id: int) -> None:
        """It is gone."""
        self._sensors.pop(id, None)

    def clear(self) -> None:
        """All are gone, and the map with them."""
        self._sensors.clear()
        self._scene = None

    def produce(self, world: World) -> None:
        """One tick of every sensor that is due and listened to."""
        time = world.episode.elapsed
        for sensor in list(self._sensors.values()):
            number = sensor.actor.stream
            if number is None or not world.hub.wanted(number) or time < sensor.due - EARLY:
                continue
            later = sensor.due + sensor.period
            sensor.due = later if later > time + EARLY else time + sensor.period
            messages = sensor.produce(world, sensor)
            for message in messages:
                world.hub.publish(number, head(world, sensor), *message)
            if messages and sensor.type is SensorType.COLLISION:
                sleep(EVENT_PAUSE)


def head(world: World, sensor: Sensor) -> bytes:
    """The header of a message: frame, time and the sensor's own place."""
    (x, y, z), (pitch, yaw, roll) = wire.transform(world.pose(sensor.actor))
    return snapshot.header(
        sensor.type, world.episode.frame, world.episode.elapsed, (x, y, z, pitch, yaw, roll)
    )
