"""Channels from ROS 2 bags, by a mapping file that says which topic is what (decision C-10).

    clock: header                 # or receive: time of arrival, for channels whose clocks differ
    typestore: ros2_humble        # for bags that carry no definitions
    channels:
      lav:
        ego: {topic: /lav/odom, reference: rear_axle, length: 4.9, width: 1.9, centre_offset: 1.4}
        plan: {topic: /lav/trajectory}
        objects: {topic: /lav/objects, frame: ego}

Ego: nav_msgs/Odometry. Plan: autoware_planning_msgs/Trajectory, or nav_msgs/Path with stamps in its
poses or a `step`. Objects: autoware PredictedObjects or derived_object_msgs/ObjectArray. Message
definitions are taken from the bag where it has them.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from math import cos, sin
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame
from skidpad.core.errors import ConfigError, FileError, MissingExtra
from skidpad.core.files.reading import decode_yaml, read_bytes
from skidpad.core.text.told import on_a_line
from skidpad.recording.channels.mcap_files import Losses, Message
from skidpad.recording.formats.ros_objects import OBJECT_READERS, RosObjects, empty_objects, yaw_of

NS = 1e9
FRESH = 0.15  # s, an older object list does not belong to an ego pose
PLAN_FRESH = 1.0  # s, an older plan is none
EVERY = 0.05  # s between two frames of a channel at most
ODOMETRY = "nav_msgs/msg/Odometry"


class Frame(str, Enum):
    """What a topic's coordinates refer to."""

    WORLD = "world"
    EGO = "ego"


class Reference(str, Enum):
    """Which point of the ego its pose means."""

    CENTRE = "centre"
    REAR_AXLE = "rear_axle"


class Clock(str, Enum):
    """Which time of a message counts."""

    HEADER = "header"
    RECEIVE = "receive"


class EgoTopic(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a channel's ego pose comes from, and how large the ego is."""

    topic: str
    reference: Reference = Reference.CENTRE
    length: float = 4.7  # m
    width: float = 1.9
    centre_offset: float = 1.4  # m from the rear axle forward to the centre


class PlanTopic(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a channel's plan comes from; `step` in s for paths without times."""

    topic: str
    frame: Frame = Frame.WORLD
    step: float | None = None


class ObjectTopic(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where a channel's objects come from."""

    topic: str
    frame: Frame = Frame.WORLD


class ChannelTopics(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The topics of one channel."""

    ego: EgoTopic
    plan: PlanTopic | None = None
    objects: ObjectTopic | None = None


class Mapping(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file that maps topics of a bag to channels."""

    channels: dict[str, ChannelTopics]
    clock: Clock = Clock.HEADER
    typestore: str = "ros2_humble"


def load_mapping(path: Path) -> Mapping:
    """Returns the mapping in a file; ConfigError where it names no channels or does not fit."""
    mapping: Mapping = decode_yaml(read_bytes(path, "mapping"), str(path), Mapping)
    if not mapping.channels:
        raise ConfigError(f"{path}: names no channels")
    return mapping


class _Assembler:
    """The newest plan and objects of a channel, put together at each ego pose."""

    def __init__(self, topics: ChannelTopics) -> None:
        self.topics = topics
        self.plan: tuple[float, Floats] | None = None  # stamp and rows x, y, t from the stamp
        self.objects: tuple[float, RosObjects] | None = None
        self.last = -float("inf")
        half_l, half_w = topics.ego.length / 2.0, topics.ego.width / 2.0
        corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        offset = topics.ego.centre_offset if topics.ego.reference is Reference.REAR_AXLE else 0.0
        self.shape = corners * (half_l, half_w) + (offset, 0.0)

    def frame(self, t: float, odometry: Any) -> ChannelFrame | None:
        """Returns the channel's frame at an odometry message at t s; None while its objects are not fresh.

        None, too, less than EVERY after the frame before.
        """
        if t - self.last < EVERY - 1e-6 and t >= self.last:
            return None
        ego = _ego(odometry)
        found = empty_objects()
        if self.topics.objects is not None:
            if self.objects is None or abs(t - self.objects[0]) > FRESH:
                return None
            found = self.objects[1]
            if self.topics.objects.frame is Frame.EGO:
                found = found.to_world(ego)
        self.last = t
        return ChannelFrame(t, ego, self.shape, self._plan(t, ego), *found)

    def _plan(self, t: float, ego: Floats) -> Floats:
        """Returns the plan at `t` s in the world, times from now; empty where it is old or absent."""
        if self.topics.plan is None or self.plan is None or t - self.plan[0] > PLAN_FRESH:
            return np.zeros((0, 3))
        stamp, plan = self.plan
        rows: Floats = plan.copy()
        rows[:, 2] += stamp - t
        if self.topics.plan.frame is Frame.EGO:
            c, s = cos(ego[2]), sin(ego[2])
            rows[:, :2] = plan[:, :2] @ np.array([[c, s], [-s, c]]) + ego[:2]
        passed = int(np.searchsorted(rows[:, 2], 0.0))  # what is already driven
        ahead: Floats = rows[max(passed - 1, 0) :]
        return ahead


class RosFrames:
    """Messages of topics put together to frames, whether from a bag or from the wire."""

    def __init__(self, mapping: Mapping) -> None:
        self.assemblers = [_Assembler(topics) for topics in mapping.channels.values()]
        self.roles = _roles(mapping)

    def take(self, topic: str, t: float, content: Any, kind: str) -> Iterator[Message]:
        """Yields the frames that a message of type `kind` at t s completes; raises ValueError etc. if odd."""
        for c, role in self.roles[topic]:
            one = self.assemblers[c]
            if role == "objects":
                one.objects = (t, _objects(content, kind))
            elif role == "plan" and one.topics.plan is not None:
                one.plan = (t, _plan(content, one.topics.plan))
            elif role == "ego":
                frame = one.frame(t, content)
                if frame is not None:
                    yield Message(c, t, frame)


class RosRecording:
    """A ROS 2 bag read as channels."""

    def __init__(self, path: Path, mapping: Path) -> None:
        self.path = path
        self.mapping = load_mapping(mapping)
        self.channels = tuple(self.mapping.channels)
        self.losses = Losses()
        with self._reader() as reader:
            present = {c.topic: c.msgtype for c in reader.connections}
        for name, topics in self.mapping.channels.items():
            for part in (topics.ego, topics.plan, topics.objects):
                if part is not None and part.topic not in present:
                    raise FileError(
                        f"{path}: has no topic {part.topic} for channel {name}; it has: "
                        + ", ".join(sorted(present))
                    )
            if present[topics.ego.topic] != ODOMETRY:
                raise FileError(f"{path}: {topics.ego.topic} must be of type {ODOMETRY}")

    def _reader(self) -> Any:
        """Returns a reader of the bag, which a `with` statement opens.

        Raises MissingExtra without the package rosbags, ConfigError for an unknown typestore, FileError
        for what is no bag; `with` raises FileError where it cannot be opened.
        """
        try:
            from rosbags.highlevel import AnyReader, AnyReaderError
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise MissingExtra("reading ROS bags", "ros") from error
        try:
            store = get_typestore(Stores(self.mapping.typestore))
        except ValueError as error:
            known = ", ".join(s.value for s in Stores)
            raise ConfigError(
                f"unknown typestore {self.mapping.typestore!r}; choose one of: {known}"
            ) from error
        try:
            return _Opened(AnyReader([self.path], default_typestore=store))
        except (AnyReaderError, OSError, ValueError) as error:
            raise FileError(
                f"{self.path}: is not a readable ROS 2 bag ({on_a_line(error)})"
            ) from error

    def messages(self) -> Iterator[Message]:
        """Yields the frames of all channels in the order of arrival of their ego poses."""
        self.losses = Losses()
        frames = RosFrames(self.mapping)
        with self._reader() as reader:
            wanted = [c for c in reader.connections if c.topic in frames.roles]
            stream = reader.messages(wanted)
            while True:
                try:
                    connection, received, raw = next(stream)
                except StopIteration:
                    return
                except Exception:  # sqlite, mcap and zstd each have their own errors
                    self.losses.cut = True
                    return
                try:
                    content = reader.deserialize(raw, connection.msgtype)
                    t = received / NS if self.mapping.clock is Clock.RECEIVE else stamp_of(content)
                    yield from frames.take(connection.topic, t, content, connection.msgtype)
                except (FileError, ValueError, KeyError, IndexError, AttributeError, TypeError):
                    self.losses.malformed += 1


class _Opened:
    """A reader opened for a `with` block; failures to open become one sentence."""

    def __init__(self, reader: Any) -> None:
        self.reader = reader

    def __enter__(self) -> Any:
        try:
            return self.reader.__enter__()
        except Exception as error:  # sqlite, mcap, yaml: whatever the bag is made of
            raise FileError(f"the ROS 2 bag cannot be opened ({on_a_line(error)})") from error

    def __exit__(self, *args: object) -> None:
        self.reader.__exit__(*args)


def _roles(mapping: Mapping) -> dict[str, list[tuple[int, str]]]:
    """Returns channel index and role of each part, by topic."""
    roles: dict[str, list[tuple[int, str]]] = {}
    for c, topics in enumerate(mapping.channels.values()):
        for role in ("objects", "plan", "ego"):
            part = getattr(topics, role)
            if part is not None:
                roles.setdefault(part.topic, []).append((c, role))
    return roles


def stamp_of(content: Any) -> float:
    """Returns the time in s of a message's header."""
    stamp = content.header.stamp
    return float(stamp.sec + stamp.nanosec / NS)


def _ego(odometry: Any) -> Floats:
    """Returns the state (5,) from Odometry, whose twist is in the body's frame."""
    p, q, v = (
        odometry.pose.pose.position,
        odometry.pose.pose.orientation,
        odometry.twist.twist.linear,
    )
    h = yaw_of(q)
    c, s = cos(h), sin(h)
    return np.array([p.x, p.y, h, v.x * c - v.y * s, v.x * s + v.y * c])


def _plan(content: Any, topic: PlanTopic) -> Floats:
    """Returns rows x, y, t from the message's stamp, in m and s."""
    if hasattr(content, "points"):
        rows = [
            (
                p.pose.position.x,
                p.pose.position.y,
                p.time_from_start.sec + p.time_from_start.nanosec / NS,
            )
            for p in content.points
        ]
    else:
        t0 = stamp_of(content)
        rows = []
        for i, p in enumerate(content.poses):
            t = stamp_of(p) - t0 if topic.step is None else i * topic.step
            rows.append((p.pose.position.x, p.pose.position.y, t))
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _objects(content: Any, kind: str) -> RosObjects:
    """Returns the objects of a message; raises FileError for a kind that is not read."""
    reader = OBJECT_READERS.get(kind)
    if reader is None:
        raise FileError(f"objects of type {kind} are not read; {', '.join(OBJECT_READERS)} are")
    return reader(content)
