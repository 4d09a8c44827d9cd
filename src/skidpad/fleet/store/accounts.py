"""Tenants, vehicles, people and their credentials; a credential is ended by an event."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, select

from skidpad.core.errors import ConfigError
from skidpad.fleet.identity import new_id, new_token, token_hash
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.tables import credentials, events, principals, tenants, vehicles
from skidpad.fleet.words import Principal, Role

YEAR = 365.25 * 86400.0  # s that a credential is good for
ENDED = "credential ended"
HAS_ENDED = (  # of a row of credentials
    select(events.c.number)
    .where(events.c.subject == credentials.c.id, events.c.what == ENDED)
    .exists()
)


@dataclass(frozen=True, slots=True)
class Account:
    """Holds a new principal and its token, which is shown once and not kept."""

    principal: Principal
    token: str


def tenant_id(connection: Connection, name: str, at: float) -> str:
    """Returns the id of the tenant of that name, which is added when it is new.

    Raises ConfigError for a name of another length than 1 to 200.
    """
    if not 0 < len(name) <= 200:
        raise ConfigError(f"a tenant's name has 1 to 200 characters, got {len(name)}")
    row = connection.execute(select(tenants.c.id).where(tenants.c.name == name)).first()
    if row is not None:
        return str(row.id)
    known = new_id()
    connection.execute(tenants.insert(), {"id": known, "name": name, "at": at})
    return known


def find_tenant(connection: Connection, name: str) -> str:
    """Returns the id of the tenant of that name; ConfigError where no tenant has it."""
    known = {
        str(r.name): str(r.id) for r in connection.execute(select(tenants.c.id, tenants.c.name))
    }
    if name not in known:
        names = ", ".join(sorted(known)) or "none yet"
        raise ConfigError(f"unknown operator {name!r}; the fleet knows: {names}")
    return known[name]


def add_person(connection: Connection, tenant: str, role: Role, name: str, at: float) -> Account:
    """Adds a person of `tenant` (its name, added if new) with a fresh credential from `at` s on.

    Raises ConfigError for the role of a vehicle.
    """
    if role is Role.VEHICLE:
        raise ConfigError("a vehicle is added with its manufacturer, not as a person")
    return _add(connection, tenant_id(connection, tenant, at), role, name, None, at)


def add_vehicle(
    connection: Connection, operator: str, manufacturer: str, name: str, at: float
) -> Account:
    """Adds a vehicle of two tenants (their names, added if new) with a fresh credential of its own.

    Raises ConfigError when the operator has one of that name.
    """
    owner, maker = tenant_id(connection, operator, at), tenant_id(connection, manufacturer, at)
    there = (vehicles.c.operator == owner) & (vehicles.c.name == name)
    if connection.execute(select(vehicles.c.id).where(there)).first() is not None:
        raise ConfigError(f"operator {operator!r} already has a vehicle {name!r}")
    row: dict[str, Any] = {
        "id": new_id(), "operator": owner, "manufacturer": maker, "name": name, "at": at,
    }  # fmt: skip
    connection.execute(vehicles.insert(), row)
    return _add(connection, owner, Role.VEHICLE, name, row["id"], at)


def _add(
    connection: Connection, tenant: str, role: Role, name: str, vehicle: str | None, at: float
) -> Account:
    """Adds a principal to the tenant, with a credential from `at` on; `vehicle` None: not a vehicle."""
    principal = Principal(new_id(), tenant, role, name, vehicle)
    connection.execute(
        principals.insert(),
        {
            "id": principal.id, "tenant": tenant, "role": role.value, "name": name,
            "vehicle": vehicle, "at": at,
        },
    )  # fmt: skip
    return Account(principal, add_credential(connection, principal.id, at))


def add_credential(connection: Connection, principal: str, at: float) -> str:
    """Adds a fresh credential of a principal, good for a YEAR from `at` s, and returns its token."""
    token = new_token()
    row = {
        "id": new_id(), "principal": principal, "token_hash": token_hash(token),
        "expires": at + YEAR, "at": at,
    }  # fmt: skip
    connection.execute(credentials.insert(), row)
    return token


def principal_of(connection: Connection, token: str, at: float) -> Principal | None:
    """Returns the principal whose credential `token` is at `at` s; None when unknown, expired or ended."""
    return _principal(connection, credentials.c.token_hash == token_hash(token), at)


def principal_by_id(connection: Connection, id: str, at: float) -> Principal | None:
    """Returns the principal of this id while it has a credential that holds at `at` s, else None."""
    return _principal(connection, principals.c.id == id, at)


def _principal(connection: Connection, which: ColumnElement[bool], at: float) -> Principal | None:
    """Returns the principal of a credential that is valid at `at`; None where there is none."""
    row = connection.execute(
        select(principals)
        .join(credentials, credentials.c.principal == principals.c.id)
        .where(which, credentials.c.expires > at, ~HAS_ENDED)
    ).first()
    if row is None:
        return None
    return Principal(row.id, row.tenant, Role(row.role), row.name, row.vehicle)


def end_credentials(connection: Connection, principal: str, by: str, at: float) -> int:
    """Adds an event that ends it to every credential of a principal; returns how many it ended.

    Those that ended before stay as they are and do not count. by: actor; at: s.
    """
    rows = connection.execute(
        select(credentials.c.id).where(credentials.c.principal == principal, ~HAS_ENDED)
    ).all()
    for row in rows:
        add_event(connection, ("credential", row.id), ENDED, (by, at))
    return len(rows)


def principals_named(connection: Connection, tenant: str, role: Role, name: str) -> list[str]:
    """Returns ids of the principals with this tenant's name, role and name; ConfigError without any."""
    found = connection.execute(
        select(principals.c.id)
        .join(tenants, tenants.c.id == principals.c.tenant)
        .where(tenants.c.name == tenant, principals.c.role == role.value, principals.c.name == name)
        .order_by(principals.c.at, principals.c.id)
    ).scalars()
    ids = [str(id) for id in found]
    if not ids:
        raise ConfigError(f"{tenant!r} has no {role.value} of the name {name!r}")
    return ids


def vehicle_row(connection: Connection, vehicle: str) -> Any:
    """Returns the row of a vehicle, which must exist."""
    return connection.execute(select(vehicles).where(vehicles.c.id == vehicle)).one()
