"""How the adapter reaches a CARLA server, and which of its optimisations are on."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from skidpad.core.errors import require_range


class Optimisation(str, Enum):
    """The published optimisations that belong to the adapter; each has its own switch (A-268)."""

    FEED_POOL = "feed-pool"
    LIGHT_CACHE = "light-cache"
    LOCAL_TRUTH = "local-truth"
    GC_IN_PAUSE = "gc-in-pause"


@dataclass(frozen=True, slots=True, kw_only=True)
class CarlaOptions:
    """Address, time limits and switches of the CARLA backend."""

    host: str = "127.0.0.1"
    port: int = 2000
    timeout: float = 20.0  # s for an answer, a tick, or a sensor's message
    pace: bool = False  # hold the run at real time
    optimisations: frozenset[Optimisation] = field(default_factory=lambda: frozenset(Optimisation))
    watchdog: float | None = None  # s without a tick after which the process ends; None: never

    def __post_init__(self) -> None:
        require_range("--port", self.port, 1, 65535)
        require_range("timeout", self.timeout, 0.1, 3600.0)

    @property
    def address(self) -> str:
        """Returns the address as host:port, for messages."""
        return f"{self.host}:{self.port}"

    def uses(self, one: Optimisation) -> bool:
        """Returns whether an optimisation is switched on."""
        return one in self.optimisations
