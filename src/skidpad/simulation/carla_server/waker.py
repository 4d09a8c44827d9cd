"""Wakes a client's Traffic Manager that has missed its wake-up, which the client cannot do itself.

After each tick of a synchronous client its Traffic Manager works and sends a batch of commands, an
empty one if need be. Its thread is told to begin without a lock, so a thread that is just about to
sleep is not told: then both it and the program wait for each other, for good, and nothing arrives
here any more, but for the settings that it asks for between two cycles, perhaps only after the
program has ticked. That silence after a tick is what we look for. The Traffic Manager has an RPC server
of its own, and to switch it out of synchronous mode notifies the thread; to switch it back leaves
all as it was.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol

import msgpack

from skidpad.simulation.carla_server.protocol.codec import REQUEST

log = logging.getLogger("skidpad.carla_server")
PATIENCE = 2.0  # s of silence after a tick; no Traffic Manager works that long
TRIES = 10  # for one silence
ANSWER_S = 5.0  # for one call
ANSWER_MAX = 65536  # bytes
METHOD = "set_synchronous_mode"
BEFORE_SLEEP = "get_episode_settings"


class Timer(Protocol):
    """What `call_later` of a loop gives."""

    def cancel(self) -> None:
        """Cancels the call that was scheduled."""
        ...


class Waker:
    """Watches one client for silence after its ticks."""

    def __init__(
        self,
        later: Callable[[float, Callable[[], None]], Timer],
        wake: Callable[[int], None],
        patience: float = PATIENCE,
    ) -> None:
        """later: as a loop's `call_later`; wake: the Traffic Manager at this port."""
        self.later, self.wake, self.patience = later, wake, patience
        self.ports: set[int] = set()  # of Traffic Managers that this client has registered
        self._timer: Timer | None = None
        self._tries = 0

    def note_request(self, method: str, arguments: list[Any], accepted: bool = True) -> None:
        """Notes a request: the client is awake, unless it is the call that precedes sleep."""
        if method == BEFORE_SLEEP:
            return
        self.stop()
        port = _port(method, arguments)
        if method == "add_traffic_manager_running" and port is not None and accepted:
            self.ports.add(port)
        elif method == "destroy_traffic_manager" and port is not None:
            self.ports.discard(port)
        elif method == "tick_cue" and self.ports:
            self._tries = TRIES
            self._timer = self.later(self.patience, self._silent)

    def stop(self) -> None:
        """Cancels the timer, so that nothing is awaited any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _silent(self) -> None:
        """Wakes this client's Traffic Managers after a missed wake-up; waits again while tries are left."""
        log.warning("a Traffic Manager has missed its wake-up; it is woken")
        for port in sorted(self.ports):
            self.wake(port)
        self._tries -= 1
        self._timer = self.later(self.patience, self._silent) if self._tries > 0 else None


def _port(method: str, arguments: list[Any]) -> int | None:
    """Returns the port that a Traffic Manager's call names; None where it names none."""
    if not arguments:
        return None
    port = arguments[0]
    if method == "add_traffic_manager_running" and isinstance(port, list) and len(port) == 2:
        port = port[1]
    return port if isinstance(port, int) and 0 < port < 65536 else None


async def rouse(host: str, port: int) -> None:
    """Notifies the Traffic Manager that listens there; does nothing where none answers."""
    with suppress(OSError, asyncio.TimeoutError, EOFError):
        reader, writer = await asyncio.wait_for(asyncio.open_connection(host, port), ANSWER_S)
        try:
            for number, mode in enumerate((False, True)):
                writer.write(msgpack.packb([REQUEST, number, METHOD, [mode]]))
                await writer.drain()
                if not await asyncio.wait_for(reader.read(ANSWER_MAX), ANSWER_S):
                    return
        finally:
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()
