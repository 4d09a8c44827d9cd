"""Object lists of ROS messages as arrays."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, cos, sin
from typing import Any, NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.vocabulary import SemanticClass
from skidpad.recording.channels.codec import POLYGON_LIMIT, padded_polygons

NS = 1e9
# autoware_perception_msgs/ObjectClassification
AUTOWARE_CLASSES = {
    1: SemanticClass.CAR, 2: SemanticClass.TRUCK, 3: SemanticClass.BUS, 4: SemanticClass.TRUCK,
    5: SemanticClass.MOTORCYCLE, 6: SemanticClass.BICYCLE, 7: SemanticClass.PEDESTRIAN,
}  # fmt: skip
# derived_object_msgs/Object
DERIVED_CLASSES = {
    4: SemanticClass.PEDESTRIAN, 5: SemanticClass.BICYCLE, 6: SemanticClass.CAR,
    7: SemanticClass.TRUCK, 8: SemanticClass.MOTORCYCLE,
}  # fmt: skip


class RosObjects(NamedTuple):
    """n objects, in the fields of a ChannelFrame."""

    states: Floats  # (n, 5)
    polygons: Floats  # (n, k, 2)
    polygon_size: Ints  # (n,)
    predictions: Floats  # (n, p, 2), NaN beyond an object's own end
    prediction_t: Floats  # (p,)
    ids: Ints  # (n,)
    classes: Ints  # (n,)

    def to_world(self, ego: Floats) -> RosObjects:
        """Returns the objects in the world, given in the frame of `ego` (5,)."""
        c, s = cos(ego[2]), sin(ego[2])
        turn = np.array([[c, s], [-s, c]])
        states = self.states.copy()
        states[:, :2] = self.states[:, :2] @ turn + ego[:2]
        states[:, 2] += ego[2]
        states[:, 3:] = self.states[:, 3:] @ turn
        return self._replace(states=states, predictions=self.predictions @ turn + ego[:2])


class _Row(NamedTuple):
    state: tuple[float, float, float, float, float]
    shape: Floats
    path: Floats  # (p, 2)
    step: float  # s
    id: int
    label: int


def empty_objects() -> RosObjects:
    """Returns a table of no objects."""
    return _table([])


def _table(rows: list[_Row]) -> RosObjects:
    """Returns rows of objects as arrays, predictions resampled to the first one's time step."""
    n = len(rows)
    size, polygons = padded_polygons(row.shape for row in rows)
    steps = [row.step for row in rows if len(row.path) and row.step > 0.0]
    step = steps[0] if steps else 0.0
    p = max((len(row.path) for row in rows), default=0) if step else 0
    predictions = np.full((n, p, 2), np.nan)
    times: Floats = np.arange(p, dtype=np.float64) * step
    for i, row in enumerate(rows):
        if len(row.path) and row.step > 0.0:
            own = np.arange(len(row.path)) * row.step
            inside = times <= own[-1] + 1e-9
            for axis in (0, 1):
                predictions[i, inside, axis] = np.interp(times[inside], own, row.path[:, axis])
    return RosObjects(
        np.array([row.state for row in rows], dtype=np.float64).reshape(n, 5),
        polygons,
        size,
        predictions,
        times,
        np.array([row.id for row in rows], dtype=np.int64),
        np.array([row.label for row in rows], dtype=np.int64),
    )


def yaw_of(q: Any) -> float:
    """Returns the heading in rad of a quaternion."""
    return atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


def _box(length: float, width: float) -> Floats:
    """Returns (4, 2) the corners of a box in m around its centre."""
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    return corners * (length / 2.0, width / 2.0)


def _autoware(content: Any) -> RosObjects:
    """Returns the objects of autoware PredictedObjects; twists are in the objects' own frames."""
    rows = []
    for o in content.objects:
        k = o.kinematics
        pose = k.initial_pose_with_covariance.pose
        v = k.initial_twist_with_covariance.twist.linear
        h = yaw_of(pose.orientation)
        c, s = cos(h), sin(h)
        best = max(k.predicted_paths, key=lambda path: path.confidence, default=None)
        path = np.array(
            [(p.position.x, p.position.y) for p in best.path] if best else [], dtype=np.float64
        ).reshape(-1, 2)
        points = [(p.x, p.y) for p in o.shape.footprint.points][:POLYGON_LIMIT]
        shape = (
            np.array(points, dtype=np.float64)
            if len(points) >= 3
            else _box(o.shape.dimensions.x, o.shape.dimensions.y)
        )
        label = max(o.classification, key=lambda c: c.probability, default=None)
        rows.append(
            _Row(
                (pose.position.x, pose.position.y, h, v.x * c - v.y * s, v.x * s + v.y * c),
                shape,
                path,
                best.time_step.sec + best.time_step.nanosec / NS if best else 0.0,
                int.from_bytes(bytes(bytearray(o.object_id.uuid))[:7], "big"),
                int(AUTOWARE_CLASSES.get(label.label, -1)) if label else -1,
            )
        )
    return _table(rows)


def _read_derived_objects(content: Any) -> RosObjects:
    """Returns the objects of derived_object_msgs/ObjectArray: no predictions, twists as the poses."""
    rows = []
    for o in content.objects:
        size = list(o.shape.dimensions)
        v = o.twist.linear
        rows.append(
            _Row(
                (o.pose.position.x, o.pose.position.y, yaw_of(o.pose.orientation), v.x, v.y),
                _box(size[0], size[1]) if len(size) >= 2 else np.zeros((0, 2)),
                np.zeros((0, 2)),
                0.0,
                int(o.id),
                int(DERIVED_CLASSES.get(int(o.classification), -1)),
            )
        )
    return _table(rows)


OBJECT_READERS: dict[str, Callable[[Any], RosObjects]] = {
    "autoware_perception_msgs/msg/PredictedObjects": _autoware,
    "autoware_auto_perception_msgs/msg/PredictedObjects": _autoware,
    "derived_object_msgs/msg/ObjectArray": _read_derived_objects,
}
