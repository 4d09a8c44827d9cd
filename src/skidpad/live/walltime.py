"""Wall time from a cycle's last word to its judgement, and what the system says of it (C-005)."""

from __future__ import annotations

import resource
import time
from pathlib import Path

from skidpad.live.watch import Timer
from skidpad.live.wire import WireSource

SCHEDULE = Path("/proc/thread-self/schedstat")  # ns on a processor, ns waiting for one, slices


class WallTimer(Timer):
    """Processor time per part, and per cycle: wall_ms since it was sent, waits and page faults."""

    def __init__(self, source: WireSource) -> None:
        super().__init__(time.thread_time_ns)
        self.source = source
        self._waited, self._faults = _waited_ns(), _faults()

    def end(self) -> None:
        """The cycle is judged and written."""
        waited, faults = _waited_ns(), _faults()
        row = self.rows[-1]
        row["wall_ms"] = (time.monotonic_ns() - self.source.sent_ns) / 1e6
        row["waited_ms"] = (waited - self._waited) / 1e6
        row["faults"] = float(faults - self._faults)
        self._waited, self._faults = waited, faults


def _waited_ns() -> int:
    """Time that this thread was ready and had no processor; 0 where the system does not say."""
    try:
        return int(SCHEDULE.read_bytes().split()[1])
    except (OSError, IndexError, ValueError):
        return 0


def _faults() -> int:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_majflt + usage.ru_minflt
