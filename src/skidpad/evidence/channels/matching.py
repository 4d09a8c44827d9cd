"""Detected against true hazards: one-to-one matching and what follows from it (C-214, decision C-5)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import maximum_bipartite_matching

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.statistics import Interval, clopper_pearson, ratio_limits

TOLERANCES = (1.0, 0.5, 2.0)  # s by which intervals are dilated; the first is the headline


@dataclass(frozen=True, slots=True)
class Span:
    """A hazard from t_start to t_end, in s; `about` names objects where they are known.

    weight: of a true one, how much it counts (importance sampling; 1: as it occurs).
    """

    hazard: HazardType
    t_start: float
    t_end: float
    about: frozenset[str] = frozenset()
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Matching:
    """Indices of matched detections and truths, and of what was left."""

    pairs: tuple[tuple[int, int], ...]  # detection, truth
    false_alarms: tuple[int, ...]
    missed: tuple[int, ...]


def match(detected: Sequence[Span], true: Sequence[Span], tolerance: float = 1.0) -> Matching:
    """Pairs as many spans as possible of the same hazard and object that overlap within `tolerance` s.

    Every detection and every truth is in at most one pair; the surplus is false or missed. Spans that
    name no object match any.
    """
    if not detected or not true:
        return Matching((), tuple(range(len(detected))), tuple(range(len(true))))
    edges = np.array([[_compatible(d, h, tolerance) for h in true] for d in detected])
    partner = maximum_bipartite_matching(csr_matrix(edges), perm_type="column")
    pairs = tuple((d, int(h)) for d, h in enumerate(partner) if h >= 0)
    hit_d, hit_h = {d for d, _ in pairs}, {h for _, h in pairs}
    return Matching(
        pairs,
        tuple(d for d in range(len(detected)) if d not in hit_d),
        tuple(h for h in range(len(true)) if h not in hit_h),
    )


def _compatible(d: Span, h: Span, tolerance: float) -> bool:
    """Returns True when two spans can match: same hazard, `tolerance` s apart at most, actors alike."""
    if d.hazard is not h.hazard:
        return False
    apart = d.t_start > h.t_end + tolerance or h.t_start > d.t_end + tolerance
    return not apart and (not d.about or not h.about or bool(d.about & h.about))


class Weighed(NamedTuple):
    """True hazards by their weights."""

    found: float = 0.0  # sum of the weights of those found
    true: float = 0.0  # of all
    squares: float = 0.0  # of the weights' squares

    @property
    def recall(self) -> float | None:
        """Returns the share found, each counted as often as it occurs; None without a true hazard."""
        return self.found / self.true if self.true > 0.0 else None

    @property
    def size(self) -> float:
        """Returns the effective sample size: so many equally weighted hazards say as much (Kish 1965)."""
        return self.true * self.true / self.squares if self.squares > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Tally:
    """Counts of one hazard in one segment of driving."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    hours: float = 0.0
    lead_times: tuple[float, ...] = ()  # s, positive: detected before it was true
    weighed: Weighed = Weighed()

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.tp + other.tp,
            self.fp + other.fp,
            self.fn + other.fn,
            self.hours + other.hours,
            self.lead_times + other.lead_times,
            Weighed(*(a + b for a, b in zip(self.weighed, other.weighed, strict=True))),
        )

    @property
    def precision(self) -> float | None:
        """Returns TP / (TP + FP); None without a detection."""
        return self.tp / (self.tp + self.fp) if self.tp + self.fp else None

    @property
    def recall(self) -> float | None:
        """Returns TP / (TP + FN); None without a true hazard."""
        return self.tp / (self.tp + self.fn) if self.tp + self.fn else None

    @property
    def false_alarms_per_hour(self) -> float | None:
        """Returns false alarms per hour of evaluated driving; None without driving."""
        return self.fp / self.hours if self.hours > 0.0 else None


def tally(
    detected: Sequence[Span], true: Sequence[Span], hours: float, tolerance: float = 1.0
) -> dict[HazardType, Tally]:
    """Returns the counts of one segment by hazard, with one entry for every HazardType."""
    out = {}
    for hazard in HazardType:
        d = [s for s in detected if s.hazard is hazard]
        h = [s for s in true if s.hazard is hazard]
        m = match(d, h, tolerance)
        leads = tuple(h[j].t_start - d[i].t_start for i, j in m.pairs)
        weighed = Weighed(
            sum(h[j].weight for _, j in m.pairs),
            sum(s.weight for s in h),
            sum(s.weight**2 for s in h),
        )
        out[hazard] = Tally(len(m.pairs), len(m.false_alarms), len(m.missed), hours, leads, weighed)
    return out


@dataclass(frozen=True, slots=True)
class Score:
    """Precision and recall of one hazard over segments, with intervals over segments."""

    total: Tally
    precision: Interval | None
    recall: Interval | None
    weighed: Interval | None = None  # of the weighted recall


def score(segments: Sequence[Tally]) -> Score:
    """Returns the score of one hazard over segments, with intervals over segments.

    Events within a drive are dependent, so resampling is over segments (X-9). With events in one
    segment only, the interval is that of a single binomial count.
    """
    return Score(
        sum(segments, Tally()),
        _interval([(t.tp, t.tp + t.fp) for t in segments]),
        _interval([(t.tp, t.tp + t.fn) for t in segments]),
        _weighed_interval([t.weighed for t in segments if t.weighed.true > 0.0]),
    )


def _weighed_interval(known: Sequence[Weighed]) -> Interval | None:
    """Returns limits of the weighted recall; exact ones of the effective size where all or none were found.

    None without a true hazard. known: of the segments that have one.
    """
    total = Weighed(*(sum(column) for column in zip(*known, strict=True))) if known else Weighed()
    if total.recall is None:
        return None
    if len(known) == 1 or not 0.0 < total.found < total.true:
        n = max(round(total.size), 1)
        return clopper_pearson(round(total.recall * n), n)
    return _share_limits([w.found for w in known], [w.true for w in known])


def _interval(counts: Sequence[tuple[int, int]]) -> Interval | None:
    """Returns limits of the ratio of sums over segments of (hits, cases); None without a case."""
    known = [(k, n) for k, n in counts if n]
    if not known:
        return None
    hits, cases = (sum(column) for column in zip(*known, strict=True))
    if len(known) == 1 or hits in (0, cases):  # resampling cannot show what was never seen
        return clopper_pearson(hits, cases)
    return _share_limits([k for k, _ in known], [n for _, n in known])


def _share_limits(hits: Sequence[float], cases: Sequence[float]) -> Interval | None:
    """Returns the interval of a share of sums over segments; None as for `ratio_limits`."""
    limits = ratio_limits(hits, cases)
    return None if limits is None else Interval(max(limits.low, 0.0), min(limits.high, 1.0))


def macro(scores: Mapping[HazardType, Score]) -> tuple[float | None, float | None]:
    """Returns means of the hazards' precisions and recalls, over those that have one (C-216); else None."""
    return (
        _mean([s.total.precision for s in scores.values()]),
        _mean([s.total.recall for s in scores.values()]),
    )


def micro(scores: Mapping[HazardType, Score]) -> tuple[float | None, float | None]:
    """Returns precision and recall of all hazards' counts together (C-216); None where not defined."""
    total = sum((s.total for s in scores.values()), Tally())
    return total.precision, total.recall


def percent(ratio: float) -> str:
    """Returns a ratio as text in percent with two decimals, rounded half up, without a sign (C-214)."""
    value = (Decimal(str(ratio)) * 100).quantize(Decimal("0.01"), ROUND_HALF_UP)
    return f"{value}"


def _mean(values: Sequence[float | None]) -> float | None:
    """Returns the mean of the known values; None without any."""
    known = [v for v in values if v is not None]
    return sum(known) / len(known) if known else None


def merge_spans(spans: Iterable[Span], pause: float = 2.0) -> list[Span]:
    """Returns the spans with those of one hazard whose pause is under `pause` s as one (decision C-5).

    A merged span has the objects of all its parts and the largest of their weights.
    """
    out: list[Span] = []
    for s in sorted(spans, key=lambda s: (s.hazard.value, s.t_start)):
        last = out[-1] if out else None
        if last and last.hazard is s.hazard and s.t_start - last.t_end < pause:
            end, weight = max(last.t_end, s.t_end), max(last.weight, s.weight)
            out[-1] = Span(s.hazard, last.t_start, end, last.about | s.about, weight)
        else:
            out.append(s)
    return out
