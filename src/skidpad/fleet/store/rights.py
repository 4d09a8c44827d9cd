"""Which rows someone may see: the condition that every read carries (C-195)."""

from __future__ import annotations

from sqlalchemy import ColumnElement, Table, false

from skidpad.fleet.words import Principal, Role


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
