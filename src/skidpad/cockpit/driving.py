"""A live drive as a producer: the one loop, with a desk, a screen and real time."""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.driving.pace import SLOW
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk
from skidpad.cockpit import hud
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.screen import Screen, Shown
from skidpad.cockpit.studio import Looks
from skidpad.cockpit.words import Link, Live, Pace
from skidpad.core.courses import Roads
from skidpad.core.environment.surface import present_patches
from skidpad.core.run import AdasDriver, RunSpec, run_from_plain
from skidpad.core.setup import DT
from skidpad.core.states import ActorTable
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.simulation.pacing import Pacer


def about(
    spec: RunSpec, folder: Path, rate: float = 1.0, paused: bool = False, own_gc: bool = True
) -> dict[str, Any]:
    """Returns the plain data that `drive_job` is given; ConfigError for a rate out of range.

    own_gc: see `RealTime`.
    """
    return {
        "spec": spec.to_plain(),
        "folder": str(folder),
        "rate": Pace(rate).rate,
        "paused": paused,
        "own_gc": own_gc,
    }


def drive_job(feed_name: str, pipe: Connection, about: dict[str, Any]) -> str:
    """Drives a run with pictures for the page and writes its folder; returns a sentence on its end."""
    spec, folder = run_from_plain(about["spec"], "the drive"), Path(about["folder"])
    feed, link = Feed(feed_name), Link(pipe)
    link.rate, link.paused = about["rate"], about["paused"]
    desk = Desk(Live(link), spec)

    def describe() -> Shown:
        told = {
            "kind": "drive",
            "seat": {
                **hud.seat(desk.outside, desk.manual, desk.pedals.method.value, desk.switch),
                "pressed_s": hud.round_value(desk.hands.pressed),
                "sky": desk.outside.weather.values(),
                "range": desk.outside.range_model.value,
                "functions": functions_on(spec, desk),
                "crowd": crowd(spec, desk),
            },
            "rtf": hud.round_value(time.rtf),
            "slow_pct": hud.round_value(100.0 * time.slow / max(time.ticks, 1), 1),
            "rate": link.rate,
            "paused": link.paused,
        }
        return Shown(desk.outside, told)

    stage = stage_of(spec)
    looks = Looks(spec.scenery, spec.bodywork, spec.quality)
    laid = [LaidSurface(0, present_patches(stage.setup.patches, spec.weather.air_temperature_c))]
    screen = Screen(feed, link, stage.map, describe, spec.seed, laid, looks)
    time = CockpitPacer(link, screen.show, own_gc=about["own_gc"])
    try:
        driven = drive_at_desk(spec, desk, folder, (screen, time))
    finally:
        time.end()
        feed.close()
    n = len(driven.log)
    mean = f", {screen.shown} pictures shown, {screen.dropped} dropped"
    return f"{driven.outcome.value} after {n} ticks{mean}: {folder}"


def crowd(spec: RunSpec, desk: Desk) -> int | None:
    """Returns how many background vehicles are wanted; None: this course has none that could leave."""
    if not isinstance(spec.course, Roads):
        return None
    return spec.course.vehicles if desk.density.wanted is None else desk.density.wanted


def functions_on(spec: RunSpec, desk: Desk) -> list[str] | None:
    """Returns the names of our stack's functions that are on; None for another stack, without switches."""
    if not isinstance(spec.driver, AdasDriver):
        return None
    on = {f.value for f in (spec.driver.functions if desk.functions is None else desk.functions)}
    if desk.functions is None and spec.settings.stack.aeb_without_acc and "acc" not in on:
        on.add("aeb")
    return [*sorted(on), *spec.driver.added]


# --- real time as a sink that obeys the page: its rate, its pauses, its single ticks
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
        """Gives garbage collection back to Python."""
        self.pacer.end()

    def see(self, moment: Moment) -> None:
        """Takes in the page's words, stands while paused, then waits for the tick's time (A-262)."""
        self._count()
        self.link.drain()
        if self.link.paused and not self.link.ended:
            self._stand(moment)
        self.pacer.tick(DT / self.link.rate if self.link.rate > 0.0 else 0.0)

    def _count(self) -> None:
        """Counts a tick and whether it was slow; updates the real time factor every WINDOW ticks."""
        now = self.clock()
        self.ticks += 1
        self.slow += SLOW * (now - self._last) > DT
        self._last = now
        if self.ticks % WINDOW == 0:
            self.rtf = WINDOW * DT / max(now - self._window, 1e-9)
            self._window = now

    def _stand(self, moment: Moment) -> None:
        """Shows the moment while the run is paused, until it goes on, steps or ends."""
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
