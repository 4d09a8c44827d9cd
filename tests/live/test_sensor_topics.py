"""What sensors publish that clients enable for ROS 2: bytes of rosbags, and a subscriber of our own."""

from __future__ import annotations

import os
import time
from math import cos, sin

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")
pytest.importorskip("rosbags.typesys", reason="rosbags is not installed")
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from skidpad.core.geometry import Pose
from skidpad.live.ros2.network import participant, qos
from skidpad.live.ros2.sensor_topics import (
    IMAGE,
    PLACES,
    POINTS,
    SensorMessages,
    SensorTopics,
)
from skidpad.live.ros2.types import ODOMETRY, Types
from skidpad.live.settings import Flow
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods.episode import (
    disable_sensor_for_ros,
    enable_sensor_for_ros,
    is_sensor_enabled_for_ros,
)
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.ros_output import RosOutput
from skidpad.simulation.carla_server.served import Served

DOMAIN = 100 + os.getpid() % 99  # one per process of the tests
PATIENCE = 60.0  # s until a reader has a message


@pytest.mark.parametrize("typestore", ["ros2_humble", "ros2_jazzy"])
def test_the_bytes_of_every_message_are_those_of_rosbags(typestore: str) -> None:
    types = Types(typestore)
    make, store = SensorMessages(types), types.store
    pose = Pose(1.0, 2.0, 3.0, 0.1, -0.2, 0.3)
    for name, message in (
        (IMAGE, make.image("cam", 1.25, (2, 1), bytes(range(8)))),
        (POINTS, make.points("lidar", 1.25, np.arange(8, dtype=np.float32).reshape(2, 4))),
        (ODOMETRY, make.odometry("car", 1.25, pose, (4.0, 0.5, 0.1))),
        (PLACES, make.places(1.25, [("map", "car", pose), ("car", "cam", pose)])),
    ):
        ours = message.serialize(use_version_2=False)
        theirs = store.deserialize_cdr(ours, name)
        assert bytes(store.serialize_cdr(theirs, name)) == ours


def test_a_turn_is_yaw_then_pitch_then_roll() -> None:
    pose = Pose(0.0, 0.0, 0.0, 0.1, -0.2, 0.3)
    q = SensorMessages(Types())._turn(pose)
    x, y, z, w = q.x, q.y, q.z, q.w
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert turned == pytest.approx(pose.rotation())


def take(reader: DataReader) -> list[object]:
    """The messages that a reader has, at least one."""
    deadline = time.monotonic() + PATIENCE
    while not (found := list(reader.take(100))):
        assert time.monotonic() < deadline, "nothing was received"
        time.sleep(0.02)
    return found


def test_a_subscriber_gets_images_points_odometry_and_frames() -> None:
    hub = StreamHub()
    served = Served(ServerOptions(map="straight"), hub)
    served.ros = RosOutput(SensorTopics(DOMAIN), hub)
    episode = served.episode
    start = episode.map.spawn_points[0]
    car = episode.spawn(Wanted("vehicle.tesla.model3", {"ros_name": "ego"}), start)
    size = {"image_size_x": "16", "image_size_y": "8", "ros_name": "front"}
    mount = Pose(1.5, 0.0, 2.0)
    camera = episode.attach(Wanted("sensor.camera.rgb", size), mount, car.id, Attachment.RIGID)
    few = {"points_per_second": "20000", "ros_name": "top", "ros_frame_id": "roof"}
    lidar = episode.attach(Wanted("sensor.lidar.ray_cast", few), mount, car.id, Attachment.RIGID)
    imu = episode.attach(Wanted("sensor.other.imu", {}), mount, car.id, Attachment.RIGID)
    for sensor in (camera, lidar, imu):
        assert not is_sensor_enabled_for_ros(served, sensor.stream)
        enable_sensor_for_ros(served, sensor.stream)
    assert [is_sensor_enabled_for_ros(served, s.stream) for s in (camera, lidar, imu)] == [
        True, True, False,  # an IMU publishes nothing
    ]  # fmt: skip
    sent: dict[int, list[bytes]] = {}
    publish = hub.publish

    def noted(stream: int, *parts: bytes) -> None:
        sent[stream] = [bytes(p) for p in parts]
        publish(stream, *parts)

    hub.publish = noted  # type: ignore[method-assign]
    node, types = participant(DOMAIN), Types()
    topics = {
        "/carla/ego/front/image": IMAGE,
        "/carla/ego/top": POINTS,
        "/carla/ego/odometry": ODOMETRY,
        "/tf": PLACES,
    }
    readers = {}
    for topic, kind in topics.items():
        wanted = qos(Flow.LIVE)
        readers[topic] = DataReader(node, Topic(node, f"rt{topic}", types.cls(kind)), qos=wanted)
    episode.vehicles.set_velocity(car.id, (5.0 * cos(start.yaw), 5.0 * sin(start.yaw), 0.0))
    served.tick()  # topics are made with their first message
    deadline = time.monotonic() + PATIENCE
    while any(not r.get_matched_publications() for r in readers.values()):
        assert time.monotonic() < deadline, "readers and writers did not meet"
        time.sleep(0.02)
    served.tick()
    image, points, odometry, frames = (take(readers[t])[-1] for t in topics)
    assert (image.width, image.height, image.step, image.encoding) == (16, 8, 64, "bgra8")
    assert image.header.frame_id == "front"
    stamp = image.header.stamp.sec + 1e-9 * image.header.stamp.nanosec
    assert stamp == pytest.approx(served.clock.elapsed)
    assert bytes(image.data) == sent[camera.stream][2]
    cloud = np.frombuffer(bytes(points.data), dtype="<f4").reshape(-1, 4)
    wired = np.frombuffer(sent[lidar.stream][2], dtype="<f4").reshape(-1, 4)
    assert len(cloud) == points.width > 50
    assert cloud == pytest.approx(wired * [1.0, -1.0, 1.0, 1.0])  # ROS's y is to the left
    assert points.header.frame_id == "roof"
    pose = episode.actors.pose(car)
    at = odometry.pose.pose.position
    assert (at.x, at.y) == pytest.approx((pose.x, pose.y))
    assert odometry.twist.twist.linear.x == pytest.approx(5.0, abs=0.3)
    assert {(t.header.frame_id, t.child_frame_id) for t in frames.transforms} == {
        ("map", "ego"), ("ego", "front"), ("ego", "roof"),
    }  # fmt: skip
    disable_sensor_for_ros(served, camera.stream)
    served.tick()
    time.sleep(0.2)
    assert not list(readers["/carla/ego/front/image"].take(100))


def test_a_name_of_any_letters_is_published_in_ascii() -> None:
    hub, sent = StreamHub(), []
    served = Served(ServerOptions(map="straight"), hub)
    topics = SensorTopics(DOMAIN)
    served.ros = RosOutput(topics, hub)
    send = topics._send
    topics._send = lambda topic, *rest: (sent.append(topic), send(topic, *rest))  # type: ignore[method-assign]
    episode = served.episode
    named = Wanted("vehicle.tesla.model3", {"ros_name": "größe 1"})
    car = episode.spawn(named, episode.map.spawn_points[0])
    few = Wanted("sensor.lidar.ray_cast", {"points_per_second": "20000", "ros_name": "上"})
    lidar = episode.attach(few, Pose(0.0, 0.0, 2.0), car.id, Attachment.RIGID)
    enable_sensor_for_ros(served, lidar.stream)
    served.tick()
    assert sent == ["/carla/gr__e_1/odometry", "/tf", "/carla/gr__e_1/_"]
    assert topics.dropped == 0


def test_a_lidar_cannot_take_the_topic_of_odometry() -> None:
    hub = StreamHub()
    served = Served(ServerOptions(map="straight"), hub)
    served.ros = RosOutput(SensorTopics(DOMAIN), hub)
    episode = served.episode
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), episode.map.spawn_points[0])
    named = Wanted("sensor.lidar.ray_cast", {"ros_name": "odometry"})
    lidar = episode.attach(named, Pose(0.0, 0.0, 2.0), car.id, Attachment.RIGID)
    with pytest.raises(CallError, match="ros_name odometry is taken"):
        enable_sensor_for_ros(served, lidar.stream)


def test_a_topic_that_dds_refuses_is_a_dropped_message() -> None:
    topics, points = SensorTopics(DOMAIN), np.zeros((1, 4), np.float32)
    topics.send_points("/carla/größe", "a", 0.0, points)
    assert topics.dropped == 1
    topics.send_points("/carla/one", "a", 0.0, points)
    topics.send_image("/carla/one", "a", 0.0, (1, 1), bytes(4))  # another type
    topics.send_points("/carla/one", "a", 0.0, points)
    assert topics.dropped <= 2
