"""An analysis of a tenant's hazards: kept with its settings, so that it can be read and repeated."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import msgspec
import numpy as np
from sqlalchemy import ColumnElement, Connection, select

from skidpad.core.arrays import Floats
from skidpad.core.errors import FileError
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.fleet.identity import new_id
from skidpad.fleet.insight.worklist import reopen_recurred
from skidpad.fleet.patterns.clusters import (
    STANDARD,
    Case,
    Cluster,
    ClusterSettings,
    find_clusters,
    recurring,
)
from skidpad.fleet.service import CAME, Fleet
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.reading import record_of
from skidpad.fleet.store.rights import in_chunks, one_row, visible
from skidpad.fleet.store.tables import analyses, clusters, hazards, recurrences, series
from skidpad.fleet.words import Principal
from skidpad.recording.hazards.records import HazardRecord

HAZARDS_MAX = 20_000  # newest hazards that one analysis looks at
SERVICE = "analysis"  # actor of what nobody asked for


@dataclass(frozen=True, slots=True)
class Analysed:
    """Clusters and counts that an analysis found."""

    id: str
    hazards: int
    unreadable: int  # records that could not be decoded
    clusters: list[Cluster]


def analyse(fleet: Fleet, who: Principal, settings: ClusterSettings = STANDARD) -> Analysed:
    """Clusters the newest visible hazards, keeps what was found and reopens fixed ones that came back."""
    cases, unreadable = gather(fleet, who)
    found = find_clusters(cases, settings)
    at, id = fleet.clock(), new_id()
    often = recurring(cases, settings)
    with fleet.engine.begin() as connection:
        kept = json.dumps(asdict(settings), sort_keys=True)
        row = {
            "id": id, "tenant": who.tenant, "actor": who.id, "settings": kept,
            "hazards": len(cases), "at": at, "role": who.role.value,
        }  # fmt: skip
        connection.execute(analyses.insert(), row)
        plain = _with_subjects(connection, who, (id, at), cases, found)
        for rank, cluster in enumerate(plain):
            connection.execute(
                clusters.insert(),
                {
                    "id": new_id(), "tenant": who.tenant, "analysis": id, "rank": rank,
                    "representative": cluster["representative"],
                    "content": msgspec.json.encode(cluster).decode(),
                },
            )  # fmt: skip
        keys = [{"key": list(key), "hazards": ids} for key, ids in list(often.items())[:200]]
        reopened = reopen_recurred(connection, who, [c | {"id": id} for c in plain], at)
        told = {"reopened": reopened, "unreadable": unreadable, "recurring": keys}
        add_event(connection, ("analysis", id), "analysed", (who.id, at), **told)
    fleet.hub.tell(f"{CAME} {who.tenant}")
    return Analysed(id, len(cases), unreadable, found)


def _with_subjects(
    connection: Connection,
    who: Principal,
    analysis: tuple[str, float],
    cases: Sequence[Case],
    found: Sequence[Cluster],
) -> list[dict[str, Any]]:
    """Returns the clusters as plain values with their subject: the recurring hazard that each is.

    Subjects of alarms that are new to it are kept. analysis: its id and time in s.
    """
    age = {case.id: k for k, case in enumerate(reversed(cases))}
    groups = [sorted(cluster.members, key=age.__getitem__) for cluster in found]
    known = read_subjects(connection, who, [id for group in groups for id in group])
    subjects = name_subjects(groups, known)
    joined = {
        id: subject for group, subject in zip(groups, subjects, strict=True) for id in group
        if known.get(id) != subject
    }  # fmt: skip
    keep_subjects(connection, analysis, joined)
    return [
        msgspec.to_builtins(cluster) | {"subject": subject}
        for cluster, subject in zip(found, subjects, strict=True)
    ]


def gather(fleet: Fleet, who: Principal) -> tuple[list[Case], int]:
    """Returns the newest visible hazards with their series, newest first, and how many are unreadable.

    At most HAZARDS_MAX; series that are computed are kept.
    """
    there = (series.c.digest == hazards.c.digest) & (series.c.version == VERSION)
    query = (
        select(hazards, series.c.content.label("course"))
        .outerjoin(series, there)
        .where(visible(who, hazards))
        .order_by(hazards.c.at.desc(), hazards.c.id.desc())
    )
    with fleet.engine.connect() as connection:
        rows = connection.execute(query.limit(HAZARDS_MAX)).all()
        courses = {row.digest: from_plain(json.loads(row.course)) for row in rows if row.course}
        fresh: dict[str, str] = {}
        for row in rows:
            if row.digest not in courses:
                with suppress(FileError):  # counted as unreadable below
                    plain = to_plain(series_of(record_of(connection, fleet.blobs, row.id)))
                    fresh[row.digest], courses[row.digest] = json.dumps(plain), from_plain(plain)
    _keep(fleet, fresh)
    cases = [
        Case(
            row.id, row.digest, row.vehicle, row.type, row.map, row.weather, row.x, row.y,
            courses[row.digest],
        )
        for row in rows
        if row.digest in courses
    ]  # fmt: skip
    return cases, len(rows) - len(cases)


def _keep(fleet: Fleet, fresh: dict[str, str]) -> None:
    """Inserts series (JSON by digest) that were computed, except those kept meanwhile."""
    with fleet.engine.begin() as connection:
        known = connection.execute(
            select(series.c.digest).where(
                series.c.digest.in_(list(fresh)), series.c.version == VERSION
            )
        )
        for name in sorted(fresh.keys() - set(known.scalars())):
            row = {"digest": name, "version": VERSION, "content": fresh[name]}
            connection.execute(series.insert(), row | {"at": fleet.clock()})


def own(who: Principal) -> ColumnElement[bool]:
    """Returns the condition for analyses of the principal's tenant in the same role.

    A manufacturer may run vehicles, too, and sees others then.
    """
    return (analyses.c.tenant == who.tenant) & (analyses.c.role == who.role.value)


def newest_clusters(connection: Connection, who: Principal) -> list[dict[str, Any]]:
    """Returns the clusters of the newest analysis by the same rights, largest first; empty before one."""
    last = connection.execute(
        select(analyses.c.id, analyses.c.at)
        .where(own(who))
        .order_by(analyses.c.at.desc(), analyses.c.id)
        .limit(1)
    ).first()
    if last is None:
        return []
    rows = connection.execute(
        select(clusters).where(clusters.c.analysis == last.id).order_by(clusters.c.rank)
    )
    return [
        {"id": row.id, "analysis": row.analysis, "at": last.at} | json.loads(row.content)
        for row in rows
    ]


def cluster_row(connection: Connection, who: Principal, cluster: str) -> dict[str, Any]:
    """Returns one cluster of an analysis by the same rights; Refused (404) otherwise."""
    query = select(clusters).join(analyses, analyses.c.id == clusters.c.analysis)
    row = one_row(connection, query.where(clusters.c.id == cluster, own(who)))
    content: dict[str, Any] = json.loads(row.content)
    return {"id": row.id, "analysis": row.analysis} | content


# --- how a hazard went: signals of the rules over its record, as one series of fixed length


POINTS = 20  # of a series; records have 11 s, so one point stands for about half a second
VERSION = 1  # of what a series means; another one is computed anew
# signal, what it is divided by, and what stands where there is no conflict or no value
SIGNALS: tuple[tuple[Signal, float, float], ...] = (
    (Signal.TTC_AHEAD, 10.0, 1.0),
    (Signal.TTC_BEHIND, 10.0, 1.0),
    (Signal.SAFETY_SCORE, 1.0, 1.0),
    (Signal.GAP, 1.0, 0.0),
    (Signal.EGO_LOCATION, 1.0, 1.0),
    (Signal.CROSS_PATH, 1.0, 1.0),
)


def series_of(record: HazardRecord) -> Floats:
    """Returns the signals of a record's worlds, (POINTS, len(SIGNALS)) within [0, 1]; neutral without any."""
    monitor = Monitor(record.channels, MonitorSettings(keep_worlds=False))
    rows = [monitor.update(cycle).signals.values for cycle in record.worlds]
    if not rows:
        return np.tile([neutral for _, _, neutral in SIGNALS], (POINTS, 1))
    table = np.array([[_scale_value(row[s], by, rest) for s, by, rest in SIGNALS] for row in rows])
    return _resample_table(table)


def _scale_value(value: float, by: float, neutral: float) -> float:
    """Returns a value divided by `by` and cut to 0..1, `neutral` for nan."""
    return neutral if np.isnan(value) else float(np.clip(value / by, 0.0, 1.0))


def _resample_table(table: Floats) -> Floats:
    """Returns means of POINTS equal stretches of a table (n, k), n >= 1; a short one repeats its rows."""
    edges = np.linspace(0.0, len(table), POINTS + 1)
    first = np.floor(edges[:-1]).astype(int)
    last = np.maximum(np.ceil(edges[1:]).astype(int), first + 1)
    return np.array([table[a:b].mean(axis=0) for a, b in zip(first, last, strict=True)])


def to_plain(series: Floats) -> list[list[float]]:
    """Returns a series for JSON, rounded to the four digits that it is compared in."""
    return [[round(v, 4) for v in row] for row in series.tolist()]


def from_plain(plain: Sequence[Sequence[float]]) -> Floats:
    """Returns the array of `to_plain`'s values."""
    return np.array(plain, dtype=np.float64).reshape(POINTS, len(SIGNALS))


# The identity of a recurring hazard, which outlives each of its alarms.
#
# Its subject is the id of the alarm that was its first when it was found. Every alarm that joins it is
# kept with that subject, so a later analysis knows it by any of them.


def name_subjects(groups: Sequence[Sequence[str]], known: Mapping[str, str]) -> list[str]:
    """Returns the subject (an id) of each group of alarms, whose ids are in order of time.

    known: subjects so far by alarm. A group is what most of its alarms belonged to; where two groups
    were one, the first in the list keeps the subject, and the other one gets a new one.
    """
    taken: set[str] = set()
    subjects = []
    for group in groups:
        votes = Counter(known[id] for id in group if id in known)
        ranked = sorted(votes, key=lambda subject: (-votes[subject], subject))
        used = taken | set(known.values())
        fresh = next((id for id in group if id not in used), group[0])
        subject = next((s for s in ranked if s not in taken), fresh)
        taken.add(subject)
        subjects.append(subject)
    return subjects


def read_subjects(connection: Connection, who: Principal, ids: Sequence[str]) -> dict[str, str]:
    """Returns the subject of each hazard that an analysis with the same rights gave one."""
    query = (
        select(recurrences.c.hazard, recurrences.c.subject)
        .join(analyses, analyses.c.id == recurrences.c.analysis)
        .where(analyses.c.tenant == who.tenant, analyses.c.role == who.role.value)
        .order_by(recurrences.c.at, recurrences.c.analysis)
    )
    found: dict[str, str] = {}
    for some in in_chunks(ids):
        rows = connection.execute(query.where(recurrences.c.hazard.in_(some)))
        found |= {row.hazard: row.subject for row in rows}
    return found


def keep_subjects(
    connection: Connection, analysis: tuple[str, float], subjects: Mapping[str, str]
) -> None:
    """Inserts the subjects of hazards (by id) as an analysis (id, s) found them."""
    id, at = analysis
    rows = [
        {"analysis": id, "hazard": hazard, "subject": subject, "at": at}
        for hazard, subject in subjects.items()
    ]
    if rows:
        connection.execute(recurrences.insert(), rows)
