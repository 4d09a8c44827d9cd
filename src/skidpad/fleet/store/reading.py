"""Reading hazards back, as far as someone may."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, select

from skidpad.core.errors import FileError
from skidpad.fleet.blobs import Blobs
from skidpad.fleet.identity import digest
from skidpad.fleet.store.rights import one_row, visible
from skidpad.fleet.store.tables import batches, hazards
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.words import Limits, Principal
from skidpad.recording.hazards.records import HazardRecord, decode_record

PAGE = 200  # rows of one answer


@dataclass(frozen=True, slots=True)
class Wanted:
    """Says which hazards are wanted; None leaves a property open."""

    type: str | None = None
    vehicle: str | None = None
    since: float | None = None  # s, server
    before: float | None = None


def hazard_rows(connection: Connection, who: Principal, wanted: Wanted) -> list[dict[str, Any]]:
    """Returns the newest wanted hazards that `who` may see as plain values, at most PAGE."""
    query = select(hazards).where(visible(who, hazards)).order_by(hazards.c.at.desc(), hazards.c.id)
    if wanted.type is not None:
        query = query.where(hazards.c.type == wanted.type)
    if wanted.vehicle is not None:
        query = query.where(hazards.c.vehicle == wanted.vehicle)
    if wanted.since is not None:
        query = query.where(hazards.c.at >= wanted.since)
    if wanted.before is not None:
        query = query.where(hazards.c.at < wanted.before)
    return [_plain(row) for row in connection.execute(query.limit(PAGE))]


def hazard_row(connection: Connection, who: Principal, hazard: str) -> dict[str, Any]:
    """Returns one hazard as plain values; Refused (404) when there is none that `who` may see."""
    query = select(hazards).where(hazards.c.id == hazard, visible(who, hazards))
    return _plain(one_row(connection, query))


def _plain(row: Any) -> dict[str, Any]:
    """Returns a row of hazards as plain data with its head decoded."""
    names = (
        "id", "operator", "manufacturer", "vehicle", "drive", "type", "map", "weather", "x", "y",
        "t_start", "t_end", "vehicle_time", "at",
    )  # fmt: skip
    return {name: getattr(row, name) for name in names} | {"head": json.loads(row.head)}


def record_text(connection: Connection, blobs: Blobs, hazard: str) -> str:
    """Returns the text of a hazard's record, whose right the caller has checked; FileError if damaged."""
    row = connection.execute(
        select(hazards.c.start, hazards.c.size, hazards.c.digest, hazards.c.batch).where(
            hazards.c.id == hazard
        )
    ).one()
    kept = connection.execute(select(batches).where(batches.c.id == row.batch)).one()
    body = blobs.part(kept.pack, kept.start, kept.size)
    if digest(body) != kept.digest:
        raise FileError(f"the body of batch {row.batch} is damaged")
    text = unpack(body, Limits())[row.start : row.start + row.size]
    if digest(text) != row.digest:
        raise FileError(f"the record of hazard {hazard} is damaged")
    return text.decode("ascii")


def record_of(connection: Connection, blobs: Blobs, hazard: str) -> HazardRecord:
    """Returns the record of a hazard, whose right the caller has checked; FileError if damaged."""
    return decode_record(record_text(connection, blobs, hazard))
