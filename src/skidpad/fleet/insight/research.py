"""The anonymised export for research (C-177): no ids, at least five vehicles behind every row.

A row is a place (500 m), an hour, a kind of hazard and a class of weather. It is published when at
least five different vehicles reported such a hazard there in that hour, with the number of hazards
rounded down to fives. Rows of an hour are made once, a day after it, and never again: an export that
is taken later holds the same rows for the same hour, so the difference of two exports is whole hours
and says nothing of a vehicle that came, went or reported late. There are no sums to subtract from.
Five false vehicles of an attacker count as five: who may enrol vehicles is trusted.
"""

from __future__ import annotations

import json
from math import floor
from typing import Any

from sqlalchemy import Connection, select

from skidpad.fleet.service import Fleet
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.tables import events, hazards

K = 5  # different vehicles
CELL = 500.0  # m
HOUR = 3600.0  # s
DELAY = 24 * HOUR  # after an hour before it is published
PUBLISHED, KIND, SERVICE = "published", "research hour", "research"


def export(fleet: Fleet) -> list[dict[str, Any]]:
    """Publishes the hours that are due and returns all rows ever published, in order of their hours."""
    _publish_due(fleet)
    with fleet.engine.connect() as connection:
        rows = connection.execute(
            select(events.c.subject, events.c.detail)
            .where(events.c.kind == KIND, events.c.what == PUBLISHED)
            .order_by(events.c.number)
        ).all()
    first: dict[str, list[dict[str, Any]]] = {}
    for row in rows:  # of two publications at the same moment the first stands
        first.setdefault(row.subject, _decode(row.detail))
    return [one for hour in sorted(first, key=int) for one in first[hour]]


def _decode(text: str) -> list[dict[str, Any]]:
    """Returns the rows of a published export from its JSON text."""
    rows: list[dict[str, Any]] = json.loads(text)["rows"]
    return rows


def _publish_due(fleet: Fleet) -> None:
    """Publishes the rows of each hour that ended at least DELAY s ago and was not published yet."""
    now = fleet.clock()
    last = floor((now - DELAY) / HOUR)  # hours before this one have ended a day ago
    with fleet.engine.begin() as connection:
        done = connection.execute(
            select(events.c.subject).where(events.c.kind == KIND, events.c.what == PUBLISHED)
        ).scalars()
        newest = max((int(hour) for hour in done), default=-1)
        table = _gather_rows(connection, (newest + 1) * HOUR, last * HOUR)
        for hour in sorted(table):
            add_event(connection, (KIND, str(hour)), PUBLISHED, (SERVICE, now), rows=table[hour])
        if last - 1 > newest and last - 1 not in table:  # hours without a row are published, too
            add_event(connection, (KIND, str(last - 1)), PUBLISHED, (SERVICE, now), rows=[])


def _gather_rows(
    connection: Connection, since: float, until: float
) -> dict[int, list[dict[str, Any]]]:
    """Returns rows by hour of the server's time within [since, until) s; groups below K vehicles go."""
    rows = connection.execute(
        select(
            hazards.c.map, hazards.c.x, hazards.c.y, hazards.c.type, hazards.c.weather,
            hazards.c.vehicle, hazards.c.at,
        ).where(hazards.c.at >= since, hazards.c.at < until)
    )  # fmt: skip
    groups: dict[tuple[int, str, int, int, str, str], list[str]] = {}
    for r in rows:
        key = floor(r.at / HOUR), r.map, floor(r.x / CELL), floor(r.y / CELL), r.type, r.weather
        groups.setdefault(key, []).append(r.vehicle)
    out: dict[int, list[dict[str, Any]]] = {}
    for (hour, map_, i, j, type_, weather), seen in sorted(groups.items()):
        if len(set(seen)) >= K:
            row = {
                "hour": hour, "map": map_, "x": (i + 0.5) * CELL, "y": (j + 0.5) * CELL,
                "hazard": type_, "weather": weather, "hazards_at_least": len(seen) // K * K,
            }  # fmt: skip
            out.setdefault(hour, []).append(row)
    return out
