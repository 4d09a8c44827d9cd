"""What readers get: trends, places, research, the safety case; and a session for the pages."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import HTMLResponse

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.insight import places as by_place
from skidpad.fleet.insight.research import export
from skidpad.fleet.insight.safety import claims
from skidpad.fleet.insight.trends import alarm_rates, trends
from skidpad.fleet.words import FIRST_PAGE, Action, Principal, Refused

Analyst = Annotated[Principal, Depends(Needs(Action.READ_TRENDS))]
PlaceReader = Annotated[Principal, Depends(Needs(Action.READ_PLACES))]
Researcher = Annotated[Principal, Depends(Needs(Action.READ_RESEARCH))]
CaseReader = Annotated[Principal, Depends(Needs(Action.READ_SAFETY_CASE))]
Visitor = Annotated[Principal, Depends(Needs(Action.VISIT))]
Days = Annotated[int, Query(ge=1, le=3660)]  # of a stretch
router = APIRouter(prefix="/api/v1", tags=["insight"])


@router.get("/trends")
def read_trends(request: Request, who: Analyst, days: Days = 1) -> dict[str, Any]:
    """Indicators over time with intervals, and alarms per hour with their precision."""
    fleet = fleet_of(request)
    with fleet.engine.connect() as connection:
        rates = [msgspec.to_builtins(rate) for rate in alarm_rates(connection, who)]
    return {"indicators": [asdict(t) for t in trends(fleet, who, days)], "hazards": rates}


@router.get("/places")
def read_places(request: Request, who: PlaceReader) -> list[dict[str, Any]]:
    """Answers with the counts of hazards by place, hazard and weather."""
    with fleet_of(request).engine.connect() as connection:
        return [asdict(row) for row in by_place.places(connection, who)]


@router.get("/places.html", response_class=HTMLResponse)
def places_page(request: Request, who: PlaceReader) -> str:
    """Answers with the report of places as an HTML page."""
    with fleet_of(request).engine.connect() as connection:
        return by_place.html(by_place.places(connection, who))


@router.get("/places.pdf", response_class=Response)
def places_pdf(request: Request, who: PlaceReader) -> Response:
    """Answers with the report of places as PDF."""
    with fleet_of(request).engine.connect() as connection:
        rows = by_place.places(connection, who)
    return Response(by_place.pdf(rows), media_type="application/pdf")


@router.get("/research")
def research(request: Request, who: Researcher) -> list[dict[str, Any]]:
    """Returns the anonymised export for research."""
    del who
    return export(fleet_of(request))


@router.get("/safety-case")
def case(request: Request, who: CaseReader) -> list[dict[str, Any]]:
    """Answers with the safety case and its current evidence."""
    return [asdict(claim) for claim in claims(trends(fleet_of(request), who))]


@router.post("/session")
def session(request: Request, who: Visitor) -> dict[str, str]:
    """Answers with the path of the role's first page, whose token opens the pages once; 404 without pages."""
    sessions = getattr(request.app.state, "sessions", None)
    if sessions is None:
        raise Refused(404, "this fleet serves no pages")
    return {"path": f"{FIRST_PAGE[who.role]}?token={sessions.invite(who.id)}"}
