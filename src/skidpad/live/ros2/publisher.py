"""Channels on ROS 2 topics while they drive: /skidpad/NAME/odom, /plan and /objects."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from skidpad.core.channels import ChannelFrame
from skidpad.core.errors import MissingExtra
from skidpad.live.outcome import LinkOutcome
from skidpad.live.ros2.messages import Messages
from skidpad.live.ros2.network import BLOCKING, participant, qos
from skidpad.live.ros2.types import OBJECTS, ODOMETRY, PATH, Types
from skidpad.live.settings import Flow
from skidpad.recording.channels.mcap_files import Item
from skidpad.recording.files import write_bytes, write_json
from skidpad.recording.formats.ros_bag import (
    ChannelTopics,
    EgoTopic,
    Mapping,
    ObjectTopic,
    PlanTopic,
)

try:
    from cyclonedds.core import DDSException
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic
    from cyclonedds.util import duration
except ImportError as error:
    raise MissingExtra("ROS 2 topics", "live") from error

KINDS = {"odom": ODOMETRY, "plan": PATH, "objects": OBJECTS}
POLL = 0.02  # s
LISTENERS = 120.0  # s that a lossless drive waits for its listeners


def topic_of(channel: str, part: str) -> str:
    """Returns the ROS name of a channel's topic; part: odom, plan or objects."""
    return f"/skidpad/{channel}/{part}"


def mapping_of(channels: Sequence[str], length: float = 4.7, width: float = 1.9) -> Mapping:
    """Returns the mapping by which our own topics are read back; the ego's size in m."""
    return Mapping(
        channels={
            name: ChannelTopics(
                ego=EgoTopic(topic_of(name, "odom"), length=length, width=width),
                plan=PlanTopic(topic_of(name, "plan")),
                objects=ObjectTopic(topic_of(name, "objects")),
            )
            for name in channels
        }
    )


class RosPublisher:
    """Publishes channels over DDS. Lossless: it waits for a reader, and for its room."""

    def __init__(
        self,
        channels: Sequence[str],
        recording: Path,
        flow: Flow,
        domain: int = 0,
    ) -> None:
        self.channels, self.recording, self.flow = tuple(channels), recording, flow
        self.types = Types()
        self.messages = Messages(self.types)
        self.participant = participant(domain)
        self.writers = {
            (c, part): self._writer(topic_of(name, part), kind)
            for c, name in enumerate(channels)
            for part, kind in KINDS.items()
        }
        self.said: list[Any] = []
        self.cycles, self.missing, self.ended = 0, list[int](), ""
        self.described = False
        self.cut = False  # a reader had no room for all of this cycle
        if flow is Flow.LOSSLESS:
            self._await_readers()

    def _writer(self, topic: str, kind: str) -> Any:
        """Returns a DDS writer of the topic for messages of type `kind`, with the flow's quality."""
        wanted = qos(self.flow, self.types.describe_type(kind))
        rt = Topic(self.participant, f"rt{topic}", self.types.cls(kind), qos=wanted)
        return DataWriter(self.participant, rt, qos=wanted)

    def _await_readers(self) -> None:
        """Waits until every topic has a reader; after LISTENERS s notes the end of the publisher."""
        deadline = time.monotonic() + LISTENERS
        while any(not w.get_matched_subscriptions() for w in self.writers.values()):
            if time.monotonic() > deadline:
                self.ended = f"nobody listened to all topics within {LISTENERS:g} s"
                return
            time.sleep(POLL)

    def hear(self, channel: int | None, item: Item) -> None:
        """Publishes a channel's frame: objects and plan before the pose, which completes it.

        Nothing for other items, a pose that is not finite, or after a reader had no room.
        """
        if channel is None or not isinstance(item, ChannelFrame) or self.ended or self.cut:
            return
        if not self.described:
            self._describe(item)
        if not np.isfinite(item.ego).all():
            return  # a pose that is no number cannot be said in a quaternion: the channel is silent
        usable = item._replace(plan=item.plan[np.isfinite(item.plan).all(axis=1)])
        parts = [("objects", self.messages.objects)]
        if len(usable.plan):
            parts.append(("plan", self.messages.path))
        for part, make in [*parts, ("odom", self.messages.odometry)]:
            try:
                self.writers[channel, part].write(make(usable), round(item.t * 1e9))
            except DDSException as error:
                self.cut = True  # a live drive drops the rest of this cycle and goes on
                if self.flow is Flow.LOSSLESS:
                    self.ended = f"a reader took nothing ({error.msg}), after {self.cycles} cycles"
                return

    def cycle_over(self, k: int, t: float) -> None:
        """Counts the cycle, and as missing when a message of it was cut."""
        del t
        self.cycles += 1
        if self.ended or self.cut:
            self.missing.append(k)
        self.cut = False

    def close(self) -> None:
        """Waits until readers have it all, leaves the domain and writes NAME.ros2.json."""
        if self.flow is Flow.LOSSLESS and not self.ended:
            for writer in self.writers.values():
                if not writer.wait_for_acks(duration(seconds=BLOCKING)):
                    self.ended = f"a reader did not take everything within {BLOCKING:g} s"
        self.writers.clear()
        del self.participant
        ended = self.ended or "complete"
        outcome = LinkOutcome(flow=self.flow, cycles=self.cycles, missing=self.missing, ended=ended)
        write_json(self.recording.with_suffix(".ros2.json"), outcome, indent=1)

    def _describe(self, frame: ChannelFrame) -> None:
        """Writes NAME.ros2.yaml, the mapping that reads these topics, with the ego's true size."""
        length, width = np.ptp(frame.ego_polygon, axis=0).tolist()
        mapping = mapping_of(self.channels, round(length, 3), round(width, 3))
        plain = msgspec.to_builtins(mapping)
        write_bytes(self.recording.with_suffix(".ros2.yaml"), msgspec.yaml.encode(plain))
        self.described = True
