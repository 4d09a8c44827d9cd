"""Real time as a sink that obeys the page: its rate, its pauses, its single ticks.

It decides when a tick is simulated, never what: a paused drive gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter, sleep

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.driving.pace import SLOW
from skidpad.cockpit.words import Link
from skidpad.core.setup import DT
from skidpad.core.states import ActorTable
from skidpad.simulation.pacing import Pacer

PATIENCE = 0.05  # s between two looks at the words while it stands
WINDOW = 20  # ticks over which the real-time factor is measured


class CockpitPacer(Sink):
    """Holds a run at so many times real time, pauses it, and lets it go tick by tick."""

    def __init__(
        self,
        link: Link,
        again: Callable[[Moment], None],
        clock: Callable[[], float] = perf_counter,
        wait: Callable[[float], None] = sleep,
        own_gc: bool = True,
    ) -> None:
        """again: shows a moment once more, as views are changed while it stands.

        own_gc: garbage is collected in the pauses between ticks only (A-267).
        """
        self.link, self.again, self.clock = link, again, clock
        self.pacer = Pacer(own_gc, grace=DT, clock=clock, wait=wait)
        self.ticks = self.slow = 0
        self._last = self._window = 0.0
        self.rtf: float | None = None

    def begin(self, table: ActorTable) -> None:
        """Starts the clock that keeps the drive at real time."""
        del table
        self.pacer.begin()
        self._last = self._window = self.clock()

    def end(self) -> None:
        """Garbage is collected as ever."""
        self.pacer.end()

    def see(self, moment: Moment) -> None:
        """A tick is done: wait for its time (A-262)."""
        self._count()
        self.link.drain()
        if self.link.paused and not self.link.ended:
            self._stand(moment)
        self.pacer.tick(DT / self.link.rate if self.link.rate > 0.0 else 0.0)

    def _count(self) -> None:
        now = self.clock()
        self.ticks += 1
        self.slow += SLOW * (now - self._last) > DT
        self._last = now
        if self.ticks % WINDOW == 0:
            self.rtf = WINDOW * DT / max(now - self._window, 1e-9)
            self._window = now

    def _stand(self, moment: Moment) -> None:
        self.again(moment)
        while self.link.paused and not self.link.ended and self.link.steps == 0:
            if self.link.pipe is None:
                break
            self.link.drain(PATIENCE)
            if self.link.reshown:
                self.link.reshown = False
                self.again(moment)
        self.link.steps = max(self.link.steps - 1, 0)
        self.pacer.restart()
        self._last = self._window = self.clock()
