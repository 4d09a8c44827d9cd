"""ROS 2 topics over DDS on this machine: bytes, lossless replay at any speed, and bad writers."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import msgspec
import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="cyclonedds is not installed")
rosbags = pytest.importorskip("rosbags.typesys", reason="rosbags is not installed")
from cyclonedds.core import DDSException  # noqa: E402

from skidpad.campaign.channels.drive import drive_segment  # noqa: E402
from skidpad.core.channels import ChannelFrame  # noqa: E402
from skidpad.core.errors import FileError  # noqa: E402
from skidpad.evidence.channels.monitor import MonitorSettings  # noqa: E402
from skidpad.live.ros2 import publisher as ros2_publisher  # noqa: E402
from skidpad.live.ros2.listener import RosTopics  # noqa: E402
from skidpad.live.ros2.messages import Messages  # noqa: E402
from skidpad.live.ros2.publisher import RosPublisher, mapping_of  # noqa: E402
from skidpad.live.ros2.types import (  # noqa: E402
    BASE,
    NAME,
    OBJECTS,
    ODOMETRY,
    PATH,
    Types,
    ros_name,
)
from skidpad.live.settings import Flow, Links  # noqa: E402
from skidpad.live.watch import watch  # noqa: E402
from skidpad.recording.channels.indicators import read_indicators  # noqa: E402
from skidpad.recording.channels.mcap_files import McapRecording  # noqa: E402
from skidpad.recording.formats.ros_bag import Mapping  # noqa: E402
from support.channel_worlds import Eyes, World, drive, frame  # noqa: E402
from support.runs import segment_run  # noqa: E402

DOMAIN = 1 + os.getpid() % 99  # one per process of the tests; ports below those given at random
PATIENCE = 900.0  # s; kernels may have to be compiled first
WORLD = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(-12.0, 0.0, 0.0, 15.6, 0.0)]))
EYES = (Eyes("lav", 0.02), Eyes("tfuse", 0.02, blind=(0,)))


def dds_name(name):
    """The DDS name of a message's type such as nav_msgs/msg/Odometry."""
    package, _, kind = name.split("/")
    return f"{package}::msg::dds_::{kind}_"


def from_rosbags(types, name, message):
    """A message of rosbags as one of the DDS library."""
    defs = types.store.fielddefs[name][1]
    return types.cls(name)(**{n: dds_value(types, d, getattr(message, n)) for n, d in defs})


def dds_value(types, definition, value):
    """A field's value as DDS takes it: plain as it is, messages converted, arrays as lists."""
    kind, what = int(definition[0]), definition[1]
    if kind == BASE:
        return value
    if kind == NAME:
        return from_rosbags(types, what, value)
    plain = value.tolist() if hasattr(value, "tolist") else value
    return [dds_value(types, what[0], v) for v in plain]


@pytest.mark.req("C-201")
@pytest.mark.parametrize("typestore", ["ros2_humble", "ros2_jazzy"])
def test_the_bytes_of_every_message_are_those_of_rosbags(typestore):
    types = Types(typestore)
    make, store = Messages(types), types.store
    f = frame(1234.5, (1.0, 2.0, 0.3, 4.0, 5.0), [(7.0, 8, 0.9, 1, 2)] * 3, ids=[1, 2, 3])
    for name, message in (
        (ODOMETRY, make.odometry(f)),
        (PATH, make.path(f)),
        (OBJECTS, make.objects(f)),
    ):
        ours = message.serialize(use_version_2=False)
        theirs = store.deserialize_cdr(ours, name)
        assert bytes(store.serialize_cdr(theirs, name)) == ours
        assert from_rosbags(types, name, theirs).serialize(use_version_2=False) == ours
        assert dds_name(name) == types.cls(name).__idl__.idl_transformed_typename
        assert ros_name(dds_name(name)) == name


@pytest.mark.req("C-201")
def test_every_message_of_the_distribution_that_channels_may_use_has_its_class():
    types = Types()
    packages = ("std_msgs", "geometry_msgs", "nav_msgs", "builtin_interfaces", "sensor_msgs")
    names = [n for n in types.store.fielddefs if n.split("/")[0] in packages]
    assert len(names) > 60
    for name in names:
        assert types.cls(name).__idl__.idl_transformed_typename == dds_name(name)


def replayed(source, folder, pause):
    """Publish a listed drive in this thread and watch it in another; returns what was found."""
    done, failed = {}, []

    def listen():
        try:
            topics = RosTopics(mapping_of(source.channels, 4.5, 1.8), DOMAIN, PATIENCE, PATIENCE)
            done["found"] = watch(topics, folder, MonitorSettings())
            topics.close()
        except Exception as error:
            failed.append(error)

    thread = threading.Thread(target=listen)
    thread.start()
    try:
        publisher = RosPublisher(
            source.channels, folder.with_suffix(".mcap"), Flow.LOSSLESS, DOMAIN
        )
        by_time: dict[int, list] = {}
        for channel, item in source.rows:
            by_time.setdefault(round(item.t * 10), []).append((channel, item))
        for k, rows in by_time.items():
            for channel, item in rows:
                publisher.hear(channel, item)
            publisher.cycle_over(k, 0.1 * k)
            time.sleep(pause)
        publisher.close()
    finally:
        thread.join(PATIENCE)
    assert not thread.is_alive()
    assert not failed, failed
    assert not publisher.ended
    return done["found"]


@pytest.mark.req("C-202", "C-203")
def test_a_slower_and_a_faster_replay_give_the_same_hazards(tmp_path):
    source = drive(WORLD, EYES, 12.0, with_truth=False)
    fast = replayed(source, tmp_path / "fast", 0.0)
    slow = replayed(source, tmp_path / "slow", 0.01)
    assert fast.hazards == slow.hazards
    assert fast.hazards
    assert fast.cycles == slow.cycles == 121
    assert fast.summary["losses"] == slow.summary["losses"]
    for name in ("hazards.txt", "hazards.jsonl"):
        assert (tmp_path / "fast" / name).read_bytes() == (tmp_path / "slow" / name).read_bytes()
    assert read_indicators(tmp_path / "fast").equals(read_indicators(tmp_path / "slow"))
    here = watch(source, tmp_path / "here", MonitorSettings())
    assert here.hazards == fast.hazards  # stamps and coordinates came through


@pytest.mark.req("C-200", "C-202")
def test_a_drive_is_heard_by_a_monitor_of_its_own_command(tmp_path, monkeypatch):
    monkeypatch.setattr(ros2_publisher, "LISTENERS", PATIENCE)
    mapping = tmp_path / "map.yaml"
    mapping.write_bytes(
        msgspec.yaml.encode(msgspec.to_builtins(mapping_of(("lav_like", "tfuse_like"))))
    )
    root = Path(__file__).parents[2]
    words = ["monitor", "--listen", "ros2", "--mapping", mapping, "--out", tmp_path / "heard"]
    call = [
        sys.executable,
        "-m",
        "skidpad",
        *map(str, words),
        "--domain",
        str(DOMAIN),
        "--wait",
        str(PATIENCE),
    ]
    environment = {**os.environ, "PYTHONPATH": str(root / "src")}
    monitor = subprocess.Popen(
        call, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        links = Links(publish=("ros2",), domain=DOMAIN)
        drive_segment(segment_run(duration=2.0), tmp_path / "a.mcap", links)
        said, _ = monitor.communicate(timeout=PATIENCE)
    finally:
        monitor.kill()
        monitor.wait()
    assert monitor.returncode == 0, said
    assert "all interfaces" in said  # DDS asks nobody who they are: that must be known
    table = read_indicators(tmp_path / "heard")
    watch(McapRecording(tmp_path / "a.mcap", truth=False), tmp_path / "file", MonitorSettings())
    expected = read_indicators(tmp_path / "file")
    assert table["cycle"].n_unique() == expected["cycle"].n_unique() == 20
    assert (tmp_path / "a.ros2.yaml").exists()
    assert '"complete"' in (tmp_path / "a.ros2.json").read_text()
    both = table.join(expected, on=["cycle", "subject", "indicator"], suffix="_file")
    same = both.drop_nulls(["value", "value_file"])
    assert len(same) > 300
    # shapes travel as 32-bit numbers
    assert (same["value"] - same["value_file"]).abs().max() < 1e-3


@pytest.mark.req("C-202")
def test_what_is_not_there_or_of_another_kind_is_one_sentence():
    with pytest.raises(FileError, match=r"nobody writes /skidpad/x/objects.* heard"):
        RosTopics(mapping_of(("x",)), DOMAIN, patience=0.2)
    publisher = RosPublisher(("a",), Path("unused.mcap"), Flow.LIVE, DOMAIN)
    swapped = mapping_of(("a",)).channels["a"]
    wrong = msgspec.structs.replace(
        swapped, ego=msgspec.structs.replace(swapped.ego, topic="/skidpad/a/plan")
    )
    with pytest.raises(FileError, match=r"/skidpad/a/plan is of type nav_msgs/msg/Path; of ego"):
        RosTopics(Mapping(channels={"a": wrong}), DOMAIN, patience=PATIENCE)
    publisher.writers.clear()


def test_frames_come_back_from_the_wire_as_they_went():
    f = frame(5.2, (1.0, 2.0, 0.3, 4.0, 5.0), [(7.0, 8, 0.9, 1, 2)], ids=[9], classes=[14])
    from skidpad.recording.formats.ros_bag import RosFrames

    make, frames = Messages(Types()), RosFrames(mapping_of(("a",), 4.5, 1.8))
    assert list(frames.take("/skidpad/a/objects", 5.2, make.objects(f), OBJECTS)) == []
    assert list(frames.take("/skidpad/a/plan", 5.2, make.path(f), PATH)) == []
    (message,) = frames.take("/skidpad/a/odom", 5.2, make.odometry(f), ODOMETRY)
    back = message.item
    assert isinstance(back, ChannelFrame)
    for name in ("ego", "plan", "objects", "predictions", "prediction_t", "ids", "classes"):
        assert getattr(back, name) == pytest.approx(getattr(f, name), abs=1e-8), name
    assert back.ego_polygon == pytest.approx(f.ego_polygon)
    assert back.polygons == pytest.approx(f.polygons, abs=1e-6)


class Full:
    """A writer whose reader has no room in one cycle."""

    def __init__(self, writer, full_at):
        self.writer, self.full_at = writer, full_at

    def write(self, message, stamp):
        if stamp == self.full_at:
            raise DDSException(DDSException.DDS_RETCODE_TIMEOUT, "full")
        self.writer.write(message, stamp)

    def wait_for_acks(self, limit):
        return True


@pytest.mark.req("C-005")
@pytest.mark.parametrize(("flow", "missing"), [(Flow.LIVE, [2]), (Flow.LOSSLESS, [2, 3, 4])])
def test_a_reader_without_room_costs_a_cycle_and_the_drive_nothing(
    tmp_path, monkeypatch, flow, missing
):
    monkeypatch.setattr(ros2_publisher, "LISTENERS", 0.0)
    publisher = RosPublisher(("full",), tmp_path / "a.mcap", flow, DOMAIN)
    publisher.ended = ""  # nobody listens, as is said; here somebody is slow
    part = (0, "plan")
    publisher.writers[part] = Full(publisher.writers[part], 200_000_000)
    for k in range(5):
        publisher.hear(0, frame(0.1 * k, (1.5 * k, 0.0, 0.0, 15.0, 0.0)))
        publisher.cycle_over(k, 0.1 * k)
    publisher.close()
    assert publisher.missing == missing
    said = (tmp_path / "a.ros2.json").read_text()
    assert ("complete" in said) is (flow is Flow.LIVE)
