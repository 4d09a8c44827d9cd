"""ROS 2 messages as DDS types, from their definitions: no code of ROS is needed.

A message pkg/msg/Type is the DDS type pkg::msg::dds_::Type_, final, without key, in XCDR1, so its
bytes are those of ROS. `rosbags` brings the definitions of a distribution; Autoware's are below.
"""

from __future__ import annotations

from typing import Any

from skidpad.core.errors import ConfigError, MissingExtra

try:
    import cyclonedds.idl as idl
    import cyclonedds.idl.types as kinds
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore
except ImportError as error:
    raise MissingExtra("ROS 2 topics", "live") from error

# Field lists of autowarefoundation/autoware_msgs (Apache-2.0), autoware_perception_msgs, 2026-04-27.
AUTOWARE = {
    "ObjectClassification": "uint8 label\nfloat32 probability",
    "Shape": "uint8 type\ngeometry_msgs/Polygon footprint\ngeometry_msgs/Vector3 dimensions",
    "PredictedPath": (
        "geometry_msgs/Pose[] path\nbuiltin_interfaces/Duration time_step\nfloat32 confidence"
    ),
    "PredictedObjectKinematics": (
        "geometry_msgs/PoseWithCovariance initial_pose_with_covariance\n"
        "geometry_msgs/TwistWithCovariance initial_twist_with_covariance\n"
        "geometry_msgs/AccelWithCovariance initial_acceleration_with_covariance\n"
        "PredictedPath[] predicted_paths"
    ),
    "PredictedObject": (
        "unique_identifier_msgs/UUID object_id\nfloat32 existence_probability\n"
        "ObjectClassification[] classification\nPredictedObjectKinematics kinematics\nShape shape"
    ),
    "PredictedObjects": "std_msgs/Header header\nPredictedObject[] objects",
}
ODOMETRY, PATH = "nav_msgs/msg/Odometry", "nav_msgs/msg/Path"
OBJECTS = "autoware_perception_msgs/msg/PredictedObjects"
BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4  # kinds of a field in rosbags
NUMBERS = {
    n: getattr(kinds, n)
    for n in (
        "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
        "float32", "float64",
    )
}  # fmt: skip
PLAIN: dict[str, Any] = {
    **NUMBERS, "bool": bool, "string": str, "byte": kinds.uint8, "char": kinds.uint8,
    "octet": kinds.uint8,
}  # fmt: skip


class Types:
    """Gives messages of one distribution, e.g. ros2_humble, as classes of the DDS library."""

    def __init__(self, typestore: str = "ros2_humble") -> None:
        try:
            self.store = get_typestore(Stores(typestore))
        except ValueError as error:
            raise ConfigError(f"unknown typestore {typestore!r}") from error
        for name, text in AUTOWARE.items():
            full = f"autoware_perception_msgs/msg/{name}"
            if full not in self.store.types:
                self.store.register(get_types_from_msg(text, full))
        self._classes: dict[str, Any] = {}

    def cls(self, name: str) -> Any:
        """Returns the DDS class of a message such as nav_msgs/msg/Odometry; KeyError for an unknown one."""
        if name not in self._classes:
            package, _, kind = name.split("/")
            fields = {n: self._field(d) for n, d in self.store.fielddefs[name][1]}
            dds = f"{package}.msg.dds_.{kind}_"
            self._classes[name] = idl.make_idl_struct(f"{kind}_", dds, fields)
        return self._classes[name]

    def _field(self, definition: Any) -> Any:
        """Returns a field's DDS type by its definition: plain, a message class, array or sequence."""
        kind, what = int(definition[0]), definition[1]
        if kind == BASE:
            return PLAIN[what[0]]
        if kind == NAME:
            return self.cls(what)
        inner = self._field(what[0])
        container: Any = kinds  # its classes take their element in brackets
        return container.array[inner, what[1]] if kind == ARRAY else container.sequence[inner]

    def make(self, name: str, *values: Any) -> Any:
        """Returns a message with these values of its fields, in their order."""
        fields = [n for n, _ in self.store.fielddefs[name][1]]
        return self.cls(name)(**dict(zip(fields, values, strict=True)))

    def describe_type(self, name: str) -> bytes:
        """Returns what a writer announces of its type, for readers of newer distributions."""
        return f"typehash={self.store.hash_rihs01(name)};".encode()


def ros_name(dds: str) -> str:
    """Returns the message's name of a DDS type; the name itself where it is none of ROS."""
    parts = dds.split("::")
    if len(parts) != 4 or parts[1:3] != ["msg", "dds_"] or not parts[3].endswith("_"):
        return dds
    return f"{parts[0]}/msg/{parts[3][:-1]}"
