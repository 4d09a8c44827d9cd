"""Triage of recurring hazards: their state, owner and release; every change is an event (R-11)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum

from sqlalchemy import Connection

from skidpad.fleet.store.events import add_event, events_of
from skidpad.fleet.words import Principal, Refused

KIND = "recurring hazard"
TEXT_MAX = 200  # characters of an owner, a release or a note
CHUNK = 500  # subjects of one query


class State(str, Enum):
    """What became of a recurring hazard."""

    NEW = "new"  # not looked at yet
    OPEN = "open"  # true, and has an owner
    REJECTED = "rejected"  # no hazard
    FIXED = "fixed"  # by a release
    REOPENED = "reopened"  # alarms came from drives with the release that should have fixed it


SETTABLE = (State.OPEN, State.REJECTED, State.FIXED)


@dataclass(frozen=True, slots=True)
class Standing:
    """State of a recurring hazard with owner and release; `at` (s) and `actor` of its last change."""

    state: State = State.NEW
    owner: str = ""
    release: str = ""
    at: float | None = None
    actor: str = ""


def read_standings(connection: Connection, subjects: Iterable[str]) -> dict[str, Standing]:
    """Return the standing of each subject that has events; the others are new."""
    ids, found = list(subjects), {}
    for start in range(0, len(ids), CHUNK):
        for event in events_of(connection, ids[start : start + CHUNK]):
            if event.kind == KIND:
                d = event.detail
                found[event.subject] = Standing(
                    State(event.what), d["owner"], d["release"], event.at, event.actor
                )
    return found


def set_standing(
    connection: Connection, who: Principal, subject: str, standing: Standing, note: str = ""
) -> None:
    """Keep a new standing of a recurring hazard as an event at `standing.at`.

    Raises:
        Refused: 422 for a state that only alarms can cause, a fix without its release, an open
            hazard without an owner, or a text that is too long.
    """
    state, at = standing.state, standing.at
    assert at is not None
    if state not in SETTABLE:
        states = ", ".join(s.value for s in SETTABLE)
        raise Refused(422, f"state must be one of {states}, got {state.value}")
    if state is State.FIXED and not standing.release:
        raise Refused(422, "state fixed needs the release that fixed it")
    if state is State.OPEN and not standing.owner:
        raise Refused(422, "state open needs an owner")
    for name, text in (("owner", standing.owner), ("release", standing.release), ("note", note)):
        if len(text) > TEXT_MAX:
            raise Refused(422, f"{name} has at most {TEXT_MAX} characters, got {len(text)}")
    _add(connection, subject, standing, who.id, at, note)


def reopen(connection: Connection, recurred: Sequence[tuple[str, Standing]], at: float) -> None:
    """Keep that these fixed hazards came back in drives with the release that should have fixed them."""
    for subject, was in recurred:
        again = Standing(State.REOPENED, was.owner, was.release)
        _add(connection, subject, again, "analysis", at, f"alarms from drives with {was.release}")


def _add(
    connection: Connection, subject: str, standing: Standing, actor: str, at: float, note: str
) -> None:
    detail = {"owner": standing.owner, "release": standing.release, "note": note}
    add_event(connection, (KIND, subject), standing.state.value, (actor, at), **detail)
