"""The RPC channel's bytes: msgpack-rpc with no framing but msgpack's own, and its limits.

A request is `[0, msgid, method, params]`, an answer `[1, msgid, error, result]`. params[0] is the
client's metadata `[bool]`: true when it will ignore the result.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgpack

from skidpad.core.errors import BackendError
from skidpad.core.text.told import on_a_line

MAX_MESSAGE = 32 * 1024 * 1024  # bytes; the largest real one is an OpenDRIVE text
MAX_ITEMS = 100_000  # in one array; the largest real one is a batch of commands
# how an array of three or four may begin, also where its length has not arrived
HEADS = (
    b"\x93",
    b"\x94",
    *(h + bytes([n]) for h in (b"\xdc\x00", b"\xdd\x00\x00\x00") for n in (3, 4)),
)
LIMITS: dict[str, Any] = {
    "raw": False,
    "unicode_errors": "replace",
    "use_list": True,
    "strict_map_key": True,
    "max_str_len": MAX_MESSAGE,
    "max_bin_len": MAX_MESSAGE,
    "max_array_len": MAX_ITEMS,
    "max_map_len": 64,
    "max_ext_len": 0,
}
REQUEST = 0
ANSWER = 1
NOTIFICATION = 2


class ProtocolError(BackendError):
    """Bytes that are not a request; the client that sent them is closed."""


@dataclass(frozen=True, slots=True)
class Request:
    """One call of a client."""

    msgid: int
    method: str
    arguments: list[Any]
    waits: bool  # False: the client ignores the answer


class Decoder:
    """Bytes in, requests out, for one connection.

    A message is unpacked when it is complete: the head of an array says how much memory to take, and
    a few bytes could ask for gigabytes that never come.
    """

    def __init__(self) -> None:
        self._scanner = msgpack.Unpacker(max_buffer_size=MAX_MESSAGE)
        self._held = bytearray()  # what is not unpacked yet
        self._begin = 0  # of it, among all bytes of the connection

    def feed(self, data: bytes) -> Iterator[Request]:
        """Yields the requests that `data` completes, and keeps the rest for the next call.

        ProtocolError for what is no request; it ends the connection.
        """
        try:
            self._scanner.feed(data)
            self._held += data
            while (message := self._next()) is not None:
                yield parse_request(msgpack.unpackb(message, **LIMITS))
        except (msgpack.exceptions.UnpackException, ValueError, TypeError, RecursionError) as error:
            raise ProtocolError(f"not a msgpack-rpc request: {on_a_line(error)}") from error

    def _next(self) -> bytes | None:
        """Removes and returns the first complete message; None while the bytes held are not a whole one."""
        try:
            self._scanner.skip()
        except msgpack.exceptions.OutOfData:
            if self._held and not _begins(bytes(self._held[:5])):
                raise ProtocolError("a request is an array of four") from None
            return None
        length = self._scanner.tell() - self._begin
        message = bytes(self._held[:length])
        del self._held[:length]
        self._begin += length
        return message


def _begins(data: bytes) -> bool:
    """Returns whether these first bytes are of an array of three or four."""
    return any(head.startswith(data) or data.startswith(head) for head in HEADS)


def parse_request(message: Any) -> Request:
    """Returns a decoded message as a request; ProtocolError when it is none.

    A message of three is a notification, which waits for no answer.
    """
    if not isinstance(message, list) or len(message) not in (3, 4):
        raise ProtocolError("a request is an array of four")
    if len(message) == 3:
        kind, method, params = message
        msgid = 0
    else:
        kind, msgid, method, params = message
    if kind != (NOTIFICATION if len(message) == 3 else REQUEST) or isinstance(kind, bool):
        raise ProtocolError(f"unknown message type {kind!r:.40}")
    if not isinstance(msgid, int) or not 0 <= msgid < 2**32:
        raise ProtocolError("msgid must be an unsigned 32-bit integer")
    if not isinstance(method, str) or not isinstance(params, list):
        raise ProtocolError("method must be a text and params an array")
    waits = kind == REQUEST
    if params and params[0] in ([False], [True]):
        waits = waits and not params[0][0]
        params = params[1:]
    return Request(msgid, method, params, waits)


def pack(value: Any) -> bytes:
    """Returns the msgpack bytes of an answer or a stream message."""
    packed: bytes = msgpack.packb(value, use_bin_type=True)
    return packed


def answer(msgid: int, result: Any) -> bytes:
    """Returns the bytes of a successful answer."""
    return pack([ANSWER, msgid, None, result])


def failure(msgid: int, message: str) -> bytes:
    """Returns the bytes of an answer that the client raises as rpc_error."""
    return pack([ANSWER, msgid, message, None])
