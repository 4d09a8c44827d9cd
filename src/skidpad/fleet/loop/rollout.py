"""A release on its way through the stages: who runs it, when it is looked at, how it ends."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import msgspec
from sqlalchemy import Connection, exists, select
from sqlalchemy.exc import IntegrityError

from skidpad.fleet.identity import new_id
from skidpad.fleet.loop.changes import change_row, evaluations_of, payload_of
from skidpad.fleet.loop.plan import Decision, Finding, Plan, choose_vehicles, look
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.events import Event, add_event, events_of
from skidpad.fleet.store.tables import changes, drives, events, looks, releases, vehicles
from skidpad.fleet.words import Principal, Refused, absent

SUBJECT = "release"
COMPLETED, REVERTED, LOOKED, STAGE = "completed", "reverted", "looked", "stage"


@dataclass(frozen=True, slots=True)
class Rollout:
    """A release as it stands."""

    row: Any
    name: str  # of the payload
    plan: Plan
    events: tuple[Event, ...]

    @property
    def outcome(self) -> str | None:
        """Returns "completed", "reverted", or None while it goes on."""
        return next((e.what for e in self.events if e.what in (COMPLETED, REVERTED)), None)

    @property
    def stage(self) -> int:
        """Returns the index of the stage that the release has reached, from 0."""
        return max(int(e.detail["stage"]) for e in self.events if e.what == STAGE)

    @property
    def share(self) -> float:
        """Returns the share of vehicles that run it."""
        return self.plan.stages[self.stage]

    def plain(self) -> dict[str, Any]:
        """Returns the release as plain values for JSON."""
        return {
            "release": self.row.id, "change": self.row.change, "payload": self.name,
            "before": self.row.before, "plan": msgspec.to_builtins(self.plan), "at": self.row.at,
            "stage": self.stage, "share": self.share, "ended": self.outcome,
            "events": [e.plain() for e in self.events],
        }  # fmt: skip


def release(fleet: Fleet, who: Principal, change: str, targets: bytes, plan: Plan) -> str:
    """Publishes a change that was signed off line and begins its first stage; returns the release's id.

    Refused (409) while another release is on its way.
    """
    _, name, content = payload_of(fleet, who, change)
    with fleet.engine.connect() as connection:
        running = [r for r in rollouts(connection, who.tenant) if r.outcome is None]
        before = standing(connection, who.tenant)
    if running:
        raise Refused(409, "another release is on its way; it ends first")
    fleet.repository(who.tenant).publish(targets, name, content)
    id, by = new_id(), (who.id, fleet.clock())
    row = {
        "id": id, "tenant": who.tenant, "change": change, "before": before,
        "plan": msgspec.json.encode(plan).decode(), "actor": by[0], "at": by[1],
    }  # fmt: skip
    with fleet.engine.begin() as connection:
        connection.execute(releases.insert(), row)
        add_event(connection, (SUBJECT, id), STAGE, by, stage=0)
        add_event(connection, ("change", change), "released", by, release=id)
    return id


def rollouts(connection: Connection, tenant: str) -> list[Rollout]:
    """Returns the releases of a tenant, oldest first."""
    rows = connection.execute(
        select(releases, changes.c.name)
        .join(changes, changes.c.id == releases.c.change)
        .where(releases.c.tenant == tenant)
        .order_by(releases.c.at, releases.c.id)
    ).all()
    return [
        Rollout(
            r, r.name, msgspec.json.decode(r.plan, type=Plan), tuple(events_of(connection, [r.id]))
        )
        for r in rows
    ]


def rollout_of(connection: Connection, tenant: str, id: str) -> Rollout:
    """Returns a release of a tenant; Refused (404) when it has none of this id."""
    found = next((r for r in rollouts(connection, tenant) if r.row.id == id), None)
    if found is None:
        raise absent()
    return found


def standing(connection: Connection, tenant: str) -> str:
    """Returns the name of the payload that every vehicle may run: the last completed one; "" for none."""
    done = [r.name for r in rollouts(connection, tenant) if r.outcome == COMPLETED]
    return done[-1] if done else ""


def assignment(connection: Connection, tenant: str, vehicle: str) -> dict[str, str]:
    """Returns the payload a vehicle is to run: of the release under way if chosen, else what stands.

    Names are "" where there is none; `before`: what stands.
    """
    stands = standing(connection, tenant)
    for one in rollouts(connection, tenant):
        if one.outcome is None and vehicle in running_on(connection, one):
            return {"release": one.row.id, "payload": one.name, "before": stands}
    return {"release": "", "payload": stands, "before": stands}


def running_on(connection: Connection, one: Rollout) -> frozenset[str]:
    """Returns the ids of the vehicles that run a release at its stage."""
    ids = connection.execute(
        select(vehicles.c.id).where(vehicles.c.manufacturer == one.row.tenant)
    ).scalars()
    return choose_vehicles(one.row.id, ids, one.share)


def under_way(connection: Connection) -> list[tuple[str, str]]:
    """Returns tenant and id of every release that has not ended, oldest first."""
    ended = exists().where(
        events.c.subject == releases.c.id, events.c.what.in_((COMPLETED, REVERTED))
    )
    rows = connection.execute(
        select(releases.c.tenant, releases.c.id)
        .where(~ended)
        .order_by(releases.c.at, releases.c.id)
    )
    return [(row.tenant, row.id) for row in rows]


def look_at(fleet: Fleet, who: Principal, id: str) -> Finding | None:
    """Looks at a release, and advances, reverts or waits; None while too little was driven.

    Refused (409) when it has ended, or when another request takes this look at the same moment.
    """
    with fleet.engine.begin() as connection:
        one = rollout_of(connection, who.tenant, id)
        if one.outcome is not None:
            raise Refused(409, f"this release was {one.outcome} already")
        differences, hours = _driven_differences(connection, one)
        looks_so_far = [e for e in one.events if e.what == LOOKED]
        seen = sum(int(e.detail["new_drives"]) for e in looks_so_far)
        new = len(differences) - seen
        if new < one.plan.least_drives or hours < one.plan.least_hours * (one.stage + 1):
            return None
        here = sum(e.detail["stage"] == one.stage for e in looks_so_far)
        finding = look(differences, one.plan, one.plan.looks - here - 1)
        by = (who.id, fleet.clock())
        _take(connection, id, len(looks_so_far), by[1])
        told = msgspec.to_builtins(finding) | {"stage": one.stage, "new_drives": new}
        add_event(connection, (SUBJECT, id), LOOKED, by, **told)
        _conclude(connection, one, finding, by)
        return finding


def _take(connection: Connection, release: str, number: int, at: float) -> None:
    """Takes a look by its number, so that of two requests at once one alone looks; Refused (409).

    Both would see the same drives: the second look would be one too many.
    """
    try:
        with connection.begin_nested():
            connection.execute(looks.insert(), {"release": release, "number": number, "at": at})
    except IntegrityError as error:
        raise Refused(409, "somebody else looks at this release at this moment") from error


def _conclude(
    connection: Connection, one: Rollout, finding: Finding, by: tuple[str, float]
) -> None:
    """Adds the event of a finding that reverts, completes or advances a roll-out; none otherwise."""
    subject = (SUBJECT, one.row.id)
    if finding.decision is Decision.REVERT:
        add_event(connection, subject, REVERTED, by, reason=finding.reason, to=one.row.before)
    elif finding.decision is Decision.ADVANCE and one.stage + 1 == len(one.plan.stages):
        add_event(connection, subject, COMPLETED, by)
    elif finding.decision is Decision.ADVANCE:
        add_event(connection, subject, STAGE, by, stage=one.stage + 1)


def _driven_differences(connection: Connection, one: Rollout) -> tuple[list[float], float]:
    """Returns the differences (errors, update less before) of drives under a release, and their hours.

    Of the vehicles that are chosen for its stage.
    """
    rows = connection.execute(
        select(drives.c.vehicle, drives.c.seconds, drives.c.summary)
        .where(drives.c.release == one.row.id, drives.c.manufacturer == one.row.tenant)
        .order_by(drives.c.at, drives.c.drive)
    )
    differences, seconds = [], 0.0
    on = running_on(connection, one)
    for row in rows:
        judged = json.loads(row.summary).get("judged")
        if judged is not None and row.vehicle in on:
            differences.append(float(judged["errors"] - judged["before"]))
            seconds += row.seconds
    return differences, seconds / 3600.0


def trace(connection: Connection, who: Principal, change: str) -> dict[str, Any]:
    """Returns the record of a change from its hazards to its re-evaluation as plain values (C-178)."""
    row = change_row(connection, who, change)
    hazards = json.loads(row.hazards)
    released = [r.plain() for r in rollouts(connection, who.tenant) if r.row.change == change]
    return {
        "change": row.id, "hazards": hazards, "cluster": row.cluster, "kind": row.kind,
        "payload": row.name, "digest": row.payload, "reason": row.reason, "actor": row.actor,
        "at": row.at, "evaluations": evaluations_of(connection, change), "releases": released,
        "events": [e.plain() for e in events_of(connection, [change])],
    }  # fmt: skip
