"""The words of the fleet: who someone is, what they may do, and the limits of what is taken in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

import msgspec

from skidpad.core.errors import SkidpadError
from skidpad.core.text.told import on_a_line

T = TypeVar("T")


class Role(str, Enum):
    """Who speaks to the fleet (C-195)."""

    MANUFACTURER = "manufacturer"
    OPERATOR = "operator"
    TELEOPERATOR = "teleoperator"
    AUTHORITY = "authority"
    RESEARCHER = "researcher"
    VEHICLE = "vehicle"


class Action(str, Enum):
    """What can be asked of the fleet; `RIGHTS` says who may."""

    REPORT = "report"  # upload hazards, drives, indicators, alerts
    READ_HAZARDS = "read hazards"  # rows and records of own vehicles
    EXPORT_SCENARIO = "export scenario"  # OpenSCENARIO in the stakeholder's own environment
    READ_TRENDS = "read trends"
    ANALYSE = "analyse"  # look for recurring hazards now
    TRIAGE = "triage"  # set state and owner of a recurring hazard
    READ_ALERTS = "read alerts"
    ANSWER_ALERTS = "answer alerts"
    GUIDE = "guide"  # order vehicles to stop, slow down, go on
    RECEIVE_ORDERS = "receive orders"
    RECEIVE_UPDATES = "receive updates"
    CHANGE = "change"  # propose changes, release updates
    READ_CHANGES = "read changes"
    READ_PLACES = "read places"  # places x hazard x weather, without vehicles
    READ_RESEARCH = "read research"  # the anonymised export
    READ_SAFETY_CASE = "read safety case"
    VISIT = "visit"  # open the pages


_M, _O, _T, _V = Role.MANUFACTURER, Role.OPERATOR, Role.TELEOPERATOR, Role.VEHICLE
RIGHTS: dict[Action, frozenset[Role]] = {
    Action.REPORT: frozenset({_V}),
    Action.READ_HAZARDS: frozenset({_M, _O, _V}),
    Action.EXPORT_SCENARIO: frozenset({_M, _O}),
    Action.READ_TRENDS: frozenset({_M, _O}),
    Action.ANALYSE: frozenset({_M, _O}),
    Action.TRIAGE: frozenset({_M, _O}),
    Action.READ_ALERTS: frozenset({_O, _T}),
    Action.ANSWER_ALERTS: frozenset({_O, _T}),
    Action.GUIDE: frozenset({_T}),
    Action.RECEIVE_ORDERS: frozenset({_V}),
    Action.RECEIVE_UPDATES: frozenset({_V}),
    Action.CHANGE: frozenset({_M}),
    Action.READ_CHANGES: frozenset({_M}),
    Action.READ_PLACES: frozenset({_M, _O, Role.AUTHORITY}),
    Action.READ_RESEARCH: frozenset({Role.RESEARCHER}),
    Action.READ_SAFETY_CASE: frozenset({_M, _O, Role.AUTHORITY}),
    Action.VISIT: frozenset({_M, _O, _T, Role.AUTHORITY, Role.RESEARCHER}),
}
FIRST_PAGE = {  # of each role that may visit: where a log-in leads
    Role.MANUFACTURER: "/",
    Role.OPERATOR: "/",
    Role.TELEOPERATOR: "/alerts",
    Role.AUTHORITY: "/places",
    Role.RESEARCHER: "/research",
}


@dataclass(frozen=True, slots=True)
class Principal:
    """Someone whose credential was found good."""

    id: str
    tenant: str  # of a vehicle: its operator
    role: Role
    name: str
    vehicle: str | None = None  # of the role vehicle: which one

    def may(self, action: Action) -> bool:
        """Returns True when the role has the right; which rows it holds for is `store.rights`."""
        return self.role in RIGHTS[action]


class Kind(str, Enum):
    """What a batch of a vehicle holds."""

    HAZARDS = "hazards"  # text of `skidpad monitor`
    DRIVE = "drive"  # its summary
    INDICATORS = "indicators"  # values by minute, one JSON row per line


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one request and one vehicle may send."""

    body: int = 8 * 1024 * 1024  # bytes of a request as sent
    unpacked: int = 64 * 1024 * 1024  # bytes of it when unpacked
    ratio: int = 200  # unpacked over sent, above 1 MB unpacked; text of hazards packs to about 1:6
    record: int = 4 * 1024 * 1024  # bytes of one record
    records: int = 2000  # in one batch
    requests_per_s: float = 20.0  # of one credential, lasting
    burst: int = 60  # requests of one credential at once


class Refused(SkidpadError):
    """A request that is not granted: one sentence, and the status that says what kind."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


MEANWHILE = "this was being kept at the same time"
UNKEPT = "it holds a character or number that cannot be kept"
NOT_THERE = "there is no such thing here"  # also of what is another tenant's


def absent() -> Refused:
    """Returns the refusal of an id that is absent or another tenant's; it does not say which."""
    return Refused(404, NOT_THERE)


def decode_sent(decode: Callable[[bytes], T], content: bytes, wrong: str) -> T:
    """Returns what `decode` makes of JSON that was sent; Refused (422) for what it cannot read.

    wrong: the beginning of the sentence that says so.
    """
    try:
        return decode(content)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise Refused(422, f"{wrong} ({on_a_line(error)})") from error
