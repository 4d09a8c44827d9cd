"""How a crash came about: what the stack said, what was true, and when, in order of time.

Distances that the stack measured stand beside the true gap to the vehicle that was hit, from where
it was in the ego's way; before that beside the gap to the lead in truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np

from skidpad.core.arrays import Flags, Floats
from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.evidence.bodies import body, corner_distance
from skidpad.evidence.drive.collisions import (
    CHAIN_TIME,
    JUST_BEFORE,
    LOOK_BACK,
    RECOVERY_LAG,
    Crash,
    last_stretch,
    number,
    rows_before,
)
from skidpad.evidence.drive.prepared import LEAD_RANGE, Drive
from skidpad.evidence.drive.severity import Contact, graded_contacts
from skidpad.recording.run.log import RunLog

EGO = 0
RIGHT_WITHIN, RIGHT_SHARE = 3.0, 0.2  # m, or this share of the gap: measured and true agree
STRAIGHT_WITHIN = 40.0  # m, nearer the ego's own axis says what is in its way
ERROR_LOOK_BACK = 5.0  # s before the contact in which an error of measurement may have mattered
JUST_CAME = 4.0  # s, what was ahead for longer did not come as a surprise
CAME_WITHIN = 50.0  # m, what appears nearer ahead came from aside
FLICKER = 0.1  # s, what the stack says for no longer
BREAK = 0.5  # s that a vehicle may be out of the lane and still be the one ahead
SLOWED_BY = 5.0  # m/s that the other car lost in the last 5 s
BRAKES = 0.1  # of the pedal
SIDE_STEP, SIDE_STEP_TIME = 1.0, 1.5  # m across the lane in so many s: the ego changes lanes
NEWS_MAX = 8  # changes of what the stack said
BRAKING = (Tier.HARD_STOP, Tier.EMERGENCY, Tier.STOPPED_TOO_CLOSE)


@dataclass(frozen=True, slots=True)
class Sighting:
    """What the stack said at one moment, and what was true."""

    before: float  # s to the contact
    status: DetectionStatus | None
    tier: Tier | None
    distance: float | None  # m, measured
    gap: float | None  # m, true; None: no vehicle ahead in the lane within 80 m, centre to centre
    to: str  # the vehicle that the gap is to
    is_wrong: bool  # measured and true do not belong together


class Arrival(Enum):
    """How the vehicle that was hit came before the ego."""

    CUT_IN = 0
    UNCOVERED = 1  # another vehicle had stood between
    EGO_CAME = 2  # by a change of lanes
    EGO_PUT = 3  # by a relocation
    DRIVEN_UP = 4  # it had been there


@dataclass(frozen=True, slots=True)
class Moment:
    """A number at a time before the contact."""

    before: float  # s
    gap: float  # m to the vehicle that was hit, or NaN
    v: float = 0.0  # m/s


@dataclass(frozen=True, slots=True, kw_only=True)
class Story:
    """A crash and how it came about; None where something did not happen."""

    crash: Crash
    arrival: Arrival | None  # of the vehicle that was hit; None: it never was the lead
    arrived: Moment | None
    first: Sighting | None  # first report while it was the lead
    news: tuple[Sighting, ...]  # changes of status and tier in the last 10 s, oldest first
    worst: Sighting | None  # the largest error that may have mattered
    braked: Moment | None  # since when the ego had been braking, with its speed then
    slowed: Moment | None  # when the other car began to slow, with its speed then
    pushed_by: Moment | None  # a contact with a vehicle just before a departure
    pusher: str
    others: tuple[tuple[float, Contact], ...]  # s after, from just before until it was put back
    put_back: float | None  # s after

    @property
    def came_just_before(self) -> bool:
        """Returns whether the vehicle that was hit came before the ego in the last seconds."""
        recent = CHAIN_TIME if self.arrival is Arrival.EGO_PUT else JUST_CAME
        came = self.arrived is not None and self.arrived.before <= recent
        return came and self.arrival is not Arrival.DRIVEN_UP


def tell_story(drive: Drive, crash: Crash) -> Story:
    """Returns how a crash came about, from the log alone."""
    at = drive.row(crash.tick)
    way = _Way(drive, at, crash.actor)
    begin = way.begin()
    pushed, worst = _find_push(drive, crash), _find_worst_error(way)
    first = None if begin is None else _find_first_report(way, begin)
    return Story(
        crash=crash,
        arrival=None if begin is None else _classify_arrival(drive, begin, way),
        arrived=None if begin is None else Moment(way.before(begin), float(way.gap[begin])),
        first=first,
        news=_list_changes(way, (first, worst)),
        worst=worst,
        braked=_find_braking(way),
        slowed=None if crash.actor is None else _find_slowing(way, crash.actor),
        pushed_by=None if pushed is None else Moment(_seconds(drive, crash, pushed), np.nan),
        pusher="" if pushed is None else pushed.other,
        others=_list_other_contacts(drive, crash, pushed),
        put_back=_find_put_back(drive, crash),
    )


class _Way:
    """The vehicle that was hit as seen from the ego, rows 0 to that of the crash."""

    def __init__(self, drive: Drive, at: int, actor: int | None) -> None:
        self.drive, self.at, self.actor = drive, at, actor
        half_lengths = np.asarray(drive.log.table.length, np.float64) / 2.0
        # a lead is sought within 80 m from centre to centre, so of a longer gap nothing is known
        self.reach = LEAD_RANGE - float(half_lengths[EGO] + half_lengths.max())
        lead = drive.lead
        self.gap: Floats = np.full(at + 1, np.nan)
        self.ahead: Flags = np.zeros(at + 1, dtype=np.bool_)
        if actor is not None:
            self.gap, straight = _box_gap(drive.log, at, actor)
            hidden = lead.gap[: at + 1] < self.gap  # the lead stands between
            self.ahead = (straight & ~hidden) | (lead.actor[: at + 1] == actor)
        moves = [drive.row(r.tick) for r in drive.log.relocations if drive.row(r.tick) < at]
        self.put = max(moves, default=-1) + 1  # the first row after the last relocation
        self.true: Floats = np.where(self.ahead, self.gap, lead.gap[: at + 1])

    def begin(self) -> int | None:
        """Returns the row from which it was ahead until the contact, 2 s of grace; None: it was not.

        Not before the ego was last put back.
        """
        joined, longest = self.ahead.copy(), round(BREAK / self.drive.log.header.dt)
        rows = np.flatnonzero(joined)
        for a, b in pairwise(rows):
            joined[a:b] |= b - a <= longest
        begin = last_stretch(joined, rows_before(self.drive, self.at, JUST_BEFORE))
        return None if begin is None else max(begin, self.put)

    def before(self, row: int) -> float:
        """Returns the time from a row to the contact in s."""
        return float(self.drive.log.t[self.at] - self.drive.log.t[row])

    def to(self, row: int) -> str:
        """Returns the name of the vehicle that the true gap in a row is to: the one hit while it is ahead.

        Else the lead; "" for none.
        """
        i = self.actor if self.ahead[row] else int(self.drive.lead.actor[row])
        return "" if i is None or i < 0 else self.drive.log.table.names[i]

    def error(self, row: int) -> float:
        """Returns the m by which measured and true differ beyond what is right; 0 where they agree.

        0, too, where nothing was measured.
        """
        measured = float(self.drive.log.report.distance[row])
        if np.isnan(measured):
            return 0.0
        gaps = [float(self.true[row]), float(self.drive.lead.gap[row])]
        errors = [
            max(abs(measured - gap) - max(RIGHT_WITHIN, RIGHT_SHARE * gap), 0.0)
            for gap in gaps
            if not np.isnan(gap)
        ]
        return min(errors, default=max(self.reach - measured, 0.0))

    def sighting(self, row: int) -> Sighting:
        """Returns what the stack said in a row, beside the truth."""
        report = self.drive.log.report
        status, tier = number(float(report.status[row])), number(float(report.tier[row]))
        return Sighting(
            before=self.before(row),
            status=None if status is None else DetectionStatus(int(status)),
            tier=None if tier is None else Tier(int(tier)),
            distance=number(float(report.distance[row])),
            gap=number(float(self.true[row])),
            to=self.to(row),
            is_wrong=self.error(row) > 0.0,
        )


def _box_gap(log: RunLog, at: int, actor: int) -> tuple[Floats, Flags]:
    """Returns m between the boxes of the ego and an actor, and whether it is straight ahead and near.

    Both (at + 1,); nan where the actor is absent. Near is within STRAIGHT_WITHIN.
    """
    ego, other = (body(log, i).select(slice(0, at + 1)) for i in (EGO, actor))
    forward, left = ego.project(other.x, other.y)
    in_way = np.abs(left) < ego.width / 2.0 + other.width / 2.0
    there = log.present[: at + 1, actor]
    straight = (forward > 0.0) & (forward < STRAIGHT_WITHIN) & in_way & there
    return np.where(there, corner_distance(ego, other), np.nan), straight


def _classify_arrival(drive: Drive, begin: int, way: _Way) -> Arrival:
    """Returns how the lead came to be ahead of the ego at row `begin`."""
    if begin == 0:
        return Arrival.DRIVEN_UP
    if begin == way.put or not drive.free[begin]:
        return Arrival.EGO_PUT
    if abs(_measure_sidestep(drive, begin)) > SIDE_STEP:
        return Arrival.EGO_CAME
    before = int(drive.lead.actor[begin - 1])
    if before >= 0:
        nearer = drive.lead.gap[begin - 1] < way.gap[begin]
        return Arrival.UNCOVERED if nearer else Arrival.CUT_IN
    return Arrival.CUT_IN if way.gap[begin] < CAME_WITHIN else Arrival.DRIVEN_UP


def _measure_sidestep(drive: Drive, row: int) -> float:
    """Returns the m that the ego moved across its lane in the 1.5 s before a row, left positive."""
    rows = slice(rows_before(drive, row, SIDE_STEP_TIME), row)
    a, heading = drive.log.actors, drive.place.heading[rows]
    across = a.vy[rows, EGO] * np.cos(heading) - a.vx[rows, EGO] * np.sin(heading)
    return float(np.nansum(across) * drive.log.header.dt)


def _find_first_report(way: _Way, begin: int) -> Sighting | None:
    """Returns the first sighting in which the stack reports a vehicle from row `begin`; None if none."""
    seen = np.flatnonzero(way.drive.log.report.detected[begin : way.at + 1] == 1.0)
    return way.sighting(begin + int(seen[0])) if seen.size else None


def _list_changes(way: _Way, wanted: Sequence[Sighting | None]) -> tuple[Sighting, ...]:
    """Returns changes of status and tier in the last 10 s that lasted, and the sightings that are wanted.

    Oldest first; of the changes the newest NEWS_MAX.
    """
    drive, begin = way.drive, rows_before(way.drive, way.at, LOOK_BACK)
    said = np.stack([drive.log.report.status, drive.log.report.tier])[:, : way.at + 1]
    changes = [
        k
        for k in range(begin, way.at + 1)
        if drive.sample[k] and (k == begin or np.any(said[:, k] != said[:, k - 1]))
    ]
    ends = [*changes, way.at + 1][1:]
    lasting = [k for k, end in zip(changes, ends, strict=True) if _lasts(way, k, end)]
    found = {way.before(k): way.sighting(k) for k in lasting[-NEWS_MAX:]}
    found |= {s.before: s for s in wanted if s is not None}
    return tuple(found[before] for before in sorted(found, reverse=True))


def _lasts(way: _Way, row: int, end: int) -> bool:
    """Returns whether what the stack said in rows `row` to `end` is no flicker; hard braking never is."""
    tier = way.drive.log.report.tier[row]
    return tier in BRAKING or (end - row) * way.drive.log.header.dt > FLICKER


def _find_worst_error(way: _Way) -> Sighting | None:
    """Returns the largest error of the last 5 s that may have mattered; None without any.

    Too short while the stack braked hard, or too long while the vehicle that was hit was ahead.
    """
    begin = rows_before(way.drive, way.at, ERROR_LOOK_BACK)
    report, true = way.drive.log.report, np.nan_to_num(way.true, nan=LEAD_RANGE)
    rows = [
        k
        for k in range(begin, way.at + 1)
        if way.drive.sample[k]
        and way.error(k) > 0.0
        and (
            (report.tier[k] in BRAKING and report.distance[k] < true[k])
            or (way.ahead[k] and report.distance[k] > true[k])
        )
    ]
    return way.sighting(max(rows, key=way.error)) if rows else None


def _find_braking(way: _Way) -> Moment | None:
    """Finds since when the pedal was pressed without a break until the contact; None: it was not."""
    pressed = way.drive.log.applied.brake[: way.at] > BRAKES
    if not pressed.size or not pressed[-1]:
        return None
    free = np.flatnonzero(~pressed)
    row = int(free[-1]) + 1 if free.size else 0
    return Moment(way.before(row), float(way.gap[row]), float(way.drive.v[row]))


def _find_slowing(way: _Way, actor: int) -> Moment | None:
    """Finds when the other car was fastest in the last 5 s; None if it lost less than SLOWED_BY since."""
    begin, a = rows_before(way.drive, way.at, ERROR_LOOK_BACK), way.drive.log.actors
    v = np.hypot(a.vx[begin : way.at, actor], a.vy[begin : way.at, actor]).astype(np.float64)
    if not v.size or v.max() - v[-1] < SLOWED_BY:
        return None
    row = begin + int(v.size - 1 - np.argmax(v[::-1]))
    return Moment(way.before(row), float(way.gap[row]), float(v.max()))


def _find_push(drive: Drive, crash: Crash) -> Contact | None:
    """Returns the last contact with a road user within 2 s before a departure; None for other crashes."""
    if crash.actor is not None:
        return None
    earliest = crash.tick - JUST_BEFORE / drive.log.header.dt
    near = [
        c for c in graded_contacts(drive) if c.is_road_user and earliest <= c.tick <= crash.tick
    ]
    return near[-1] if near else None


def _seconds(drive: Drive, crash: Crash, contact: Contact) -> float:
    """Returns the time in s from the contact to the crash; negative where the contact came after."""
    return (crash.tick - contact.tick) * drive.log.header.dt


def _list_other_contacts(
    drive: Drive, crash: Crash, pushed: Contact | None
) -> tuple[tuple[float, Contact], ...]:
    """Returns the contacts from RECOVERY_LAG before a recovery to its end, with s after the crash.

    Without that of the crash and the one that pushed the ego; empty without a recovery.
    """
    found = _find_recovery(drive, crash)
    if found is None:
        return ()
    begin, last = (int(drive.log.tick[row]) for row in found)
    first = begin - RECOVERY_LAG / drive.log.header.dt
    return tuple(
        (-_seconds(drive, crash, c), c)
        for c in graded_contacts(drive)
        if first <= c.tick <= last and c not in (crash.contact, pushed)
    )


def _find_put_back(drive: Drive, crash: Crash) -> float | None:
    """Returns the time in s from the crash to the ego's first move back in its recovery; None if none."""
    found = _find_recovery(drive, crash)
    if found is None:
        return None
    last = int(drive.log.tick[found[1]])
    ticks = [r.tick for r in drive.log.relocations if crash.tick <= r.tick <= last]
    return (ticks[0] - crash.tick) * drive.log.header.dt if ticks else None


def _find_recovery(drive: Drive, crash: Crash) -> tuple[int, int] | None:
    """Returns first and last row of the supervised stretch that the crash began; None: there is none."""
    at = drive.row(crash.tick)
    begins = np.flatnonzero(~drive.free[at : at + 1 + round(0.3 / drive.log.header.dt)])
    if not begins.size:
        return None
    begin = at + int(begins[0])
    ends = np.flatnonzero(drive.free[begin:])
    return begin, begin + int(ends[0]) - 1 if ends.size else len(drive.log) - 1
