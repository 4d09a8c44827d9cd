"""The dashboard: alarms per hour, trends with intervals, the map, clusters, replay of a hazard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from html import escape
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from skidpad.evidence.statistics_text import interval_text, share_text
from skidpad.fleet.insight.trends import AlarmRate, Trend, alarm_rates, trends
from skidpad.fleet.insight.worklist import Work, rank_work
from skidpad.fleet.patterns.analysis import newest_clusters
from skidpad.fleet.service import CAME, Fleet
from skidpad.fleet.site.acting import click_analyse, person
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

WIDTH, HEIGHT = 260.0, 130.0
LEFT, RIGHT, TOP, BOTTOM = 42.0, 14.0, 12.0, 24.0  # room around the plot for its labels
INK, LINE = "#9aa5b1", "#4d9dff"
TOPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # of the share's axis
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
    """Returns all that the dashboard shows of what a manufacturer or operator may see."""
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
    """Adds the dashboard to the page, drawn anew within LOOK_S s of something new.

    It ends with the credential. The open page keeps the principal and a count, not what it shows.
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
    """Adds alarms per hour, trends, the map and recurring hazards to the page."""
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
    """Adds the top of the work list to the page, with a button that calls `again`.

    A click keeps `again` alone for as long as the page is open, not all that was shown.
    """
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
    """Returns row and record of the requested hazard, and the roads around it; Refused (404) out of sight."""
    hazard = str(request.path_params["hazard"])
    with fleet.engine.connect() as connection:
        row = hazard_row(connection, who, hazard)
        record = record_of(connection, fleet.blobs, hazard)
    return row, record, near(lines(row["map"]), row["x"], row["y"])


def draw_replay(ui: Any, found: tuple[dict[str, Any], HazardRecord, Sequence[Line]]) -> None:
    """Adds one hazard to the page, cycle by cycle, as every channel saw it."""
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


# A trend as a chart with axes: share of cycles over days, with its interval.


def trend_svg(trends: Sequence[Trend], name: str) -> str:
    """Returns an SVG of the share of cycles in violation over time, with its interval as a band.

    Of one day: a bar. trends: of one indicator, in order of time, at least one.
    """
    most = max(max(t.interval.high, t.share) for t in trends)
    top = next((limit for limit in TOPS if limit >= most), 1.0)
    first, last = trends[0].at, trends[-1].at
    span = last - first

    def x(at: float) -> float:
        part = (at - first) / span if span > 0.0 else 0.5
        return LEFT + part * (WIDTH - LEFT - RIGHT)

    def y(share: float) -> float:
        return HEIGHT - BOTTOM - share / top * (HEIGHT - TOP - BOTTOM)

    dates = [first] if span <= 0.0 else [first, last]
    body = _axes(top, y) + "".join(_date(x(at), at, len(dates) > 1) for at in dates)
    body += _data([(x(t.at), y(t.share), y(t.interval.low), y(t.interval.high)) for t in trends])
    return (
        f'<svg role="img" aria-label="{escape(name)}" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" '
        f'font-size="11" fill="{INK}" style="width:100%;background:#0d1014">{body}</svg>'
    )


def _axes(top: float, y: Callable[[float], float]) -> str:
    """Returns SVG lines at 0, half and the top of the axis, each with its share in percent.

    y: height in the drawing of a share.
    """
    return "".join(
        f'<path d="M{LEFT:g} {y(share):.1f}H{WIDTH - RIGHT:g}" stroke="#303944"/>'
        f'<text x="{LEFT - 4:g}" y="{y(share) + 4:.1f}" text-anchor="end">{100 * share:g} %</text>'
        for share in (0.0, top / 2, top)
    )


def _date(x: float, at: float, is_end: bool) -> str:
    """Returns the SVG of a day (UTC) under the plot; those at an end stay within the picture."""
    day = f"{datetime.fromtimestamp(at, timezone.utc):%Y-%m-%d}"
    anchor = "middle" if not is_end else "start" if x < WIDTH / 2 else "end"
    return f'<text x="{x:.1f}" y="{HEIGHT - 8:g}" text-anchor="{anchor}">{day}</text>'


def _data(points: Sequence[tuple[float, float, float, float]]) -> str:
    """Returns the SVG of points (x, share, low, high) as a line within a band; of one as a dot on a bar."""
    if len(points) == 1:
        x, share, low, high = points[0]
        return (
            f'<path d="M{x:.1f} {low:.1f}V{high:.1f}" stroke="{LINE}" stroke-opacity=".5" '
            f'stroke-width="6"/><circle cx="{x:.1f}" cy="{share:.1f}" r="4" fill="{LINE}"/>'
        )
    band = [(x, high) for x, _, _, high in points] + [(x, low) for x, _, low, _ in points[::-1]]
    line = [(x, share) for x, share, _, _ in points]
    return (
        f'<polygon points="{_points(band)}" fill="{LINE}" fill-opacity=".3"/>'
        f'<polyline points="{_points(line)}" fill="none" stroke="{LINE}" stroke-width="2"/>'
    )


def _points(points: Sequence[tuple[float, float]]) -> str:
    """Returns points as the text of an SVG attribute, one decimal."""
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
