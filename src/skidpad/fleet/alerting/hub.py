"""Listeners are woken: a count per topic that only grows, for long polls and pages."""

from __future__ import annotations

import asyncio
from collections import Counter
from threading import Lock

STEP_S = 0.02  # between two looks at a count


class Hub:
    """Counts of what happened, by topic; safe between threads."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = Lock()

    def tell(self, topic: str) -> None:
        """Counts one more event of a topic, which waiting listeners see within STEP_S s."""
        with self._lock:
            self._counts[topic] += 1

    def count(self, topic: str) -> int:
        """Returns how many events of a topic were told so far, 0 for an unknown one."""
        return self._counts[topic]

    async def wait_for_change(self, topic: str, seen: int, wait_s: float) -> int:
        """Returns the topic's count as soon as it differs from `seen`, or unchanged after `wait_s` s."""
        for _ in range(round(wait_s / STEP_S)):
            if self.count(topic) != seen:
                break
            await asyncio.sleep(STEP_S)
        return self.count(topic)
