"""How fast a run went on the wall. It looks on; no clock is read inside the loop (A-246, X-1)."""

from __future__ import annotations

from time import perf_counter, sleep

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.core.states import ActorTable
from skidpad.simulation.pacing import Pacer

SLOW = 0.9  # real-time factor below which a tick counts as slow


class Pace(Sink):
    """Counts the ticks of a run, and those whose wall time was slow.

    Of ticks that a kernel drives in one call the mean counts, for all of them.
    """

    sees_all = False

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.slow = self.ticks = 0
        self.last = perf_counter()

    def see(self, moment: Moment) -> None:
        """Counts a tick, and as slow one whose real-time factor is below SLOW."""
        del moment
        now = perf_counter()
        self.slow += self.dt < SLOW * (now - self.last)
        self.ticks += 1
        self.last = now

    def pass_ticks(self, ticks: int) -> None:
        """Counts ticks that took the same time each."""
        now = perf_counter()
        self.slow += ticks * (self.dt * ticks < SLOW * (now - self.last))
        self.ticks += ticks
        self.last = now

    @property
    def slow_pct(self) -> float:
        """Returns the percentage of ticks with a real-time factor below SLOW; 0 before any."""
        return 100.0 * self.slow / max(self.ticks, 1)


class Brake(Sink):
    """Makes every tick take `seconds` longer: for showing that pace changes nothing (F-25)."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    def see(self, moment: Moment) -> None:
        """Waits for a fixed time after each tick."""
        del moment
        sleep(self.seconds)


class RealTime(Sink):
    """Holds a run at real time: no tick is over before its time; what is late is not caught up."""

    def __init__(self, dt: float) -> None:
        self.dt, self.pacer = dt, Pacer(own_gc=False)

    def begin(self, table: ActorTable) -> None:
        """Starts the clock of the first tick."""
        del table
        self.pacer.begin()

    def see(self, moment: Moment) -> None:
        """Waits until the tick's time is over."""
        del moment
        self.pacer.tick(self.dt)
