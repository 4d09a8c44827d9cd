"""Readings of sensors, odometry and frames as ROS 2 messages, published over DDS."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import MissingExtra
from skidpad.core.geometry import Pose
from skidpad.live.ros2.network import participant, qos
from skidpad.live.ros2.types import ODOMETRY, Types
from skidpad.live.settings import Flow

try:
    from cyclonedds.core import DDSException
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
except ImportError as error:
    raise MissingExtra("ROS 2 topics", "live") from error

IMAGE, POINTS = "sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2"
PLACES, PLACES_TOPIC = "tf2_msgs/msg/TFMessage", "/tf"
FLOAT32 = 7  # of sensor_msgs/PointField
COLUMNS = ("x", "y", "z", "intensity")
MAP = "map"
NS = 1_000_000_000
UNKNOWN = [0.0] * 36  # a covariance


class SensorMessages:
    """Makes the messages; times in s, poses and vectors ISO 8855, which are ROS's axes."""

    def __init__(self, types: Types) -> None:
        self.types = types

    def image(self, frame: str, t: float, size: tuple[int, int], bgra: bytes) -> Any:
        """Returns sensor_msgs/Image of size (width, height), encoded bgra8."""
        width, height = size
        head = self._header(frame, t)
        return self._make(IMAGE, head, height, width, "bgra8", 0, 4 * width, list(bgra))

    def points(self, frame: str, t: float, points: NDArray[np.float32]) -> Any:
        """Returns sensor_msgs/PointCloud2 of points (n, 4): x, y, z in m, intensity."""
        fields = [
            self._make("sensor_msgs/msg/PointField", name, 4 * i, FLOAT32, 1)
            for i, name in enumerate(COLUMNS)
        ]
        step, n = 4 * len(COLUMNS), len(points)
        data = list(points.astype("<f4").tobytes())
        head = self._header(frame, t)
        return self._make(POINTS, head, 1, n, fields, False, step, step * n, data, True)

    def odometry(self, frame: str, t: float, pose: Pose, motion: tuple[float, float, float]) -> Any:
        """Returns nav_msgs/Odometry: pose in the world, motion (forward, left m/s, yaw rad/s) in the body."""
        forward, left, rate = motion
        place = self._make("geometry_msgs/msg/Point", pose.x, pose.y, pose.z)
        at = self._make("geometry_msgs/msg/Pose", place, self._turn(pose))
        twist = self._make(
            "geometry_msgs/msg/Twist", self._vector(forward, left), self._vector(0.0, 0.0, rate)
        )
        return self._make(
            ODOMETRY,
            self._header(MAP, t),
            frame,
            self._make("geometry_msgs/msg/PoseWithCovariance", at, UNKNOWN),
            self._make("geometry_msgs/msg/TwistWithCovariance", twist, UNKNOWN),
        )

    def places(self, t: float, places: Sequence[tuple[str, str, Pose]]) -> Any:
        """Returns tf2_msgs/TFMessage of frames: parent, name, pose seen from the parent."""
        rows = [
            self._make(
                "geometry_msgs/msg/TransformStamped",
                self._header(parent, t),
                child,
                self._make(
                    "geometry_msgs/msg/Transform",
                    self._vector(pose.x, pose.y, pose.z),
                    self._turn(pose),
                ),
            )
            for parent, child, pose in places
        ]
        return self._make(PLACES, rows)

    def _make(self, name: str, *values: Any) -> Any:
        """Returns a message with these values of its fields, in their order."""
        return self.types.make(name, *values)

    def _header(self, frame: str, t: float) -> Any:
        """Returns a message header with `t` s as its stamp."""
        ns = round(t * NS)
        stamp = self._make("builtin_interfaces/msg/Time", ns // NS, ns % NS)
        return self._make("std_msgs/msg/Header", stamp, frame)

    def _vector(self, x: float, y: float, z: float = 0.0) -> Any:
        """Returns the Vector3 message with these three components."""
        return self._make("geometry_msgs/msg/Vector3", x, y, z)

    def _turn(self, pose: Pose) -> Any:
        """Returns the quaternion of a pose: yaw, then pitch, then roll."""
        a, b, c = pose.roll / 2.0, pose.pitch / 2.0, pose.yaw / 2.0
        sa, ca, sb, cb, sc, cc = sin(a), cos(a), sin(b), cos(b), sin(c), cos(c)
        return self._make(
            "geometry_msgs/msg/Quaternion",
            sa * cb * cc - ca * sb * sc,
            ca * sb * cc + sa * cb * sc,
            ca * cb * sc - sa * sb * cc,
            ca * cb * cc + sa * sb * sc,
        )


class SensorTopics:
    """Publishes readings on topics of a DDS domain, and never waits for a reader."""

    def __init__(self, domain: int) -> None:
        self.types = Types()
        self.messages = SensorMessages(self.types)
        self.dropped = 0  # messages that were not published
        self._participant = participant(domain)
        self._writers: dict[tuple[str, str], Any] = {}

    def send_image(
        self, topic: str, frame: str, t: float, size: tuple[int, int], bgra: bytes
    ) -> None:
        """Publishes a picture of size (width, height)."""
        self._send(topic, IMAGE, self.messages.image(frame, t, size, bgra))

    def send_points(self, topic: str, frame: str, t: float, points: NDArray[np.float32]) -> None:
        """Publishes points (n, 4): x, y, z in m in the sensor's frame, intensity."""
        self._send(topic, POINTS, self.messages.points(frame, t, points))

    def send_odometry(
        self, topic: str, frame: str, t: float, pose: Pose, motion: tuple[float, float, float]
    ) -> None:
        """Publishes a pose in the world and a motion in the body's frame: forward, left m/s, yaw rad/s."""
        self._send(topic, ODOMETRY, self.messages.odometry(frame, t, pose, motion))

    def send_places(self, t: float, places: Sequence[tuple[str, str, Pose]]) -> None:
        """Publishes where frames are: each the parent's name, its own, and its pose seen from the parent."""
        self._send(PLACES_TOPIC, PLACES, self.messages.places(t, places))

    def _send(self, topic: str, kind: str, message: Any) -> None:
        """Publishes a message; counts it as dropped where DDS refuses the topic or a reader has no room."""
        try:
            if (topic, kind) not in self._writers:
                wanted = qos(Flow.LIVE, self.types.describe_type(kind))
                made = Topic(self._participant, f"rt{topic}", self.types.cls(kind), qos=wanted)
                self._writers[topic, kind] = DataWriter(self._participant, made, qos=wanted)
            self._writers[topic, kind].write(message)
        except DDSException:
            self.dropped += 1
