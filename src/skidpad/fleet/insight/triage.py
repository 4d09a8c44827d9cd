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


class State(str, Enum):
    """What became of a recurring hazard."""

    NEW = "new"  # not looked at yet
    OPEN = "open"  # true, and has an owner
    REJECTED = "rejected"  # no hazard
    FIXED = "fixed"  # by a release
    REOPENED = "reopened"  # alarms came from drives with the release that fixed it, or a later one


SETTABLE = (State.OPEN, State.REJECTED, State.FIXED)


@dataclass(frozen=True, slots=True)
class Standing:
    """State of a recurring hazard with owner and release; `at` (s) and `actor` of its last change."""

    state: State = State.NEW
    owner: str = ""
    release: str = ""
    at: float | None = None
    actor: str = ""


def subject_key(who: Principal, subject: str) -> str:
    """Returns the subject of events, which has organisation and role in it: each triages for itself."""
    return f"{who.tenant} {who.role.value} {subject}"


def read_standings(
    connection: Connection, who: Principal, subjects: Iterable[str]
) -> dict[str, Standing]:
    """Returns the standing of each subject that has events of this organisation; others are new."""
    by_key, found = {subject_key(who, s): s for s in subjects}, {}
    for event in events_of(connection, list(by_key)):
        d = event.detail
        found[by_key[event.subject]] = Standing(
            State(event.what), d["owner"], d["release"], event.at, event.actor
        )
    return found


def set_standing(
    connection: Connection, who: Principal, subject: str, standing: Standing, note: str = ""
) -> None:
    """Keeps a new standing of a recurring hazard as an event at `standing.at`, which must be set.

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
    _record_standing(connection, subject_key(who, subject), standing, (who.id, at), note)


def reopen(
    connection: Connection, who: Principal, recurred: Sequence[tuple[str, Standing, str]], at: float
) -> None:
    """Adds an event at `at` s per fixed hazard that came back: subject, standing before, release driven."""
    for subject, was, driven in recurred:
        again = Standing(State.REOPENED, was.owner, was.release)
        note = f"alarms from drives with {driven}"
        _record_standing(connection, subject_key(who, subject), again, ("analysis", at), note)


def _record_standing(
    connection: Connection, key: str, standing: Standing, by: tuple[str, float], note: str
) -> None:
    """Adds an event with a recurring hazard's new state, owner, release and note."""
    detail = {"owner": standing.owner, "release": standing.release, "note": note}
    add_event(connection, (KIND, key), standing.state.value, by, **detail)
