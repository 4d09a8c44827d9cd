"""Hazards by cycle and as events, and positions that jump or drift, for both truths."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.vocabulary import HazardType

JUMP, JUMP_TIME = 1.0, 0.5  # m within s: a position that jumps
DRIFT = 2.0  # m: a position that is off
JUMP_KIND, DRIFT_KIND = "jump", "drift"
PAUSE = 2.0  # s, shorter pauses are one hazard (C-140)


class World(str, Enum):
    """Whose world a hazard is true in."""

    SIM = "sim"
    CHANNELS = "channels"


@dataclass(frozen=True, slots=True)
class TrueHazard:
    """A hazard that was there from t_start to t_end, in s."""

    hazard: HazardType
    t_start: float
    t_end: float
    world: World
    about: frozenset[str] = frozenset()  # objects or channels, by name
    kind: str = ""  # jump or drift of a position; with a jump in it a jump
    seen: bool = True  # False: no channel reported the object at any time


@dataclass(frozen=True, slots=True)
class Mark:
    """A hazard in one cycle."""

    hazard: HazardType
    t: float
    about: str
    kind: str = ""
    seen: bool = True
    clearance: float = 0.0  # m that are left when the leader brakes; negative: a hit


def offsets(rows: Floats, about: str, factor: float = 1.0) -> list[Mark]:
    """Returns marks of jumps and drifts of an offset given as rows of t in s, dx and dy in m.

    about: name of the channel or pair; factor: on both limits, JUMP and DRIFT.
    """
    rows = rows[np.isfinite(rows).all(axis=1)]
    marks = []
    for k, (t, dx, dy) in enumerate(rows):
        j = int(np.searchsorted(rows[:, 0], t - JUMP_TIME - 1e-6))
        change = np.hypot(rows[j:k, 1] - dx, rows[j:k, 2] - dy).max(initial=0.0)
        if change > factor * JUMP:
            marks.append(Mark(HazardType.INCONSISTENT_LOCALISATION, t, about, JUMP_KIND))
        elif np.hypot(dx, dy) > factor * DRIFT:
            marks.append(Mark(HazardType.INCONSISTENT_LOCALISATION, t, about, DRIFT_KIND))
    return marks


def lasting(marks: list[Mark], duration: float) -> list[Mark]:
    """Returns the marks that belong to runs of at least `duration` s for the same hazard and object.

    Marks more than 0.15 s apart are two runs.
    """
    kept: list[Mark] = []
    runs: dict[tuple[HazardType, str], list[Mark]] = {}

    def end(run: list[Mark]) -> None:
        if run[-1].t - run[0].t >= duration - 1e-6:
            kept.extend(run)

    for mark in marks:
        key = mark.hazard, mark.about
        run = runs.setdefault(key, [])
        if run and mark.t - run[-1].t > 0.15:
            end(run)
            run = runs[key] = []
        run.append(mark)
    for run in runs.values():
        end(run)
    return kept


def merge_marks(marks: list[Mark], world: World) -> list[TrueHazard]:
    """Returns the marks as hazards, those of one hazard with a pause under PAUSE as one (C-140, C-141)."""
    out: list[TrueHazard] = []
    for hazard in HazardType:
        group: list[Mark] = []
        for mark in sorted((m for m in marks if m.hazard is hazard), key=lambda m: m.t):
            if group and mark.t - group[-1].t >= PAUSE - 1e-6:
                out.append(_hazard(group, world))
                group = []
            group.append(mark)
        if group:
            out.append(_hazard(group, world))
    return sorted(out, key=lambda h: (h.t_start, h.hazard.value))


def _hazard(group: list[Mark], world: World) -> TrueHazard:
    """Returns the true hazard that neighbouring marks make, from the first mark to the last."""
    kinds = {m.kind for m in group}
    return TrueHazard(
        group[0].hazard,
        group[0].t,
        group[-1].t,
        world,
        frozenset(m.about for m in group if m.about),
        JUMP_KIND if JUMP_KIND in kinds else "".join(kinds),
        any(m.seen for m in group),
    )
