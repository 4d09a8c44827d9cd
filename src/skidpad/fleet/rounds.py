"""What the service does again and again beside its requests: one thread, ended when it closes."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

log = logging.getLogger(__name__)


class Rounds:
    """Calls `work` every `pause_s` s or when woken, in a thread; after one that fails comes the next."""

    def __init__(self, name: str, work: Callable[[], None], pause_s: float) -> None:
        self.name, self.work, self.pause_s = name, work, pause_s
        self.ended = threading.Event()
        self._wake = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Starts the thread that does the rounds."""
        self._thread = threading.Thread(target=self._run, name=f"fleet-{self.name}")
        self._thread.start()

    def wake(self) -> None:
        """Begins the next round at once, or as soon as the present one is done."""
        self._wake.set()

    def close(self) -> None:
        """Ends the thread after its present round; safe to call twice."""
        self.ended.set()
        self._wake.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        """Does the work every `pause_s` s or when woken until ended; logs a round that fails."""
        while not self.ended.is_set():
            try:
                self.work()
            except Exception:  # the next round tries again; nothing must end with one failure
                log.exception("the %s failed", self.name)
            self._wake.wait(self.pause_s)
            self._wake.clear()
