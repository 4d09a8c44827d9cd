"""Alerts: raised by vehicles, pushed to whoever waits, answered by operators (C-175)."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.concurrency import run_in_threadpool

from skidpad.fleet.alerting.keeping import (
    AlertText,
    What,
    alert_of,
    answer,
    keep_alert,
    newest_alerts,
    parse_alert,
)
from skidpad.fleet.alerting.orders import Order, give_order
from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.api.vehicle import Key, Reporter, VehicleTime, read_body
from skidpad.fleet.checking import owners_of
from skidpad.fleet.service import Fleet
from skidpad.fleet.words import Action, Principal

Reader = Annotated[Principal, Depends(Needs(Action.READ_ALERTS))]
Answerer = Annotated[Principal, Depends(Needs(Action.ANSWER_ALERTS))]
Teleoperator = Annotated[Principal, Depends(Needs(Action.GUIDE))]
Wait = Annotated[float, Query(ge=0.0, le=30.0, allow_inf_nan=False)]
router = APIRouter(prefix="/api/v1/alerts", tags=["alerts"])


@router.post("")
async def raise_alert(
    request: Request, who: Reporter, key: Key, vehicle_time: VehicleTime = None
) -> dict[str, Any]:
    """Keeps a vehicle's alert and has it relayed; answers its id and whether it was known."""
    fleet = fleet_of(request)
    alert = parse_alert(await read_body(request, fleet.limits))
    return await run_in_threadpool(_keep, fleet, who, key, alert, vehicle_time)


def _keep(
    fleet: Fleet, who: Principal, key: str, alert: AlertText, vehicle_time: float | None
) -> dict[str, Any]:
    """Keeps a vehicle's alert and wakes pages and relays if it is new; returns its id and if it was known."""
    vehicle = str(who.vehicle)
    operator, manufacturer = owners_of(fleet, vehicle)
    owned = {"vehicle": vehicle, "operator": operator, "manufacturer": manufacturer}
    with fleet.engine.begin() as connection:
        id, new = keep_alert(connection, owned, key, alert, (fleet.clock(), vehicle_time))
    if new:
        fleet.hub.tell(f"alerts {operator}")
        fleet.dispatcher.wake()
    return {"alert": id, "known": not new}


@router.get("")
async def list_alerts(
    request: Request, who: Reader, seen: int = -1, wait: Wait = 0.0
) -> dict[str, Any]:
    """Answers with the newest alerts and a count; with that as `seen`, waits `wait` s for a change."""
    fleet = fleet_of(request)
    count = await fleet.hub.wait_for_change(f"alerts {who.tenant}", seen, wait)

    def read() -> list[dict[str, Any]]:
        with fleet.engine.connect() as connection:
            return [alert.plain() for alert in newest_alerts(connection, who)]

    return {"seen": count, "alerts": await run_in_threadpool(read)}


@router.post("/{alert}/acknowledge")
def acknowledge(request: Request, who: Answerer, alert: str) -> dict[str, Any]:
    """Notes that a person takes the alert up."""
    return keep_answer(fleet_of(request), who, alert, What.ACKNOWLEDGED)


@router.post("/{alert}/escalate")
def escalate(request: Request, who: Answerer, alert: str) -> dict[str, Any]:
    """Raises an alert one level, which relays it again; returns the alert."""
    return keep_answer(fleet_of(request), who, alert, What.ESCALATED)


@router.post("/{alert}/close")
def close(request: Request, who: Answerer, alert: str) -> dict[str, Any]:
    """Closes an alert; returns it."""
    return keep_answer(fleet_of(request), who, alert, What.CLOSED)


def keep_answer(fleet: Fleet, who: Principal, alert: str, what: What) -> dict[str, Any]:
    """Keeps an answer to an alert, wakes pages and relays, and returns the alert as it is now."""
    with fleet.engine.begin() as connection:
        answer(connection, alert_of(connection, who, alert), what, who, fleet.clock())
    with fleet.engine.connect() as connection:
        now = alert_of(connection, who, alert)
    fleet.hub.tell(f"alerts {now.row.operator}")
    fleet.dispatcher.wake()
    return now.plain()


@router.post("/{alert}/order/{to}")
def order(request: Request, who: Teleoperator, alert: str, to: Order, key: Key) -> dict[str, Any]:
    """Orders the vehicle to stop, slow down or go on; void unless it is fetched within 2 s."""
    return keep_order(fleet_of(request), who, alert, (to, key))


def keep_order(
    fleet: Fleet, who: Principal, alert: str, asked: tuple[Order, str]
) -> dict[str, Any]:
    """Keeps an order (what, and the request's key) and wakes its vehicle; returns id and expiry (s)."""
    with fleet.engine.begin() as connection:
        order = give_order(connection, who, alert, asked, fleet.clock())
    fleet.hub.tell(f"orders {order.vehicle}")
    fleet.hub.tell(f"alerts {who.tenant}")
    return {"order": order.id, "expires": order.expires}
