"""Alerts live: the scene, who took it up, and for a teleoperator orders to the vehicle."""

from __future__ import annotations

from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool

from skidpad.core.text.wording import count_text
from skidpad.fleet.alerting.keeping import Alert, Scene, What, newest_alerts
from skidpad.fleet.alerting.orders import Order
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.acting import click_answer, click_order, person
from skidpad.fleet.site.drawing import MapLines, near, scene_legend, scene_svg, scene_text
from skidpad.fleet.site.frame import say
from skidpad.fleet.words import Action, Principal, Refused

LOOK_S = 0.5
SHOWN = 20
ANSWERS = {
    "Acknowledge": What.ACKNOWLEDGED,
    "Escalate": What.ESCALATED,
    "Close": What.CLOSED,
}
ORDERS = {
    "Order to stop": (Order.STOP, "red"),
    "Slow to walking pace": (Order.SLOW, "primary"),
    "Its own speed again": (Order.RESUME, "primary"),
}


def alerts_of(fleet: Fleet, who: Principal) -> tuple[int, Principal, list[Alert]]:
    """Returns the count of what came so far, the principal, and the newest alerts that it may see.

    The count is taken before the alerts are read. Refused (401) when the credential has ended.
    """
    now, seen = person(fleet, who.id), fleet.hub.count(f"alerts {who.tenant}")
    with fleet.engine.connect() as connection:
        return seen, now, newest_alerts(connection, now)


def draw_alerts(
    fleet: Fleet, lines: MapLines, ui: Any, seen: int, who: Principal, found: list[Alert]
) -> None:
    """Adds the newest alerts to the page, drawn anew within LOOK_S s of a change while it is open."""
    topic = f"alerts {who.tenant}"

    @ui.refreshable  # type: ignore[untyped-decorator]
    def cards(now: Principal, known: list[Alert]) -> None:
        ui.label(count_text(sum(not a.is_closed for a in known), "open alert"))
        for alert in known[:SHOWN]:
            _card(fleet, lines, ui, now, alert)

    async def look() -> None:
        nonlocal seen
        if fleet.hub.count(topic) == seen:
            return
        try:
            seen, now, known = await run_in_threadpool(alerts_of, fleet, who)
            cards.refresh(now, known)
        except Refused as error:
            cards.refresh(who, [])
            ui.label(str(error))
            timer.cancel()

    cards(who, found)
    timer = ui.timer(LOOK_S, look)


def _card(fleet: Fleet, lines: MapLines, ui: Any, who: Principal, alert: Alert) -> None:
    """Adds the card of an alert to the page: scene, state and, while it is open, its buttons."""
    id, scene = alert.row.id, msgspec.json.decode(alert.row.scene, type=Scene)
    with ui.element("div").classes("card"):
        state = "closed" if alert.is_closed else f"level {alert.level}"
        ui.label(f"{alert.row.kind.replace('_', ' ')}: {alert.row.text} ({state})")
        taken = "acknowledged" if alert.acknowledged_by else "not taken up yet"
        ui.label(f"{scene.map}, {scene.v:.1f} m/s, {taken}").classes("dim")
        ego, roads = scene.ego, near(lines(scene.map), scene.ego.x, scene.ego.y)
        picture = scene_svg(ego, scene.objects, f"scene of alert {id}", roads)
        ui.html(picture, sanitize=False).style("max-width: 420px")
        ui.html(scene_legend(), sanitize=False).classes("dim")
        ui.label(scene_text(ego, scene.objects))
        ui.label("; ".join(e.what for e in alert.events) or "new").classes("dim")
        if alert.is_closed:
            return
        for name, what in ANSWERS.items():
            ui.button(name, on_click=_answering(fleet, ui, who, id, what))
        for name, (order, colour) in ORDERS.items() if who.may(Action.GUIDE) else ():
            ui.button(name, color=colour, on_click=_ordering(fleet, ui, who, id, order))


def _answering(fleet: Fleet, ui: Any, who: Principal, alert: str, what: What) -> Any:
    """Returns the handler of a click that answers an alert and tells how it went."""
    return lambda: say(ui, lambda: click_answer(fleet, who.id, alert, what), what.value)


def _ordering(fleet: Fleet, ui: Any, who: Principal, alert: str, order: Order) -> Any:
    """Returns the handler of a click that orders the vehicle of an alert and tells how it went."""
    told = f"{order.value} ordered, good for 2 s"
    return lambda: say(ui, lambda: click_order(fleet, who.id, alert, order), told)
