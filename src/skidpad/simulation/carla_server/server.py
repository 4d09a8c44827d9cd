"""The server: two ports, connections, and what happens to clients that misbehave."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

from skidpad.core.errors import ConfigError
from skidpad.simulation.carla_server.methods import TABLES
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.pacer import MANAGER_REST, ServerPacer
from skidpad.simulation.carla_server.protocol.codec import Decoder, ProtocolError, Request
from skidpad.simulation.carla_server.protocol.rpc import Dispatcher
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.waker import Waker, rouse
from skidpad.simulation.carla_server.warming import Helper, warm_up

log = logging.getLogger("skidpad.carla_server")
MAX_CLIENTS = 512
MAX_UNREAD = 64 * 1024 * 1024  # bytes of answers that a client may leave unread
PORT_TRIES = 50


class RpcConnection(asyncio.Protocol):
    """Serves the calls of one client in the order of their arrival."""

    def __init__(self, server: CarlaServer) -> None:
        self._server = server
        self._decoder = Decoder()
        self._queue: deque[Request] = deque()
        self._transport: asyncio.Transport | None = None
        self._rousing: set[asyncio.Task[None]] = set()
        self._last = ""  # the method that was asked for before

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Registers the client, or closes the connection when too many are open."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        loop = asyncio.get_running_loop()
        self._waker = Waker(loop.call_later, self._rouse)
        if not self._server.admit(self):
            transport.close()

    def data_received(self, data: bytes) -> None:
        """Answers every request that is complete; closes the connection on what is none."""
        assert self._transport is not None
        waiting, broken = bool(self._queue), False
        try:
            self._queue.extend(self._decoder.feed(data))
        except ProtocolError as error:
            log.warning("closing a client: %s", error)
            broken = True
        if not waiting:
            self._work()
        if broken:
            self._transport.close()

    def _work(self) -> None:
        """Answers the queued requests; a tick and what follows it wait for streams on their way.

        While they wait, no more is read from the client.
        """
        transport = self._transport
        assert transport is not None
        while self._queue and not transport.is_closing():
            if ticks(self._queue[0]) and not self._server.hub.complete:
                transport.pause_reading()
                self._server.hub.when_complete(self._go_on)
                return
            self._answer(transport, self._queue.popleft())

    def _go_on(self) -> None:
        """Answers the queued requests and resumes writing when none is left."""
        self._work()
        if not self._queue:
            self.resume_writing()

    def _answer(self, transport: asyncio.Transport, request: Request) -> None:
        """Answers a request, delayed where a rest is due; closes a client that leaves too much unread."""
        known = len(self._server.served.managers.by_port)
        self._server.served.follows_batch = self._last == "apply_batch"
        self._last = request.method
        answer = self._server.answer(request)
        accepted = len(self._server.served.managers.by_port) > known
        self._waker.note_request(request.method, request.arguments, accepted)
        rest = self._server.rest_before(request)
        if rest > 0.0:
            asyncio.get_running_loop().call_later(rest, transport.write, answer)
        else:
            transport.write(answer)
        if transport.get_write_buffer_size() > MAX_UNREAD:
            log.warning("closing a client that does not read its answers")
            transport.abort()

    def pause_writing(self) -> None:
        """Stops reading from a client that is slow to fetch its answers."""
        if self._transport is not None:
            self._transport.pause_reading()

    def resume_writing(self) -> None:
        """Reads on from a client that has fetched its answers."""
        if self._transport is not None and not self._transport.is_closing():
            self._transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002  asyncio's name
        """Releases a client that went away."""
        self._waker.stop()
        self._server.release(self)

    def _rouse(self, port: int) -> None:
        """Wakes the client's Traffic Manager at this port of its machine, in a task."""
        assert self._transport is not None
        peer = self._transport.get_extra_info("peername")
        if peer:
            task = asyncio.get_running_loop().create_task(rouse(peer[0], port))
            self._rousing.add(task)
            task.add_done_callback(self._rousing.discard)


def ticks(request: Request) -> bool:
    """Returns whether a request advances the simulation."""
    if request.method == "apply_batch":
        return len(request.arguments) == 2 and request.arguments[1] is True
    return request.method == "tick_cue"


@dataclass(frozen=True, slots=True)
class Ports:
    """Holds the two ports on which the server listens."""

    rpc: int
    streaming: int


class CarlaServer:
    """The simulation behind CARLA's protocol."""

    def __init__(self, options: ServerOptions) -> None:
        self.options = options
        self.hub = StreamHub()
        self.served = Served(options, self.hub)
        self.dispatcher = Dispatcher(self.served, TABLES)
        self.pacer = ServerPacer(self.served.tick, self._own_step, lambda: not self._clients)
        self.served.platform_time = self.pacer.measure_elapsed
        self.served.announce = self.hub.announce
        self._clients: set[RpcConnection] = set()
        self._calls: IO[str] | None = None
        self._servers: list[asyncio.Server] = []

    def _own_step(self) -> float | None:
        """Returns the server's own time step in s; None in synchronous mode."""
        settings = self.served.clock.settings
        return None if settings.synchronous else settings.step

    def admit(self, client: RpcConnection) -> bool:
        """Adds a client to those that are connected; returns False when there are MAX_CLIENTS."""
        if len(self._clients) >= MAX_CLIENTS:
            return False
        self._clients.add(client)
        return True

    def release(self, client: RpcConnection) -> None:
        """Removes a client from those that are connected."""
        self._clients.discard(client)

    def answer(self, request: Request) -> bytes:
        """Returns the answer to a request, which is written down when calls are recorded."""
        if self._calls is not None:
            line = [self.served.clock.frame, request.method, request.arguments]
            self._calls.write(json.dumps(line, default=repr) + "\n")
        return self.dispatcher.answer(request)

    def rest_before(self, request: Request) -> float:
        """Returns the s by which an answer is held back; 0 but for ticks with a Traffic Manager."""
        held = request.method == "tick_cue" and self.served.managers.by_port
        return MANAGER_REST if held else 0.0

    async def open(self) -> Ports:
        """Listens on the port pair and returns it; the streaming port is the next one.

        ConfigError when no such pair is free.
        """
        host = self.options.host
        loop = asyncio.get_running_loop()
        for rpc_socket, stream_socket in _socket_pair(host, self.options.port):
            self._servers = [
                await loop.create_server(lambda: RpcConnection(self), sock=rpc_socket),
                await loop.create_server(self.hub.protocol, sock=stream_socket),
            ]
            ports = Ports(rpc_socket.getsockname()[1], stream_socket.getsockname()[1])
            self.hub.port = ports.streaming
            return ports
        raise ConfigError(f"no free port pair on {host} at {self.options.port}")

    async def run(self, ready: Callable[[Ports], Any], helper: Helper | None) -> None:
        """Serves until cancelled or idle for too long; then closes.

        ready: called with the ports when clients may come. helper: the process that compiles at a first
        start.
        """
        if self.options.record_calls is not None:
            self._calls = self.options.record_calls.open("w", encoding="utf-8")
        warm_up(self.options, helper)
        if helper is not None:
            self.served.before_sensing = helper.finish
        try:
            ready(await self.open())
            await self.pacer.run(self.options.idle_exit)
        finally:
            self.close()

    def close(self) -> None:
        """Stops listening and closes recordings."""
        for server in self._servers:
            server.close()
        self.served.recorder.stop()
        if self._calls is not None:
            self._calls.close()
            self._calls = None

    def complaints(self) -> list[str]:
        """Returns a sentence for each unknown call and how often it came, for --strict."""
        return [f"unknown call {n} ({k} times)" for n, k in self.dispatcher.unknown.items()]


def _bind_socket(host: str, port: int) -> socket.socket:
    """Returns a TCP socket bound to host and port; raises OSError where that fails."""
    # Named as TCP: only then does asyncio switch Nagle's algorithm off, which would cost 40 ms a tick.
    made = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((host, port))
    except OSError:
        made.close()
        raise
    return made


def _socket_pair(host: str, port: int) -> list[tuple[socket.socket, socket.socket]]:
    """Returns one pair of bound sockets on neighbouring ports in a list; [] when they cannot be had.

    port 0: any; several are tried.
    """
    for _ in range(PORT_TRIES if port == 0 else 1):
        try:
            first = _bind_socket(host, port)
        except OSError:
            return []
        try:
            return [(first, _bind_socket(host, first.getsockname()[1] + 1))]
        except (OSError, OverflowError):
            first.close()
    return []
