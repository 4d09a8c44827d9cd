"""All pages as one application, with the interface below /api/."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI
from starlette.requests import Request

from skidpad.fleet.api.app import add_api
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.alerts import alerts_of, draw_alerts
from skidpad.fleet.site.dashboard import MapLines, draw_overview, draw_replay, overview, replayed
from skidpad.fleet.site.frame import STYLE, page
from skidpad.fleet.site.reports import (
    case_of,
    changes_of,
    draw_case,
    draw_changes,
    draw_places,
    places_of,
)
from skidpad.fleet.words import Action, Principal
from skidpad.pages.sessions import Sessions
from skidpad.pages.site import site


def make_site(fleet: Fleet, lines: MapLines, sessions: Sessions) -> FastAPI:
    """Pages and interface; one per process."""

    def routes(app: FastAPI) -> None:
        add_api(app, fleet)
        app.state.sessions = sessions

    def read(what: Callable[..., Any]) -> Callable[[Principal, Request], Any]:
        return lambda who, _: what(fleet, who)

    pages = {
        "/": page(
            fleet, Action.READ_TRENDS, "Fleet",
            lambda who, _: overview(fleet, lines, who), draw_overview,
        ),
        "/replay/{hazard}": page(
            fleet, Action.READ_HAZARDS, "Replay",
            lambda who, request: replayed(fleet, lines, who, request), draw_replay,
        ),
        "/alerts": page(
            fleet, Action.READ_ALERTS, "Alerts", read(alerts_of),
            lambda ui, found: draw_alerts(fleet, ui, *found),
        ),
        "/places": page(fleet, Action.READ_PLACES, "Places", read(places_of), draw_places),
        "/case": page(fleet, Action.READ_SAFETY_CASE, "Safety case", read(case_of), draw_case),
        "/changes": page(fleet, Action.READ_CHANGES, "Changes", read(changes_of), draw_changes),
    }  # fmt: skip
    return site("Skidpad fleet", pages, routes=routes, style=STYLE)
