"""All pages as one application, with the interface below /api/."""

from __future__ import annotations

from fastapi import FastAPI

from skidpad.fleet.api.app import add_api
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.alerts import fill_alerts
from skidpad.fleet.site.dashboard import MapLines, fill_dashboard, fill_replay
from skidpad.fleet.site.frame import STYLE, page
from skidpad.fleet.site.reports import fill_case, fill_changes, fill_places
from skidpad.fleet.words import Action
from skidpad.pages.sessions import Sessions
from skidpad.pages.site import site


def make_site(fleet: Fleet, lines: MapLines, sessions: Sessions) -> FastAPI:
    """Pages and interface; one per process."""

    def routes(app: FastAPI) -> None:
        add_api(app, fleet)
        app.state.sessions = sessions

    pages = {
        "/": page(
            fleet, Action.READ_TRENDS, "Fleet",
            lambda ui, who, _: fill_dashboard(fleet, lines, ui, who),
        ),
        "/replay/{hazard}": page(
            fleet, Action.READ_HAZARDS, "Replay",
            lambda ui, who, request: fill_replay(fleet, ui, who, request),
        ),
        "/alerts": page(
            fleet, Action.READ_ALERTS, "Alerts", lambda ui, who, _: fill_alerts(fleet, ui, who)
        ),
        "/places": page(
            fleet, Action.READ_PLACES, "Places", lambda ui, who, _: fill_places(fleet, ui, who)
        ),
        "/case": page(
            fleet, Action.READ_SAFETY_CASE, "Safety case",
            lambda ui, who, _: fill_case(fleet, ui, who),
        ),
        "/changes": page(
            fleet, Action.READ_CHANGES, "Changes", lambda ui, who, _: fill_changes(fleet, ui, who)
        ),
    }  # fmt: skip
    return site("Skidpad fleet", pages, routes=routes, style=STYLE)
