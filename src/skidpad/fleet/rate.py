"""How often one credential may ask: one bucket for every link that it comes by."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock


@dataclass(slots=True)
class _Bucket:
    left: float
    at: float


class Rate:
    """A bucket per credential: so many requests at once, refilled at a lasting rate."""

    def __init__(self, per_s: float, burst: int) -> None:
        self.per_s, self.burst = per_s, float(burst)
        self._buckets: dict[str, _Bucket] = {}
        self._lock = Lock()

    def take(self, who: str, now: float) -> float:
        """0 when a request is granted, else the seconds until one will be."""
        with self._lock:
            bucket = self._buckets.setdefault(who, _Bucket(self.burst, now))
            gained = max(0.0, now - bucket.at) * self.per_s
            bucket.left, bucket.at = min(self.burst, bucket.left + gained), now
            if bucket.left >= 1.0:
                bucket.left -= 1.0
                return 0.0
            return (1.0 - bucket.left) / self.per_s
