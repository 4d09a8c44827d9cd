"""Collisions: what was hit, which of the two struck the other, and the moment in numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np

from skidpad.core.arrays import Flags
from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import RelocationReason, Supervision
from skidpad.evidence.drive.perception import vehicle_present
from skidpad.evidence.drive.prepared import Drive
from skidpad.evidence.drive.severity import Contact, grade
from skidpad.recording.run.log import RunLog

BEND_RADIUS = 250.0  # m, a lane curved tighter is a bend
LOOK_BACK = 10.0  # s of history in the chain of causes
JUST_BEFORE = 2.0  # s, for bend, lead and brake
RECOVERY_LAG = 0.25  # s within which a contact has started a recovery
BEHIND = -0.5  # cosine of the direction to the other car: it stands behind
CHAIN_TIME = 8.0  # s after a relocation within which what happens follows on,
CHAIN_WAY = 100.0  # m from where the ego was put, likewise


class CrashKind(str, Enum):
    """What a fatal event was (decision M-8)."""

    VEHICLE = "vehicle"
    STATIC = "static"
    WRONG_WAY = "wrong_way"
    OFF_ROAD = "off_road"  # decision R-6
    ROLL_OVER = "roll_over"


CORRECTIONS = {
    RelocationReason.WRONG_WAY: CrashKind.WRONG_WAY,
    RelocationReason.OFF_ROAD: CrashKind.OFF_ROAD,
    RelocationReason.ROLL_OVER: CrashKind.ROLL_OVER,
}  # relocations that are fatal by themselves, without a contact


class Striker(str, Enum):
    """Which of the two drove into the other."""

    EGO = "ego"
    OTHER = "other"


@dataclass(frozen=True, slots=True, kw_only=True)
class Crash:
    """One fatal event and how it came about. None: does not apply, or was not there."""

    tick: int
    t: float  # s
    kind: CrashKind
    weather: str
    other: str  # name of the vehicle, or what stood there
    actor: int | None  # its row in the log; None for what is no actor
    striker: Striker | None
    rear_ended: bool
    sideways: bool  # the two stood side by side just before
    bend_exit: bool  # off the road, or rolled over, in a bend without a lead (decision M-6)
    follows: bool  # soon and near after a relocation: no first of its chain
    v_ego: float  # m/s just before
    v_other: float | None
    v_closing: float | None  # m/s at the contact
    impulse: float | None  # N s
    contact: Contact | None  # graded (decision T-4); None without a contact
    x: float
    y: float
    lane_offset: float | None  # m, left positive
    bend_radius: float | None  # m, tightest of the last two seconds
    mu: float | None  # mean at the ego's tyres
    brake_max: float  # of the last two seconds
    unseen: float  # s of the last ten with a lead in truth that was not reported
    lead_since: float | None  # s that the other car had been the lead: small for a cut-in


def recovery_rows(log: RunLog) -> list[int]:
    """Returns the rows on which the supervisor began to brake for a collision (A-179, A-190)."""
    braking = log.supervision == Supervision.BRAKE
    begins = braking & ~np.concatenate([[False], braking[:-1]])
    return [int(k) for k in np.flatnonzero(begins)]


def find_crashes(drive: Drive) -> tuple[Crash, ...]:
    """Returns all fatal events of a drive in order: recoveries, wrong ways, departures (A-247, R-6).

    They are what tables count: of several contacts before a recovery, that of the largest impulse.
    """
    return _find_crashes(drive, lambda contact: (contact.impulse,))


def shown_crashes(drive: Drive) -> tuple[Crash, ...]:
    """Returns the events of `find_crashes`, each by the contact that decides its class (T-4)."""
    return _find_crashes(drive, partial(_rank, drive))


def _rank(drive: Drive, contact: ContactEvent) -> tuple[float, ...]:
    """Returns what orders contacts by how much they decide a class (T-4), the deciding one largest.

    A person or two wheels come first, then what was hit hardest, then the larger impulse.
    """
    graded = grade(drive, contact)
    return graded.is_vulnerable, graded.v_graded, contact.impulse


def _find_crashes(
    drive: Drive, rank: Callable[[ContactEvent], tuple[float, ...]]
) -> tuple[Crash, ...]:
    """Returns all fatal events in order; a recovery is about the contact before it that ranks highest."""
    log = drive.log
    crashes = [_crash(drive, row, _culprit(log, row, rank)) for row in recovery_rows(log)]
    crashes += [
        _correct_crash(drive, drive.row(r.tick), CORRECTIONS[r.reason])
        for r in log.relocations
        if r.reason in CORRECTIONS
    ]
    return tuple(sorted(crashes, key=lambda c: c.tick))


def contact_crashes(drive: Drive) -> tuple[Crash, ...]:
    """Returns a crash for each body touched, by its hardest contact (T-4), in order.

    It is for drives without a supervisor.
    """
    hardest: dict[tuple[int, str], ContactEvent] = {}
    for contact in drive.log.contacts:
        body = contact.actor, contact.static
        touches = hardest.get(body, contact), contact
        hardest[body] = max(touches, key=partial(_rank, drive))
    ordered = sorted(hardest.values(), key=lambda contact: contact.tick)
    return tuple(_crash(drive, drive.row(c.tick), c) for c in ordered)


def _culprit(
    log: RunLog, row: int, rank: Callable[[ContactEvent], tuple[float, ...]]
) -> ContactEvent | None:
    """Returns the contact that ranks highest within RECOVERY_LAG before a recovery at `row`; None: none."""
    tick, lag = int(log.tick[row]), RECOVERY_LAG / log.header.dt
    recent = [c for c in log.contacts if 0 <= tick - c.tick <= lag]
    return max(recent, key=rank, default=None)


def _crash(drive: Drive, row: int, contact: ContactEvent | None) -> Crash:
    """Returns the crash of a contact; None: of the tick of `row`, with something that is not known."""
    log = drive.log
    at = row if contact is None else drive.row(contact.tick)
    other = contact.actor if contact is not None and contact.actor > 0 else None
    sideways = other is not None and _are_side_by_side(log, max(at - 1, 0), other)
    behind, struck = (False, None) if other is None else _who(log, at, other)
    before = max(at - 1, 0)  # the contact itself changes the speeds
    static = "something" if contact is None else contact.static
    return _event(
        drive,
        at,
        kind=CrashKind.STATIC if other is None else CrashKind.VEHICLE,
        other=static if other is None else log.table.names[other],
        actor=other,
        striker=struck,
        rear_ended=behind and struck is Striker.OTHER,
        sideways=sideways,
        bend_exit=other is None and _is_bend_exit(drive, at),
        v_other=None if other is None else _speed(log, before, other),
        contact=contact,
    )


def _correct_crash(drive: Drive, at: int, kind: CrashKind) -> Crash:
    """Returns the crash of an ego that left the road, rolled over or drove the wrong way at row `at`."""
    left = kind in (CrashKind.OFF_ROAD, CrashKind.ROLL_OVER)
    return _event(drive, at, kind=kind, other="", bend_exit=left and _is_bend_exit(drive, at))


def _is_bend_exit(drive: Drive, at: int) -> bool:
    """Returns whether the ego was in a bend with no vehicle ahead in the JUST_BEFORE s up to row `at`."""
    radius = _bend_radius(drive, at)
    alone = not np.any(drive.lead.actor[rows_before(drive, at, JUST_BEFORE) : at + 1] >= 0)
    return radius is not None and radius < BEND_RADIUS and alone


def _follows(drive: Drive, at: int) -> bool:
    """Returns whether a crash comes within CHAIN_TIME and CHAIN_WAY of where the ego was last put."""
    log = drive.log
    tick = int(log.tick[at])
    before = [r for r in log.relocations if r.tick < tick]
    if not before:
        return False
    last, a = before[-1], log.actors
    way = float(np.hypot(a.x[at, 0] - last.new.x, a.y[at, 0] - last.new.y))
    return (tick - last.tick) * log.header.dt <= CHAIN_TIME and way <= CHAIN_WAY


def _event(
    drive: Drive,
    at: int,
    *,
    kind: CrashKind,
    other: str,
    actor: int | None = None,
    striker: Striker | None = None,
    rear_ended: bool = False,
    sideways: bool = False,
    bend_exit: bool = False,
    v_other: float | None = None,
    contact: ContactEvent | None = None,
) -> Crash:
    """Returns a crash at row `at` with what log and map say of it, just before and within LOOK_BACK."""
    log, a = drive.log, drive.log.actors
    recent = slice(rows_before(drive, at, JUST_BEFORE), at + 1)
    history = slice(rows_before(drive, at, LOOK_BACK), at + 1)
    unseen = vehicle_present(drive) & (log.report.detected != 1.0) & drive.sample
    return Crash(
        tick=int(log.tick[at]),
        t=float(log.t[at]),
        kind=kind,
        weather=log.weathers[int(log.weather[at])],
        other=other,
        actor=actor,
        striker=striker,
        rear_ended=rear_ended,
        sideways=sideways,
        bend_exit=bend_exit,
        follows=_follows(drive, at),
        v_ego=float(drive.v[max(at - 1, 0)]),
        v_other=v_other,
        v_closing=None if contact is None else contact.v_closing,
        impulse=None if contact is None else contact.impulse,
        contact=None if contact is None else grade(drive, contact),
        x=float(a.x[at, 0]) if contact is None else contact.x,
        y=float(a.y[at, 0]) if contact is None else contact.y,
        lane_offset=number(float(drive.place.offset[at])),
        bend_radius=_bend_radius(drive, at),
        mu=_grip(log, at),
        brake_max=float(np.nanmax(log.applied.brake[recent])),
        unseen=float(np.count_nonzero(unseen[history]) * log.header.dt),
        lead_since=_lead_since(drive, at, actor),
    )


def rows_before(drive: Drive, at: int, seconds: float) -> int:
    """Returns the row that lies so many seconds before row `at`, at least the first one of the log."""
    return max(at - round(seconds / drive.log.header.dt), 0)


def _bend_radius(drive: Drive, at: int) -> float | None:
    """Returns the tightest radius in m of the ego's lane in the last two seconds; None on a straight."""
    curvature = np.abs(drive.place.curvature[rows_before(drive, at, JUST_BEFORE) : at + 1])
    curvature = curvature[np.isfinite(curvature)]
    tightest = float(curvature.max()) if curvature.size else 0.0
    return 1.0 / tightest if tightest > 1e-6 else None


def _who(log: RunLog, at: int, other: int) -> tuple[bool, Striker]:
    """Returns whether the other car stood behind, and which of the two approached faster.

    Cars that stood side by side just before met sideways: neither was behind, and what counts is
    how fast each moved across. other: column of the car in the log.
    """
    a, k = log.actors, max(at - 1, 0)
    to = np.array([a.x[k, other] - a.x[k, 0], a.y[k, other] - a.y[k, 0]], dtype=np.float64)
    along = np.array([np.cos(a.yaw[k, 0]), np.sin(a.yaw[k, 0])], dtype=np.float64)
    if _are_side_by_side(log, k, other):
        to -= float(to @ along) * along
    to /= max(float(np.hypot(*to)), 1e-9)
    ahead = float(to @ along)
    ego = a.vx[k, 0] * to[0] + a.vy[k, 0] * to[1]
    them = -(a.vx[k, other] * to[0] + a.vy[k, other] * to[1])
    return bool(ahead < BEHIND), Striker.OTHER if them > ego else Striker.EGO


def _are_side_by_side(log: RunLog, row: int, other: int) -> bool:
    """Returns whether two cars overlap along the ego's axis, and by more than across it."""
    a, table = log.actors, log.table
    dx, dy = a.x[row, other] - a.x[row, 0], a.y[row, other] - a.y[row, 0]
    yaw, turned = float(a.yaw[row, 0]), float(a.yaw[row, other] - a.yaw[row, 0])
    along, across = dx * np.cos(yaw) + dy * np.sin(yaw), dy * np.cos(yaw) - dx * np.sin(yaw)
    c, s = abs(np.cos(turned)), abs(np.sin(turned))
    length, width = table.length[other], table.width[other]
    apart_along = abs(along) - (table.length[0] + length * c + width * s) / 2.0
    apart_across = abs(across) - (table.width[0] + length * s + width * c) / 2.0
    return bool(apart_along < min(0.0, apart_across))


def _grip(log: RunLog, row: int) -> float | None:
    """Returns the mean friction coefficient at the ego's tyres; None where it is not known."""
    mu = log.mu[row, 0]
    return None if np.all(np.isnan(mu)) else float(np.nanmean(mu))


def _speed(log: RunLog, row: int, actor: int) -> float:
    """Returns an actor's speed in m/s at a row."""
    return float(np.hypot(log.actors.vx[row, actor], log.actors.vy[row, actor]))


def _lead_since(drive: Drive, at: int, actor: int | None) -> float | None:
    """Returns for how many s the actor had been the lead up to row `at`; None where it was not.

    It was when it led at any time in the JUST_BEFORE s up to then.
    """
    if actor is None:
        return None
    is_lead = np.asarray(drive.lead.actor[: at + 1] == actor)
    begin = last_stretch(is_lead, rows_before(drive, at, JUST_BEFORE))
    return None if begin is None else (at - begin) * drive.log.header.dt


def last_stretch(flags: Flags, since: int) -> int | None:
    """Returns the row where the last stretch of true values begins; None if it ends before row `since`."""
    last = np.flatnonzero(flags[since:])
    if not last.size:
        return None
    breaks = np.flatnonzero(~flags[: since + int(last[-1]) + 1])
    return int(breaks[-1]) + 1 if breaks.size else 0


def number(value: float) -> float | None:
    """Returns `value`, None when it is NaN: the way from arrays to interfaces."""
    return None if np.isnan(value) else value
