"""What sensors that clients enable for ROS 2 publish, with odometry and places of the vehicles they ride on.

Topics as CARLA's own (public source: LibCarla `ros2/publishers`, tree after 0.9.16), odometry as its
ROS bridge: /carla/VEHICLE/SENSOR/image, /carla/VEHICLE/SENSOR for a lidar, /carla/VEHICLE/odometry, /tf.
A name is the attribute `ros_name`, else the blueprint's last word and the actor's id.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import cos, sin
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import vectors_to_carla
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.episode import Episode
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.carla_server.sensing.images import IMAGE_HEAD

IMAGES = tuple(
    f"sensor.camera.{kind}"
    for kind in ("rgb", "depth", "semantic_segmentation", "instance_segmentation", "normals")
)
POINTS = ("sensor.lidar.ray_cast",)
MAP = "map"  # the frame of the world
ODOMETRY = "odometry"  # the last word of a topic
Part = bytes | memoryview


class RosLink(Protocol):
    """What publishes messages on ROS 2 topics; times in s, poses and vectors ISO 8855."""

    def send_image(
        self, topic: str, frame: str, t: float, size: tuple[int, int], bgra: bytes
    ) -> None:
        """Publishes a picture of size (width, height)."""

    def send_points(self, topic: str, frame: str, t: float, points: NDArray[np.float32]) -> None:
        """Publishes points (n, 4): x, y, z in m in the sensor's frame, intensity."""

    def send_odometry(
        self, topic: str, frame: str, t: float, pose: Pose, motion: tuple[float, float, float]
    ) -> None:
        """Publishes a pose in the world and a motion in the body's frame: forward, left m/s, yaw rad/s."""

    def send_places(self, t: float, places: Sequence[tuple[str, str, Pose]]) -> None:
        """Publishes where frames are: each the parent's name, its own, and its pose seen from the parent."""


class RosOutput:
    """Hands the readings of enabled sensors to a link."""

    def __init__(self, link: RosLink, hub: StreamHub) -> None:
        self._link, self._hub = link, hub
        self._sensors: dict[int, Actor] = {}  # by stream
        self._topics: dict[int, str] = {}  # by stream
        self._now = 0.0  # s of the episode

    def enable(self, sensor: Actor, carrier: Actor | None) -> None:
        """Publishes a sensor's readings from now on; nothing for kinds other than images and points.

        CallError for a lidar whose topic is that of its vehicle's odometry.
        """
        if carrier is not None and sensor.blueprint.id in POINTS and _name(sensor) == ODOMETRY:
            raise CallError(
                f"ros_name {ODOMETRY} is taken by the vehicle's odometry; choose another"
            )
        stream = sensor.stream
        if stream is not None and sensor.blueprint.id in (*IMAGES, *POINTS):
            above = "" if carrier is None else f"/{_name(carrier)}"
            self._sensors[stream] = sensor
            self._topics[stream] = f"/carla{above}/{_name(sensor)}"
            self._hub.tap(stream, lambda parts: self._hear(stream, parts))

    def disable(self, stream: int) -> None:
        """Ends what a stream's sensor publishes, if it does."""
        self._sensors.pop(stream, None)
        self._hub.tap(stream, None)

    def is_enabled(self, stream: int) -> bool:
        """Returns whether a stream's sensor publishes."""
        return stream in self._sensors

    def tick(self, episode: Episode, clock: Clock) -> None:
        """Publishes odometry and places of the tick; call it before the sensors read."""
        self._now = clock.elapsed
        alive = episode.actors.alive
        self._sensors = {s: a for s, a in self._sensors.items() if alive.get(a.id) is a}
        places: dict[str, tuple[str, str, Pose]] = {}
        for sensor in self._sensors.values():
            carrier = episode.actors.carrier(sensor)
            if sensor.attributes.get("ros_publish_tf", "true") == "true":
                above, pose = (
                    (MAP, sensor.pose) if carrier is None else (_frame(carrier), sensor.mount)
                )
                places[_frame(sensor)] = (above, _frame(sensor), pose)
            if carrier is not None and _frame(carrier) not in places:
                pose = episode.actors.pose(carrier)
                places[_frame(carrier)] = (MAP, _frame(carrier), pose)
                motion = _motion(episode, carrier, pose)
                topic = f"/carla/{_name(carrier)}/{ODOMETRY}"
                self._link.send_odometry(topic, _frame(carrier), self._now, pose, motion)
        if places:
            self._link.send_places(self._now, list(places.values()))

    def _hear(self, stream: int, parts: Sequence[Part]) -> None:
        """Publishes a reading, whose parts are header, the kind's own header and the content."""
        _, head, content = parts
        sensor, topic = self._sensors[stream], self._topics[stream]
        if sensor.blueprint.id in IMAGES:
            width, height, _ = IMAGE_HEAD.unpack(head)
            size = width, height
            self._link.send_image(f"{topic}/image", _frame(sensor), self._now, size, bytes(content))
            return
        points = np.frombuffer(content, dtype="<f4").reshape(-1, 4).copy()
        points[:, :3] = vectors_to_carla(*points[:, :3].T)  # the flip of y is its own inverse
        self._link.send_points(topic, _frame(sensor), self._now, points)


def _name(actor: Actor) -> str:
    """Returns an actor's name in topics."""
    given = (
        actor.attributes.get("ros_name") or f"{actor.blueprint.id.rsplit('.', 1)[-1]}_{actor.id}"
    )
    return re.sub(r"\W", "_", given, flags=re.ASCII)


def _frame(actor: Actor) -> str:
    """Returns the name of an actor's frame."""
    return actor.attributes.get("ros_frame_id") or _name(actor)


def _motion(episode: Episode, actor: Actor, pose: Pose) -> Vector:
    """Returns an actor's velocity forward and to the left in m/s, and its yaw rate in rad/s."""
    vx, vy, _ = episode.actors.velocity(actor)
    c, s, rate = cos(pose.yaw), sin(pose.yaw), 0.0
    if actor.body is not None:
        rate = float(episode.moving.states.yaw_rate[episode.moving.row(actor.body)])
    return c * vx + s * vy, c * vy - s * vx, rate
