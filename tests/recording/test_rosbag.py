"""ROS 2 bags as channels: a bag is written with rosbags, its definitions embedded, and read."""

from __future__ import annotations

from math import cos, sin

import numpy as np
import pytest

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.vocabulary import SemanticClass
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.formats.ros_bag import load_mapping
from skidpad.recording.sources import open_channels

rosbag2 = pytest.importorskip("rosbags.rosbag2")
from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # noqa: E402

HEADING = 0.5
OBJECT_ARRAY = {
    "derived_object_msgs/msg/Object": (
        "std_msgs/Header header\nuint32 id\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\n"
        "shape_msgs/SolidPrimitive shape\nuint8 classification\n"
    ),
    "derived_object_msgs/msg/ObjectArray": (
        "std_msgs/Header header\nderived_object_msgs/Object[] objects\n"
    ),
}
PREDICTED = {
    "autoware_perception_msgs/msg/ObjectClassification": "uint8 label\nfloat32 probability\n",
    "autoware_perception_msgs/msg/Shape": (
        "uint8 type\ngeometry_msgs/Polygon footprint\ngeometry_msgs/Vector3 dimensions\n"
    ),
    "autoware_perception_msgs/msg/PredictedPath": (
        "geometry_msgs/Pose[] path\nbuiltin_interfaces/Duration time_step\nfloat32 confidence\n"
    ),
    "autoware_perception_msgs/msg/PredictedObjectKinematics": (
        "geometry_msgs/PoseWithCovariance initial_pose_with_covariance\n"
        "geometry_msgs/TwistWithCovariance initial_twist_with_covariance\n"
        "autoware_perception_msgs/PredictedPath[] predicted_paths\n"
    ),
    "autoware_perception_msgs/msg/PredictedObject": (
        "unique_identifier_msgs/UUID object_id\nfloat32 existence_probability\n"
        "autoware_perception_msgs/ObjectClassification[] classification\n"
        "autoware_perception_msgs/PredictedObjectKinematics kinematics\n"
        "autoware_perception_msgs/Shape shape\n"
    ),
    "autoware_perception_msgs/msg/PredictedObjects": (
        "std_msgs/Header header\nautoware_perception_msgs/PredictedObject[] objects\n"
    ),
    "autoware_planning_msgs/msg/TrajectoryPoint": (
        "builtin_interfaces/Duration time_from_start\ngeometry_msgs/Pose pose\n"
    ),
    "autoware_planning_msgs/msg/Trajectory": (
        "std_msgs/Header header\nautoware_planning_msgs/TrajectoryPoint[] points\n"
    ),
}
MAPPING = """
channels:
  a:
    ego: {topic: /a/odom, reference: rear_axle, length: 4.0, width: 2.0, centre_offset: 1.5}
    plan: {topic: /a/plan}
    objects: {topic: /a/objects}
  b:
    ego: {topic: /b/odom}
    plan: {topic: /b/path, frame: ego, step: 0.2}
    objects: {topic: /b/objects, frame: ego}
"""


class Maker:
    """Builds messages of a typestore that knows autoware's and derived types."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        for name, text in (OBJECT_ARRAY | PREDICTED).items():
            self.store.register(get_types_from_msg(text, name))

    def __call__(self, name, *args):
        return self.store.types[name](*args)

    def stamp(self, t, kind="Time"):
        return self(f"builtin_interfaces/msg/{kind}", int(t), round((t - int(t)) * 1e9))

    def header(self, t):
        return self("std_msgs/msg/Header", self.stamp(t), "map")

    def pose(self, x, y, h=0.0):
        point = self("geometry_msgs/msg/Point", float(x), float(y), 0.0)
        turn = self("geometry_msgs/msg/Quaternion", 0.0, 0.0, sin(h / 2), cos(h / 2))
        return self("geometry_msgs/msg/Pose", point, turn)

    def twist(self, vx, vy=0.0):
        return self(
            "geometry_msgs/msg/Twist",
            self("geometry_msgs/msg/Vector3", vx, vy, 0.0),
            self("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0),
        )

    def odometry(self, t, x, y, v):
        pose = self("geometry_msgs/msg/PoseWithCovariance", self.pose(x, y, HEADING), np.zeros(36))
        twist = self("geometry_msgs/msg/TwistWithCovariance", self.twist(v), np.zeros(36))
        return self("nav_msgs/msg/Odometry", self.header(t), "base", pose, twist)

    def trajectory(self, t, rows):
        kind = "autoware_planning_msgs/msg/Trajectory"
        points = [
            self(f"{kind}Point", self.stamp(dt, "Duration"), self.pose(x, y)) for x, y, dt in rows
        ]
        return self(kind, self.header(t), points)

    def path(self, t, rows):
        poses = [
            self("geometry_msgs/msg/PoseStamped", self.header(t), self.pose(x, y)) for x, y in rows
        ]
        return self("nav_msgs/msg/Path", self.header(t), poses)

    def predicted(self, t, x, y, v):
        kind = "autoware_perception_msgs/msg/"
        path = self(
            kind + "PredictedPath",
            [
                self.pose(x + v * 0.5 * k * cos(HEADING), y + v * 0.5 * k * sin(HEADING))
                for k in range(5)
            ],
            self.stamp(0.5, "Duration"),
            1.0,
        )
        kinematics = self(
            kind + "PredictedObjectKinematics",
            self("geometry_msgs/msg/PoseWithCovariance", self.pose(x, y, HEADING), np.zeros(36)),
            self("geometry_msgs/msg/TwistWithCovariance", self.twist(v), np.zeros(36)),
            [path],
        )
        shape = self(
            kind + "Shape", 0, self("geometry_msgs/msg/Polygon", []),
            self("geometry_msgs/msg/Vector3", 4.0, 2.0, 1.5),
        )  # fmt: skip
        one = self(
            kind + "PredictedObject",
            self("unique_identifier_msgs/msg/UUID", np.arange(16, dtype=np.uint8)),
            1.0, [self(kind + "ObjectClassification", 7, 1.0)], kinematics, shape,
        )  # fmt: skip
        return self(kind + "PredictedObjects", self.header(t), [one])

    def derived(self, t, x, y):
        kind = "derived_object_msgs/msg/"
        none = self("geometry_msgs/msg/Polygon", [])
        shape = self("shape_msgs/msg/SolidPrimitive", 1, np.array([4.0, 2.0, 1.5]), none)
        one = self(
            kind + "Object",
            self.header(t),
            7,
            self.pose(x, y, 0.25),
            self.twist(3.0, 1.0),
            shape,
            6,
        )
        return self(kind + "ObjectArray", self.header(t), [one])


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag")
    make, c, s = Maker(), cos(HEADING), sin(HEADING)
    (folder / "mapping.yaml").write_text(MAPPING)
    with rosbag2.Writer(folder / "bag", version=9) as writer:
        topics = {}

        def write(topic, t, message):
            name = message.__msgtype__
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, name, typestore=make.store)
            raw = make.store.serialize_cdr(message, name)
            writer.write(topics[topic], round((t + 1000.0) * 1e9), raw)

        for k in range(20):
            t, x = 5.0 + 0.1 * k, 10.0 * 0.1 * k
            write("/a/plan", t, make.trajectory(t, [(x * c + 2 * j * c, x * s + 2 * j * s, 0.2 * j)
                                                    for j in range(8)]))  # fmt: skip
            write("/b/path", t, make.path(t, [(2.0 * j, 0.0) for j in range(8)]))
            write("/a/objects", t, make.predicted(t, 30.0 * c, 30.0 * s, 4.0))
            if k < 15:
                write("/b/objects", t, make.derived(t, 30.0 - x, 1.0))
            write("/a/odom", t, make.odometry(t, x * c, x * s, 10.0))
            write("/b/odom", t, make.odometry(t, x * c, x * s, 10.0))
    return folder


@pytest.mark.req("C-020", "C-022")
def test_a_bag_gives_the_frames_that_were_put_into_it(bag):
    source = open_channels(bag / "bag", bag / "mapping.yaml")
    grid = list(cycles(source))
    assert source.channels == ("a", "b")
    assert source.losses.malformed == 0
    a, b = grid[10].frames
    c, s = cos(HEADING), sin(HEADING)
    assert a.t == pytest.approx(6.0)
    for f in (a, b):
        assert f.ego == pytest.approx([10 * c, 10 * s, HEADING, 10 * c, 10 * s])
        assert f.plan[:, :2] == pytest.approx(np.outer(10 + 2.0 * np.arange(8), [c, s]))
        assert f.plan[:, 2] == pytest.approx(0.2 * np.arange(8))
    assert a.ego_polygon.mean(axis=0) == pytest.approx([1.5, 0.0])  # rear axle to centre
    assert np.ptp(a.ego_polygon, axis=0) == pytest.approx([4.0, 2.0])
    assert a.objects[0] == pytest.approx([30 * c, 30 * s, HEADING, 4 * c, 4 * s])
    assert a.predictions[0, -1] == pytest.approx([38 * c, 38 * s])
    assert a.prediction_t == pytest.approx([0, 0.5, 1.0, 1.5, 2.0])
    assert a.classes.tolist() == [SemanticClass.PEDESTRIAN]
    # b reports 20 m ahead and 1 m left of itself, in its own frame
    assert b.objects[0, :2] == pytest.approx([30 * c - s, 30 * s + c])
    assert b.objects[0, 2:] == pytest.approx([0.25 + HEADING, 3 * c - s, 3 * s + c])
    assert b.predictions.shape == (1, 0, 2)
    assert (b.ids.tolist(), b.classes.tolist()) == ([7], [SemanticClass.CAR])


def test_a_channel_whose_objects_stop_is_absent(bag):
    source = open_channels(bag / "bag", bag / "mapping.yaml")
    present = [cycle.frames[1] is not None for cycle in cycles(source)]
    assert present[:15] == [True] * 15
    assert present[-2:] == [False, False]


def test_the_time_of_arrival_may_count_instead(bag, tmp_path):
    mapping = tmp_path / "m.yaml"
    mapping.write_text("clock: receive\n" + MAPPING)
    grid = list(cycles(open_channels(bag / "bag", mapping)))
    assert grid[0].t == pytest.approx(1005.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("/a/odom", "/a/nothing", "has no topic /a/nothing for channel a; it has: /a/objects"),
        ("/a/odom", "/a/plan", "must be of type"),
        ("rear_axle", "bumper", "bumper"),
        ("channels:", "typestore: ros9\nchannels:", "ros2_humble"),
        ("plan:", "plans:", "plans"),
    ],
)
def test_a_wrong_mapping_is_named(bag, tmp_path, old, new, words):
    mapping = tmp_path / "m.yaml"
    mapping.write_text(MAPPING.replace(old, new, 1))
    with pytest.raises((ConfigError, FileError), match=words):
        open_channels(bag / "bag", mapping)


def test_what_is_no_bag_is_refused(bag, tmp_path):
    with pytest.raises(FileError):
        open_channels(tmp_path, bag / "mapping.yaml")
    with pytest.raises(FileError, match="cannot be read"):
        load_mapping(tmp_path / "none.yaml")
