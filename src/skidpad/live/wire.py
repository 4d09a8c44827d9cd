"""What goes from a drive to its monitor: the messages of the recording, with a mark per cycle.

record:  kind (1 byte), channel (2 bytes, signed), length (4 bytes), content
content: the protobuf message of the recording; of a mark k, t and the sender's monotonic clock
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import BinaryIO

from skidpad.core.channels import Due, TruthFrame
from skidpad.recording.channels import codec
from skidpad.recording.channels.mcap_files import Item, Losses, Message, read_item

HEAD = struct.Struct("<BhI")
MARK = struct.Struct("<qdq")
NOBODY = -1
LIMIT = 64 * 1024 * 1024  # bytes; a longer record is damage
MESSAGES = ("Channel", "Decision", "Context")  # by kind
CYCLE_OVER, END = 3, 4  # kinds of marks


def pack_item(channel: int | None, item: Item) -> bytes:
    """Returns an item as a record of bytes, b"" for the true world (C-021)."""
    if isinstance(item, TruthFrame):
        return b""
    kind = codec.KINDS[type(item)]
    content: bytes = kind.write(item).SerializeToString()
    return (
        HEAD.pack(MESSAGES.index(kind.name), NOBODY if channel is None else channel, len(content))
        + content
    )


def cycle_mark(k: int, t: float, now_ns: int) -> bytes:
    """Returns the record that ends cycle k at `t` s; now_ns: clock of the sender."""
    return HEAD.pack(CYCLE_OVER, NOBODY, MARK.size) + MARK.pack(k, t, now_ns)


def end_mark() -> bytes:
    """Returns the record of a drive that ended; a stream that stops without it was cut."""
    return HEAD.pack(END, NOBODY, 0)


class WireSource:
    """Reads a stream of records as channels; `sent_ns` is the clock of the last mark."""

    def __init__(self, stream: BinaryIO, channels: tuple[str, ...]) -> None:
        self.stream, self.channels = stream, channels
        self.losses = Losses()
        self.sent_ns = 0

    def messages(self) -> Iterator[Message]:
        """Yields all messages until the end of the drive, and a `Due` behind each cycle.

        A stream that was cut sets `losses.cut`.
        """
        while True:
            head = self.stream.read(HEAD.size)
            if len(head) < HEAD.size:
                self.losses.cut = True
                return
            kind, channel, length = HEAD.unpack(head)
            if kind == END:
                return
            content = self.stream.read(length) if length <= LIMIT else b""
            if len(content) < length:
                self.losses.cut = True
                return
            if kind == CYCLE_OVER:
                _, t, self.sent_ns = MARK.unpack(content)
                yield Message(None, t, Due(t))
                continue
            name = MESSAGES[kind] if kind < len(MESSAGES) else ""
            item = read_item(name, content, self.losses)
            if item is not None:
                yield Message(None if channel == NOBODY else channel, item.t, item)
