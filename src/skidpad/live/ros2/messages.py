"""Channel frames as ROS 2 messages: the inverse of `recording/formats/ros_bag.py`."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np

from skidpad.core.channels import ChannelFrame
from skidpad.live.ros2.types import OBJECTS, ODOMETRY, PATH, Types
from skidpad.recording.formats.ros_objects import AUTOWARE_CLASSES

NS = 1_000_000_000
NOTHING_KNOWN = [0.0] * 36  # a covariance
POLYGON = 2  # type of a shape with a footprint
HEIGHT = 1.5  # m, which channels do not report
LABELS = {int(ours): label for label, ours in reversed(AUTOWARE_CLASSES.items())}


class Messages:
    """Makes the three messages of a channel's frame; world coordinates, times in s as stamps."""

    def __init__(self, types: Types) -> None:
        self.types = types

    def odometry(self, frame: ChannelFrame) -> Any:
        """Returns the ego's pose and twist as nav_msgs/Odometry, at the body's centre."""
        x, y, h, vx, vy = frame.ego.tolist()
        return self.types.make(
            ODOMETRY,
            self._header(frame.t),
            "base_link",
            self._with_covariance("Pose", self._pose(x, y, h)),
            self._with_covariance("Twist", self._twist(vx, vy, h)),
        )

    def path(self, frame: ChannelFrame) -> Any:
        """Returns the plan, of at least one row, as nav_msgs/Path with a stamp per pose."""
        rows = frame.plan
        steps = np.diff(rows[:, :2], axis=0, append=rows[-1:, :2])
        headings = np.arctan2(steps[:, 1], steps[:, 0])
        poses = [
            self._make(
                "geometry_msgs", "PoseStamped", self._header(frame.t + t), self._pose(x, y, h)
            )
            for (x, y, t), h in zip(rows.tolist(), headings.tolist(), strict=True)
        ]
        return self.types.make(PATH, self._header(frame.t), poses)

    def objects(self, frame: ChannelFrame) -> Any:
        """Returns the objects as autoware_perception_msgs/PredictedObjects."""
        times = frame.prediction_t
        step = float(times[1] - times[0]) if len(times) > 1 else 0.0
        rows = [self._object(frame, i, step) for i in range(len(frame.objects))]
        return self.types.make(OBJECTS, self._header(frame.t), rows)

    def _object(self, frame: ChannelFrame, i: int, step: float) -> Any:
        """Returns the PredictedObject of object `i`; `step` is the time between its predictions in s."""
        x, y, h, vx, vy = frame.objects[i].tolist()
        said = frame.predictions[i][np.isfinite(frame.predictions[i]).all(axis=1)]
        poses = [self._pose(px, py, h) for px, py in said.tolist()]
        shape = frame.polygons[i, : frame.polygon_size[i]]
        size = np.ptp(shape, axis=0).tolist() if len(shape) else [0.0, 0.0]
        corners = [self._make("geometry_msgs", "Point32", px, py, 0.0) for px, py in shape.tolist()]
        own, rest = "autoware_perception_msgs", self._vector(0.0, 0.0)
        kinematics = self._make(
            own,
            "PredictedObjectKinematics",
            self._with_covariance("Pose", self._pose(x, y, h)),
            self._with_covariance("Twist", self._twist(vx, vy, h)),
            self._with_covariance("Accel", self._make("geometry_msgs", "Accel", rest, rest)),
            [self._make(own, "PredictedPath", poses, self._time(step, "Duration"), 1.0)],
        )
        identity = max(int(frame.ids[i]), 0).to_bytes(7, "big") + bytes(9)
        label = LABELS.get(int(frame.classes[i]), 0)
        return self._make(
            own,
            "PredictedObject",
            self._make("unique_identifier_msgs", "UUID", list(identity)),
            1.0,
            [self._make(own, "ObjectClassification", label, 1.0)],
            kinematics,
            self._make(
                own,
                "Shape",
                POLYGON,
                self._make("geometry_msgs", "Polygon", corners),
                self._vector(size[0], size[1], HEIGHT),
            ),
        )

    def _make(self, package: str, kind: str, *values: Any) -> Any:
        """Returns a message of the type `package`/msg/`kind` with these values of its fields, in order."""
        return self.types.make(f"{package}/msg/{kind}", *values)

    def _with_covariance(self, kind: str, value: Any) -> Any:
        """Returns the message `kind`WithCovariance around a value, with the covariance NOTHING_KNOWN."""
        return self._make("geometry_msgs", f"{kind}WithCovariance", value, NOTHING_KNOWN)

    def _time(self, t: float, kind: str = "Time") -> Any:
        """Returns `t` s as a message of builtin_interfaces, a Time or a Duration, rounded to nanoseconds."""
        ns = round(t * NS)
        return self._make("builtin_interfaces", kind, ns // NS, ns % NS)

    def _header(self, t: float) -> Any:
        """Returns a message header in the frame "map" with `t` s as its stamp."""
        return self._make("std_msgs", "Header", self._time(t), "map")

    def _vector(self, x: float, y: float, z: float = 0.0) -> Any:
        """Returns the Vector3 message with these three components."""
        return self._make("geometry_msgs", "Vector3", x, y, z)

    def _pose(self, x: float, y: float, h: float) -> Any:
        """Returns the Pose message at (x, y, 0) m with the heading `h` in rad about the z axis."""
        place = self._make("geometry_msgs", "Point", x, y, 0.0)
        turn = self._make("geometry_msgs", "Quaternion", 0.0, 0.0, sin(h / 2.0), cos(h / 2.0))
        return self._make("geometry_msgs", "Pose", place, turn)

    def _twist(self, vx: float, vy: float, h: float) -> Any:
        """Returns the Twist message of a velocity in the world (m/s) in the body's frame, as ROS gives it."""
        c, s = cos(h), sin(h)
        forward = self._vector(c * vx + s * vy, c * vy - s * vx)
        return self._make("geometry_msgs", "Twist", forward, self._vector(0.0, 0.0))
