"""What vehicles send (C-151, C-171, C-194): batches with an idempotency key."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Request
from starlette.concurrency import run_in_threadpool

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.batch import drive_of, hazards_of, rows_of
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.accounts import vehicle_row
from skidpad.fleet.store.intake import Batch, plain, summary_text
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.words import Action, Kind, Limits, Principal, Refused

INLINE = 65536  # bytes of a body that is unpacked at once, without a thread
Reporter = Annotated[Principal, Depends(Needs(Action.REPORT))]
Key = Annotated[str, Header(alias="Idempotency-Key", pattern="^[A-Za-z0-9-]{8,64}$")]
DriveName = Annotated[str, Header(alias="X-Skidpad-Drive", pattern="^[0-9a-f]{0,64}$")]
VehicleTime = Annotated[
    float | None, Header(alias="X-Skidpad-Time", ge=-1e12, le=1e12, allow_inf_nan=False)
]
router = APIRouter(prefix="/api/v1", tags=["vehicle"])


@router.post("/batches/{kind}")
async def upload(
    request: Request,
    who: Reporter,
    kind: Kind,
    key: Key,
    drive: DriveName = "",
    vehicle_time: VehicleTime = None,
) -> dict[str, Any]:
    """Keep a batch (gzip); the answer comes after the commit and names the records' ids."""
    fleet = fleet_of(request)
    body = await read_body(request, fleet.limits)

    def checked() -> Batch:
        return _checked(fleet, who, kind, (key, drive, vehicle_time), body)

    batch = checked() if len(body) <= INLINE else await run_in_threadpool(checked)
    return plain(await asyncio.wrap_future(fleet.intake.submit(batch)))


async def read_body(request: Request, limits: Limits) -> bytes:
    """The body, given up as soon as it is longer than allowed."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > limits.body:
            raise Refused(413, f"a body may have {limits.body} bytes")
        parts.append(part)
    return b"".join(parts)


def _checked(
    fleet: Fleet,
    who: Principal,
    kind: Kind,
    told: tuple[str, str, float | None],
    body: bytes,
) -> Batch:
    content = unpack(body, fleet.limits)
    key, drive, vehicle_time = told
    operator, manufacturer = owners_of(fleet, str(who.vehicle))
    readers: dict[Kind, Callable[[], dict[str, Any]]] = {
        Kind.HAZARDS: lambda: {"found": hazards_of(content, fleet.limits)},
        Kind.DRIVE: lambda: {
            "summary": drive_of(content), "summary_text": summary_text(content),
        },
        Kind.INDICATORS: lambda: {"found": ()} if rows_of(content, fleet.limits) else {},
    }  # fmt: skip
    return Batch(
        vehicle=str(who.vehicle),
        operator=operator,
        manufacturer=manufacturer,
        kind=kind,
        key=key,
        body=body,
        drive=drive,
        vehicle_time=vehicle_time,
        **readers[kind](),
    )


def owners_of(fleet: Fleet, vehicle: str) -> tuple[str, str]:
    """Operator and manufacturer of a vehicle, which never change."""
    known = fleet.owners.get(vehicle)
    if known is None:
        with fleet.engine.connect() as connection:
            row = vehicle_row(connection, vehicle)
        known = fleet.owners[vehicle] = row.operator, row.manufacturer
    return known
