"""The work list of recurring hazards, and their triage (C-173, C-193)."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool

from skidpad.core.environment.localities import RoadKind
from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.api.vehicle import read_value
from skidpad.fleet.insight.triage import Standing, State, set_standing, subject_key
from skidpad.fleet.insight.worklist import Severity, Work, WorkFilter, rank_work
from skidpad.fleet.patterns.analysis import newest_clusters
from skidpad.fleet.service import CAME, Fleet
from skidpad.fleet.store.events import events_of
from skidpad.fleet.words import Action, Principal, absent

Reader = Annotated[Principal, Depends(Needs(Action.READ_TRENDS))]
Triager = Annotated[Principal, Depends(Needs(Action.TRIAGE))]
Seconds = Annotated[float | None, Query(ge=0.0, le=1e12, allow_inf_nan=False)]
Word = Annotated[str | None, Query(max_length=200)]
router = APIRouter(prefix="/api/v1/recurring", tags=["recurring hazards"])


class TriageText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A new state of a recurring hazard."""

    state: State
    owner: str = ""
    release: str = ""
    note: str = ""


def work_list(fleet: Fleet, who: Principal, wanted: WorkFilter) -> list[Work]:
    """Returns the recurring hazards of the newest analysis, ranked."""
    with fleet.engine.connect() as connection:
        return rank_work(connection, who, newest_clusters(connection, who), wanted, fleet.locate)


def require_subject(fleet: Fleet, who: Principal, subject: str) -> None:
    """Raises Refused (404) when no recurring hazard of that id is visible to `who`."""
    if subject not in {one.subject for one in work_list(fleet, who, WorkFilter())}:
        raise absent()


def triage(fleet: Fleet, who: Principal, subject: str, text: TriageText) -> dict[str, Any]:
    """Sets the state of a recurring hazard; Refused: 404 unless it is visible, 422 for a wrong state."""
    require_subject(fleet, who, subject)
    standing = Standing(text.state, text.owner, text.release, fleet.clock(), who.id)
    with fleet.engine.begin() as connection:
        set_standing(connection, who, subject, standing, text.note)
    fleet.hub.tell(f"{CAME} {who.tenant}")
    return {"subject": subject, "state": text.state.value}


@router.get("")
def list_work(
    request: Request,
    who: Reader,
    state: State | None = None,
    owner: Word = None,
    map: Word = None,
    weather: Word = None,
    release: Word = None,
    severity: Severity | None = None,
    road: RoadKind | None = None,
    since: Seconds = None,
    before: Seconds = None,
) -> list[dict[str, Any]]:
    """Answers with the recurring hazards of the newest analysis, most likely true risk first."""
    wanted = WorkFilter(
        state=state, owner=owner, map=map, weather=weather, release=release,
        severity=severity, road=road, since=since, before=before,
    )  # fmt: skip
    return [_plain(one) for one in work_list(fleet_of(request), who, wanted)]


@router.post("/{subject}/state")
async def set_state(request: Request, who: Triager, subject: str) -> dict[str, Any]:
    """Sets the state of a recurring hazard and keeps the change as an event; 404, 422 when refused."""
    fleet = fleet_of(request)
    await run_in_threadpool(require_subject, fleet, who, subject)
    text = await read_value(request, fleet.limits, TriageText)
    return await run_in_threadpool(triage, fleet, who, subject, text)


@router.get("/{subject}/events")
def list_events(request: Request, who: Reader, subject: str) -> list[dict[str, Any]]:
    """Answers with every change of a recurring hazard, oldest first; 404 for one out of sight."""
    fleet = fleet_of(request)
    require_subject(fleet, who, subject)
    with fleet.engine.connect() as connection:
        found = events_of(connection, [subject_key(who, subject)])
    return [{"state": e.what, "at": e.at, "actor": e.actor} | e.detail for e in found]


def _plain(one: Work) -> dict[str, Any]:
    """Returns an entry of the work list as plain data; None where place or precision is unknown."""
    risk, precision = one.mean_risk, one.precision
    return {
        "subject": one.subject,
        "type": one.cluster["type"],
        "map": one.cluster["map"],
        "x": one.cluster["x"],
        "y": one.cluster["y"],
        "place": None if one.place is None else one.place.describe(),
        "road": None if one.place is None else one.place.kind.value,
        "severity": one.severity.value,
        "alarms": len(one.alarms),
        "vehicles": one.cluster["vehicles"],
        "mean_risk": risk,
        "precision": None if precision is None else precision.share,
        "weight": one.weight,
        "first": one.first,
        "last": one.last,
        "earlier": one.earlier,
        "later": one.later,
        "state": one.standing.state.value,
        "owner": one.standing.owner,
        "release": one.standing.release,
        "representative": one.cluster["representative"],
    }
