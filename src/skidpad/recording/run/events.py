"""What happens now and then during a run, one JSON line each in events.jsonl."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, is_dataclass
from enum import Enum
from typing import Any

import msgspec

from skidpad.core.files.reading import UNUSABLE, unusable
from skidpad.core.geometry import Pose
from skidpad.core.states import ContactEvent, LaneInvasion, TrafficContact
from skidpad.core.vocabulary import LightState, RelocationReason


@dataclass(frozen=True, slots=True)
class Relocation:
    """The supervisor put the ego somewhere else (A-194)."""

    tick: int  # number of the tick
    reason: RelocationReason  # why the ego was put elsewhere
    shift: float  # m moved back along the lane to find clearance
    old: Pose  # pose before, m and rad
    new: Pose  # pose afterwards, m and rad


@dataclass(frozen=True, slots=True)
class LightChange:
    """A traffic light of the map changed; the first tick lists every light."""

    tick: int  # number of the tick
    signal: int  # OpenDRIVE signal id
    state: LightState  # state from this tick on


@dataclass(frozen=True, slots=True)
class PutBack:
    """A vehicle of the background stood without a cause or off its lane and was put elsewhere (M-7)."""

    tick: int  # number of the tick
    actor: int  # index of the vehicle


@dataclass(frozen=True, slots=True)
class MovedOn:
    """A vehicle of the background that was far from the ego was moved to a place nearer to it."""

    tick: int  # number of the tick
    actor: int  # index of the vehicle


@dataclass(frozen=True, slots=True)
class RolledOver:
    """A vehicle, the ego or another one, came to lie on its side."""

    tick: int  # number of the tick
    actor: int  # index of the vehicle


class NoticeSource(str, Enum):
    """The part of the program that a notice comes from."""

    STACK = "stack"
    SUPERVISOR = "supervisor"
    TRAFFIC = "traffic"
    SCENARIO = "scenario"


@dataclass(frozen=True, slots=True)
class Notice:
    """An error of the stack, a retry of the supervisor (A-192), a wreck put back (M-7)."""

    tick: int  # number of the tick
    source: NoticeSource  # part of the program that says it
    text: str  # one sentence


Event = (
    ContactEvent
    | LaneInvasion
    | Relocation
    | LightChange
    | Notice
    | TrafficContact
    | PutBack
    | MovedOn
    | RolledOver
)
KINDS: dict[str, type[Event]] = {
    "contact": ContactEvent,
    "lane_invasion": LaneInvasion,
    "relocation": Relocation,
    "light": LightChange,
    "notice": Notice,
    "traffic_contact": TrafficContact,
    "put_back": PutBack,
    "moved_on": MovedOn,
    "rolled_over": RolledOver,
}
NAMES = {kind: name for name, kind in KINDS.items()}


def encode_events(events: Iterable[Event]) -> bytes:
    """Returns one JSON line per event, in the order given."""
    lines = [msgspec.json.encode({"event": NAMES[type(e)], **_plain(e)}) for e in events]
    return b"".join(line + b"\n" for line in lines)


def decode_events(text: bytes, name: str = "events.jsonl") -> tuple[Event, ...]:
    """Returns the events of lines of `encode_events`; FileError names the line that cannot be read."""
    events: list[Event] = []
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            fields = msgspec.json.decode(line)
            events.append(msgspec.convert(fields, KINDS[fields.pop("event")]))
        except UNUSABLE as error:
            raise unusable(f"{name}, line {number}", "an event", error) from error
    return tuple(events)


def _plain(event: Event) -> dict[str, Any]:
    """Returns an event's fields by name."""
    assert is_dataclass(event)
    return asdict(event)
