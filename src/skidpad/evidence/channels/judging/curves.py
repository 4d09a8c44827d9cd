"""Precision against recall: what an identifier would find with another limit (C-105).

Of a rule the limit of one leading clause is varied, all others stay; of `tracked` also the standard
deviations by which a gap must be short; of a learned identifier the limit of its probability.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.frames import usable
from skidpad.evidence.channels.hazards import SCORED_HAZARDS, Rule, Signal, load_rules
from skidpad.evidence.channels.identifier.model import Detector, events_of, probability_of
from skidpad.evidence.channels.matching import Span, tally
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.tracks import Lookout, Seen
from skidpad.evidence.channels.tracked.vote import Tracked
from skidpad.evidence.comparisons import OPERATORS

Table = Mapping[Signal, Floats]  # of a drive, (k,) each; NaN: not evaluated
Sweep = Mapping[float, Sequence[Span]]  # what is found, by limit
LIMITS = tuple(np.round(np.arange(0.05, 0.96, 0.05), 2).tolist())  # of a probability
SURES = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0)  # standard deviations
GAPS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6)
LOCATIONS = (0.1, 0.15, 0.2, 0.25, 0.3, 0.3333, 0.4, 0.5, 0.6)  # 1 / (1 + m between positions)
CHI2 = (5.0, 9.0, 13.8, 20.0, 27.6, 40.0, 60.0, 100.0, 200.0)
LEADS: Mapping[Profile, Mapping[HazardType, tuple[Signal, Sequence[float]]]] = {
    Profile.PRACTICAL: {
        HazardType.INCONSISTENT_LOCALISATION: (Signal.EGO_LOCATION, LOCATIONS),
        HazardType.EGO_TAILGATING: (Signal.GAP, GAPS),
        HazardType.EGO_TAILGATED: (Signal.GAP_SIGNED, GAPS),
    },
    Profile.TRACKED: {HazardType.INCONSISTENT_LOCALISATION: (Signal.OFFSET_CHI2, CHI2)},
}
SIDES = {
    HazardType.EGO_TAILGATING: Signal.FRONT_DEFICIT,
    HazardType.EGO_TAILGATED: Signal.REAR_DEFICIT,
}


class Point(NamedTuple):
    """Holds the counts of matched and unmatched hazards at one limit."""

    limit: float
    tp: int
    fp: int
    fn: int
    found: float  # weights of the true hazards found
    true: float  # of all


class Swept(NamedTuple):
    """Whose limit is varied, against which truth, for which hazard, and what comes of it."""

    identifier: str
    truth: str
    hazard: HazardType
    points: tuple[Point, ...]


def sweep_counts(
    sweeps: Mapping[str, Mapping[HazardType, Sweep]], truths: Mapping[str, Sequence[Span]]
) -> Iterator[Swept]:
    """Yields the curves of all identifiers against all truths.

    sweeps: found spans by identifier, hazard and limit; truths: true spans by name.
    """
    for identifier, of in sweeps.items():
        for truth, true in truths.items():
            for hazard, rows in points(of, true).items():
                yield Swept(identifier, truth, hazard, rows)


def columns(signals: Sequence[Mapping[Signal, float]]) -> Table:
    """Returns the signals of a drive as a column (k,) per signal."""
    return {s: np.array([row[s] for row in signals], dtype=np.float64) for s in Signal}


def found_by(rule: Rule, t: Floats, table: Table, begin: float) -> tuple[Span, ...]:
    """Returns the spans that the rule finds and that end at `begin` s or later, as cycle by cycle.

    t: (k,) s; table: the signals of the drive.
    """
    present = np.zeros(t.size)
    for clauses in rule.alternatives:
        held = np.ones(t.size, dtype=bool)
        for c in clauses:
            held &= OPERATORS[c.operator](table[c.signal], c.value)  # never with NaN
        present[held] = 1.0
    return spans(rule.hazard, t, present, 0.5, 1, begin)


def spans(
    hazard: HazardType, t: Floats, p: Floats, limit: float, confirm: int, begin: float
) -> tuple[Span, ...]:
    """Returns the events of a probability p (k,) over t (k,) that end at `begin` s or later.

    limit, confirm: of `events_of`.
    """
    return tuple(Span(hazard, a, b) for a, b in events_of(t, p, limit, confirm) if b >= begin)


def with_limit(rule: Rule, signal: Signal, change: Callable[[float], float]) -> Rule:
    """Returns the rule with the value of every clause on `signal` changed by `change`."""
    alternatives = tuple(
        tuple(replace(c, value=change(c.value)) if c.signal is signal else c for c in clauses)
        for clauses in rule.alternatives
    )
    return replace(rule, alternatives=alternatives)


def of_rules(profile: Profile, t: Floats, table: Table, begin: float) -> dict[HazardType, Sweep]:
    """Returns what the profile would find, by hazard and limit of its leading clause; {} for AS_PRINTED.

    Only spans that end at `begin` s or later count.
    """
    rules = {r.hazard: r for r in load_rules(profile)}
    out: dict[HazardType, Sweep] = {}
    for hazard, (signal, limits) in LEADS.get(profile, {}).items():
        varied = {to: with_limit(rules[hazard], signal, constant(to)) for to in limits}
        out[hazard] = {to: found_by(rule, t, table, begin) for to, rule in varied.items()}
    return out


def constant(value: float) -> Callable[[float], float]:
    """Returns a function that gives `value` for every argument."""
    return lambda _: value


def of_distances(
    channels: Sequence[str], looked: Sequence[Looked], begin: float
) -> dict[HazardType, Sweep]:
    """Returns what `tracked` would find of both tailgating hazards, by hazard and standard deviations.

    These, SURES, say how sure it must be that a gap is short. Only spans that end at `begin` s or
    later count.
    """
    found: dict[HazardType, dict[float, tuple[Span, ...]]] = {hazard: {} for hazard in SIDES}
    for sure in SURES:
        for hazard, short in _short(Tracked(channels, sure=sure), looked, begin).items():
            found[hazard][sure] = short
    return dict(found)


def told_the_grip(
    channels: Sequence[str], looked: Sequence[Looked], grip: float, begin: float
) -> tuple[Span, ...]:
    """Returns what `tracked` would find of both tailgating hazards from `begin` s on if it knew the grip."""
    found = _short(Tracked(channels, SafeDistance.on(grip)), looked, begin)
    return tuple(s for short in found.values() for s in short)


class Looked(NamedTuple):
    """A cycle, looked at once for all who judge it."""

    t: float
    seen: list[Seen | None]
    frames: list[ChannelFrame | None]


def look(channels: Sequence[str], cycles: Sequence[Cycle]) -> list[Looked]:
    """Returns each cycle with what every channel saw in path coordinates, in order of time."""
    lookouts = [Lookout() for _ in channels]
    rows = ((c.t, [None if f is None else usable(f).frame for f in c.frames]) for c in cycles)
    return [
        Looked(t, [out.see(f) for out, f in zip(lookouts, frames, strict=True)], frames)
        for t, frames in rows
    ]


def _short(
    tracked: Tracked, looked: Sequence[Looked], begin: float
) -> dict[HazardType, tuple[Span, ...]]:
    """Returns the spans of short gaps ahead and behind that end at `begin` s or later, by hazard."""
    rows = [tracked.distances(*cycle) for cycle in looked]
    t = np.array([cycle.t for cycle in looked])
    short = {
        hazard: np.array([row[signal] > 0.0 for row in rows], dtype=np.float64)
        for hazard, signal in SIDES.items()
    }
    return {hazard: spans(hazard, t, p, 0.5, 1, begin) for hazard, p in short.items()}


def of_learned(
    detectors: Mapping[HazardType, Detector], t: Floats, rows: Floats, begin: float
) -> dict[HazardType, Sweep]:
    """Returns what a learned identifier would find, by hazard and limit of probability (LIMITS).

    t: (k,) s; rows: (k, f) features. Only spans that end at `begin` s or later count.
    """
    out: dict[HazardType, Sweep] = {}
    for hazard, d in detectors.items():
        p = probability_of(d.forest, t, rows)
        out[hazard] = {limit: spans(hazard, t, p, limit, d.confirm, begin) for limit in LIMITS}
    return out


def points(
    sweeps: Mapping[HazardType, Sweep], true: Sequence[Span]
) -> dict[HazardType, tuple[Point, ...]]:
    """Returns the counts at each limit against a truth, by scored hazard."""
    out = {}
    for hazard in (h for h in SCORED_HAZARDS if h in sweeps):
        here = [s for s in true if s.hazard is hazard]
        rows = ((limit, tally(found, here, 0.0)[hazard]) for limit, found in sweeps[hazard].items())
        out[hazard] = tuple(
            Point(limit, row.tp, row.fp, row.fn, row.weighed.found, row.weighed.true)
            for limit, row in rows
        )
    return out
