"""How hard contacts were: each graded by the larger change of speed of the two (decision T-4)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import mps_from_kmh
from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import ActorKind
from skidpad.evidence.drive.prepared import Drive
from skidpad.recording.run.log import RunLog

LIGHT_BELOW = mps_from_kmh(5.0)  # m/s, a contact below it is of the lowest class
HEAVY_ABOVE = mps_from_kmh(20.0)  # m/s, a contact above it is of the highest class
AGAIN = 8.0  # s without a touch after which the next one is another contact
A_POSSIBLE = 15.0  # m/s^2, more than tyres can do: the tick before was a contact too
JUMP = 1.0  # m, further than any motion explains: the actor was put somewhere else
VULNERABLE = (ActorKind.MOTORCYCLE, ActorKind.BICYCLE, ActorKind.PEDESTRIAN)


class Severity(str, Enum):
    """The class of a contact."""

    LIGHT = "below 5 km/h"
    MEDIUM = "5 to 20 km/h"
    HEAVY = "above 20 km/h"


class Measure(str, Enum):
    """What a contact is graded by."""

    DELTA_V = "delta-v"
    CLOSING_SPEED = "closing speed"


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact of the ego and how hard it was; speeds in m/s."""

    tick: int
    actor: int  # row of what was touched, -1 for what stands
    other: str  # its name
    kind: ActorKind | None  # of what was touched; None: it is no actor
    delta_v: float | None  # the larger change of speed of the two; None: the log cannot tell
    v_closing: float

    @property
    def is_road_user(self) -> bool:
        """Returns whether a vehicle or a person was touched, not a barrier or a cone."""
        return self.kind is not None and self.kind is not ActorKind.PROP

    @property
    def is_vulnerable(self) -> bool:
        """Returns whether a pedestrian or a two-wheeler was touched."""
        return self.kind in VULNERABLE

    @property
    def v_graded(self) -> float:
        """Returns the speed that decides the class, m/s."""
        return self.v_closing if self.delta_v is None else self.delta_v

    @property
    def graded_by(self) -> Measure:
        """Returns whether the delta-v decides, or the closing speed for want of it."""
        return Measure.CLOSING_SPEED if self.delta_v is None else Measure.DELTA_V

    @property
    def is_serious(self) -> bool:
        """Returns whether a road user was hit above the lowest class; a person or two wheels always count."""
        return self.is_road_user and self.severity is not Severity.LIGHT

    @property
    def severity(self) -> Severity:
        """Returns the class; never the lowest with a pedestrian or a two-wheeler."""
        if self.v_graded > HEAVY_ABOVE:
            return Severity.HEAVY
        light = self.v_graded < LIGHT_BELOW and not self.is_vulnerable
        return Severity.LIGHT if light else Severity.MEDIUM


def graded_contacts(drive: Drive) -> tuple[Contact, ...]:
    """Returns every contact of the ego in order, each graded."""
    return tuple(grade(drive, contact) for contact in drive.log.contacts)


def distinct_contacts(drive: Drive) -> tuple[Contact, ...]:
    """Returns the contacts with road users, each once and as hard as its hardest touch.

    Touching the same road user again within 8 s, before the ego is put back, is the same contact.
    """
    chains: list[list[Contact]] = []
    last: dict[int, list[Contact]] = {}
    for contact in (c for c in graded_contacts(drive) if c.is_road_user):
        chain = last.get(contact.actor)
        if chain is None or not _is_again(drive, chain[-1], contact):
            chain = last[contact.actor] = []
            chains.append(chain)
        chain.append(contact)
    return tuple(
        replace(max(chain, key=lambda c: c.v_graded), tick=chain[0].tick) for chain in chains
    )


def _is_again(drive: Drive, before: Contact, contact: Contact) -> bool:
    """Returns True when a contact soon follows the one before, without the ego moved in between."""
    soon = (contact.tick - before.tick) * drive.log.header.dt <= AGAIN
    return soon and not any(before.tick < r.tick <= contact.tick for r in drive.log.relocations)


def grade(drive: Drive, contact: ContactEvent) -> Contact:
    """Returns a contact with the larger delta-v of those involved in m/s, None where one is unknown."""
    log, row, i = drive.log, drive.row(contact.tick), contact.actor
    changes = [speed_change(log, row, actor) for actor in ((0,) if i < 0 else (0, i))]
    known = [change for change in changes if change is not None]
    return Contact(
        tick=contact.tick,
        actor=i,
        other=contact.static if i < 0 else log.table.names[i],
        kind=None if i < 0 else ActorKind(int(log.table.kind[i])),
        delta_v=max(known) if len(known) == len(changes) else None,
        v_closing=contact.v_closing,
    )


def speed_change(log: RunLog, row: int, actor: int) -> float | None:
    """Returns the change of an actor's velocity in the tick of a contact, in m/s.

    What its acceleration of the tick before would have changed in that time is taken off, so
    braking is no impact. None where the actor was absent, or was put somewhere else meanwhile.
    """
    if row < 1 or not np.all(log.present[row - 1 : row + 1, actor]):
        return None
    before, after = _velocity(log, row - 1, actor), _velocity(log, row, actor)
    dt = float(log.tick[row] - log.tick[row - 1]) * log.header.dt
    a = log.actors
    way = np.hypot(a.x[row, actor] - a.x[row - 1, actor], a.y[row, actor] - a.y[row - 1, actor])
    if way > max(np.hypot(*before), np.hypot(*after)) * dt + JUMP:
        return None
    return float(np.hypot(*(after - before - _usual_change(log, row, actor, dt))))


def _usual_change(log: RunLog, row: int, actor: int, dt: float) -> Floats:
    """Returns (2,) m/s that the acceleration just before would add; 0 where that was an impact.

    0, too, where it is not known.
    """
    if row < 2 or not log.present[row - 2, actor]:
        return np.zeros(2)
    earlier = float(log.tick[row - 1] - log.tick[row - 2]) * log.header.dt
    a = (_velocity(log, row - 1, actor) - _velocity(log, row - 2, actor)) / earlier
    return a * dt if np.hypot(*a) < A_POSSIBLE else np.zeros(2)


def _velocity(log: RunLog, row: int, actor: int) -> Floats:
    """Returns (2,) the actor's velocity in m/s at a row, world axes."""
    a = log.actors
    return np.array([a.vx[row, actor], a.vy[row, actor]], dtype=np.float64)
