"""All pages as one application, with the interface below /api/."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from fastapi import FastAPI
from starlette.requests import Request

from skidpad.fleet.api.app import add_api
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.alerts import alerts_of, draw_alerts
from skidpad.fleet.site.dashboard import draw_overview, draw_replay, overview, read_replay
from skidpad.fleet.site.drawing import MapLines
from skidpad.fleet.site.frame import STYLE, page
from skidpad.fleet.site.reports import (
    case_of,
    changes_of,
    draw_case,
    draw_changes,
    draw_places,
    draw_research,
    places_of,
    research_of,
)
from skidpad.fleet.site.work import draw_work, work_of
from skidpad.fleet.words import Action, Principal
from skidpad.pages.sessions import Sessions
from skidpad.pages.site import site


class Page(NamedTuple):
    """Who may open it, and how it is read and drawn."""

    action: Action
    title: str
    read: Callable[[Principal, Request], Any]
    draw: Callable[[Any, Any], None]


def make_site(fleet: Fleet, lines: MapLines, sessions: Sessions) -> FastAPI:
    """Returns the application with pages and interface; one per process."""

    def routes(app: FastAPI) -> None:
        add_api(app, fleet)
        app.state.sessions = sessions

    pages = {path: page(fleet, *one) for path, one in pages_of(fleet, lines).items()}
    return site("Skidpad fleet", pages, routes=routes, style=STYLE)


def pages_of(fleet: Fleet, lines: MapLines) -> dict[str, Page]:
    """Returns every page by its path."""

    def read(what: Callable[..., Any]) -> Callable[[Principal, Request], Any]:
        return lambda who, _: what(fleet, who)

    return {
        "/": Page(
            Action.READ_TRENDS, "Fleet",
            lambda who, _: (who, overview(fleet, lines, who)),
            lambda ui, found: draw_overview(fleet, lines, ui, *found),
        ),
        "/work": Page(
            Action.READ_TRENDS, "Work list", lambda who, request: work_of(fleet, who, request), draw_work,
        ),
        "/replay/{hazard}": Page(
            Action.READ_HAZARDS, "Replay",
            lambda who, request: read_replay(fleet, lines, who, request), draw_replay,
        ),
        "/alerts": Page(
            Action.READ_ALERTS, "Alerts", read(alerts_of),
            lambda ui, found: draw_alerts(fleet, lines, ui, *found),
        ),
        "/places": Page(Action.READ_PLACES, "Places", read(places_of), draw_places),
        "/case": Page(Action.READ_SAFETY_CASE, "Safety case", read(case_of), draw_case),
        "/changes": Page(Action.READ_CHANGES, "Changes", read(changes_of), draw_changes),
        "/research": Page(Action.READ_RESEARCH, "Research", read(research_of), draw_research),
    }  # fmt: skip
