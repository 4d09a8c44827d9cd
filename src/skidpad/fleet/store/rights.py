"""Which rows someone may see: the condition that every read carries (C-195), and how rows are read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Connection, Select, Table, false

from skidpad.fleet.words import Principal, Role, absent

CHUNK = 500  # ids of one query


def visible(who: Principal, table: Table) -> ColumnElement[bool]:
    """Returns the SQL condition for the rows of `table` that `who` may see; no row for other roles.

    The table has the columns `operator`, `manufacturer` and `vehicle`.
    """
    if who.role is Role.VEHICLE:
        return table.c.vehicle == who.vehicle
    if who.role in (Role.OPERATOR, Role.TELEOPERATOR):
        return table.c.operator == who.tenant
    if who.role is Role.MANUFACTURER:
        return table.c.manufacturer == who.tenant
    return false()


def one_row(connection: Connection, query: Select[Any]) -> Any:
    """Returns the first row of a query; Refused (404) where there is none."""
    row = connection.execute(query).first()
    if row is None:
        raise absent()
    return row


def in_chunks(ids: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yields the ids in parts that one query may ask for."""
    for first in range(0, len(ids), CHUNK):
        yield ids[first : first + CHUNK]
