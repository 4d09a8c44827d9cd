"""Changes and releases: proposed, re-evaluated on their scenes, rolled out, looked at (C-176, C-178)."""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Request, Response
from msgspec import Meta
from starlette.concurrency import run_in_threadpool

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.api.vehicle import read_value
from skidpad.fleet.loop.changes import Proposal, payload_of, propose, re_evaluate
from skidpad.fleet.loop.plan import Plan
from skidpad.fleet.loop.rollout import look_at, release, rollout_of, rollouts, trace
from skidpad.fleet.updates.payloads import PayloadKind
from skidpad.fleet.words import Action, Principal, Refused

Changer = Annotated[Principal, Depends(Needs(Action.CHANGE))]
Reader = Annotated[Principal, Depends(Needs(Action.READ_CHANGES))]
Id = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
router = APIRouter(prefix="/api/v1", tags=["changes"])


class ProposalText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A change as it is proposed; the payload in base64."""

    kind: PayloadKind
    payload: str
    reason: Annotated[str, Meta(min_length=1, max_length=2000)]
    hazards: tuple[Id, ...]
    cluster: Id | None = None


class Before(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the fleet runs, to compare with; the payload in base64."""

    kind: PayloadKind
    payload: str


class ReleaseText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A release: the list of updates as it was signed off line (base64), and the plan."""

    change: Id
    targets: str
    plan: Plan = Plan()


def _bytes(text: str) -> bytes:
    """Returns the bytes of base64 text; refuses with 422 what is not base64."""
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise Refused(422, "a payload must be base64") from error


@router.post("/changes")
async def new_change(request: Request, who: Changer) -> dict[str, str]:
    """Keeps a proposed change with the hazards that led to it, checks its payload; answers its id."""
    fleet = fleet_of(request)
    text = await read_value(request, fleet.limits, ProposalText)
    proposal = Proposal(
        kind=text.kind,
        content=_bytes(text.payload),
        reason=text.reason,
        hazards=text.hazards,
        cluster=text.cluster,
    )
    return {"change": await run_in_threadpool(propose, fleet, who, proposal)}


@router.get("/changes/{change}")
def trace_change(request: Request, who: Reader, change: str) -> dict[str, Any]:
    """Answers with the record of a change: hazards, analysis, releases, looks and re-evaluation."""
    with fleet_of(request).engine.connect() as connection:
        return trace(connection, who, change)


@router.get("/changes/{change}/payload", response_class=Response)
def payload(request: Request, who: Changer, change: str) -> Response:
    """Answers with the bytes of a change's payload, to be signed off line."""
    content = payload_of(fleet_of(request), who, change)[2]
    return Response(content, media_type="application/octet-stream")


@router.post("/changes/{change}/evaluate")
async def evaluate(request: Request, who: Changer, change: str) -> list[dict[str, Any]]:
    """Judges the scenes that led to the change again, under the payload sent (before) and the change."""
    fleet = fleet_of(request)
    with fleet.engine.connect() as connection:
        trace(connection, who, change)
    before = await read_value(request, fleet.limits, Before)
    told = (before.kind, _bytes(before.payload))
    return await run_in_threadpool(re_evaluate, fleet, who, change, told)


@router.get("/update-list", response_class=Response)
def update_list(request: Request, who: Changer) -> Response:
    """Answers with the current list of updates, to be extended and signed off line."""
    content = fleet_of(request).repository(who.tenant).targets()
    return Response(content, media_type="application/json")


@router.post("/releases")
async def new_release(request: Request, who: Changer) -> dict[str, str]:
    """Publishes a change that was signed off line and starts stage one of its plan; answers the id."""
    fleet = fleet_of(request)
    text = await read_value(request, fleet.limits, ReleaseText)
    targets = _bytes(text.targets)
    id = await run_in_threadpool(release, fleet, who, text.change, targets, text.plan)
    return {"release": id}


@router.get("/releases")
def list_releases(request: Request, who: Reader) -> list[dict[str, Any]]:
    """Answers with all releases of one's own, oldest first."""
    with fleet_of(request).engine.connect() as connection:
        return [one.plain() for one in rollouts(connection, who.tenant)]


@router.post("/releases/{release}/look")
def look(request: Request, who: Changer, release: str) -> dict[str, Any]:
    """Looks at a release, which may advance or revert it; answers with finding (or null) and state."""
    fleet = fleet_of(request)
    finding = look_at(fleet, who, release)
    with fleet.engine.connect() as connection:
        now = rollout_of(connection, who.tenant, release).plain()
    return {"finding": None if finding is None else msgspec.to_builtins(finding), "now": now}
