"""How far a run was from a failure, as one number that falls towards it.

A failure is a contact above 5 km/h, with a person or a two-wheeler any contact, or a departure: the ego
with all wheels off every lane. Whatever an objective prefers among the other runs, every failure lies
at 0 or below and every other run above, so that no objective calls a failure better than a near miss.

    no conflict                            2
    no contact                      1 to   2, by gap, TTC or required deceleration
    contact below 5 km/h         above 0, to 1, by its speed
    contact above 5 km/h, departure  0 or below, by its speed
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.evidence.bodies import body
from skidpad.evidence.drive.conflict import deceleration_to_avoid_crash, time_to_collision
from skidpad.evidence.drive.prepared import prepare
from skidpad.evidence.drive.severity import LIGHT_BELOW, Contact, graded_contacts
from skidpad.evidence.pairs import EGO, Pair, following, pairs, together
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import RoadMap

NO_CONFLICT = 2.0
GAP_SCALE, TTC_SCALE, BRAKING_SCALE = (
    5.0,
    2.0,
    4.0,
)  # m, s, m/s^2: half-way values of the terms; ours
SPEED_SCALE = 10.0  # m/s of a contact by which the margin of a failure falls by 1; ours


@dataclass(frozen=True, slots=True)
class Closeness:
    """What a run came to: None where it never applied.

    Attributes:
        margin: at most 0 for a failure, 2 where there was no conflict.
        contact: the hardest contact of the ego.
        departed_s: when all wheels had left every lane, s.
    """

    margin: float
    min_gap_m: float | None
    min_ttc_s: float | None
    max_drac_mps2: float | None
    contact: Contact | None
    departed_s: float | None


def _rising(value: float | None, scale: float) -> float:
    """Returns 0 for a value of 0, 1/2 at the scale, 1 for None, a value that never applied."""
    return float(_rise_of(np.array(np.inf if value is None else value), scale))


def _least(found: Sequence[Pair], name: str) -> float | None:
    """Returns the least value of that field over the pairs; None where no pair has one."""
    return min((v for p in found if (v := getattr(p, name)) is not None), default=None)


def _most_braking(found: Sequence[Pair]) -> float | None:
    """Returns the greatest needed deceleration in m/s^2 over the pairs; None where no pair has one."""
    return max((p.max_drac_mps2 for p in found if p.max_drac_mps2 is not None), default=None)


def _by_gap(found: Sequence[Pair]) -> float:
    """Returns the margin in 0..1 by the least gap in m; 1 where there is none."""
    return _rising(_least(found, "min_gap_m"), GAP_SCALE)


def _by_ttc(found: Sequence[Pair]) -> float:
    """Returns the margin in 0..1 by the least time to collision in s; 1 where there is none."""
    return _rising(_least(found, "min_ttc_s"), TTC_SCALE)


def _by_braking(found: Sequence[Pair]) -> float:
    """Returns the margin in 0..1 by the greatest needed deceleration; 1 where there is none."""
    worst = _most_braking(found)
    return 1.0 if worst is None else BRAKING_SCALE / (BRAKING_SCALE + max(worst, 0.0))


def _by_all(found: Sequence[Pair]) -> float:
    """Returns the mean of the margins by gap, time to collision and braking."""
    return (_by_gap(found) + _by_ttc(found) + _by_braking(found)) / 3.0


OBJECTIVES: Mapping[str, Callable[[Sequence[Pair]], float]] = {
    "combined": _by_all,  # the mean of the three below
    "gap": _by_gap,  # the least gap, bumper to bumper
    "ttc": _by_ttc,  # the least time to collision
    "braking": _by_braking,  # the largest deceleration that avoided a contact
}


def closeness(
    log: RunLog, road: RoadMap, off_road: Sequence[bool] | np.ndarray | None, objective: str
) -> Closeness:
    """Return how near a failure a run came.

    Args:
        log: of the run.
        road: its map, by which the lanes of contacts are found.
        off_road: (T,) whether the ego had all wheels off every lane; None: not known.
        objective: a name of OBJECTIVES, which ranks runs without contact.
    """
    found = pairs(log)
    contacts = graded_contacts(prepare(log, road)) if log.contacts else ()
    hardest = max(contacts, key=lambda c: (is_failure(c), c.v_graded), default=None)
    away = np.flatnonzero(off_road) if off_road is not None else np.empty(0, np.int64)
    departed = float(log.t[away[0]]) if len(away) else None
    return Closeness(
        margin=_margin(hardest, departed is not None, OBJECTIVES[objective](found)),
        min_gap_m=_least(found, "min_gap_m"),
        min_ttc_s=_least(found, "min_ttc_s"),
        max_drac_mps2=_most_braking(found),
        contact=hardest,
        departed_s=departed,
    )


def approach(log: RunLog, off_road: np.ndarray) -> Floats:
    """Returns (T,) the margin that a run would have if it had ended at each tick; it never rises.

    From the first contact or departure of the ego on it is 1.0; what that is worth, `closeness` says.
    Runs are ranked by all three terms ("combined"). off_road: (T,) as for `closeness`.
    """
    gap, ttc = (np.full(len(log), np.inf) for _ in range(2))
    drac = np.zeros(len(log))
    bodies = [body(log, i) for i in range(len(log.table.names))]
    for i in range(1, len(bodies)):
        both = together(log, EGO, i)
        for f in (following(bodies[EGO], bodies[i]), following(bodies[i], bodies[EGO])):
            apart = np.where(both & ~np.isnan(f.gap), f.gap, np.inf)
            gap = np.minimum(gap, apart)
            ttc = np.minimum(ttc, time_to_collision(apart, f.v_closing))
            drac = np.maximum(drac, deceleration_to_avoid_crash(apart, f.v_closing))
    gap_term, ttc_term, braking_term = (
        _rise_of(np.minimum.accumulate(gap), GAP_SCALE),
        _rise_of(np.minimum.accumulate(ttc), TTC_SCALE),
        BRAKING_SCALE / (BRAKING_SCALE + np.maximum.accumulate(drac)),
    )
    levels = 1.0 + (gap_term + ttc_term + braking_term) / 3.0
    ends = [c.tick for c in log.contacts] + log.tick[off_road].tolist()
    if ends:
        levels[log.tick >= min(ends)] = 1.0
    return levels


def _rise_of(values: Floats, scale: float) -> Floats:
    """Returns 0 for values of 0 and less, 1/2 at the scale, 1 for inf, a value that never applied."""
    low = np.maximum(values, 0.0)
    return np.divide(low, low + scale, out=np.ones_like(low), where=np.isfinite(low))


def is_failure(contact: Contact) -> bool:
    """Return whether a contact is one: above 5 km/h, or with a person or a two-wheeler."""
    return contact.v_graded > LIGHT_BELOW or contact.is_vulnerable


def _margin(contact: Contact | None, departed: bool, share: float) -> float:
    """Returns the margin of a run by its hardest contact, by a departure, or without both by `share`.

    share: 0 to 1, how far a run without contact stayed away.
    """
    speed = 0.0 if contact is None else contact.v_graded
    if departed or (contact is not None and is_failure(contact)):
        return -max(speed - LIGHT_BELOW, 0.0) / SPEED_SCALE
    if contact is not None:
        return 1.0 - speed / LIGHT_BELOW if speed < LIGHT_BELOW else float(np.nextafter(0.0, 1.0))
    return 1.0 + share
