"""All sensors of an episode. Only those work that have a listener and whose time has come."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from contextlib import nullcontext
from time import sleep

from skidpad.core.geometry import Pose
from skidpad.core.kernels.threads import Beside
from skidpad.core.maths.randomness import stream
from skidpad.simulation.carla_server import snapshot
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.sensing.sensor import Producer, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings
from skidpad.simulation.carla_server.snapshot import SensorType

# s. Every stream has a connection of its own, and the client's threads race: a collision gets ahead
# of what its tick sends afterwards, so that a client that waits for that has the collision too.
EVENT_PAUSE = 0.002


Reading = tuple[int, tuple[bytes | memoryview, ...]]  # a stream and the parts of a message


class SensorSet:
    """Holds the sensors of an episode by actor id."""

    def __init__(self, producers: Mapping[str, Producer], seed: int) -> None:
        """producers: by blueprint; other kinds stay silent (listed in the coverage table)."""
        self._producers, self._seed = producers, seed
        self._sensors: dict[int, Sensor] = {}

    def add(self, actor: Actor) -> None:
        """Adds a new sensor; WireError or ConfigError when its attributes cannot be used.

        Kinds that send nothing are ignored.
        """
        producer = self._producers.get(actor.blueprint.id)
        if producer is None:
            return
        noise_seed = actor.attributes.get("noise_seed", "0")
        rng = stream(self._seed, "carla_server", actor.blueprint.id, noise_seed)
        period = float(actor.attributes.get("sensor_tick", "0"))
        equipment = producer.equip(actor, self._seed)
        self._sensors[actor.id] = Sensor(actor, period, rng, equipment)

    def forget(self, id: int) -> list[int]:
        """Removes a sensor and returns the streams of its G-buffers; [] for none."""
        sensor = self._sensors.pop(id, None)
        return list(sensor.textures.values()) if sensor is not None else []

    def of(self, id: int) -> Sensor | None:
        """Returns the sensor that is this actor; None when it is none that sends something."""
        return self._sensors.get(id)

    def has_listeners(self, hub: StreamHub) -> bool:
        """Tells whether any sensor has a listener."""
        return any(_is_heard(sensor, hub) for sensor in self._sensors.values())

    def produce(self, around: Surroundings, clock: Clock, hub: StreamHub) -> None:
        """Reads and publishes every sensor that is due and listened to, one tick.

        Before that all radios send.
        """
        time = clock.elapsed
        for sensor in self._sensors.values():
            speak = self._producers[sensor.actor.blueprint.id].speak
            if speak is not None:
                speak(around, clock, sensor)
        due = [s for s in self._sensors.values() if _is_heard(s, hub) and s.is_due(time)]
        together: dict[Hashable, list[Sensor]] = {}
        for sensor in due:
            shares = self._producers[sensor.actor.blueprint.id].shares
            if shares is not None:
                together.setdefault(shares(around, sensor), []).append(sensor)

        def read(sensors: list[Sensor]) -> dict[int, list[Reading]]:
            return {s.actor.id: self._read(s, around, clock, hub) for s in sensors}

        with around.standing_still() if together else nullcontext(), Beside() as threads:
            began = [(sensors, threads.start(read, sensors)) for sensors in together.values()]
            coming = {s.actor.id: future for sensors, future in began for s in sensors}
            for sensor in due:
                id = sensor.actor.id
                own = coming[id].result()[id] if id in coming else read([sensor])[id]
                for stream, parts in own:
                    hub.publish(stream, *parts)
                if own and self._producers[sensor.actor.blueprint.id].type is SensorType.COLLISION:
                    sleep(EVENT_PAUSE)

    def _read(
        self, sensor: Sensor, around: Surroundings, clock: Clock, hub: StreamHub
    ) -> list[Reading]:
        """Returns what a sensor sends and its textures, only for streams that have listeners."""
        producer = self._producers[sensor.actor.blueprint.id]
        place, number = around.actors.pose(sensor.actor), sensor.actor.stream
        told: list[Reading] = []
        if number is not None and hub.has_listeners(number):
            head = _head(producer.type, clock, place)
            told += [(number, (head, *m)) for m in producer.produce(around, clock, sensor)]
        wanted = [t for t, stream in sensor.textures.items() if hub.has_listeners(stream)]
        if wanted and producer.textures is not None:
            head, made = (
                _head(SensorType.GBUFFER, clock, place),
                producer.textures(around, clock, sensor, wanted),
            )
            streams = (sensor.textures[texture] for texture in wanted)
            told += [(s, (head, *m)) for s, m in zip(streams, made, strict=False)]
        return told


def _is_heard(sensor: Sensor, hub: StreamHub) -> bool:
    """Tells whether the sensor or one of its G-buffers has a listener."""
    streams = (sensor.actor.stream, *sensor.textures.values())
    return any(s is not None and hub.has_listeners(s) for s in streams)


def _head(type: SensorType, clock: Clock, place: Pose) -> bytes:
    """Returns the header of a message: frame, time and the sensor's own place."""
    (x, y, z), (pitch, yaw, roll) = wire.transform(place)
    return snapshot.header(type, clock.frame, clock.elapsed, (x, y, z, pitch, yaw, roll))
