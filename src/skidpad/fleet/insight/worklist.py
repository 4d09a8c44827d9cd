"""Recurring hazards in the order in which they deserve a look: alarms that are likely true, most first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from sqlalchemy import Connection, select

from skidpad.fleet.insight.precision import Precision, measured_precision
from skidpad.fleet.store.rights import visible
from skidpad.fleet.store.tables import hazards
from skidpad.fleet.words import Principal

CHUNK = 500  # ids of one query


@dataclass(frozen=True, slots=True)
class Work:
    """One recurring hazard: what was found, when, and how much of it is likely true."""

    cluster: dict[str, Any]
    first: float  # s, when its first alarm came in
    last: float
    earlier: int  # alarms in the first half of the period
    later: int
    precision: Precision | None  # as measured for its kind under these rules; None: not measured

    @property
    def likely_true(self) -> float:
        """Alarms times precision; all of them where the precision was not measured."""
        alarms = self.earlier + self.later
        return alarms if self.precision is None else alarms * self.precision.share


def rank_work(
    connection: Connection, who: Principal, clusters: Sequence[dict[str, Any]]
) -> list[Work]:
    """Return the clusters with period and trend, the one with most likely true alarms first."""
    ids = iter([id for cluster in clusters for id in cluster["members"]])
    found: dict[str, tuple[float, str]] = {}
    while some := list(islice(ids, CHUNK)):
        query = select(hazards.c.id, hazards.c.at, hazards.c.head)
        for row in connection.execute(query.where(visible(who, hazards), hazards.c.id.in_(some))):
            found[row.id] = row.at, str(json.loads(row.head)["profile"])
    listed = [_work(c, [found[id] for id in c["members"] if id in found]) for c in clusters]
    return sorted((one for one in listed if one), key=lambda w: (-w.likely_true, w.cluster["id"]))


def _work(cluster: dict[str, Any], alarms: list[tuple[float, str]]) -> Work | None:
    if not alarms:
        return None
    times = [at for at, _ in alarms]
    middle = (min(times) + max(times)) / 2
    earlier = sum(at <= middle for at in times)
    precision = measured_precision(max(alarms)[1], cluster["type"])
    return Work(cluster, min(times), max(times), earlier, len(times) - earlier, precision)
