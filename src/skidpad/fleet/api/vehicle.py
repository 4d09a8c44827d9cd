"""What vehicles send (C-151, C-171, C-194): batches with an idempotency key."""

from __future__ import annotations

import asyncio
from typing import Annotated, Any, TypeVar

import msgspec
from fastapi import APIRouter, Depends, Header, Request
from starlette.concurrency import run_in_threadpool

from skidpad.fleet.api.guard import Needs, fleet_of
from skidpad.fleet.checking import DRIVE, KEY, TIME_MAX, MessageHead, check_batch
from skidpad.fleet.store.intake import plain
from skidpad.fleet.words import Action, Kind, Limits, Principal, Refused, decode_sent

T = TypeVar("T")

INLINE = 65536  # bytes of a body that is unpacked at once, without a thread
Reporter = Annotated[Principal, Depends(Needs(Action.REPORT))]
Receiving = Annotated[Principal, Depends(Needs(Action.RECEIVE_ORDERS))]
Key = Annotated[str, Header(alias="Idempotency-Key", pattern=KEY)]
DriveName = Annotated[str, Header(alias="X-Skidpad-Drive", pattern=DRIVE)]
VehicleTime = Annotated[
    float | None, Header(alias="X-Skidpad-Time", ge=-TIME_MAX, le=TIME_MAX, allow_inf_nan=False)
]
router = APIRouter(prefix="/api/v1", tags=["vehicle"])


@router.get("/vehicle")
async def who_i_am(who: Receiving) -> dict[str, str]:
    """Answers with the vehicle of this credential, as orders name it."""
    return {"vehicle": str(who.vehicle)}


@router.post("/batches/{kind}")
async def upload(
    request: Request,
    who: Reporter,
    kind: Kind,
    key: Key,
    drive: DriveName = "",
    vehicle_time: VehicleTime = None,
) -> dict[str, Any]:
    """Keeps a batch (gzip) and answers after the commit with the ids of its records."""
    fleet = fleet_of(request)
    body = await read_body(request, fleet.limits)

    about = MessageHead(kind, key, drive, vehicle_time)
    if len(body) <= INLINE:
        batch = check_batch(fleet, who, about, body)
    else:
        batch = await run_in_threadpool(check_batch, fleet, who, about, body)
    return plain(await asyncio.wrap_future(fleet.intake.submit(batch)))


async def read_body(request: Request, limits: Limits) -> bytes:
    """Returns the request's body; Refused (413) as soon as it is longer than allowed."""
    parts, size = [], 0
    async for part in request.stream():
        size += len(part)
        if size > limits.body:
            raise Refused(413, f"a body may have {limits.body} bytes")
        parts.append(part)
    return b"".join(parts)


async def read_value(request: Request, limits: Limits, kind: type[T]) -> T:
    """Returns the request's JSON body as a value of type `kind`; Refused (413, 422) for anything else."""
    decoder = msgspec.json.Decoder(kind)
    return decode_sent(
        decoder.decode, await read_body(request, limits), "the request cannot be read"
    )
