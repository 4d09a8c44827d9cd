"""OSI messages as UDP datagrams, in parts with a counter, as esmini sends them and its receivers read.

A datagram is a 32-bit counter, a 32-bit size and at most 8192 bytes of the message. The parts of one
message count from 1; the last one counts negative.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable, Iterable, Iterator
from ipaddress import ip_address

from skidpad.core.errors import ConfigError

PART = 8192  # bytes of a message in one datagram
LOCAL = "127.0.0.1"


def read_address(text: str) -> tuple[str, int]:
    """Returns host and port of `PORT` or `ADDRESS:PORT`; this machine where none is given.

    ConfigError for anything else.
    """
    host, _, port = text.rpartition(":")
    try:
        number = int(port)
        address = str(ip_address(host.strip("[]"))) if host else LOCAL
    except ValueError:
        number, address = 0, ""
    if not 0 < number < 65536:
        raise ConfigError(
            f"--osi-udp takes PORT or ADDRESS:PORT with a numeric address, got {text}"
        )
    return address, number


def message_parts(message: bytes) -> Iterator[bytes]:
    """Yields the datagrams of one message."""
    parts = [message[k : k + PART] for k in range(0, len(message), PART)] or [b""]
    for k, part in enumerate(parts, start=1):
        counter = -k if k == len(parts) else k
        yield struct.pack("<iI", counter, len(part)) + part


def send_osi(
    address: tuple[str, int],
    messages: Iterable[tuple[float, bytes]],
    wait: Callable[[float], None] = time.sleep,
) -> int:
    """Sends messages at their times, s from the first; returns how many were sent."""
    family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
    count, begin, first = 0, time.monotonic(), 0.0
    with socket.socket(family, socket.SOCK_DGRAM) as out:
        for t, message in messages:
            first = t if count == 0 else first
            wait(max(t - first - (time.monotonic() - begin), 0.0))
            for part in message_parts(message):
                out.sendto(part, address)
            count += 1
    return count
