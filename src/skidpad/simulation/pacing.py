"""Real time and garbage: when a tick is over on the wall, never what is in it (A-262, A-267).

Every loop that is held at real time uses this: a live monitor, the cockpit, a drive on CARLA. (The
CARLA server's own clock is another thing: it ticks while no client does, and catches up.)
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from time import perf_counter, sleep

COLLECT_EVERY = 200  # ticks between collections of everything
PAUSE_FOR_GC = 0.005  # s of pause that a collection of the youngest objects fits into


class Pacer:
    """Called once per tick. From `begin` to `end` garbage is collected here only, if it is asked to."""

    def __init__(
        self,
        own_gc: bool = True,
        grace: float = 0.0,
        clock: Callable[[], float] = perf_counter,
        wait: Callable[[float], None] = sleep,
    ) -> None:
        """grace: s that a tick may be late and still be caught up by the next ones."""
        self.own_gc, self.grace, self.clock, self.wait = own_gc, grace, clock, wait
        self.late = 0  # ticks that ended after their time
        self._ticks = 0
        self._due = 0.0
        self._was_enabled = self._running = False

    def begin(self) -> None:
        """Starts the loop's clock and, if so set, switches garbage collection off."""
        self._running, self._was_enabled = True, gc.isenabled()
        if self.own_gc:
            gc.collect()
            gc.disable()
        self.restart()

    def restart(self) -> None:
        """Lets the next tick begin now, as after a pause."""
        self._due = self.clock()

    def tick(self, period: float) -> None:
        """Ends a tick: collects garbage, and waits until it has taken `period` s; 0: does not wait.

        A tick that took longer counts as late.
        """
        self._ticks += 1
        self._due += period
        left = self._due - self.clock() if period > 0.0 else 0.0
        if self.own_gc and (left > PAUSE_FOR_GC or self._ticks % COLLECT_EVERY == 0):
            gc.collect(0 if self._ticks % COLLECT_EVERY else 2)
        left = self._due - self.clock()
        if period <= 0.0:
            self.restart()
        elif left > 0.0:
            self.wait(left)
        else:
            self.late += 1
            if left < -self.grace:  # a late tick does not make the next ones hurry
                self.restart()

    def end(self) -> None:
        """Sets garbage collection as it was before `begin`; safe to call twice."""
        if self._running and self.own_gc and self._was_enabled:
            gc.enable()
        self._running = False
