"""The adapter's only wall clock: real-time pacing, garbage collection in the pauses, a watchdog.

Nothing here decides what is simulated, only when.
"""

from __future__ import annotations

import gc
import os
import sys
import threading
import time

from skidpad.simulation.carla.options import CarlaOptions, Optimisation

COLLECT_EVERY = 200  # ticks between collections when nothing ever pauses
PAUSE_FOR_GC = 0.005  # s of pause that a collection of the youngest objects fits into
HANGS = 70  # exit status; EX_SOFTWARE of sysexits.h


class Pacer:
    """Called once per tick. Garbage is collected here only, from `begin` to `end` (A-267)."""

    def __init__(self, options: CarlaOptions, dt: float) -> None:
        self.pace, self.dt = options.pace, dt
        self.own_gc = options.uses(Optimisation.GC_IN_PAUSE)
        self.late = 0  # ticks that ended after their deadline
        self._ticks = 0
        self._deadline = 0.0
        self._was_enabled = False
        self._running = False

    def begin(self) -> None:
        """The loop starts now."""
        self._running = True
        self._was_enabled = gc.isenabled()
        if self.own_gc:
            gc.collect()
            gc.disable()
        self._deadline = time.perf_counter() + self.dt

    def tick(self) -> None:
        """A tick is done: collect, and wait for its deadline when pacing (A-262)."""
        self._ticks += 1
        left = self._deadline - time.perf_counter() if self.pace else 0.0
        if self.own_gc and (left > PAUSE_FOR_GC or self._ticks % COLLECT_EVERY == 0):
            gc.collect(0 if self._ticks % COLLECT_EVERY else 2)
        if not self.pace:
            return
        left = self._deadline - time.perf_counter()
        if left > 0.0:
            time.sleep(left)
            self._deadline += self.dt
        else:  # a late tick does not make the next one hurry
            self.late += 1
            self._deadline = time.perf_counter() + self.dt

    def end(self) -> None:
        """Garbage collection is as it was before `begin`; safe to call twice."""
        if self._running and self.own_gc and self._was_enabled:
            gc.enable()
        self._running = False


class Watchdog:
    """Ends the process when the wheel hangs inside a call, where no exception reaches it.

    The wheel's Traffic Manager can wait for ever (docs/carla-programs.md). Campaigns drive in
    worker processes: the pool notices the end and drives the cell again.
    """

    def __init__(self, patience: float | None) -> None:
        self.patience = patience
        self._timer: threading.Timer | None = None

    def feed(self) -> None:
        """Something moved; wait for the next sign of life."""
        self.stop()
        if self.patience is not None:
            self._timer = threading.Timer(self.patience, self._bite)
            self._timer.daemon = True
            self._timer.start()

    def stop(self) -> None:
        """Nothing is awaited any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _bite(self) -> None:
        print(f"CARLA's client did not return within {self.patience:g} s", file=sys.stderr)
        sys.stderr.flush()
        os._exit(HANGS)


def rest(seconds: float) -> None:
    """Let the wheel's threads work for a moment."""
    time.sleep(seconds)
