"""A watchdog over calls into the wheel, which can hang where no exception reaches them."""

from __future__ import annotations

import os
import sys
import threading
import time

HANGS = 70  # exit status; EX_SOFTWARE of sysexits.h


class Watchdog:
    """Ends the process when the wheel hangs inside a call, where no exception reaches it.

    The wheel's Traffic Manager can wait for ever (docs/carla-programs.md). Campaigns drive in
    worker processes: the pool notices the end and drives the cell again.
    """

    def __init__(self, patience: float | None) -> None:
        self.patience = patience
        self._timer: threading.Timer | None = None

    def feed(self) -> None:
        """Starts the wait for the next sign of life anew; does nothing without a patience."""
        self.stop()
        if self.patience is not None:
            self._timer = threading.Timer(self.patience, self._bite)
            self._timer.daemon = True
            self._timer.start()

    def stop(self) -> None:
        """Cancels the timer, so that nothing is awaited any more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _bite(self) -> None:
        """Ends the whole process with the exit code HANGS after a message on standard error."""
        print(f"CARLA's client did not return within {self.patience:g} s", file=sys.stderr)
        sys.stderr.flush()
        os._exit(HANGS)


def rest(seconds: float) -> None:
    """Sleeps for so many seconds, in which the wheel's threads work."""
    time.sleep(seconds)
