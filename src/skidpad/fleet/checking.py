"""A batch as it came, by whichever link: checked as a whole, before anything of it is kept (C-171)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from skidpad.fleet.batch import drive_of, hazards_of, rows_of
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.accounts import vehicle_row
from skidpad.fleet.store.intake import Batch
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.words import Kind, Principal

KEY = "^[A-Za-z0-9-]{8,64}$"  # of a batch, chosen by the vehicle
DRIVE = "^[0-9a-f]{0,64}$"
TIME_MAX = 1e12  # s, either side of 1970


@dataclass(frozen=True, slots=True)
class MessageHead:
    """What stands beside the body."""

    kind: Kind
    key: str
    drive: str
    vehicle_time: float | None  # s, as the vehicle believed


def check_batch(fleet: Fleet, who: Principal, told: MessageHead, body: bytes) -> Batch:
    """Returns the batch of a vehicle, unpacked and read by its kind; Refused when any of it is wrong.

    told: what stands beside the body.
    """
    content = unpack(body, fleet.limits)
    operator, manufacturer = owners_of(fleet, str(who.vehicle))
    readers: dict[Kind, Callable[[], dict[str, Any]]] = {
        Kind.HAZARDS: lambda: {"found": hazards_of(content, fleet.limits)},
        Kind.DRIVE: lambda: {"summary": drive_of(content)},
        Kind.INDICATORS: lambda: {"found": ()} if rows_of(content, fleet.limits) else {},
    }  # fmt: skip
    return Batch(
        vehicle=str(who.vehicle),
        operator=operator,
        manufacturer=manufacturer,
        kind=told.kind,
        key=told.key,
        body=body,
        drive=told.drive,
        vehicle_time=told.vehicle_time,
        **readers[told.kind](),
    )


def owners_of(fleet: Fleet, vehicle: str) -> tuple[str, str]:
    """Returns operator and manufacturer of a vehicle, which are read once and remembered."""
    known = fleet.owners.get(vehicle)
    if known is None:
        with fleet.engine.connect() as connection:
            row = vehicle_row(connection, vehicle)
        known = fleet.owners[vehicle] = row.operator, row.manufacturer
    return known
