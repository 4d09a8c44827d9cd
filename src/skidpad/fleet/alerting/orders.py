"""Orders of a teleoperator: signed, for one vehicle, good once and for 2 s, bound to its question.

Clocks of vehicles are not trusted, so an order does not say a time of day: a vehicle asks with a
random challenge, the order repeats it, and the vehicle counts the 2 s from its own question.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, select
from sqlalchemy.exc import IntegrityError

from skidpad.core.errors import OutputError
from skidpad.fleet.alerting.keeping import alert_of
from skidpad.fleet.identity import new_id
from skidpad.fleet.keys import load_key, new_key
from skidpad.fleet.store.events import add_event, events_of
from skidpad.fleet.store.rights import one_row, visible
from skidpad.fleet.store.tables import deliveries, orders
from skidpad.fleet.words import Principal, Refused
from skidpad.recording.files import write_bytes

VALID_S = 2.0
SUBJECT = "order"


class Order(str, Enum):
    """How a vehicle is guided; what it sees, and its own rules, bind it as before."""

    STOP = "stop"  # minimal-risk stop, for good
    SLOW = "slow"  # go on at walking pace
    RESUME = "resume"  # go on at its own speed


class Signer:
    """The fleet's key for orders, in its data folder; vehicles know the public half."""

    def __init__(self, folder: Path) -> None:
        """Reads orders.key in the folder, or makes one, and writes orders.pub; FileError for no such key."""
        path = folder / "orders.key"
        try:
            self._key = load_key(path) if path.exists() else new_key(path)
        except OutputError:
            if not path.exists():
                raise
            self._key = load_key(path)  # another process made it at this moment
        self.public = self._key.public_key().public_bytes_raw()
        write_bytes(folder / "orders.pub", self.public.hex().encode() + b"\n")

    def sign(self, order: dict[str, Any]) -> dict[str, str]:
        """Returns the order as it is sent: its JSON text and the signature of exactly that text, in hex."""
        text = json.dumps(order, sort_keys=True, separators=(",", ":"))
        return {"order": text, "signature": self._key.sign(text.encode()).hex()}


@dataclass(frozen=True, slots=True)
class Ordered:
    """An order that waits for its vehicle to ask."""

    id: str
    vehicle: str
    expires: float  # s, server


def give_order(
    connection: Connection, who: Principal, alert: str, asked: tuple[Order, str], at: float
) -> Ordered:
    """Keeps an order for the vehicle of an alert, which may fetch it for VALID_S s, and returns it.

    asked: the order and the key of the request. The same request again gives the order that it gave,
    with its time: nothing is ordered anew. Refused (404) for an alert out of sight, (409) for a key
    that was used for another order.
    """
    what, key = asked
    row = alert_of(connection, who, alert).row
    known = connection.execute(
        select(orders).where(orders.c.alert == alert, orders.c.actor == who.id, orders.c.key == key)
    ).first()
    if known is not None:
        if known.what != what.value:
            raise Refused(409, "this idempotency key was used for another order")
        return Ordered(known.id, known.vehicle, known.expires)
    order = Ordered(new_id(), row.vehicle, at + VALID_S)
    connection.execute(
        orders.insert(),
        {
            "id": order.id, "operator": row.operator, "manufacturer": row.manufacturer,
            "vehicle": row.vehicle, "alert": alert, "what": what.value, "actor": who.id,
            "expires": order.expires, "at": at, "key": key,
        },
    )  # fmt: skip
    add_event(connection, ("alert", alert), f"{what.value} ordered", (who.id, at), order=order.id)
    return order


def hand_out(
    connection: Connection, signer: Signer, vehicle: str, challenge: str, at: float
) -> list[dict[str, str]]:
    """Returns the orders that wait for `vehicle` at `at` s, signed with its challenge; each only once.

    Expired ones are left out.
    """
    rows = connection.execute(
        select(orders)
        .outerjoin(deliveries, deliveries.c.order == orders.c.id)
        .where(orders.c.vehicle == vehicle, orders.c.expires > at, deliveries.c.order.is_(None))
        .order_by(orders.c.at)
    ).all()
    out = []
    for row in rows:
        try:
            with connection.begin_nested():
                connection.execute(
                    deliveries.insert(), {"order": row.id, "challenge": challenge, "at": at}
                )
        except IntegrityError:
            continue  # handed out to another request at this moment
        out.append(
            signer.sign(
                {
                    "order": row.id, "vehicle": vehicle, "what": row.what,
                    "challenge": challenge, "valid_s": VALID_S,
                }
            )
        )  # fmt: skip
    return out


def note_answer(connection: Connection, who: Principal, order: str, what: str, at: float) -> str:
    """Keeps what the vehicle did with its order and returns the id of the alert that led to it.

    Refused (404) for an order out of sight, (409) when this was told before.
    """
    row = one_row(connection, select(orders).where(orders.c.id == order, visible(who, orders)))
    if events_of(connection, [order]):
        raise Refused(409, "what became of this order was told already")
    add_event(connection, (SUBJECT, order), what, (who.id, at))
    add_event(connection, ("alert", row.alert), what, (who.id, at), order=order)
    return str(row.alert)
