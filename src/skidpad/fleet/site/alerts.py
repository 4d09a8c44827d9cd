"""Alerts live: the scene, who took it up, and for a teleoperator the order to stop."""

from __future__ import annotations

from typing import Any

import msgspec

from skidpad.fleet.alerting.keeping import Alert, Scene, What, newest_alerts
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.acting import click_answer, click_stop, person
from skidpad.fleet.site.drawing import scene_svg
from skidpad.fleet.site.frame import say
from skidpad.fleet.words import Action, Principal, Refused

LOOK_S = 0.5
SHOWN = 20
ANSWERS = {
    "Acknowledge": What.ACKNOWLEDGED,
    "Escalate": What.ESCALATED,
    "Close": What.CLOSED,
}


def fill_alerts(fleet: Fleet, ui: Any, who: Principal) -> None:
    """The newest alerts; what changes is pushed to the page within half a second."""
    seen = {"count": -1}

    @ui.refreshable  # type: ignore[untyped-decorator]
    def cards() -> None:
        try:
            now = person(fleet, who.id)
        except Refused as error:
            ui.label(str(error))
            return
        with fleet.engine.connect() as connection:
            found = newest_alerts(connection, now)
        ui.label(f"{sum(not a.closed for a in found)} open alerts")
        for alert in found[:SHOWN]:
            _card(fleet, ui, now, alert)

    def look() -> None:
        count = fleet.hub.count(f"alerts {who.tenant}")
        if count != seen["count"]:
            seen["count"] = count
            cards.refresh()

    cards()
    ui.timer(LOOK_S, look)


def _card(fleet: Fleet, ui: Any, who: Principal, alert: Alert) -> None:
    id, scene = alert.row.id, msgspec.json.decode(alert.row.scene, type=Scene)
    with ui.element("div").classes("card"):
        state = "closed" if alert.closed else f"level {alert.level}"
        ui.label(f"{alert.row.kind.replace('_', ' ')}: {alert.row.text} ({state})")
        taken = "acknowledged" if alert.acknowledged_by else "nobody took it up yet"
        ui.label(f"{scene.map}, {scene.v:.1f} m/s, {taken}").classes("dim")
        ui.html(scene_svg(scene.ego, scene.objects, f"scene of alert {id}"), sanitize=False).style(
            "max-width: 420px"
        )
        ui.label("; ".join(e.what for e in alert.events) or "new").classes("dim")
        if alert.closed:
            return
        for name, what in (
            ("Acknowledge", What.ACKNOWLEDGED),
            ("Escalate", What.ESCALATED),
            ("Close", What.CLOSED),
        ):
            ui.button(name, on_click=_answering(fleet, ui, who, id, what))
        if who.may(Action.ORDER_STOP):

            def stop() -> None:
                say(ui, lambda: click_stop(fleet, who.id, id), "stop ordered, good for 2 s")

            ui.button("Order to stop", color="red", on_click=stop)


def _answering(fleet: Fleet, ui: Any, who: Principal, alert: str, what: What) -> Any:
    return lambda: say(ui, lambda: click_answer(fleet, who.id, alert, what), what.value)
