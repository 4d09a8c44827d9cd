"""The only wall clock of the server (decision K-7): it decides when to tick, never by how much."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable

log = logging.getLogger("skidpad.carla_server")
BEHIND = 0.5  # s; a pacer that is later than this gives up catching up
IDLE = 0.05  # s between looks while clients tick
MANAGER_REST = 0.002  # s before a tick's answer
"""The 0.9.16 client's Traffic Manager thread misses its wake-up, and the client then hangs for good,
when a tick returns before that thread has gone to sleep. Simulators that render never are so quick;
without this rest we met it about once in 2000 ticks on two busy cores."""


class ServerPacer:
    """Ticks in real time while no client does."""

    def __init__(
        self, tick: Callable[[], object], step: Callable[[], float | None], idle: Callable[[], bool]
    ) -> None:
        """step: s of simulated time per tick, None while clients tick; idle: is no client connected."""
        self._tick, self._step, self._idle = tick, step, idle
        self._begin = time.monotonic()

    def measure_elapsed(self) -> float:
        """Returns s of wall time since the start, for the snapshots' platform time."""
        return time.monotonic() - self._begin

    async def run(self, idle_exit: float | None = None) -> None:
        """Ticks in real time until cancelled, or until no client was connected for `idle_exit` s.

        While clients tick it only looks every IDLE s. A delay of more than BEHIND s is not caught up.
        """
        due = time.monotonic()
        seen = due
        while True:
            now = time.monotonic()
            if not self._idle():
                seen = now
            elif idle_exit is not None and now - seen > idle_exit:
                log.info("no client for %g s", idle_exit)
                return
            step = self._step()
            if step is None:
                due = now
                await asyncio.sleep(IDLE)
                continue
            if now >= due:
                self._tick()
                due = due + step if now - due < BEHIND else now + step
            await asyncio.sleep(max(due - time.monotonic(), 0.0))
