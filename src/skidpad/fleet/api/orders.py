"""Orders as vehicles fetch them: each once, signed with the vehicle's own question."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool

from skidpad.fleet.alerting.orders import hand_out, note_answer
from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.words import Action, Principal

Receiving = Annotated[Principal, Depends(Needs(Action.RECEIVE_ORDERS))]
Challenge = Annotated[str, Query(pattern="^[0-9a-f]{32}$")]
Wait = Annotated[float, Query(ge=0.0, le=1.0, allow_inf_nan=False)]
router = APIRouter(prefix="/api/v1/orders", tags=["orders"])


@router.get("")
async def fetch(
    request: Request, who: Receiving, challenge: Challenge, wait: Wait = 0.0
) -> list[dict[str, str]]:
    """Answers with the vehicle's waiting orders, signed with its challenge and then handed out.

    Without one it waits up to `wait` s, and answers with an empty list.
    """
    fleet, vehicle = fleet_of(request), str(who.vehicle)
    topic = f"orders {vehicle}"

    def take() -> list[dict[str, str]]:
        with fleet.engine.begin() as connection:
            return hand_out(connection, fleet.signer, vehicle, challenge, fleet.clock())

    seen = fleet.hub.count(topic)
    found = await run_in_threadpool(take)
    if not found and await fleet.hub.wait_for_change(topic, seen, wait) != seen:
        found = await run_in_threadpool(take)
    return found


@router.post("/{order}/{what}")
def report(
    request: Request, who: Receiving, order: str, what: Literal["obeyed", "standing", "refused"]
) -> dict[str, Any]:
    """Keeps what the vehicle did with its order, which can be told once."""
    fleet = fleet_of(request)
    with fleet.engine.begin() as connection:
        note_answer(connection, who, order, what, fleet.clock())
    fleet.hub.tell(f"alerts {who.tenant}")
    return {"order": order, "what": what}
