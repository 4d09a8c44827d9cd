"""The monitor judged: hazards found by rules against both truths and labels (C-210 to C-218)."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from skidpad.core.channels import Cycle
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.hazards import SCORED_HAZARDS, Profile, Signal, load_rules
from skidpad.evidence.indicators.comfort import Form
from skidpad.evidence.indicators.panel import IndicatorSettings
from skidpad.evidence.matching import TOLERANCES, Score, Span, Tally, macro, micro, score, tally
from skidpad.evidence.monitor import Monitor
from skidpad.evidence.timefilter import TimeFilter
from skidpad.evidence.truth import TrueHazard, simulator_truth, world_model_truth

FORMS = {Profile.PRACTICAL: Form.CORRECTED, Profile.AS_PRINTED: Form.COMPLETED}  # decision C-16
CURVE_FACTORS = (0.5, 0.67, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
WARM_UP = 2.0  # s at the start of a segment that are not evaluated (decision C-12)
LABEL_COLUMNS = ("hazard", "start_s", "end_s", "world", "annotator", "note")


@dataclass(frozen=True, slots=True)
class Segment:
    """One recording, judged."""

    name: str
    route: str
    hours: float
    detected: Mapping[Profile, tuple[Span, ...]]
    truths: Mapping[str, tuple[Span, ...]]  # "sim", "world", and "labels" where there are any
    candidates: Mapping[HazardType, int]  # candidate hazards, listed and counted (decision C-4)
    unseen: int  # true hazards with an object that no channel reported
    curve: Mapping[float, tuple[Span, ...]]  # practical rules with one threshold scaled


def judge(
    name: str,
    route: str,
    channels: Sequence[str],
    cycles: Sequence[Cycle],
    labels: Iterable[Span] = (),
    truths: Sequence[str] = ("sim", "world"),
    curve: Signal | None = None,
) -> Segment:
    """Run both rule profiles and the truths over a recording's cycles.

    With `curve` the practical rules are applied again with each clause on that signal scaled by
    CURVE_FACTORS (C-105).
    """
    detected: dict[Profile, tuple[Span, ...]] = {}
    candidates: dict[HazardType, int] = {}
    scaled: dict[float, tuple[Span, ...]] = {}
    begin = cycles[0].t + WARM_UP if cycles else 0.0
    for profile in Profile:
        settings = IndicatorSettings(form=FORMS[profile])
        monitor = Monitor(channels, settings=settings, profile=profile, keep_worlds=False)
        signals = [(c.t, monitor.update(c).signals.values) for c in cycles]
        spans = _found(monitor.hazards, begin)
        detected[profile] = tuple(s for s in spans if s.hazard in SCORED_HAZARDS)
        if profile is Profile.PRACTICAL:
            scaled = {f: _reapplied(signals, curve, f, begin) for f in CURVE_FACTORS if curve}
            others = [s.hazard for s in spans if s.hazard not in SCORED_HAZARDS]
            candidates = {hazard: others.count(hazard) for hazard in dict.fromkeys(others)}
    found: dict[str, tuple[Span, ...]] = {}
    unseen = 0
    if "sim" in truths and any(c.truth is not None for c in cycles):
        sim = [h for h in simulator_truth(cycles, channels) if h.t_end >= begin]
        found["sim"] = _spans(sim)
        unseen = sum(not h.seen for h in sim)
    if "world" in truths:
        found["world"] = _spans(h for h in world_model_truth(cycles, channels) if h.t_end >= begin)
    if marked := tuple(labels):
        found["labels"] = tuple(merged(marked))
    duration = cycles[-1].t - begin if cycles else 0.0
    return Segment(
        name, route, max(duration, 0.0) / 3600.0, detected, found, candidates, unseen, scaled
    )


def _found(events: TimeFilter[HazardType], begin: float) -> list[Span]:
    """The events of a finished drive that reach into its evaluated part."""
    spans = [Span(e.key, e.t_start, e.t_end) for e in events.finish()]
    return sorted((s for s in spans if s.t_end >= begin), key=lambda s: s.t_start)


def _reapplied(
    signals: Sequence[tuple[float, dict[Signal, float]]],
    signal: Signal | None,
    factor: float,
    begin: float,
) -> tuple[Span, ...]:
    """What the practical rules find with every threshold on `signal` times `factor`."""
    events: TimeFilter[HazardType] = TimeFilter()
    for rule in load_rules(Profile.PRACTICAL):
        if rule.hazard not in SCORED_HAZARDS:
            continue
        alternatives = tuple(
            tuple(replace(c, value=c.value * factor) if c.signal is signal else c for c in clauses)
            for clauses in rule.alternatives
        )
        changed = replace(rule, alternatives=alternatives)
        for t, values in signals:
            if changed.fires(values):
                events.add(rule.hazard, t, 0.0, least=True)
    return tuple(_found(events, begin))


def _spans(hazards: Iterable[TrueHazard]) -> tuple[Span, ...]:
    return tuple(Span(h.hazard, h.t_start, h.t_end) for h in hazards)


@dataclass(slots=True)
class Evaluation:
    """All segments together."""

    segments: list[Segment] = field(default_factory=list)

    def tallies(
        self, profile: Profile, truth: str, tolerance: float = TOLERANCES[0]
    ) -> list[dict[HazardType, Tally]]:
        """Counts per segment, of the segments that have this truth."""
        return [
            tally(s.detected[profile], s.truths[truth], s.hours, tolerance)
            for s in self.segments
            if truth in s.truths
        ]

    def scores(
        self, profile: Profile, truth: str, tolerance: float = TOLERANCES[0]
    ) -> dict[HazardType, Score]:
        """Scores of the three scored hazards."""
        rows = self.tallies(profile, truth, tolerance)
        return {h: score([row[h] for row in rows]) for h in SCORED_HAZARDS}

    def by_route(self, profile: Profile, truth: str) -> dict[str, dict[HazardType, Tally]]:
        """Counts per route (C-216)."""
        out: dict[str, dict[HazardType, Tally]] = {}
        with_truth = [s for s in self.segments if truth in s.truths]
        for segment, row in zip(with_truth, self.tallies(profile, truth), strict=True):
            total = out.setdefault(segment.route, dict.fromkeys(SCORED_HAZARDS, Tally()))
            for hazard in SCORED_HAZARDS:
                total[hazard] = total[hazard] + row[hazard]
        return out

    def truths_agree(self) -> dict[HazardType, Score]:
        """World-model truth held against simulator truth, as if it were a detector (C-212)."""
        rows = [
            tally(s.truths["world"], s.truths["sim"], s.hours)
            for s in self.segments
            if {"world", "sim"} <= set(s.truths)
        ]
        return {h: score([row[h] for row in rows]) for h in SCORED_HAZARDS}

    def curve(self, truth: str) -> dict[float, dict[HazardType, Tally]]:
        """Counts by factor on the threshold, over the segments that have this truth (C-105)."""
        out: dict[float, dict[HazardType, Tally]] = {}
        for segment in (s for s in self.segments if truth in s.truths):
            for factor, spans in segment.curve.items():
                row = tally(spans, segment.truths[truth], segment.hours)
                total = out.setdefault(factor, dict.fromkeys(SCORED_HAZARDS, Tally()))
                for hazard in SCORED_HAZARDS:
                    total[hazard] = total[hazard] + row[hazard]
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything, for JSON."""
        truths = sorted({name for s in self.segments for name in s.truths})
        return {
            "segments": len(self.segments),
            "hours": sum(s.hours for s in self.segments),
            "unseen_by_all_channels": sum(s.unseen for s in self.segments),
            "candidates": {
                h.value: sum(s.candidates.get(h, 0) for s in self.segments)
                for h in HazardType
                if h not in SCORED_HAZARDS
            },
            "results": [
                self._result(profile, truth, tolerance)
                for profile in Profile
                for truth in truths
                for tolerance in TOLERANCES
            ],
            "by_route": {
                f"{profile.value}/{truth}": {
                    route: {h.value: [t.tp, t.fp, t.fn] for h, t in row.items()}
                    for route, row in self.by_route(profile, truth).items()
                }
                for profile in Profile
                for truth in truths
            },
            "curve": {
                truth: {
                    str(factor): {h.value: [t.tp, t.fp, t.fn] for h, t in row.items()}
                    for factor, row in self.curve(truth).items()
                }
                for truth in truths
            },
            "truths_agree": {h.value: _row(s) for h, s in self.truths_agree().items()},
        }

    def _result(self, profile: Profile, truth: str, tolerance: float) -> dict[str, Any]:
        scores = self.scores(profile, truth, tolerance)
        return {
            "rules": profile.value,
            "truth": truth,
            "tolerance_s": tolerance,
            "hazards": {h.value: _row(s) for h, s in scores.items()},
            "macro": macro(scores),
            "micro": micro(scores),
        }


def _row(s: Score) -> dict[str, Any]:
    total = s.total
    leads = sorted(total.lead_times)
    return {
        "tp": total.tp,
        "fp": total.fp,
        "fn": total.fn,
        "precision": total.precision,
        "precision_interval": s.precision,
        "recall": total.recall,
        "recall_interval": s.recall,
        "false_alarms_per_hour": total.false_alarms_per_hour,
        "lead_time_median_s": leads[len(leads) // 2] if leads else None,
    }


def read_labels(path: Path) -> dict[str, list[Span]]:
    """Human labels by recording ("" where the file has no column `recording`), both worlds.

    CSV with the columns hazard, start_s, end_s, world (sim or channels), annotator, note.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FileError(f"{path}: cannot be read as labels ({error})") from error
    out: dict[str, list[Span]] = {}
    for number, row in enumerate(rows, start=2):
        out.setdefault(row.get("recording") or "", []).append(_label(f"{path}:{number}", row))
    return out


def _label(where: str, row: dict[str, Any]) -> Span:
    missing = [c for c in LABEL_COLUMNS if row.get(c) is None]
    if missing:
        raise ConfigError(f"{where}: lacks the columns {', '.join(missing)}")
    if row["world"] not in ("sim", "channels"):
        raise ConfigError(f"{where}: world must be sim or channels, got {row['world']!r}")
    try:
        hazard = HazardType(row["hazard"])
        start, end = float(row["start_s"]), float(row["end_s"])
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from error
    if not start <= end:
        raise ConfigError(f"{where}: end_s must not be before start_s, got {start:g} to {end:g}")
    return Span(hazard, start, end)


def merged(spans: Iterable[Span], pause: float = 2.0) -> list[Span]:
    """Spans of one hazard whose pause is under `pause` s, as one (decision C-5)."""
    out: list[Span] = []
    for s in sorted(spans, key=lambda s: (s.hazard.value, s.t_start)):
        last = out[-1] if out else None
        if last and last.hazard is s.hazard and s.t_start - last.t_end < pause:
            out[-1] = Span(s.hazard, last.t_start, max(last.t_end, s.t_end), last.about | s.about)
        else:
            out.append(s)
    return out
