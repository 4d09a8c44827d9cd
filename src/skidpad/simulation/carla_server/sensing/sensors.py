"""All sensors of the world. Only those that somebody listens to, and whose time has come, work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from skidpad.core.randomness import stream
from skidpad.physics.vehicle import G
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server import snapshot, wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.sensing import events, inertial
from skidpad.simulation.carla_server.snapshot import SensorType

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

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
        self.roads: RoadMap | None = None

    def begin(self, roads: RoadMap) -> None:
        """Another map."""
        self.roads = roads

    def add(self, actor: Actor) -> None:
        """A new sensor; kinds that we cannot produce stay silent (listed in the coverage table)."""
        entry = PRODUCERS.get(actor.blueprint.id)
        if entry is None:
            return
        noise_seed = actor.attributes.get("noise_seed", "0")
        rng = stream(self._seed, "carla_server", actor.blueprint.id, actor.id, noise_seed)
        period = float(actor.attributes.get("sensor_tick", "0"))
        self._sensors[actor.id] = Sensor(actor, entry[0], entry[1], period, rng)

    def forget(self, id: int) -> None:
        """It is gone."""
        self._sensors.pop(id, None)

    def clear(self) -> None:
        """All are gone."""
        self._sensors.clear()

    def produce(self, world: World) -> None:
        """One tick of every sensor that is due and listened to."""
        time = world.episode.elapsed
        for sensor in list(self._sensors.values()):
            number = sensor.actor.stream
            if number is None or not world.hub.wanted(number) or time < sensor.due - EARLY:
                continue
            sensor.due = max(sensor.due + sensor.period, time)
            for message in sensor.produce(world, sensor):
                world.hub.publish(number, head(world, sensor), *message)


def head(world: World, sensor: Sensor) -> bytes:
    """The header of a message: frame, time and the sensor's own place."""
    (x, y, z), (pitch, yaw, roll) = wire.transform(world.pose(sensor.actor))
    return snapshot.header(
        sensor.type, world.episode.frame, world.episode.elapsed, (x, y, z, pitch, yaw, roll)
    )
