"""Indicators of all vehicles over time: batches become Parquet, and DuckDB asks questions of it."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb
import msgspec
import polars as pl
from sqlalchemy import Connection, func, select

from skidpad.evidence.statistics import Interval, event_rate, ratio_limits
from skidpad.fleet.batch import IndicatorRow, rows_of
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.rights import visible
from skidpad.fleet.store.tables import batches, drives, events, hazards, vehicles
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.words import Kind, Principal, Role
from skidpad.recording.files import write_parquet

COMPACTED = "compacted"
SERVICE = "trends"
GROUP = 500  # batches of one Parquet file
_LOCK = threading.Lock()
SCHEMA = {
    "manufacturer": pl.String, "operator": pl.String, "vehicle": pl.String, "batch": pl.String,
    "at": pl.Float64, "minute": pl.Int64, "subject": pl.String, "indicator": pl.String,
    "n": pl.Int64, "violated": pl.Int64, "mean": pl.Float64, "least": pl.Float64,
    "greatest": pl.Float64,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Trend:
    """An indicator in a stretch of time."""

    indicator: str
    at: float  # s, beginning of the stretch
    mean: float
    share: float  # of cycles in which it was violated
    interval: Interval  # of that share, by drawing vehicles anew
    vehicles: int
    cycles: int


@dataclass(frozen=True, slots=True)
class HazardRate:
    """Hazards of one kind per hour of driving."""

    type: str
    events: int
    hours: float
    rate: float
    interval: Interval | None


def compact(fleet: Fleet) -> int:
    """Write batches of indicators that are not yet in a Parquet file; how many there were.

    A kill between file and event writes the same file again: its name is that of its first batch.
    """
    done = 0
    with _LOCK:
        while rows := _pending(fleet):
            table = pl.concat([_table(fleet, row) for row in rows])
            write_parquet(folder_of(fleet) / f"{rows[0].id}.parquet", table)
            at = fleet.clock()
            with fleet.engine.begin() as connection:
                for row in rows:
                    add_event(connection, ("batch", row.id), COMPACTED, (SERVICE, at))
            done += len(rows)
    return done


def folder_of(fleet: Fleet) -> Path:
    """Where the Parquet files lie."""
    return fleet.data / "trends"


def _pending(fleet: Fleet) -> Sequence[Any]:
    there = select(events.c.number).where(
        events.c.subject == batches.c.id, events.c.what == COMPACTED
    )
    query = (
        select(batches, vehicles.c.operator, vehicles.c.manufacturer)
        .join(vehicles, vehicles.c.id == batches.c.vehicle)
        .where(batches.c.kind == Kind.INDICATORS.value, ~there.exists())
        .order_by(batches.c.at, batches.c.id)
    )
    with fleet.engine.connect() as connection:
        return connection.execute(query.limit(GROUP)).all()


def _table(fleet: Fleet, row: Any) -> pl.DataFrame:
    body = unpack(fleet.blobs.part(row.pack, row.start, row.size), fleet.limits)
    found: list[IndicatorRow] = rows_of(body, fleet.limits)
    plain = [msgspec.structs.asdict(one) | {"indicator": one.indicator.value} for one in found]
    values = pl.DataFrame(plain, schema={k: v for k, v in SCHEMA.items() if k in _ROW})
    told = {"manufacturer": row.manufacturer, "operator": row.operator, "vehicle": row.vehicle}
    more = [pl.lit(v).alias(k) for k, v in (told | {"batch": row.id, "at": row.at}).items()]
    return values.with_columns(more).select(list(SCHEMA))


_ROW = frozenset(IndicatorRow.__struct_fields__)


def trends(fleet: Fleet, who: Principal, stretch_s: float = 86400.0) -> list[Trend]:
    """Every indicator by stretches of time, of the vehicles that `who` may see."""
    compact(fleet)
    if not any(folder_of(fleet).glob("*.parquet")):
        return []
    query = f"""
        SELECT indicator, floor("at" / $stretch) AS slot, vehicle, sum(n)::DOUBLE AS n,
               sum(violated)::DOUBLE AS violated, sum(mean * n) AS total
        FROM read_parquet($files) WHERE {_RIGHT.get(who.role, "operator")} = $tenant
        GROUP BY indicator, slot, vehicle ORDER BY indicator, slot, vehicle
    """
    told = {
        "stretch": stretch_s, "files": str(folder_of(fleet) / "*.parquet"), "tenant": who.tenant,
    }  # fmt: skip
    with duckdb.connect() as database:
        rows = pl.DataFrame(database.execute(query, told).fetchnumpy())
    return [
        _trend(str(indicator), float(slot) * stretch_s, group)
        for (indicator, slot), group in rows.group_by("indicator", "slot", maintain_order=True)
    ]


_RIGHT = {
    Role.MANUFACTURER: "manufacturer",
    Role.AUTHORITY: "$tenant",  # all tenants, without vehicles
}


def _trend(indicator: str, at: float, group: pl.DataFrame) -> Trend:
    n, violated = group["n"].to_numpy(), group["violated"].to_numpy()
    cycles = int(n.sum())
    return Trend(
        indicator=indicator,
        at=at,
        mean=float(group["total"].sum()) / max(cycles, 1),
        share=float(violated.sum()) / max(cycles, 1),
        interval=_within(ratio_limits(violated, n) if cycles else None),
        vehicles=len(group),
        cycles=cycles,
    )


def _within(limits: Interval | None) -> Interval:
    """Limits of a share; all of it where there are none."""
    if limits is None:
        return Interval(0.0, 1.0)
    return Interval(max(limits.low, 0.0), min(limits.high, 1.0))


def hazard_rates(connection: Connection, who: Principal) -> list[HazardRate]:
    """Hazards per hour by kind, over all drives that `who` may see."""
    driven = connection.execute(
        select(drives.c.vehicle, drives.c.drive, drives.c.seconds)
        .where(visible(who, drives))
        .order_by(drives.c.at, drives.c.drive)
    ).all()
    hours = [row.seconds / 3600.0 for row in driven]
    if sum(hours) <= 0.0:
        return []
    counted = connection.execute(
        select(hazards.c.type, hazards.c.vehicle, hazards.c.drive, func.count().label("n"))
        .where(visible(who, hazards))
        .group_by(hazards.c.type, hazards.c.vehicle, hazards.c.drive)
    ).all()
    table = {(row.type, row.vehicle, row.drive): int(row.n) for row in counted}
    out = []
    for type_ in sorted({row.type for row in counted}):
        counts = [table.get((type_, row.vehicle, row.drive), 0) for row in driven]
        rate = event_rate(counts, hours)
        out.append(HazardRate(type_, rate.events, rate.exposure, rate.rate, rate.interval))
    return out
