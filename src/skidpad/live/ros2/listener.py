"""ROS 2 topics as a source of channels, put in the order of their stamps."""

from __future__ import annotations

import heapq
import time
from collections.abc import Iterator
from typing import Any

from skidpad.core.errors import ConfigError, FileError, MissingExtra
from skidpad.live.ros2.network import like, participant, said_of_type
from skidpad.live.ros2.types import Types, ros_name
from skidpad.recording.channels.mcap_files import Losses, Message
from skidpad.recording.formats.ros_bag import ODOMETRY, Clock, Mapping, RosFrames, stamp_of
from skidpad.recording.formats.ros_objects import OBJECT_READERS

try:
    from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
    from cyclonedds.internal import InvalidSample
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic
except ImportError as error:
    raise MissingExtra("ROS 2 topics", "live") from error

POLL = 0.005  # s
AT_ONCE = 1000  # samples of a topic
LAG = 5.0  # s of stamps by which a topic may be behind before the others go on without it
ROLES = ("objects", "plan", "ego")  # of one stamp: the pose completes the frame
PLANS = ("nav_msgs/msg/Path", "autoware_planning_msgs/msg/Trajectory")
READ = {"ego": (ODOMETRY,), "plan": PLANS, "objects": tuple(OBJECT_READERS)}


class RosTopics:
    """Reads the topics that `mapping` names; ends when all writers have gone, or all is silent."""

    def __init__(
        self, mapping: Mapping, domain: int = 0, patience: float = 60.0, silence: float = 60.0
    ) -> None:
        if mapping.clock is not Clock.HEADER:
            raise ConfigError("--listen: clock must be header, times are taken from stamps")
        self.mapping, self.silence = mapping, silence
        self.channels = tuple(mapping.channels)
        self.losses = Losses()
        self.types = Types(mapping.typestore)
        self.frames = RosFrames(mapping)
        self.participant = participant(domain)
        self.kinds: dict[str, str] = {}
        self.readers: dict[str, Any] = {}
        self._open(patience)

    def _open(self, patience: float) -> None:
        """Waits `patience` s for a writer of every topic and opens a reader of each; FileError otherwise."""
        found = BuiltinDataReader(self.participant, BuiltinTopicDcpsPublication)
        deadline = time.monotonic() + patience
        wanted, heard = set(self.frames.roles), set[str]()
        while wanted:
            for writer in found.take(AT_ONCE):
                if isinstance(writer, InvalidSample):
                    continue
                heard.add(writer.topic_name)
                topic = writer.topic_name.removeprefix("rt")
                if topic in wanted:
                    self._read(topic, writer)
                    wanted.remove(topic)
            if wanted and time.monotonic() > deadline:
                raise FileError(
                    f"nobody writes {', '.join(sorted(wanted))} within {patience:g} s; heard: "
                    + (", ".join(sorted(heard)) or "nothing")
                )
            time.sleep(POLL)

    def _read(self, topic: str, writer: Any) -> None:
        """Opens a reader of the topic; raises FileError if the writer's type or hash does not fit."""
        kind = ros_name(writer.type_name)
        for _, role in self.frames.roles[topic]:
            if kind not in READ[role]:
                raise FileError(
                    f"{topic} is of type {kind}; of {role} {', '.join(READ[role])} are read"
                )
        try:
            cls = self.types.cls(kind)
        except KeyError as error:
            raise FileError(f"{topic} is of type {kind}, whose definition is not known") from error
        ours, theirs = self.types.store.hash_rihs01(kind), said_of_type(writer.qos)
        if theirs and theirs != ours:
            raise FileError(
                f"{topic}: the writer's {kind} has the hash {theirs}, that of "
                f"{self.mapping.typestore} is {ours}"
            )
        asked = like(writer.qos)
        rt = Topic(self.participant, f"rt{topic}", cls, qos=asked)
        self.kinds[topic] = kind
        self.readers[topic] = DataReader(self.participant, rt, qos=asked)

    def messages(self) -> Iterator[Message]:
        """Yields frames as they complete; a second call goes on where the first ended.

        It ends with the writers, after `silence` s without a sample (a loss), or by Ctrl-C.
        """
        roles = self.frames.roles
        ranks = {t: min(ROLES.index(role) for _, role in roles[t]) for t in self.readers}
        merge = _Merge(tuple(self.readers), ranks)
        quiet = time.monotonic()
        try:
            while True:
                gone = not any(r.get_matched_publications() for r in self.readers.values())
                if self._take(merge):
                    quiet = time.monotonic()
                    for entry in merge.ready():
                        yield from self._frames(*entry)
                elif merge.has_begun and gone:
                    break
                elif time.monotonic() - quiet > self.silence:
                    self.losses.cut = True
                    break
                else:
                    time.sleep(POLL)
        except KeyboardInterrupt:
            pass  # Ctrl-C ends the watch, not what it has found
        for entry in merge.rest():
            yield from self._frames(*entry)

    def _take(self, merge: _Merge) -> bool:
        """Adds the samples that came to `merge`; returns True when there was any."""
        some = False
        for topic, reader in self.readers.items():
            for sample in reader.take(AT_ONCE):
                if isinstance(sample, InvalidSample):
                    continue  # a word about its writer, no data
                merge.add(topic, stamp_of(sample), sample)
                some = True
        return some

    def _frames(self, t: float, topic: str, content: Any) -> Iterator[Message]:
        """Yields the channel messages in a topic's message at `t` s; a malformed one counts as lost."""
        try:
            yield from self.frames.take(topic, t, content, self.kinds[topic])
        except (FileError, ValueError, KeyError, IndexError, AttributeError, TypeError):
            self.losses.malformed += 1

    def close(self) -> None:
        """Leaves the DDS domain and releases all readers."""
        self.readers.clear()
        del self.participant


class _Merge:
    """Sorts messages of several topics by their stamps, then by roles."""

    def __init__(self, topics: tuple[str, ...], rank: dict[str, int]) -> None:
        self.rank, self.newest = rank, dict.fromkeys(topics, -float("inf"))
        self.waiting: list[tuple[float, int, str, int, Any]] = []
        self.count = 0

    @property
    def has_begun(self) -> bool:
        """Returns True when any message has arrived."""
        return self.count > 0

    def add(self, topic: str, t: float, content: Any) -> None:
        """Adds a topic's message, whose time stamp is `t` s."""
        self.count += 1
        self.newest[topic] = max(self.newest[topic], t)
        heapq.heappush(self.waiting, (t, self.rank[topic], topic, self.count, content))

    def ready(self) -> Iterator[tuple[float, str, Any]]:
        """Yields messages that none can precede; a topic LAG s of stamps behind is not waited for."""
        last = max(self.newest.values())
        safe = min(t for t in self.newest.values() if t >= last - LAG)
        while self.waiting and self.waiting[0][0] <= safe:
            t, _, topic, _, content = heapq.heappop(self.waiting)
            yield t, topic, content

    def rest(self) -> Iterator[tuple[float, str, Any]]:
        """Yields all messages that are left, in order of time."""
        while self.waiting:
            t, _, topic, _, content = heapq.heappop(self.waiting)
            yield t, topic, content
