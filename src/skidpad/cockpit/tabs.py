"""Which tab of the page drives: the first one, until it is gone; the others watch (R-10)."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

RELEASE_AFTER = 0.3  # s without a sign of the driving tab, after which the pedals are released
ASLEEP_AFTER = 10.0  # s without an answer of a tab, after which it counts as closed; our choice


class Tabs:
    """The open tabs in order of coming. One that sleeps goes, and comes anew when it wakes."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self.clock = clock
        self._open: dict[str, float] = {}  # when each of them was last heard of

    def come(self, tab: str) -> None:
        """A tab is opened, or gives a sign that it is awake."""
        self._open[tab] = self.clock()

    def go(self, tab: str) -> None:
        """A tab is closed, or sleeps; the next one in order drives."""
        self._open.pop(tab, None)

    def asleep(self) -> list[str]:
        """Returns tabs that are open, but do not answer: a browser may stop a hidden page."""
        now = self.clock()
        return [tab for tab, heard in self._open.items() if now - heard > ASLEEP_AFTER]

    @property
    def driver(self) -> str | None:
        """The tab whose words count."""
        return next(iter(self._open), None)

    def __len__(self) -> int:
        return len(self._open)


class DeadMan:
    """Releases the pedals when nothing is heard of them any more (A-274)."""

    def __init__(self, release: Callable[[], None], clock: Callable[[], float] = monotonic) -> None:
        self.release, self.clock = release, clock
        self._heard: float | None = None  # None: they are released

    def heard(self, pressed: bool) -> None:
        """The tab told how its pedals stand."""
        self._heard = self.clock() if pressed else None

    def check(self) -> None:
        """Release them if it is time."""
        if self._heard is not None and self.clock() - self._heard > RELEASE_AFTER:
            self._heard = None
            self.release()
