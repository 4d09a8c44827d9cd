"""Channel recordings: MCAP with the schema of channels.proto embedded, one topic per channel.

A file cut short or damaged in places is read as far as it goes; `Losses` says what was lost.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import mcap.records
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from skidpad.core.channels import ChannelFrame, Context, Decision, Due, TruthFrame
from skidpad.core.errors import ConfigError, FileError, OutputError
from skidpad.recording.channels import channels_pb2 as pb
from skidpad.recording.channels import codec

CHANNEL_TOPIC = "/channels/"
TRUTH_TOPIC = "/truth"
DECISION_TOPIC = "/arbiter"
CONTEXT_TOPIC = "/context"
CHUNK_SIZE = 64 * 1024  # bytes; what a power cut can cost
RECORD_LIMIT = 64 * 1024 * 1024  # bytes; a longer record is damage
FLUSH_EVERY = 1.0  # s of recorded time
NS = 1_000_000_000
PREFIX = "skidpad."  # of schemas

Item = ChannelFrame | TruthFrame | Decision | Context


@dataclass(frozen=True, slots=True)
class Message:
    """One item of a recording; `channel` is the index of the driving channel that said it."""

    channel: int | None  # None: truth, decision or context
    t: float  # s
    item: Item | Due  # Due: from live sources only


@dataclass(slots=True)
class Losses:
    """What a recording should hold and did not give; words for people come from `report`."""

    cut: bool = False  # the file ends before its footer
    chunks: int = 0  # damaged chunks that were skipped
    malformed: int = 0  # messages whose content does not fit together
    foreign: int = 0  # messages of topics or types that are not read
    out_of_order: int = 0  # messages older than their channel's newest
    jumps: int = 0  # single messages with a time far ahead of all others
    stale: dict[str, int] = field(
        default_factory=dict
    )  # cycles without a fresh message, by channel

    def any(self) -> bool:
        """Returns whether anything was lost; messages of foreign topics are no loss."""
        return self.cut or bool(
            self.chunks or self.malformed or self.out_of_order or self.jumps or self.stale
        )


class ChannelSource(Protocol):
    """Anything that replays what channels said: an MCAP file, a ROS bag, a list in memory."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Returns the names of the driving channels."""
        ...

    @property
    def losses(self) -> Losses:
        """Returns what could not be read; complete once all messages have been."""
        ...

    def messages(self) -> Iterator[Message]:
        """Yields all messages, oldest first as far as the recording is in order."""
        ...


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """What `skidpad channels info` says about a topic."""

    topic: str
    schema: str
    messages: int
    t_first: float  # s
    t_last: float


class ChannelWriter(AbstractContextManager["ChannelWriter"]):
    """Writes a channel recording; times must not run backwards by the caller's own clock."""

    def __init__(self, path: Path, channels: Sequence[str]) -> None:
        if not channels or len(set(channels)) != len(channels):
            raise ConfigError(f"channels must be different names, got {list(channels)}")
        self.channels = tuple(channels)
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise OutputError(f"{path}: cannot be written ({error.strerror})") from error
        self._writer = Writer(self._file, chunk_size=CHUNK_SIZE)
        self._writer.start(profile="skidpad", library="skidpad")
        self._writer.add_metadata("skidpad", {"channels": json.dumps(list(channels))})
        file = FileDescriptorSet()
        pb.DESCRIPTOR.CopyToProto(file.file.add())
        schemas = {
            kind.name: int(
                self._writer.register_schema(
                    f"skidpad.{kind.name}", "protobuf", file.SerializeToString()
                )
            )
            for kind in codec.KINDS.values()
        }
        self._topics: dict[object, int] = {
            name: self._topic(CHANNEL_TOPIC + name, schemas["Channel"]) for name in channels
        }
        self._topics[TruthFrame] = self._topic(TRUTH_TOPIC, schemas["Truth"])
        self._topics[Decision] = self._topic(DECISION_TOPIC, schemas["Decision"])
        self._topics[Context] = self._topic(CONTEXT_TOPIC, schemas["Context"])
        self._flushed_at = -float("inf")

    def _topic(self, topic: str, schema: int) -> int:
        """Registers a topic with its schema's id and returns the id of the topic."""
        return int(self._writer.register_channel(topic, "protobuf", schema))

    def add(self, item: Item, channel: int | None = None) -> None:
        """Appends any item; a frame, and nothing else, with the index of the channel that said it.

        ConfigError for another index, and for a time outside [0, 1.8e10) s.
        """
        indices = range(len(self.channels)) if isinstance(item, ChannelFrame) else (None,)
        if channel not in indices:
            kind = type(item).__name__
            raise ConfigError(f"channel of a {kind} must be in {list(indices)}, got {channel!r}")
        if not 0.0 <= item.t < 1.8e10:  # MCAP stores unsigned nanoseconds
            raise ConfigError(f"time of a channel message must be in [0, 1.8e10) s, got {item.t!r}")
        message, stamp = codec.KINDS[type(item)].write(item), round(item.t * NS)
        topic = self._topics[type(item) if channel is None else self.channels[channel]]
        self._writer.add_message(topic, stamp, message.SerializeToString(), stamp)
        if item.t - self._flushed_at >= FLUSH_EVERY:
            self._file.flush()
            self._flushed_at = item.t

    def close(self) -> None:
        """Finishes the file; safe to call twice."""
        if not self._file.closed:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def __exit__(self, *error: object) -> None:
        self.close()


_READERS = {kind.name: kind.read for kind in codec.KINDS.values()}


def read_item(name: str, data: bytes, losses: Losses) -> Item | None:
    """Returns the item in a message of this name; None, counted as a loss, if foreign or malformed."""
    reader: Callable[[Any], Item] | None = _READERS.get(name)
    if reader is None:
        losses.foreign += 1
        return None
    try:
        return reader(getattr(pb, name).FromString(data))
    except (FileError, ValueError, OverflowError, DecodeError):
        losses.malformed += 1
        return None


class McapRecording:
    """A channel recording on disk. Reads front to back, so that a cut file still reads.

    Without `truth` the true world is not even decoded.
    """

    def __init__(self, path: Path, truth: bool = True) -> None:
        self.path = path
        self.truth = truth
        self.losses = Losses()
        self.topics = self._scan()
        names = [t.topic for t in self.topics if t.schema == "skidpad.Channel"]
        if not names:
            raise FileError(f"{path}: holds no channel topics of type skidpad.Channel")
        self.channels = tuple(name.removeprefix(CHANNEL_TOPIC) for name in names)

    def messages(self) -> Iterator[Message]:
        """Yields all messages; `losses` begins anew and is complete once they have been read."""
        self.losses = Losses()
        index = {CHANNEL_TOPIC + name: i for i, name in enumerate(self.channels)}
        for topic, schema, record in self._records(self.losses):
            if schema == "skidpad.Truth" and not self.truth:
                continue
            name = schema.removeprefix(PREFIX) if schema.startswith(PREFIX) else ""
            item = read_item(name, record.data, self.losses)
            if item is None:
                continue
            channel = index.get(topic) if isinstance(item, ChannelFrame) else None
            yield Message(channel, item.t, item)

    def _scan(self) -> tuple[TopicInfo, ...]:
        """Returns each topic with its schema, count, first and last time in s; reads the whole file."""
        seen: dict[str, tuple[str, int, float, float]] = {}
        for topic, schema, record in self._records(self.losses):
            t = record.log_time / NS
            _, count, first, last = seen.get(topic, (schema, 0, t, t))
            seen[topic] = (schema, count + 1, min(first, t), max(last, t))
        return tuple(TopicInfo(topic, *seen[topic]) for topic in self._order_channels(list(seen)))

    def _order_channels(self, topics: list[str]) -> list[str]:
        """Returns the topics, channels in the order of the writer's metadata if it survives, then by name."""
        rank = {CHANNEL_TOPIC + name: i for i, name in enumerate(self._declared)}
        return sorted(topics, key=lambda topic: (rank.get(topic, len(rank)), topic))

    def _records(self, losses: Losses) -> Iterator[tuple[str, str, mcap.records.Message]]:
        """Yields topic, schema and message of each record; counts in `losses` what cannot be read."""
        self._declared: list[str] = []
        schemas: dict[int, str] = {}
        channels: dict[int, tuple[str, str]] = {}
        for record in self._top_level(losses):
            for inner in _open_chunk(record, losses):
                if isinstance(inner, mcap.records.Schema):
                    schemas[inner.id] = inner.name
                elif isinstance(inner, mcap.records.Channel):
                    channels[inner.id] = (inner.topic, schemas.get(inner.schema_id, ""))
                elif isinstance(inner, mcap.records.Metadata) and inner.name == "skidpad":
                    self._declared = _names(inner.metadata.get("channels", "[]"))
                elif isinstance(inner, mcap.records.Message):
                    if inner.channel_id not in channels:
                        losses.malformed += 1
                        continue
                    yield (*channels[inner.channel_id], inner)

    def _top_level(self, losses: Losses) -> Iterator[Any]:
        """Yields the records of the file, chunks whole; a damaged rest counts as cut."""
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise FileError(f"{self.path}: cannot be read ({error.strerror})") from error
        with stream:
            if stream.read(8) != b"\x89MCAP0\r\n":
                raise FileError(f"{self.path}: is not an MCAP file")
            stream.seek(0)
            reader = StreamReader(stream, emit_chunks=True, record_size_limit=RECORD_LIMIT)
            records = reader.records
            while True:
                try:
                    record = next(records)
                except StopIteration:
                    return
                except Exception:  # whatever the bytes provoke: the file ends here
                    losses.cut = True
                    return
                yield record


def _open_chunk(record: Any, losses: Losses) -> Sequence[Any]:
    """Returns the records inside a chunk, or the record itself; a damaged chunk is counted and empty."""
    if not isinstance(record, mcap.records.Chunk):
        return (record,)
    try:
        if record.uncompressed_size > RECORD_LIMIT:
            raise FileError("a chunk longer than any record may be")
        return breakup_chunk(record, validate_crc=True)
    except Exception:  # zstandard, lz4, struct and mcap each have their own errors
        losses.chunks += 1
        return ()


def _names(text: str) -> list[str]:
    """Returns the names in a JSON list; empty for anything else."""
    try:
        names = json.loads(text)
    except ValueError:
        return []
    return [str(name) for name in names] if isinstance(names, list) else []
