"""A car of the CARLA server that drives with sensors on it, and what their streams say."""

from __future__ import annotations

from typing import Any

import msgpack
import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import GripModel
from skidpad.simulation.carla_server.actors.catalogue import AttributeType
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods import TABLES
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.codec import Request
from skidpad.simulation.carla_server.protocol.rpc import Dispatcher
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.weather import PACKED
from support.carla_streams import Kept

HEAD, IMAGE_HEAD = 48, 12  # bytes of a message, and of a picture in it
SIZE = {"image_size_x": 160, "image_size_y": 120, "fov": 40}
MOUNTS = {
    "other": Pose(2.4, 0.0, 0.5),  # below the top of the rails
    "lidar": Pose(0.0, 0.0, 1.9),
    "camera": Pose(0.6, 0.0, 1.5),
}


class Stage:
    """A car that carries sensors at 20 m/s, and others around it that drive as fast, on a straight road."""

    def __init__(self, **weather: float) -> None:
        self.hub = Kept()
        options = ServerOptions(map="straight", weather_grip=GripModel.NONE)  # all drive alike
        self.served = Served(options, self.hub)
        self.calls = Dispatcher(self.served, TABLES)
        episode = self.served.episode
        values = {"sun_altitude_deg": 60.0, **weather}
        self.call("set_weather_parameters", [*(values.get(n, 0.0) for n in PACKED), 0.0])
        self.start = episode.map.spawn_points[100]
        self.ego = self.spawn("vehicle.tesla.model3", Pose(0.0, 0.0))
        self.streams: list[int] = []

    @property
    def weather(self) -> Any:
        return self.served.episode.sky.weather

    def call(self, name: str, *arguments: Any) -> Any:
        """What a client is told: the result of a call, or the sentence of its error."""
        request = Request(1, name, msgpack.unpackb(msgpack.packb(list(arguments))), True)
        _, _, error, result = msgpack.unpackb(self.calls.answer(request), strict_map_key=False)
        assert error is None
        return result

    def spawn(self, name: str, place: Pose, speed: float = 20.0) -> Any:
        """A vehicle at a place seen from the ego's start, which drives along the road."""
        episode = self.served.episode
        actor = episode.spawn(Wanted(name, {}), self.start @ place)
        vx, vy = speed * np.cos(self.start.yaw), speed * np.sin(self.start.yaw)
        episode.vehicles.set_velocity(actor.id, (vx, vy, 0.0))
        return actor

    def attach(self, sensor: str, **attributes: Any) -> Any:
        """What `spawn_actor_with_parent` says about a sensor on the ego with these attributes."""
        given = [[n, int(AttributeType.STRING), str(v)] for n, v in attributes.items()]
        (place,) = [m for kind, m in MOUNTS.items() if kind in sensor]
        return self.call(
            "spawn_actor_with_parent", [0, sensor, given], wire.transform(place), self.ego.id, 0
        )

    def attach_all(self, sensor: str, *variants: dict[str, Any]) -> list[int]:
        """The streams of a sensor for each of the attributes."""
        actors = self.served.episode.actors.alive
        streams = []
        for attributes in variants:
            before = set(actors)
            self.attach(sensor, **attributes)
            (new,) = set(actors) - before
            streams.append(actors[new].stream)
        return streams

    def ticks(self, times: int) -> None:
        for _ in range(times):
            self.served.tick()

    def told(self, stream: int) -> list[bytes]:
        """The messages of a stream, without header."""
        return [m[HEAD:] for m in self.hub.told.get(stream, [])]

    def run(self, sensor: str, *variants: dict[str, Any], ticks: int = 6) -> list[list[bytes]]:
        """The messages of a sensor for each of the attributes, all of the same ticks, without header."""
        streams = self.attach_all(sensor, *variants)
        self.ticks(ticks)
        return [self.told(s) for s in streams]


def pictures(messages: list[bytes]) -> np.ndarray:
    """Blue, green, red, alpha of a camera's messages, as numbers that can be subtracted."""
    shape = (SIZE["image_size_y"], SIZE["image_size_x"], 4)
    return np.array([np.frombuffer(m[IMAGE_HEAD:], np.uint8).reshape(shape) for m in messages], int)
