"""CARLA's recorder file: a header, then packets of one frame after the other, all little-endian.

Header and packets 0 to 9 are documented (CARLA's `ref_recorder_binary_file_format.md`). Packets 10 to
17, field orders and types: CARLA's public source, the plugin's `Recorder/CarlaRecorder*.h` and `.cpp`
(0.9.10 to the tree after 0.9.16). Packet 24, the weather, is in that tree (`CarlaRecorderWeather.cpp`);
whether release 0.9.16 writes it is unknown. Readers skip packets that they do not know, and so does
this one. Places are in cm, turns in deg (roll, pitch, yaw), both in CARLA's axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.simulation.carla_server.protocol.rpc import CallError

MAGIC = "CARLA_RECORDER"
VERSION = 1
NO_ACTOR = 2**32 - 1  # the other side of a contact with the scenery
NO_DURATION = -1.0  # of a frame after which none came

Vector = tuple[float, float, float]
Records = NDArray[np.void]
Attribute = tuple[int, str, str]  # type, name, value

_U16, _U32, _DATE = Struct("<H"), Struct("<I"), Struct("<q")
_HEAD = Struct("<BI")  # packet id, bytes that follow
_FRAME = Struct("<Qdd")  # number from 1, s to the next frame, s since the recording began
_ACTOR = Struct("<IB6fI")  # id, kind, place, turn, number of the description
_ATTRIBUTE = Struct("<B")
_TIME = Struct("<d")
DURATION_AT = _HEAD.size + 8  # byte of a frame's duration from the frame's first byte


class Packet(IntEnum):
    """The packets of a frame by their number in the file."""

    FRAME_START = 0
    FRAME_END = 1
    EVENT_ADD = 2
    EVENT_DEL = 3
    EVENT_PARENT = 4
    COLLISION = 5
    POSITION = 6
    TRAFFIC_LIGHT = 7
    VEHICLE = 8
    WALKER = 9
    VEHICLE_LIGHT = 10
    KINEMATICS = 12
    BOUNDING_BOX = 13
    PLATFORM_TIME = 14
    TRAFFIC_LIGHT_TIME = 16
    TRIGGER_VOLUME = 17
    WEATHER = 24


_ID = ("id", "<u4")
_BOX = np.dtype([_ID, ("origin", "<f4", (3,)), ("extent", "<f4", (3,))])
RECORDS = {  # packets that are a 16-bit count and records of one size
    Packet.EVENT_DEL: np.dtype([_ID]),
    Packet.EVENT_PARENT: np.dtype([_ID, ("parent", "<u4")]),
    Packet.COLLISION: np.dtype(
        [("number", "<u4"), _ID, ("other", "<u4"), ("hero", "?"), ("other_hero", "?")]
    ),
    Packet.POSITION: np.dtype([_ID, ("place", "<f4", (3,)), ("turn", "<f4", (3,))]),
    Packet.TRAFFIC_LIGHT: np.dtype([_ID, ("frozen", "?"), ("elapsed", "<f4"), ("state", "i1")]),
    Packet.VEHICLE: np.dtype(
        [_ID, ("steer", "<f4"), ("throttle", "<f4"), ("brake", "<f4"), ("hand_brake", "?"),
         ("gear", "<i4")]
    ),
    Packet.WALKER: np.dtype([_ID, ("speed", "<f4")]),  # cm/s
    Packet.VEHICLE_LIGHT: np.dtype([_ID, ("flags", "<u4")]),
    Packet.KINEMATICS: np.dtype([_ID, ("velocity", "<f4", (3,)), ("turn", "<f4", (3,))]),
    Packet.BOUNDING_BOX: _BOX,
    Packet.TRAFFIC_LIGHT_TIME: np.dtype([_ID, ("times", "<f4", (3,))]),  # s: green, yellow, red
    Packet.TRIGGER_VOLUME: _BOX,
    Packet.WEATHER: np.dtype([("values", "<f4", (14,))]),  # as `WeatherParameters` on the wire
}  # fmt: skip


class Kind(IntEnum):
    """Kinds of actors in a recording (public source: `Actor/CarlaActor.h`)."""

    OTHER = 0
    VEHICLE = 1
    WALKER = 2
    TRAFFIC_LIGHT = 3
    TRAFFIC_SIGN = 4
    SENSOR = 5


@dataclass(frozen=True, slots=True)
class Added:
    """An actor that enters a recording."""

    id: int
    kind: int
    place: Vector  # cm
    turn: Vector  # deg: roll, pitch, yaw
    blueprint: str
    attributes: tuple[Attribute, ...] = ()
    number: int = 0  # of its blueprint's definition; 0: an actor of the map

    def attribute_values(self) -> dict[str, str]:
        """Returns the attributes' values by name."""
        return {name: value for _, name, value in self.attributes}


@dataclass(frozen=True, slots=True)
class LogHead:
    """What a recording's first bytes say."""

    version: int
    date: int  # s since 1970
    map: str


@dataclass(slots=True)
class LogFrame:
    """One frame of a recording."""

    number: int
    duration: float  # s to the next frame
    elapsed: float  # s since the recording began
    added: list[Added] = field(default_factory=list)
    records: dict[int, Records] = field(default_factory=dict)
    platform_time: float | None = None  # s of the machine's clock since the recording began

    def rows(self, packet: Packet) -> list[Any]:
        """Returns the records of a packet as tuples, vectors as lists; none without the packet."""
        found = self.records.get(packet)
        if found is None or found.dtype.names is None:
            return []
        return list(zip(*(found[name].tolist() for name in found.dtype.names), strict=True))


# --- writing


def pack_head(map: str, date: int) -> bytes:
    """Returns the header of a file."""
    return _U16.pack(VERSION) + _text(MAGIC) + _DATE.pack(date) + _text(map)


def pack_start(number: int, elapsed: float) -> bytes:
    """Returns the packet that begins a frame; its duration is written when the next one comes."""
    return _packet(Packet.FRAME_START, _FRAME.pack(number, NO_DURATION, elapsed))


def pack_duration(seconds: float) -> bytes:
    """Returns a frame's duration, to be written at DURATION_AT."""
    return _TIME.pack(seconds)


def pack_end() -> bytes:
    """Returns the packet that ends a frame."""
    return _packet(Packet.FRAME_END, b"")


def pack_added(actors: Sequence[Added]) -> bytes:
    """Returns the packet of actors that enter."""
    parts = [_U16.pack(len(actors))]
    for a in actors:
        parts += [_ACTOR.pack(a.id, a.kind, *a.place, *a.turn, a.number), _text(a.blueprint)]
        parts.append(_U16.pack(len(a.attributes)))
        for type, name, value in a.attributes:
            parts += [_ATTRIBUTE.pack(type), _text(name), _text(value)]
    return _packet(Packet.EVENT_ADD, b"".join(parts))


def pack_records(packet: Packet, rows: Sequence[Any]) -> bytes:
    """Returns a packet of records, each a tuple in the order of RECORDS."""
    return _packet(packet, _U16.pack(len(rows)) + np.array(rows, RECORDS[packet]).tobytes())


def pack_platform_time(seconds: float) -> bytes:
    """Returns the packet with the machine's time in s since the recording began."""
    return _packet(Packet.PLATFORM_TIME, _TIME.pack(seconds))


def _packet(packet: Packet, data: bytes) -> bytes:
    """Returns a packet with its header."""
    return _HEAD.pack(packet, len(data)) + data


def _text(value: str) -> bytes:
    """Returns a text as length and UTF-8 characters."""
    data = value.encode("utf-8")
    return _U16.pack(len(data)) + data


# --- reading


def read_log(name: str, data: bytes) -> tuple[LogHead, Iterator[LogFrame]]:
    """Returns header and frames of a file; the frames are read while they are asked for.

    CallError of one sentence for what is no recording, and from the frames for what is damaged or cut.
    """
    source = _Source(name, data)
    try:
        (version,), magic = source.take(_U16), source.text()
    except CallError:
        magic = ""
    if magic != MAGIC:
        raise CallError(f"{name} is no recording of CARLA's: it does not begin with {MAGIC}")
    (date,) = source.take(_DATE)
    return LogHead(version, date, source.text()), _frames(source)


def _frames(source: _Source) -> Iterator[LogFrame]:
    """Yields the frames of a file; CallError for one that is damaged or cut."""
    frame: LogFrame | None = None
    while source.left():
        packet, size = source.take(_HEAD)
        body = source.part(size)
        if packet == Packet.FRAME_START:
            if frame is not None:
                raise source.fault(f"frame {frame.number} has no end")
            frame = LogFrame(*body.take(_FRAME))
        elif frame is None:
            raise source.fault(f"packet {packet} stands outside of a frame")
        elif packet == Packet.FRAME_END:
            yield frame
            frame = None
        elif packet == Packet.EVENT_ADD:
            frame.added += _read_added(body)
        elif packet == Packet.PLATFORM_TIME:
            (frame.platform_time,) = body.take(_TIME)
        elif packet in RECORDS:
            frame.records[packet] = body.records(RECORDS[Packet(packet)])
    if frame is not None:
        raise source.fault(f"frame {frame.number} has no end")


def _read_added(body: _Source) -> list[Added]:
    """Returns the actors of a packet of those that enter."""
    (count,) = body.take(_U16)
    found = []
    for _ in range(count):
        id, kind, *numbers = body.take(_ACTOR)
        blueprint, (attributes,) = body.text(), body.take(_U16)
        given = [(*body.take(_ATTRIBUTE), body.text(), body.text()) for _ in range(attributes)]
        x, y, z, roll, pitch, yaw, number = numbers
        place, turn = (x, y, z), (roll, pitch, yaw)
        found.append(Added(id, kind, place, turn, blueprint, tuple(given), number))
    return found


class _Source:
    """A piece of a file that is read from its beginning."""

    def __init__(self, name: str, data: bytes, start: int = 0, end: int | None = None) -> None:
        self._name, self._data, self._at = name, data, start
        self._end = len(data) if end is None else end

    def left(self) -> int:
        """Returns the bytes that were not read yet."""
        return self._end - self._at

    def fault(self, what: str) -> CallError:
        """Returns the error of a damaged file, with the place of the damage."""
        return CallError(f"{self._name} is damaged or cut off at byte {self._at}: {what}")

    def take(self, layout: Struct) -> tuple[Any, ...]:
        """Returns the values of the next bytes."""
        at = self._advance(layout.size)
        return layout.unpack_from(self._data, at)

    def text(self) -> str:
        """Returns the text that comes next."""
        (length,) = self.take(_U16)
        at = self._advance(length)
        return self._data[at : at + length].decode("utf-8", errors="replace")

    def part(self, size: int) -> _Source:
        """Returns the next `size` bytes as a piece of their own."""
        at = self._advance(size)
        return _Source(self._name, self._data, at, at + size)

    def records(self, layout: np.dtype[np.void]) -> Records:
        """Returns the records of the piece, which begins with their number and holds nothing else."""
        (count,) = self.take(_U16)
        if self.left() != count * layout.itemsize:
            raise self.fault(f"{count} records of {layout.itemsize} bytes in {self.left()} bytes")
        return np.frombuffer(self._data, layout, count, self._at)

    def _advance(self, size: int) -> int:
        """Goes on by `size` bytes and returns where they begin; CallError where there are fewer."""
        if size > self.left():
            raise self.fault(f"{size} bytes expected, {self.left()} left")
        self._at += size
        return self._at - size
