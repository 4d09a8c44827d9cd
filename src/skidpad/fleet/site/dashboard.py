"""The dashboard: alarms per hour, trends with intervals, the map, clusters, replay of a hazard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from skidpad.evidence.statistics import interval_text, share_text
from skidpad.fleet.insight.trends import AlarmRate, Trend, alarm_rates, trends
from skidpad.fleet.insight.worklist import Work, rank_work
from skidpad.fleet.patterns.analysis import newest_clusters
from skidpad.fleet.service import CAME, Fleet
from skidpad.fleet.site.acting import click_analyse, person
from skidpad.fleet.site.charts import trend_svg
from skidpad.fleet.site.drawing import (
    Dot,
    Line,
    MapLines,
    kinds_legend,
    map_svg,
    moment_text,
    near,
    replay_legend,
    replay_svg,
)
from skidpad.fleet.site.frame import say, table
from skidpad.fleet.site.work import WORK_NOTE, draw_top
from skidpad.fleet.store.reading import Wanted, hazard_row, hazard_rows, record_of
from skidpad.fleet.words import Principal, Refused
from skidpad.recording.hazards.records import HazardRecord

SHOWN = 6  # trends
MAPS = 3
CLUSTERS = 5
PLAY_S = 0.1
LOOK_S = 5.0  # between two looks of an open page for what came

ALARM_NOTE = (
    "An alarm is what the rules found, right or wrong. How many are true was measured on simulated"
    " drives among natural drivers; in your traffic it may differ."
)


@dataclass(frozen=True, slots=True)
class Overview:
    """Everything that the dashboard shows at once."""

    trends: list[Trend]
    rates: list[AlarmRate]
    clusters: list[dict[str, Any]]
    work: list[Work]  # the clusters, ranked
    newest: list[dict[str, Any]]
    roads: dict[str, Sequence[Line]]  # of the maps of the newest hazards
    look: Callable[[], int]  # for recurring hazards, as the person who opened the page
    seen: int  # of what came, counted before it was read


def overview(fleet: Fleet, lines: MapLines, who: Principal) -> Overview:
    """Everything that a manufacturer or operator sees at once."""
    seen = fleet.hub.count(f"{CAME} {who.tenant}")
    found = trends(fleet, who)
    with fleet.engine.connect() as connection:
        rates, clusters = alarm_rates(connection, who), newest_clusters(connection, who)
        work = rank_work(connection, who, clusters, locate=fleet.locate)
        newest = hazard_rows(connection, who, Wanted())
    names = list(dict.fromkeys(row["map"] for row in newest if row["map"]))
    roads = {name: lines(name) for name in names[:MAPS]}
    return Overview(
        found, rates, clusters, work, newest, roads, lambda: click_analyse(fleet, who.id), seen
    )


def draw_overview(fleet: Fleet, lines: MapLines, ui: Any, who: Principal, found: Overview) -> None:
    """What is known now; what comes is shown within LOOK_S, as long as the credential holds.

    The open page keeps who looks and a count, not what it shows.
    """
    topic, box = f"{CAME} {who.tenant}", ui.element("div").classes("parts")
    seen = found.seen
    with box:
        _parts(ui, found)

    def fresh() -> Overview:
        return overview(fleet, lines, person(fleet, who.id))

    async def look() -> None:
        nonlocal seen
        if fleet.hub.count(topic) == seen:
            return
        try:
            now = await run_in_threadpool(fresh)
        except Refused as error:
            timer.cancel()
            box.clear()
            with box:
                ui.label(str(error))
            return
        seen = now.seen
        box.clear()
        with box:
            _parts(ui, now)

    timer = ui.timer(LOOK_S, look)


def _parts(ui: Any, found: Overview) -> None:
    """Alarms per hour, trends, the map, clusters."""
    with ui.element("section"):
        ui.label("Alarms per hour").classes("h2")
        rows = [
            [r.type.replace("_", " "), str(r.events), f"{r.hours:.2f}", f"{r.rate:.3g}",
             interval_text(r.interval), r.rules.replace("_", " "),
             r.precision.describe() if r.precision else "not measured"]
            for r in found.rates
        ]  # fmt: skip
        heads = ["alarm", "alarms", "hours", "per hour", "interval", "rules", "of these true"]
        table(ui, heads, rows)
        ui.label(ALARM_NOTE).classes("dim")
    _trends(ui, found.trends)
    _map(ui, found)
    _clusters(ui, found.work, found.look)


def _trends(ui: Any, found: list[Trend]) -> None:
    """Adds the trends of the worst SHOWN indicators to the page, a chart each."""
    by_name: dict[str, list[Trend]] = {}
    for trend in found:
        by_name.setdefault(trend.indicator, []).append(trend)
    worst = sorted(by_name, key=lambda n: (-max(t.share for t in by_name[n]), n))[:SHOWN]
    with ui.element("section"):
        ui.label("Indicators beyond their bound, share of cycles per day").classes("h2")
        with ui.element("div").classes("few"):
            for name in worst:
                with ui.element("div"):
                    last = by_name[name][-1]
                    ui.label(name.replace("_", " "))
                    ui.html(trend_svg(by_name[name], name), sanitize=False)
                    text = share_text(last.share, last.interval)
                    ui.label(f"{text}, {last.vehicles} vehicles").classes("dim")
        if not worst:
            ui.label("No indicator was sent yet.").classes("dim")


def _map(ui: Any, found: Overview) -> None:
    """Adds a map per road network with the newest hazards and the clusters to the page."""
    with ui.element("section"):
        ui.label("Where").classes("h2")
        for name, roads in found.roads.items():
            dots = [
                Dot(r["x"], r["y"], r["type"], r["type"].replace("_", " "))
                for r in found.newest
                if r["map"] == name
            ]
            dots += [
                Dot(c["x"], c["y"], c["type"], f"{len(c['members'])} alike", len(c["members"]))
                for c in found.clusters
                if c["map"] == name
            ]
            ui.label(f"{name}: {len(dots)} mark{'' if len(dots) == 1 else 's'}")
            ui.html(map_svg(roads, dots, f"map {name}"), sanitize=False)
            ui.html(kinds_legend(dots), sanitize=False).classes("dim")
        if not found.roads:
            ui.label("No hazard has come in yet.").classes("dim")


def _clusters(ui: Any, found: list[Work], again: Callable[[], int]) -> None:
    """A click keeps what it needs for as long as the page is open: `again`, not all that was shown."""
    with ui.element("section"):
        ui.label("Recurring hazards").classes("h2")

        async def look() -> None:
            await say(ui, again, "looked")

        ui.button("Look for recurring hazards now", on_click=look)
        ui.label(WORK_NOTE).classes("dim")
        draw_top(ui, found, CLUSTERS)


def read_replay(
    fleet: Fleet, lines: MapLines, who: Principal, request: Request
) -> tuple[dict[str, Any], HazardRecord, Sequence[Line]]:
    """Row and record of a hazard that `who` may see, and the roads around it."""
    hazard = str(request.path_params["hazard"])
    with fleet.engine.connect() as connection:
        row = hazard_row(connection, who, hazard)
        record = record_of(connection, fleet.blobs, hazard)
    return row, record, near(lines(row["map"]), row["x"], row["y"])


def draw_replay(ui: Any, found: tuple[dict[str, Any], HazardRecord, Sequence[Line]]) -> None:
    """Draws one hazard, cycle by cycle, as every channel saw it."""
    row, record, roads = found
    ui.label(f"{row['type'].replace('_', ' ')}, {row['map']}, {row['weather']}")
    if not record.worlds:
        ui.label("This record holds no worlds.")
        return
    picture = ui.html(replay_svg(record, 0, roads), sanitize=False)
    moment = ui.label(moment_text(record, 0))
    ui.html(replay_legend(record), sanitize=False).classes("dim")
    last = len(record.worlds) - 1

    def show(event: Any) -> None:
        k = min(int(event.value), last)
        picture.set_content(replay_svg(record, k, roads))
        moment.set_text(moment_text(record, k))

    slider = ui.slider(min=0, max=last, value=0, on_change=show)

    def step() -> None:
        slider.set_value(0 if slider.value >= last else slider.value + 1)

    timer = ui.timer(PLAY_S, step, active=False)
    ui.button("Play or pause", on_click=lambda: setattr(timer, "active", not timer.active))
