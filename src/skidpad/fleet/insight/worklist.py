"""Recurring hazards in the order in which they deserve a look: risk times precision, most first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from sqlalchemy import Connection, func, select

from skidpad.core.environment.localities import Locality, Locate, RoadKind
from skidpad.fleet.insight.precision import Precision, measured_precision
from skidpad.fleet.insight.triage import Standing, State, read_standings, reopen
from skidpad.fleet.store.rights import in_chunks, visible
from skidpad.fleet.store.tables import drives, hazards
from skidpad.fleet.words import Principal

SEVERE_FROM, NOTABLE_FROM = 0.5, 0.2  # risk; assumption


class Severity(str, Enum):
    """How hard the worst alarm of a recurring hazard was."""

    SEVERE = "severe"  # risk 0.5 and above: a safety score of at most 0.5
    NOTABLE = "notable"  # risk 0.2 to 0.5
    SLIGHT = "slight"
    UNSCORED = "not scored"  # the rules keep no score of this kind


@dataclass(frozen=True, slots=True)
class Alarm:
    """One alarm of a recurring hazard."""

    id: str
    at: float  # s, server
    rules: str
    risk: float | None  # 1 less the least safety score; None: the rules keep none of this kind
    weather: str
    release: str  # that the vehicle drove, "" where it told no drive


@dataclass(frozen=True, slots=True)
class Work:
    """One recurring hazard: its alarms, how much of it is likely true, and what became of it."""

    subject: str  # what it is known by: analyses and single alarms come and go
    cluster: dict[str, Any]
    alarms: tuple[Alarm, ...]  # by time
    precision: Precision | None  # as measured for its kind under these rules; None: not measured
    standing: Standing
    place: Locality | None = None  # None: no road of a known map is near

    @property
    def severity(self) -> Severity:
        """Returns the class of the largest risk of its alarms: SEVERE_FROM, NOTABLE_FROM; or unscored."""
        known = [alarm.risk for alarm in self.alarms if alarm.risk is not None]
        if not known:
            return Severity.UNSCORED
        if max(known) >= SEVERE_FROM:
            return Severity.SEVERE
        return Severity.NOTABLE if max(known) >= NOTABLE_FROM else Severity.SLIGHT

    @property
    def first(self) -> float:
        """Returns the time of the first alarm in s."""
        return self.alarms[0].at

    @property
    def last(self) -> float:
        """Returns the time of the last alarm in s."""
        return self.alarms[-1].at

    @property
    def earlier(self) -> int:
        """Returns the number of alarms in the first half of the time from `first` to `last`."""
        middle = (self.first + self.last) / 2
        return sum(alarm.at <= middle for alarm in self.alarms)

    @property
    def later(self) -> int:
        """Returns the number of alarms in the second half of the time from `first` to `last`."""
        return len(self.alarms) - self.earlier

    @property
    def likely_true(self) -> float:
        """Returns the number of alarms times precision; all of them where that was not measured."""
        share = 1.0 if self.precision is None else self.precision.share
        return share * len(self.alarms)

    @property
    def mean_risk(self) -> float | None:
        """Returns the mean risk of the alarms that have one; None where none has."""
        known = [alarm.risk for alarm in self.alarms if alarm.risk is not None]
        return sum(known) / len(known) if known else None

    @property
    def weight(self) -> float:
        """Returns the sum of risk times precision; an alarm without a risk counts as 1."""
        share = 1.0 if self.precision is None else self.precision.share
        return share * sum(1.0 if a.risk is None else a.risk for a in self.alarms)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkFilter:
    """Which recurring hazards; None: any. Period, weather and release hold for single alarms."""

    state: State | None = None
    owner: str | None = None
    map: str | None = None
    weather: str | None = None
    release: str | None = None
    severity: Severity | None = None
    road: RoadKind | None = None
    since: float | None = None  # s, server
    before: float | None = None


def rank_work(
    connection: Connection,
    who: Principal,
    clusters: Sequence[dict[str, Any]],
    wanted: WorkFilter = WorkFilter(),  # frozen
    locate: Locate | None = None,
) -> list[Work]:
    """Returns the recurring hazards that pass `wanted`, by falling `weight`.

    Alarms that `who` may not see, or that the filter drops, do not count. locate: finds the road.
    """
    found = _read_alarms(connection, who, [id for c in clusters for id in c["members"]])
    groups = [
        (c, sorted((found[i] for i in c["members"] if i in found), key=lambda a: (a.at, a.id)))
        for c in clusters
    ]
    subjects = [c.get("subject") or alarms[0].id for c, alarms in groups if alarms]
    standings = read_standings(connection, who, subjects)
    listed = []
    for (cluster, alarms), subject in zip([g for g in groups if g[1]], subjects, strict=True):
        kept = tuple(alarm for alarm in alarms if _is_wanted(alarm, wanted))
        if not kept:
            continue
        precision = measured_precision(kept[-1].rules, cluster["type"])
        place = None if locate is None else _locate(locate, cluster)
        one = Work(subject, cluster, kept, precision, standings.get(subject, Standing()), place)
        if _matches(one, wanted):
            listed.append(one)
    return sorted(listed, key=lambda w: (-w.weight, w.cluster["id"]))


def reopen_recurred(
    connection: Connection, who: Principal, clusters: Sequence[dict[str, Any]], at: float
) -> int:
    """Reopens fixed hazards with later alarms from drives with the release; returns how many.

    A release that was first driven after the fixing one counts as holding the fix.
    """
    first = _first_drives(connection, who)
    recurred = []
    for one in rank_work(connection, who, clusters, WorkFilter(state=State.FIXED)):
        fixed = one.standing
        fixed_from = first.get(fixed.release)
        for alarm in one.alarms:
            holds_fix = alarm.release == fixed.release or (
                fixed_from is not None and first.get(alarm.release, fixed_from) > fixed_from
            )
            if holds_fix and alarm.at > (fixed.at or 0.0):
                recurred.append((one.subject, fixed, alarm.release))
                break
    reopen(connection, who, recurred, at)
    return len(recurred)


def _first_drives(connection: Connection, who: Principal) -> dict[str, float]:
    """Returns when (s) the first visible drive with each release came in; drives without one are left out."""
    query = select(drives.c.release, func.min(drives.c.at)).where(visible(who, drives))
    rows = connection.execute(query.group_by(drives.c.release))
    return {release: at for release, at in rows if release}


def _locate(locate: Locate, cluster: dict[str, Any]) -> Locality | None:
    """Returns what lies at a cluster's place; None where the cluster has no map."""
    if "map" not in cluster:
        return None
    return locate(cluster["map"], cluster["x"], cluster["y"])


def _matches(one: Work, wanted: WorkFilter) -> bool:
    """Returns True when a recurring hazard as a whole passes the filters that are set."""
    return (
        wanted.map in (None, one.cluster.get("map"))
        and wanted.state in (None, one.standing.state)
        and wanted.owner in (None, one.standing.owner)
        and wanted.severity in (None, one.severity)
        and (wanted.road is None or (one.place is not None and one.place.kind is wanted.road))
    )


def _is_wanted(alarm: Alarm, wanted: WorkFilter) -> bool:
    """Returns True when an alarm passes all filters that are set; None: no filter."""
    return (
        wanted.weather in (None, alarm.weather)
        and wanted.release in (None, alarm.release)
        and (wanted.since is None or alarm.at >= wanted.since)
        and (wanted.before is None or alarm.at < wanted.before)
    )


def _read_alarms(connection: Connection, who: Principal, ids: Sequence[str]) -> dict[str, Alarm]:
    """Returns the alarms of these hazards by id, as far as the principal may see them."""
    there = (drives.c.vehicle == hazards.c.vehicle) & (drives.c.drive == hazards.c.drive)
    query = select(
        hazards.c.id, hazards.c.at, hazards.c.head, hazards.c.weather, drives.c.release
    ).outerjoin(drives, there & (hazards.c.drive != ""))
    found = {}
    for some in in_chunks(ids):
        for row in connection.execute(query.where(visible(who, hazards), hazards.c.id.in_(some))):
            head = json.loads(row.head)
            score = head["extremes"].get("safety_score")
            risk = None if score is None else min(max(1.0 - float(score), 0.0), 1.0)
            found[row.id] = Alarm(
                row.id, row.at, str(head["profile"]), risk, row.weather, row.release or ""
            )
    return found
