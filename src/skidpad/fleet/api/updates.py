"""Updates as vehicles fetch them: metadata and payloads of their maker, and which one to run."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.checking import owners_of
from skidpad.fleet.loop.rollout import assignment
from skidpad.fleet.updates.repository import Repository
from skidpad.fleet.words import Action, Principal

Receiving = Annotated[Principal, Depends(Needs(Action.RECEIVE_UPDATES))]
router = APIRouter(prefix="/api/v1/updates", tags=["updates"])


def _repository(request: Request, who: Principal) -> Repository:
    """Returns the repository of updates of the maker of the principal's vehicle."""
    fleet = fleet_of(request)
    return fleet.repository(owners_of(fleet, str(who.vehicle))[1])


@router.get("/assignment")
def what_to_run(request: Request, who: Receiving) -> dict[str, str]:
    """Answers with the payload that this vehicle is to run and its release, "" for what stands."""
    fleet, vehicle = fleet_of(request), str(who.vehicle)
    with fleet.engine.connect() as connection:
        return assignment(connection, owners_of(fleet, vehicle)[1], vehicle)


@router.get("/metadata/{name}", response_class=Response)
def metadata(request: Request, who: Receiving, name: str) -> Response:
    """Answers with a metadata file of The Update Framework, of the vehicle's manufacturer."""
    return Response(_repository(request, who).metadata(name), media_type="application/json")


@router.get("/targets/{name}", response_class=Response)
def payload(request: Request, who: Receiving, name: str) -> Response:
    """Answers with a payload of the vehicle's manufacturer by its name with digest."""
    content = _repository(request, who).payload(name)
    return Response(content, media_type="application/octet-stream")
