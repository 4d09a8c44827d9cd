"""Alerts as facts, and what became of them as events."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Any

import msgspec
from msgspec import Meta
from sqlalchemy import Connection, select

from skidpad.fleet.identity import digest, new_id
from skidpad.fleet.store.events import Event, add_event, events_of
from skidpad.fleet.store.rights import one_row, visible
from skidpad.fleet.store.tables import alerts
from skidpad.fleet.words import Principal, Refused, decode_sent

ESCALATE_AFTER_S = 30.0  # without an acknowledgement; assumption
LEVELS = 3  # escalations at most
PAGE = 100
SUBJECT = "alert"
Metres = Annotated[float, Meta(ge=-1.0e9, le=1.0e9)]


class Kind(str, Enum):
    """What a vehicle raises an alert for."""

    COLLISION = "collision"
    HAZARD = "hazard"
    MINIMAL_RISK = "minimal_risk"
    FAULT = "fault"


class What(str, Enum):
    """What can become of an alert."""

    RELAYED = "relayed"
    FAILED = "relay failed"
    ACKNOWLEDGED = "acknowledged"
    ESCALATED = "escalated"
    CLOSED = "closed"


class Body(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rectangle on the road, world of the map."""

    x: Metres
    y: Metres
    heading: Annotated[float, Meta(ge=-10.0, le=10.0)]  # rad
    length: Annotated[float, Meta(ge=0.0, le=100.0)] = 4.5  # m
    width: Annotated[float, Meta(ge=0.0, le=10.0)] = 1.9


class Scene(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the vehicle sees at the moment of its alert."""

    map: Annotated[str, Meta(max_length=200)]
    ego: Body
    v: Annotated[float, Meta(ge=-100.0, le=200.0)]  # m/s
    objects: Annotated[tuple[Body, ...], Meta(max_length=200)] = ()


class AlertText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An alert as a vehicle sends it."""

    kind: Kind
    text: Annotated[str, Meta(min_length=1, max_length=500)]
    scene: Scene


_ALERT = msgspec.json.Decoder(AlertText)


@dataclass(frozen=True, slots=True)
class Alert:
    """An alert and what became of it."""

    row: Any
    events: tuple[Event, ...]

    @property
    def acknowledged_by(self) -> str | None:
        """Returns the id of the principal that first acknowledged the alert; None without one."""
        return next((e.actor for e in self.events if e.what == What.ACKNOWLEDGED.value), None)

    @property
    def is_closed(self) -> bool:
        """Returns True when a person has closed the alert."""
        return any(e.what == What.CLOSED.value for e in self.events)

    @property
    def level(self) -> int:
        """Returns how many times the alert was escalated."""
        return sum(e.what == What.ESCALATED.value for e in self.events)

    def plain(self) -> dict[str, Any]:
        """Returns the alert as plain values for JSON."""
        r = self.row
        return {
            "id": r.id, "operator": r.operator, "vehicle": r.vehicle, "kind": r.kind,
            "text": r.text, "scene": json.loads(r.scene), "vehicle_time": r.vehicle_time,
            "at": r.at, "level": self.level, "acknowledged_by": self.acknowledged_by,
            "closed": self.is_closed,
            "events": [e.plain() for e in self.events],
        }  # fmt: skip


def parse_alert(body: bytes) -> AlertText:
    """Returns the alert in a request's body; Refused (413, 422) when it is too long or none."""
    if len(body) > 65536:
        raise Refused(413, "an alert may have 65536 bytes")
    return decode_sent(_ALERT.decode, body, "the alert cannot be read")


def keep_alert(
    connection: Connection,
    owned: dict[str, str],
    key: str,
    alert: AlertText,
    times: tuple[float, float | None],
) -> tuple[str, bool]:
    """Inserts an alert; returns its id and True, or False where the vehicle's key has kept it already.

    times: s, of the server and of the vehicle. Refused (409) when the key had another content.
    """  # fmt: skip
    content = msgspec.json.encode(alert)
    known = connection.execute(
        select(alerts.c.id, alerts.c.digest).where(
            alerts.c.vehicle == owned["vehicle"], alerts.c.key == key
        )
    ).first()
    if known is not None:
        if known.digest != digest(content):
            raise Refused(409, "this idempotency key was used for another alert")
        return known.id, False
    row = owned | {
        "id": new_id(), "key": key, "digest": digest(content), "kind": alert.kind.value,
        "text": alert.text, "scene": msgspec.json.encode(alert.scene).decode(),
        "vehicle_time": times[1], "at": times[0],
    }  # fmt: skip
    connection.execute(alerts.insert(), row)
    return str(row["id"]), True


def alert_of(connection: Connection, who: Principal, alert: str) -> Alert:
    """Returns one alert; Refused (404) when there is none that `who` may see."""
    row = one_row(connection, select(alerts).where(alerts.c.id == alert, visible(who, alerts)))
    return Alert(row, tuple(events_of(connection, [alert])))


def newest_alerts(connection: Connection, who: Principal) -> list[Alert]:
    """Returns the newest alerts that `who` may see, at most PAGE."""
    query = select(alerts).where(visible(who, alerts)).order_by(alerts.c.at.desc(), alerts.c.id)
    return _with_events(connection, connection.execute(query.limit(PAGE)).all())


def alerts_since(connection: Connection, at: float) -> list[Alert]:
    """Returns all alerts of all tenants since `at` s, oldest first; for the service itself."""
    query = select(alerts).where(alerts.c.at >= at).order_by(alerts.c.at, alerts.c.id)
    return _with_events(connection, connection.execute(query).all())


def _with_events(connection: Connection, rows: Any) -> list[Alert]:
    """Returns an alert with all its events per row."""
    found: dict[str, list[Event]] = {row.id: [] for row in rows}
    for event in events_of(connection, list(found)):
        found[event.subject].append(event)
    return [Alert(row, tuple(found[row.id])) for row in rows]


def answer(connection: Connection, alert: Alert, what: What, by: Principal, at: float) -> None:
    """Adds an event that acknowledges, escalates or closes an alert at `at` s.

    Refused (409) when it is closed or acknowledged already, or was escalated LEVELS times.
    """
    if alert.is_closed:
        raise Refused(409, "this alert is closed")
    if what is What.ACKNOWLEDGED and alert.acknowledged_by is not None:
        raise Refused(409, "this alert was acknowledged already")
    if what is What.ESCALATED and alert.level >= LEVELS:
        raise Refused(409, f"this alert was escalated {LEVELS} times already")
    add_event(connection, (SUBJECT, alert.row.id), what.value, (by.id, at), role=by.role.value)


def overdue(alert: Alert, now: float) -> bool:
    """Returns True when an open alert without an acknowledgement is to go one level up.

    That is ESCALATE_AFTER_S s after its beginning per level, up to LEVELS.
    """
    if alert.is_closed or alert.acknowledged_by is not None or alert.level >= LEVELS:
        return False
    at: float = alert.row.at
    return now - at >= ESCALATE_AFTER_S * (alert.level + 1)
