"""The streaming channel: one connection per stream, which first names it by four bytes.

A message is its length in four bytes, little-endian, and the payload. Only streams with a
listener are produced; what a slow client has not fetched is bounded, and then dropped.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Sequence

EPISODE_STREAM = 1  # the world snapshots
MAX_PENDING = 64 * 1024 * 1024  # bytes that one client may leave unfetched
MAX_CONNECTIONS = 4096
# s. The 0.9.16 client hangs up when a sensor is stopped, which commonly happens right before it is
# destroyed. Its process dies now and then when both sides hang up at once.
GRACE = 2.0
# s. On a new episode the client drops its old one at once, unless one of its threads is busy with a
# snapshot just then: it then unsubscribes on that thread while another one subscribes, in a table
# without a lock, and its process dies (seen in a debugger). So it gets no snapshot for that long.
HOLD = 0.05
# Subscriptions to snapshots from here on up: each client's episode has an id of its own, because the
# client's table is by id and holds the old episode and the new one for a moment.
EPISODE_ALIASES = 2**31
# s that a tick waits at most for a stream whose token was asked for, once (1 s was too little for a
# machine with a load of 15 on two cores). The client's `listen` returns
# before its thread has connected, and what the tick sends without a listener is lost.
PATIENCE = 5.0
TCP = 1
ADDRESS_NOT_SET = 0  # the client then uses the host it was given
TOKEN = struct.Struct("<IHBB16s")


def canonical(stream: int) -> int:
    """Returns the stream behind an id; aliases stand for the episode stream."""
    return EPISODE_STREAM if stream >= EPISODE_ALIASES else stream


Tap = Callable[[Sequence[bytes | memoryview]], None]


class StreamHub:
    """Holds the streams, and which connections listen to each."""

    def __init__(self) -> None:
        self.port = 0
        self.dropped = 0  # messages not sent because a client did not fetch
        self._next = EPISODE_STREAM + 1
        self._open: set[int] = {EPISODE_STREAM}
        self._listeners: dict[int, list[asyncio.Transport]] = {}
        self._taps: dict[int, Tap] = {}  # what is called with each message, beside connections
        self._connections = 0
        self._aliases = EPISODE_ALIASES
        self._held: dict[asyncio.Transport, bytes | None] = {}  # and the newest message withheld
        self._announced: set[int] = set()  # asked for and not connected yet
        self._eager: list[Callable[[], None]] = []  # to be called when all are connected
        self._ended: dict[int, float] = {}  # streams of destroyed sensors, and when they ended
        self._left: dict[int, float] = {}  # streams that a client has left, and when
        self.on_subscribe: Callable[[int], bytes | None] = lambda _: None

    def create(self) -> int:
        """Opens a stream and returns its id."""
        stream = self._next
        self._next += 1
        self._open.add(stream)
        return stream

    def episode_token(self) -> bytes:
        """Returns a token of the snapshots that no other client has."""
        self._aliases = EPISODE_ALIASES + (self._aliases + 1) % EPISODE_ALIASES
        return self.token(self._aliases)

    def token(self, stream: int) -> bytes:
        """Returns the 24 bytes with which a client finds a stream."""
        return TOKEN.pack(stream, self.port, TCP, ADDRESS_NOT_SET, b"")

    def exists(self, stream: int) -> bool:
        """Returns whether the stream may be subscribed to."""
        return canonical(stream) in self._open

    def announce(self, stream: int) -> None:
        """Notes that a client is about to connect.

        `complete` is False until it has, or PATIENCE s are over.
        """
        stream = canonical(stream)
        if stream not in self._announced:
            self._announced.add(stream)
            asyncio.get_running_loop().call_later(PATIENCE, self._on_arrival, stream)

    def _on_arrival(self, stream: int) -> None:
        """Notes that a stream has connected, or is no longer waited for.

        Calls what waits for the last one.
        """
        self._announced.discard(stream)
        if not self._announced:
            eager, self._eager = self._eager, []
            for callback in eager:
                callback()

    @property
    def complete(self) -> bool:
        """Whether no announced stream is still waited for."""
        return not self._announced

    def when_complete(self, callback: Callable[[], None]) -> None:
        """Keeps a callback for one call, when the last announced stream has arrived or is given up.

        Where none is announced, that is at the next arrival.
        """
        self._eager.append(callback)

    def has_listeners(self, stream: int) -> bool:
        """Tells whether any connection listens to a stream, or a tap."""
        return bool(self._listeners.get(stream)) or stream in self._taps

    def tap(self, stream: int, callback: Tap | None) -> None:
        """Calls back with the parts of each message of a stream; None ends that."""
        self._taps.pop(stream, None)
        if callback is not None:
            self._taps[stream] = callback

    def publish(self, stream: int, *parts: bytes | memoryview) -> None:
        """Sends one message, of these parts, to all listeners of a stream; does nothing without any.

        A client with more than MAX_PENDING bytes not fetched does not get it.
        """
        if stream in self._taps:
            self._taps[stream](parts)
        listeners = self._listeners.get(stream)
        if not listeners:
            return
        size = sum(len(p) for p in parts)
        head = size.to_bytes(4, "little")
        for transport in listeners:
            if transport in self._held:
                self._held[transport] = b"".join((head, *parts))
                continue
            if transport.get_write_buffer_size() + size > MAX_PENDING:
                self.dropped += 1
                continue
            if size < 65536:
                transport.write(b"".join((head, *parts)))
            else:
                transport.write(head)
                for part in parts:
                    transport.write(part)

    def hold(self, stream: int) -> None:
        """Holds back messages to the present listeners for a moment; then they get the newest one."""
        waiting = [t for t in self._listeners.get(stream, []) if t not in self._held]
        if waiting:
            self._held.update(dict.fromkeys(waiting))
            asyncio.get_running_loop().call_later(HOLD, self._resume, waiting)

    def _resume(self, waiting: list[asyncio.Transport]) -> None:
        """Sends the messages held back for the transports that are still open."""
        for transport in waiting:
            message = self._held.pop(transport, None)
            if message is not None and not transport.is_closing():
                transport.write(message)

    def close(self, stream: int) -> None:
        """Forgets a stream; its listeners have GRACE s to hang up themselves."""
        self._open.discard(stream)
        self._taps.pop(stream, None)
        listeners = self._listeners.pop(stream, [])
        if listeners or stream in self._left:
            self._note(self._ended, stream)
        for transport in listeners:
            asyncio.get_running_loop().call_later(GRACE, transport.close)

    @staticmethod
    def _note(times: dict[int, float], stream: int) -> None:
        """Remembers a stream for GRACE seconds."""
        now = asyncio.get_running_loop().time()
        for old in [s for s, t in times.items() if now - t > GRACE]:
            del times[old]
        times[stream] = now

    def is_client_cleaning_up(self) -> bool:
        """Returns whether a client has left a sensor's stream and the sensor was destroyed, just now."""
        if not self._ended:
            return False
        now = asyncio.get_running_loop().time()
        return any(
            now - ended <= GRACE and now - self._left.get(stream, -GRACE) <= GRACE
            for stream, ended in self._ended.items()
        )

    def protocol(self) -> StreamConnection:
        """Returns a connection's protocol, for asyncio's server."""
        return StreamConnection(self)

    def admit(self) -> bool:
        """Counts a new connection and returns whether it may stay: False beyond MAX_CONNECTIONS."""
        self._connections += 1
        return self._connections <= MAX_CONNECTIONS

    def release(self, stream: int | None, transport: asyncio.Transport) -> None:
        """Removes a connection that has ended from its stream."""
        self._connections -= 1
        self._held.pop(transport, None)
        if stream is not None:
            self._note(self._left, stream)
        listeners = self._listeners.get(stream) if stream is not None else None
        if listeners and transport in listeners:
            listeners.remove(transport)

    def subscribe(self, stream: int, transport: asyncio.Transport) -> None:
        """Adds a listener to a stream; what `on_subscribe` gives, the newest snapshot, is sent at once.

        A client that asks for a stream that has ended is kept waiting: cut off, it would try for ever. One
        that asks for a stream that there never was is cut off.
        """
        if not self.exists(stream):
            if stream >= self._next:
                transport.close()
            return
        self._listeners.setdefault(stream, []).append(transport)
        if stream in self._announced:
            asyncio.get_running_loop().call_soon(self._on_arrival, stream)
        latest = self.on_subscribe(stream)
        if latest is not None:
            transport.write(len(latest).to_bytes(4, "little") + latest)


class StreamConnection(asyncio.Protocol):
    """One client's connection for one stream."""

    def __init__(self, hub: StreamHub) -> None:
        self._hub = hub
        self._asked = b""
        self._stream: int | None = None
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Admits the client, or closes the connection when too many are open."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if not self._hub.admit():
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Reads the four bytes of the stream id and subscribes; anything after them is ignored."""
        assert self._transport is not None
        if self._stream is not None:
            return
        self._asked += data[:4]
        if len(self._asked) >= 4:
            self._stream = canonical(int.from_bytes(self._asked[:4], "little"))
            self._hub.subscribe(self._stream, self._transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  asyncio's name
        """Releases a client that went away."""
        if self._transport is not None:
            self._hub.release(self._stream, self._transport)
