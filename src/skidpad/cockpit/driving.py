"""A live drive as a producer: the one loop, with a desk, a screen and real time."""

from __future__ import annotations

from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.takeover.desk import Desk
from skidpad.cockpit import hud
from skidpad.cockpit.feed import Feed
from skidpad.cockpit.realtime import CockpitPacer
from skidpad.cockpit.screen import Screen, Shown
from skidpad.cockpit.words import Link, Live, Pace
from skidpad.core.run import AdasDriver, Roads, RunSpec, run_from_plain


def about(
    spec: RunSpec, folder: Path, rate: float = 1.0, paused: bool = False, own_gc: bool = True
) -> dict[str, Any]:
    """What `drive_job` is given; ConfigError for a rate out of range. own_gc: see `RealTime`."""
    return {
        "spec": spec.to_plain(),
        "folder": str(folder),
        "rate": Pace(rate).rate,
        "paused": paused,
        "own_gc": own_gc,
    }


def drive_job(feed_name: str, pipe: Connection, about: dict[str, Any]) -> str:
    """Drive a run and write its folder; the sentence of its end."""
    spec, folder = run_from_plain(about["spec"], "the drive"), Path(about["folder"])
    feed, link = Feed(feed_name), Link(pipe)
    link.rate, link.paused = about["rate"], about["paused"]
    desk = Desk(Live(link), spec)

    def shown() -> Shown:
        told = {
            "kind": "drive",
            "seat": {
                **hud.seat(desk),
                "functions": functions_on(spec, desk),
                "crowd": crowd(spec, desk),
            },
            "rtf": hud.round_value(time.rtf),
            "slow_pct": hud.round_value(100.0 * time.slow / max(time.ticks, 1), 1),
            "rate": link.rate,
            "paused": link.paused,
        }
        return Shown(desk.outside, told)

    screen = Screen(feed, link, stage_of(spec).map, shown, spec.seed, spec.surface)
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
    """Background vehicles that are wanted; None: this course has none that could leave."""
    if not isinstance(spec.course, Roads):
        return None
    return spec.course.vehicles if desk.density.wanted is None else desk.density.wanted


def functions_on(spec: RunSpec, desk: Desk) -> list[str] | None:
    """The functions of our stack that are on; None: another stack drives, which has no switches."""
    if not isinstance(spec.driver, AdasDriver):
        return None
    on = {f.value for f in (spec.driver.functions if desk.functions is None else desk.functions)}
    if desk.functions is None and spec.settings.stack.aeb_without_acc and "acc" not in on:
        on.add("aeb")
    return [*sorted(on), *spec.driver.added]
