"""One recording, judged: what rules and learned identifier found, and what was true (C-212 to C-215)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import nan
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import Cycle
from skidpad.core.errors import FileError
from skidpad.core.vocabulary import HazardType, Stratum
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.hazards import SCORED_HAZARDS, Signal, default_form, load_rules
from skidpad.evidence.channels.identifier.features import feature_row
from skidpad.evidence.channels.indicators.panel import no_lap
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.judging.causes import (
    NO_RULE,
    Mistake,
    ego_motion,
    missed_cause,
    mistakes,
    moments,
)
from skidpad.evidence.channels.judging.curves import (
    Swept,
    Table,
    columns,
    found_by,
    look,
    of_distances,
    of_rules,
    sweep_counts,
    told_the_grip,
    with_limit,
)
from skidpad.evidence.channels.judging.facts import Observer, times_of, warm_times
from skidpad.evidence.channels.judging.reference import NAME as REFERENCE
from skidpad.evidence.channels.judging.reference import at_the_truths_limits, reference
from skidpad.evidence.channels.judging.truth.marks import JUMP_KIND, TrueHazard
from skidpad.evidence.channels.judging.truth.simulator import simulator_truth
from skidpad.evidence.channels.judging.truth.worldmodel import world_model_truth
from skidpad.evidence.channels.matching import Span, match, merge_spans
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.evidence.channels.timefilter import TimeFilter
from skidpad.evidence.channels.timing import Stopwatch
from skidpad.evidence.channels.tracked.distance import GRIPS, NOMINAL_GRIP

Signals = Sequence[tuple[float, dict[Signal, float]]]
TOLD = "tracked, told the grip"
CURVE_FACTORS = (0.5, 0.67, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
WARM_UP = 2.0  # s at the start of a segment that are not evaluated (decision C-12)


@dataclass(frozen=True, slots=True)
class Segment:
    """Judgement of one recording by every identifier."""

    name: str
    route: str
    hours: float
    detected: Mapping[str, tuple[Span, ...]]  # by identifier: a rule profile, or a learned one
    truths: Mapping[str, tuple[Span, ...]]  # "sim", "world", and "labels" where there are any
    candidates: Mapping[HazardType, int]  # candidate hazards, listed and counted (decision C-4)
    unseen: int  # true hazards with an object that no channel reported
    curve: Mapping[float, tuple[Span, ...]]  # practical rules with one threshold scaled
    points: tuple[Swept, ...]  # precision and recall by limit
    mistakes: tuple[Mistake, ...] = ()
    facts: Mapping[str, float | None] = field(default_factory=dict)  # see drive_facts
    context: Mapping[str, str] = field(default_factory=dict)
    t: Floats = field(default_factory=lambda: np.empty(0))  # (k,) s, and what an identifier sees
    rows: Floats = field(default_factory=lambda: np.empty((0, 0)))  # (k, f)
    motion: Floats = field(default_factory=lambda: np.empty((0, 3)))  # (k, 3) see causes.moments
    times: Floats = field(default_factory=lambda: np.empty((0, 4)))  # (k, 4) ms, see warm_times

    @property
    def stratum(self) -> Stratum:
        """Returns the kind of drivers that it was driven among."""
        return Stratum(self.context.get("stratum", Stratum.NATURAL.value))


@dataclass(slots=True)
class _Pass:
    """The practical rules once over the drive, with everything that hangs on it."""

    signals: list[tuple[float, dict[Signal, float]]]
    rows: Floats
    facts: dict[str, float | None]


def judge(
    name: str,
    route: str,
    channels: Sequence[str],
    cycles: Sequence[Cycle],
    labels: Iterable[Span] = (),
    truths: Sequence[str] = ("sim", "world"),
    curve: Signal | None = None,
    context: Mapping[str, str] | None = None,
    timer: Stopwatch | None = None,
) -> Segment:
    """Judges a recording by every rule profile and truth after its warm-up; spans are keyed by profile.

    With `curve` the practical rules are applied again with each clause on that signal scaled by
    CURVE_FACTORS (C-105). labels: human ones, a truth of their own; truths: those that are wanted, of
    which simulator truth needs a recording that holds it; context: stratum, weights and the like;
    timer: measures the practical rules' time.
    """
    t = np.array([c.t for c in cycles])
    begin = evaluated_from(t)
    detected: dict[str, tuple[Span, ...]] = {}
    seen, candidates, detected[Profile.PRACTICAL.value] = _practical(channels, cycles, begin, timer)
    table = columns([values for _, values in seen.signals])
    sweeps = {Profile.PRACTICAL.value: of_rules(Profile.PRACTICAL, t, table, begin)}
    for profile in (Profile.AS_PRINTED, Profile.TRACKED):
        monitor = Monitor(channels, _settings(profile))
        rows = [monitor.update(cycle).signals.values for cycle in cycles]
        detected[profile.value] = _scored_spans(_found_spans(monitor.hazards, begin))
        sweeps[profile.value] = of_rules(profile, t, columns(rows), begin)
    looked = look(channels, cycles)
    sweeps[Profile.TRACKED.value] |= of_distances(channels, looked, begin)
    weights = weights_from(context or {})
    found, unseen, unseen_found = _truths(channels, cycles, truths, begin, detected, weights)
    if "sim" in found:
        told = told_the_grip(channels, looked, grip_of(cycles), begin)
        tracked = detected[Profile.TRACKED.value]  # grip plays no part in localisation
        places = (s for s in tracked if s.hazard is HazardType.INCONSISTENT_LOCALISATION)
        detected[TOLD] = tuple(sorted([*places, *told], key=lambda span: span.t_start))
        sweeps[REFERENCE] = dict(reference(cycles, channels, begin))
        detected[REFERENCE] = at_the_truths_limits(sweeps[REFERENCE])
    if marked := tuple(labels):
        found["labels"] = tuple(merge_spans(marked))
    duration = cycles[-1].t - begin if cycles else 0.0
    motion = moments(cycles, [values[Signal.SAFETY_SCORE] for _, values in seen.signals])
    why = partial(_why_missed, signals=seen.signals)
    return Segment(
        name=name,
        route=route,
        hours=max(duration, 0.0) / 3600.0,
        detected=detected,
        truths=found,
        candidates=candidates,
        unseen=unseen,
        curve={f: _apply_scaled(t, table, curve, f, begin) for f in CURVE_FACTORS if curve},
        points=tuple(sweep_counts(sweeps, found)),
        mistakes=tuple(mistakes(detected, found, t, motion, why)),
        facts=seen.facts | {"unseen": float(unseen), "unseen_found": float(unseen_found)},
        context=dict(context or {}),
        t=t,
        rows=seen.rows,
        motion=motion,
        **({"times": warm_times(timer.table())} if timer and cycles else {}),
    )


def evaluated_from(t: Floats) -> float:
    """Returns the s from which a drive with cycles at t (k,) is evaluated (decision C-12); 0 without any."""
    return float(t[0]) + WARM_UP if t.size else 0.0


def _settings(profile: Profile) -> MonitorSettings:
    """Returns the monitor's settings for a profile with its default form, without worlds in records."""
    return MonitorSettings(
        indicators=IndicatorSettings(form=default_form(profile)), profile=profile, keep_worlds=False
    )


def _practical(
    channels: Sequence[str], cycles: Sequence[Cycle], begin: float, timer: Stopwatch | None
) -> tuple[_Pass, dict[HazardType, int], tuple[Span, ...]]:
    """Returns what the practical rules gave: values per cycle, candidates by hazard, scored spans."""
    monitor = Monitor(channels, _settings(Profile.PRACTICAL))
    observer = Observer(monitor, ego_motion(cycles))
    signals, rows = [], []
    for k, cycle in enumerate(cycles):
        if timer:
            timer.begin(cycle)
        evidence = monitor.update(cycle, timer.lap if timer else no_lap)
        observer.see(k, evidence)
        signals.append((cycle.t, evidence.signals.values))
        rows.append(feature_row(evidence.readings, evidence.risk, evidence.signals))
    facts = observer.facts() | (times_of(timer.table()) if timer and cycles else {})
    spans = _found_spans(monitor.hazards, begin)
    others = [s.hazard for s in spans if s.hazard not in SCORED_HAZARDS]
    return (
        _Pass(signals, np.array(rows), facts),
        {hazard: others.count(hazard) for hazard in dict.fromkeys(others)},
        _scored_spans(spans),
    )


def grip_of(cycles: Sequence[Cycle]) -> float:
    """Returns the ego's true grip of a drive: the median over time, within GRIPS; else NOMINAL_GRIP."""
    grips = [c.truth.ego_mu for c in cycles if c.truth is not None and c.truth.ego_mu > 0.0]
    return float(np.clip(np.median(grips), *GRIPS)) if grips else NOMINAL_GRIP


def _truths(
    channels: Sequence[str],
    cycles: Sequence[Cycle],
    wanted: Sequence[str],
    begin: float,
    detected: Mapping[str, tuple[Span, ...]],
    weights: Weights,
) -> tuple[dict[str, tuple[Span, ...]], int, int]:
    """Returns true hazards by truth, how many of the simulator's no channel saw, and how many of those

    the practical rules found all the same.
    """
    found: dict[str, tuple[Span, ...]] = {}
    unseen: list[Span] = []
    if "sim" in wanted and any(c.truth is not None for c in cycles):
        sim = [h for h in simulator_truth(cycles, channels) if h.t_end >= begin]
        found["sim"] = tuple(map(weights.weigh, sim))
        unseen = [Span(h.hazard, h.t_start, h.t_end) for h in sim if not h.seen]
    if "world" in wanted:
        found["world"] = _spans(h for h in world_model_truth(cycles, channels) if h.t_end >= begin)
    hits = len(match(detected[Profile.PRACTICAL.value], unseen).pairs)
    return found, len(unseen), hits


def _why_missed(identifier: str, missed: Span, signals: Signals) -> str:
    """Returns the clause that kept a profile from firing; NO_RULE for a learned identifier."""
    if identifier not in {p.value for p in Profile}:
        return NO_RULE
    rules = {r.hazard: r for r in load_rules(Profile(identifier))}
    rule = rules.get(missed.hazard)
    return NO_RULE if rule is None else missed_cause(missed, rule, signals)


def _scored_spans(spans: Iterable[Span]) -> tuple[Span, ...]:
    """Returns the spans of the hazards that are scored."""
    return tuple(s for s in spans if s.hazard in SCORED_HAZARDS)


def _found_spans(events: TimeFilter[HazardType], begin: float) -> list[Span]:
    """Returns the events of a finished drive that end at `begin` s or later, in order of their start."""
    spans = [Span(e.key, e.t_start, e.t_end) for e in events.finish()]
    return sorted((s for s in spans if s.t_end >= begin), key=lambda s: s.t_start)


def _apply_scaled(
    t: Floats, signals: Table, signal: Signal, factor: float, begin: float
) -> tuple[Span, ...]:
    """Returns what the practical rules find with every threshold on `signal` times `factor`."""
    rules = (r for r in load_rules(Profile.PRACTICAL) if r.hazard in SCORED_HAZARDS)
    changed = (with_limit(rule, signal, lambda value: value * factor) for rule in rules)
    found = (span for rule in changed for span in found_by(rule, t, signals, begin))
    return tuple(sorted(found, key=lambda s: s.t_start))


def _spans(hazards: Iterable[TrueHazard]) -> tuple[Span, ...]:
    """Returns the spans of true hazards, without what they are about."""
    return tuple(Span(h.hazard, h.t_start, h.t_end) for h in hazards)


# How much a true hazard of the stratum of risky drivers counts (importance sampling).


class Weights(NamedTuple):
    """What a recording says of what was drawn more often than it occurs; 1: as it occurs."""

    drivers: Mapping[str, tuple[float, float]] = {}  # by name: of his headway and of his cut-ins
    jumps: float = 1.0  # of a channel's position

    def weigh(self, hazard: TrueHazard) -> Span:
        """Returns a true hazard as a span that counts by the habit that brought it about.

        Being tailgated comes from a follower's headway, tailgating from a cut-in, a jump from the
        channel; anything else counts 1.
        """
        match hazard.hazard:
            case HazardType.INCONSISTENT_LOCALISATION if hazard.kind == JUMP_KIND:
                weight = self.jumps
            case HazardType.EGO_TAILGATED:
                weight = self._mean(hazard, 0)
            case HazardType.EGO_TAILGATING:
                weight = self._mean(hazard, 1)
            case _:
                weight = 1.0
        return Span(hazard.hazard, hazard.t_start, hazard.t_end, weight=weight)

    def _mean(self, hazard: TrueHazard, column: int) -> float:
        """Returns the mean of a column over the hazard's known drivers, 1 where none is known."""
        own = [self.drivers[a][column] for a in hazard.about if a in self.drivers]
        return sum(own) / len(own) if own else 1.0


def weights_from(context: Mapping[str, str]) -> Weights:
    """Returns the weights in a recording's context, 1 where it has none; FileError where they are damaged."""
    text, jumps = context.get("weights", "{}"), context.get("weight_of_jumps", "1")
    try:
        drivers = {f"actor {i}": (float(a), float(b)) for i, (a, b) in json.loads(text).items()}
    except (ValueError, TypeError, AttributeError):
        raise FileError(
            f"the recording's words `weights` must be JSON of two numbers per actor, got {text[:60]!r}"
        ) from None
    try:
        weight = float(jumps)
    except ValueError:
        weight = nan
    if not 0.0 < weight <= 1.0:  # nor is NaN
        raise FileError(
            f"the recording's word `weight_of_jumps` must be a number in (0, 1], got {jumps[:60]!r}"
        )
    return Weights(drivers, weight)
