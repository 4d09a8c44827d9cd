"""Events: what became of a fact, who did it and when (decision R-11)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, select

from skidpad.fleet.store.rights import in_chunks
from skidpad.fleet.store.tables import events


@dataclass(frozen=True, slots=True)
class Event:
    """One event as it is kept."""

    number: int
    subject: str
    kind: str
    what: str
    actor: str
    at: float  # s, server
    detail: dict[str, Any]

    def plain(self) -> dict[str, Any]:
        """Returns what became of the fact as plain values for JSON."""
        return {"what": self.what, "actor": self.actor, "at": self.at, "detail": self.detail}


def add_event(
    connection: Connection,
    subject: tuple[str, str],
    what: str,
    by: tuple[str, float],
    **detail: Any,
) -> None:
    """Inserts an event: `what` happened to `subject` (kind, id), `by` (actor, time in s).

    detail: anything that JSON holds but nan and inf.
    """
    connection.execute(
        events.insert(),
        {
            "kind": subject[0], "subject": subject[1], "what": what, "actor": by[0], "at": by[1],
            "detail": json.dumps(detail, sort_keys=True, allow_nan=False),
        },
    )  # fmt: skip


def events_of(connection: Connection, subjects: Sequence[str]) -> list[Event]:
    """Returns the events of these subjects (ids), those of each in the order in which they were kept."""
    query = select(events).order_by(events.c.number)
    return [
        Event(r.number, r.subject, r.kind, r.what, r.actor, r.at, json.loads(r.detail))
        for some in in_chunks(subjects)
        for r in connection.execute(query.where(events.c.subject.in_(some)))
    ]
