"""Indicators of all vehicles over time, with intervals, and alarms per hour with their precision."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import polars as pl
from sqlalchemy import Connection, func, select

from skidpad.evidence.statistics import (
    Interval,
    clopper_pearson,
    event_rate,
    linear_ratio_limits,
    ratio_limits,
)
from skidpad.fleet.batch import IndicatorRow, rows_of
from skidpad.fleet.insight.precision import Precision, measured_precision
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.rights import visible
from skidpad.fleet.store.tables import batches, drives, hazards, vehicles
from skidpad.fleet.unpacking import unpack
from skidpad.fleet.warehouse import DAY, MANY_VEHICLES, Moments
from skidpad.fleet.words import Kind, Principal, Role

GROUP = 500  # batches that are taken at once
SCHEMA = {
    "manufacturer": pl.String, "operator": pl.String, "vehicle": pl.String, "received": pl.Float64,
    "indicator": pl.String, "n": pl.Int64, "violated": pl.Int64, "mean": pl.Float64,
}  # fmt: skip
READ = ("indicator", "n", "violated", "mean")  # of a row as it was sent


@dataclass(frozen=True, slots=True)
class Trend:
    """An indicator in a stretch of time."""

    indicator: str
    at: float  # s, beginning of the stretch
    mean: float
    share: float  # of cycles in which it was violated
    interval: Interval  # of that share, over vehicles
    vehicles: int
    cycles: int


@dataclass(frozen=True, slots=True)
class AlarmRate:
    """Alarms of one kind per hour of driving, and how many such alarms are true."""

    type: str
    events: int
    hours: float
    rate: float
    interval: Interval | None
    rules: str  # of the newest alarm of the kind
    precision: Precision | None  # as measured for these rules; None: not measured


def compact(fleet: Fleet) -> int:
    """Adds the indicator batches that came since the last call to the warehouse; returns how many."""
    done, house = 0, fleet.warehouse
    with house.lock:
        since, after = house.since(), ""
        while rows := _batches(fleet, since, after):
            fresh = house.unknown([row.id for row in rows])
            new = [row for row in rows if row.id in fresh]
            if new:
                table = pl.concat([_table(fleet, row) for row in new])
                house.take([(row.id, row.at) for row in new], table)
            done += len(new)
            since, after = rows[-1].at, rows[-1].id
        house.complete()
    return done


def _batches(fleet: Fleet, since: float, after: str) -> Sequence[Any]:
    """Returns at most GROUP indicator batches after (`since` s, id `after`), in order of time and id."""
    later = (batches.c.at > since) | ((batches.c.at == since) & (batches.c.id > after))
    query = (
        select(batches, vehicles.c.operator, vehicles.c.manufacturer)
        .join(vehicles, vehicles.c.id == batches.c.vehicle)
        .where(batches.c.kind == Kind.INDICATORS.value, batches.c.at >= since, later)
        .order_by(batches.c.at, batches.c.id)
    )
    with fleet.engine.connect() as connection:
        return connection.execute(query.limit(GROUP)).all()


def _table(fleet: Fleet, row: Any) -> pl.DataFrame:
    """Returns the indicator rows of a stored batch as a table with its owners and time of receipt."""
    body = unpack(fleet.blobs.part(row.pack, row.start, row.size), fleet.limits)
    found: list[IndicatorRow] = rows_of(body, fleet.limits)
    plain = [msgspec.structs.asdict(one) | {"indicator": one.indicator.value} for one in found]
    values = pl.DataFrame(plain, schema={name: SCHEMA[name] for name in READ})
    told = {"manufacturer": row.manufacturer, "operator": row.operator, "vehicle": row.vehicle}
    more = [pl.lit(v).alias(k) for k, v in (told | {"received": row.at}).items()]
    return values.with_columns(more).select(list(SCHEMA))


def trends(fleet: Fleet, who: Principal, days: int = 1) -> list[Trend]:
    """Returns every indicator by stretches of `days`, of visible vehicles; takes in new batches before."""
    compact(fleet)
    column = _RIGHT.get(who.role, "operator")
    return [_trend(m, days) for m in fleet.warehouse.moments(column, who.tenant, days)]


_RIGHT: dict[Role, str | None] = {
    Role.MANUFACTURER: "manufacturer",
    Role.AUTHORITY: None,  # all tenants, without vehicles
}


def _trend(m: Moments, days: int) -> Trend:
    """Returns the trend of an indicator in one stretch of `days` days."""
    return Trend(
        indicator=m.indicator,
        at=m.slot * days * DAY,
        mean=m.total / m.n,
        share=m.violated / m.n,
        interval=_limits(m),
        vehicles=m.vehicles,
        cycles=int(m.n),
    )


def _limits(m: Moments) -> Interval:
    """Limits of a share over vehicles; all of it where they are fewer than eight.

    Where nothing was seen, or nothing else, a vehicle counts as one observation: whatever the spread
    of shares over vehicles, none is seen in k of them with a chance of at most (1 - share)^k.
    """
    if m.violated in (0.0, m.n):
        return clopper_pearson(m.vehicles if m.violated else 0, m.vehicles)
    if m.vehicles < MANY_VEHICLES:
        limits = ratio_limits(m.each_violated, m.each_n)
    else:
        products, cubes = (m.vv, m.vn, m.nn), (m.vvv, m.vvn, m.vnn, m.nnn)
        limits = linear_ratio_limits(m.vehicles, (m.violated, m.n), products, cubes)
    if limits is None:
        return Interval(0.0, 1.0)
    return Interval(max(limits.low, 0.0), min(limits.high, 1.0))


def alarm_rates(connection: Connection, who: Principal) -> list[AlarmRate]:
    """Returns alarms per hour by kind over all visible vehicles with a drive; empty without hours."""
    driven = connection.execute(
        select(drives.c.vehicle, func.sum(drives.c.seconds))
        .where(visible(who, drives))
        .group_by(drives.c.vehicle)
        .order_by(drives.c.vehicle)
    ).all()
    hours = [seconds / 3600.0 for _, seconds in driven]
    if sum(hours) <= 0.0:
        return []
    counted = connection.execute(
        select(hazards.c.type, hazards.c.vehicle, func.count())
        .where(visible(who, hazards))
        .group_by(hazards.c.type, hazards.c.vehicle)
    ).all()
    table = {(type_, vehicle): count for type_, vehicle, count in counted}
    out = []
    for type_ in sorted({type_ for type_, _ in table}):
        rate = event_rate([table.get((type_, vehicle), 0) for vehicle, _ in driven], hours)
        rules = _newest_rules(connection, who, type_)
        out.append(
            AlarmRate(
                type_, rate.events, rate.exposure, rate.rate, rate.interval,
                rules, measured_precision(rules, type_),
            )
        )  # fmt: skip
    return out


def _newest_rules(connection: Connection, who: Principal, type_: str) -> str:
    """Returns the rule profile of the newest hazard of this type that the principal may see."""
    head = connection.execute(
        select(hazards.c.head)
        .where(visible(who, hazards), hazards.c.type == type_)
        .order_by(hazards.c.at.desc())
        .limit(1)
    ).scalar_one()
    return str(json.loads(head)["profile"])
