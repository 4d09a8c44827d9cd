"""A change with the scenes that led to it, and what it does to those very scenes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, select

from skidpad.core.vocabulary import HazardType
from skidpad.fleet.identity import new_id
from skidpad.fleet.patterns.analysis import cluster_row
from skidpad.fleet.service import Fleet
from skidpad.fleet.store.events import add_event
from skidpad.fleet.store.reading import hazard_row, record_of
from skidpad.fleet.store.rights import one_row
from skidpad.fleet.store.tables import changes, evaluations
from skidpad.fleet.updates.payloads import PayloadKind, payload_name, read_payload_content
from skidpad.fleet.words import Principal, Refused

SCENES_MAX = 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """Holds a proposed change: its payload, the reason, and the hazards that led to it."""

    kind: PayloadKind
    content: bytes
    reason: str
    hazards: tuple[str, ...]
    cluster: str | None = None


def propose(fleet: Fleet, who: Principal, proposal: Proposal) -> str:
    """Keeps a change and returns its id; Refused for an invalid payload or a hazard out of sight.

    It names 1 to SCENES_MAX hazards.
    """
    if not 1 <= len(proposal.hazards) <= SCENES_MAX:
        raise Refused(422, f"a change names 1 to {SCENES_MAX} hazards that led to it")
    read_payload_content(proposal.kind, proposal.content)
    with fleet.engine.connect() as connection:
        for hazard in proposal.hazards:
            hazard_row(connection, who, hazard)
        if proposal.cluster is not None:
            cluster_row(connection, who, proposal.cluster)
    row = {
        "id": new_id(), "tenant": who.tenant, "cluster": proposal.cluster,
        "kind": proposal.kind.value, "name": payload_name(proposal.kind, proposal.content),
        "payload": fleet.blobs.store(proposal.content),
        "hazards": json.dumps(list(proposal.hazards)), "reason": proposal.reason,
        "actor": who.id, "at": fleet.clock(),
    }  # fmt: skip
    with fleet.engine.begin() as connection:
        connection.execute(changes.insert(), row)
        add_event(connection, ("change", str(row["id"])), "proposed", (who.id, fleet.clock()))
    return str(row["id"])


def change_row(connection: Connection, who: Principal, change: str) -> Any:
    """Returns the row of a change of the caller's own tenant; Refused (404) where there is none."""
    query = select(changes).where(changes.c.id == change, changes.c.tenant == who.tenant)
    return one_row(connection, query)


def payload_of(fleet: Fleet, who: Principal, change: str) -> tuple[PayloadKind, str, bytes]:
    """Returns kind, name and content of a change's payload; Refused (404) for another tenant's."""
    with fleet.engine.connect() as connection:
        row = change_row(connection, who, change)
    return PayloadKind(row.kind), row.name, fleet.blobs.get(row.payload)


def re_evaluate(
    fleet: Fleet, who: Principal, change: str, before: tuple[PayloadKind, bytes]
) -> list[dict[str, Any]]:
    """Judges the scenes that led to a change under `before` and the change; returns all evaluations.

    Scenes that were evaluated earlier are not judged again.
    """
    from skidpad.fleet.loop.judging import errors_of

    kind, _, content = payload_of(fleet, who, change)
    settings = [read_payload_content(*before), read_payload_content(kind, content)]
    with fleet.engine.connect() as connection:
        scenes = json.loads(change_row(connection, who, change).hazards)
        known = {row["hazard"] for row in evaluations_of(connection, change)}
    for hazard in scenes:
        if hazard in known:
            continue
        with fleet.engine.connect() as connection:
            type_ = HazardType(hazard_row(connection, who, hazard)["type"])
            record = record_of(connection, fleet.blobs, hazard)
        old, new = errors_of(record.worlds, record.channels, settings)
        with fleet.engine.begin() as connection:
            connection.execute(
                evaluations.insert(),
                {
                    "id": new_id(), "change": change, "hazard": hazard,
                    "errors_before": old.total, "errors_after": new.total,
                    "found_after": int(type_ in new.found), "at": fleet.clock(),
                },
            )  # fmt: skip
    with fleet.engine.begin() as connection:
        add_event(connection, ("change", change), "re-evaluated", (who.id, fleet.clock()))
    with fleet.engine.connect() as connection:
        return evaluations_of(connection, change)


def evaluations_of(connection: Connection, change: str) -> list[dict[str, Any]]:
    """Returns the evaluations of a change as plain values, by hazard; empty before the first."""
    rows = connection.execute(
        select(evaluations).where(evaluations.c.change == change).order_by(evaluations.c.hazard)
    )
    return [
        {
            "hazard": r.hazard, "errors_before": r.errors_before, "errors_after": r.errors_after,
            "found_after": bool(r.found_after), "at": r.at,
        }
        for r in rows
    ]  # fmt: skip
