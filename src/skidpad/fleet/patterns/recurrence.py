"""The identity of a recurring hazard, which outlives each of its alarms.

Its subject is the id of the alarm that was its first when it was found. Every alarm that joins it is
kept with that subject, so a later analysis knows it by any of them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice

from sqlalchemy import Connection, select

from skidpad.fleet.store.tables import analyses, recurrences
from skidpad.fleet.words import Principal

CHUNK = 500  # ids of one query


def name_subjects(groups: Sequence[Sequence[str]], known: Mapping[str, str]) -> list[str]:
    """Returns the subject of each group of alarms, whose ids are in order of time.

    A group is what most of its alarms belonged to. Where two groups were one, the first in the list
    keeps the subject, and the other one gets a new one.
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
    rest = iter(ids)
    while some := list(islice(rest, CHUNK)):
        rows = connection.execute(query.where(recurrences.c.hazard.in_(some)))
        found |= {row.hazard: row.subject for row in rows}
    return found


def keep_subjects(
    connection: Connection, analysis: tuple[str, float], subjects: Mapping[str, str]
) -> None:
    """Keep the subjects of hazards as an analysis (id, s) found them."""
    id, at = analysis
    rows = [
        {"analysis": id, "hazard": hazard, "subject": subject, "at": at}
        for hazard, subject in subjects.items()
    ]
    if rows:
        connection.execute(recurrences.insert(), rows)
