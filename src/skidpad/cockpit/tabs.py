"""Which tab of the page drives: the first one, until it is gone; the others watch (R-10)."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

RELEASE_AFTER = 0.3  # s without a sign of the driving tab, after which the pedals are released


class Tabs:
    """The open tabs in order of coming."""

    def __init__(self) -> None:
        self._open: list[str] = []

    def come(self, tab: str) -> None:
        """A tab is opened."""
        if tab not in self._open:
            self._open.append(tab)

    def go(self, tab: str) -> None:
        """A tab is closed; the next one in order drives."""
        if tab in self._open:
            self._open.remove(tab)

    @property
    def driver(self) -> str | None:
        """The tab whose words count."""
        return self._open[0] if self._open else None

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
