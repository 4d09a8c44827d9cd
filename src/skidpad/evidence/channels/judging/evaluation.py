"""The monitor judged: hazards found by rules against both truths and labels (C-210 to C-218)."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.text.told import on_a_line
from skidpad.core.vocabulary import HazardType, Stratum
from skidpad.evidence.channels.choices import Profile
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.judging.causes import EXPLAINED
from skidpad.evidence.channels.judging.curves import Point
from skidpad.evidence.channels.judging.facts import route_shares
from skidpad.evidence.channels.judging.segments import Segment, evaluated_from
from skidpad.evidence.channels.matching import (
    TOLERANCES,
    Score,
    Span,
    Tally,
    macro,
    micro,
    score,
    tally,
)

NONE: Floats = np.zeros(0)
LABEL_COLUMNS = ("hazard", "start_s", "end_s", "world", "annotator", "note")


@dataclass(slots=True)
class Evaluation:
    """Counts of all segments of an evaluation together."""

    segments: list[Segment] = field(default_factory=list)

    @property
    def identifiers(self) -> list[str]:
        """Returns the rule profiles and learned identifiers that judged every segment."""
        names = dict.fromkeys(name for s in self.segments for name in s.detected)
        return [n for n in names if all(n in s.detected for s in self.segments)]

    def tallies(
        self, identifier: str, truth: str, tolerance: float = TOLERANCES[0]
    ) -> list[dict[HazardType, Tally]]:
        """Returns the counts by hazard of each segment that has this truth; `tolerance` is in s."""
        return [
            tally(s.detected[identifier], s.truths[truth], s.hours, tolerance)
            for s in self.segments
            if truth in s.truths
        ]

    def scores(
        self, identifier: str, truth: str, tolerance: float = TOLERANCES[0]
    ) -> dict[HazardType, Score]:
        """Returns the scores of the three scored hazards over all segments that have this truth."""
        rows = self.tallies(identifier, truth, tolerance)
        return {h: score([row[h] for row in rows]) for h in SCORED_HAZARDS}

    def by_route(self, identifier: str, truth: str) -> dict[str, dict[HazardType, Tally]]:
        """Returns the counts by route and scored hazard, of the segments that have this truth (C-216)."""
        out: dict[str, dict[HazardType, Tally]] = {}
        with_truth = [s for s in self.segments if truth in s.truths]
        for segment, row in zip(with_truth, self.tallies(identifier, truth), strict=True):
            total = out.setdefault(segment.route, dict.fromkeys(SCORED_HAZARDS, Tally()))
            for hazard in SCORED_HAZARDS:
                total[hazard] = total[hazard] + row[hazard]
        return out

    def truths_agree(self) -> dict[HazardType, Score]:
        """Returns scores of world-model truth against simulator truth, as if it were a detector (C-212)."""
        rows = [
            tally(s.truths["world"], s.truths["sim"], s.hours)
            for s in self.segments
            if {"world", "sim"} <= set(s.truths)
        ]
        return {h: score([row[h] for row in rows]) for h in SCORED_HAZARDS}

    def curve(self, truth: str) -> dict[float, dict[HazardType, Tally]]:
        """Returns counts by factor on the threshold, over the segments that have this truth (C-105)."""
        out: dict[float, dict[HazardType, Tally]] = {}
        for segment in (s for s in self.segments if truth in s.truths):
            for factor, spans in segment.curve.items():
                row = tally(spans, segment.truths[truth], segment.hours)
                total = out.setdefault(factor, dict.fromkeys(SCORED_HAZARDS, Tally()))
                for hazard in SCORED_HAZARDS:
                    total[hazard] = total[hazard] + row[hazard]
        return out

    def as_dict(self) -> dict[str, Any]:
        """Returns everything as plain data: of natural drivers, and of risky ones apart (never pooled).

        On top stand the natural ones, where there are any; all are under "strata".
        """
        parts = {
            stratum: Evaluation([s for s in self.segments if s.stratum is stratum])
            for stratum in Stratum
        }
        first = Stratum.NATURAL if parts[Stratum.NATURAL].segments else Stratum.RISKY
        return parts[first]._as_dict() | {
            "stratum": first.value,
            "strata": {k.value: e._as_dict() for k, e in parts.items() if e.segments},
        }

    def _as_dict(self) -> dict[str, Any]:
        """Returns the evaluation as plain data, as `evaluation.json` and the report have it."""
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
                self._result(identifier, truth, tolerance)
                for identifier in self.identifiers
                for truth in truths
                for tolerance in TOLERANCES
            ],
            "by_route": {
                f"{identifier}/{truth}": {
                    route: {h.value: [t.tp, t.fp, t.fn] for h, t in row.items()}
                    for route, row in self.by_route(identifier, truth).items()
                }
                for identifier in self.identifiers
                for truth in truths
            },
            "curve": {
                truth: {
                    str(factor): {h.value: [t.tp, t.fp, t.fn] for h, t in row.items()}
                    for factor, row in self.curve(truth).items()
                }
                for truth in truths
            },
            "precision_recall": self._precision_recall(),
            "causes": self._causes(),
            "segment_table": self.segment_table().to_dicts(),
            "truths_agree": {h.value: _row(s) for h, s in self.truths_agree().items()},
        }

    def _precision_recall(self) -> dict[str, dict[str, dict[str, list[list[float]]]]]:
        """Returns rows of limit, tp, fp, fn, found and true weight, by truth, identifier and hazard."""
        curves: dict[tuple[str, str, str], list[tuple[Point, ...]]] = {}
        for s in self.segments:
            for c in s.points:
                curves.setdefault((c.truth, c.identifier, c.hazard.value), []).append(c.points)
        out: dict[str, dict[str, dict[str, list[list[float]]]]] = {}
        for (truth, identifier, hazard), known in curves.items():
            of = out.setdefault(truth, {}).setdefault(identifier, {})
            of[hazard] = [
                [at[0].limit, *(sum(column) for column in list(zip(*at, strict=True))[1:])]
                for at in zip(*known, strict=True)
            ]
        return out

    def _causes(self) -> list[dict[str, Any]]:
        """Returns how often each cause stands behind false alarms and misses, in falling order (C-215)."""
        counted = Counter(
            (m.identifier, m.truth, m.hazard.value, m.missed, m.cause)
            for s in self.segments
            for m in s.mistakes
        )
        names = ("rules", "truth", "hazard", "missed", "cause")
        return [
            dict(zip(names, key, strict=True)) | {"count": n} for key, n in counted.most_common()
        ]

    def segment_table(self) -> pl.DataFrame:
        """Returns a row per segment: practical rules against world-model truth, and the drive's facts."""
        greatest: dict[str, Floats] = {}
        for s in self.segments:
            if len(s.times):
                most = s.times.max(axis=0)
                greatest[s.route] = np.maximum(most, greatest.get(s.route, most))
        rows = [
            _facts(s) | route_shares(s.times, greatest.get(s.route, NONE)) for s in self.segments
        ]
        return pl.DataFrame(rows, infer_schema_length=None)

    def _result(self, identifier: str, truth: str, tolerance: float) -> dict[str, Any]:
        """Returns the scores of an identifier against a truth as plain data; `tolerance` is in s."""
        scores = self.scores(identifier, truth, tolerance)
        return {
            "rules": identifier,
            "truth": truth,
            "tolerance_s": tolerance,
            "hazards": {h.value: _row(s) for h, s in scores.items()},
            "macro": macro(scores),
            "micro": micro(scores),
        }


def _facts(s: Segment) -> dict[str, Any]:
    """Returns a row of facts on a segment: route, seed, hours, night, counts by hazard and truth."""
    practical, sun = Profile.PRACTICAL.value, s.context.get("sun_altitude_deg")
    rain = s.context.get("precipitation")
    row: dict[str, Any] = {
        "name": s.name,
        "route": s.route,
        "seed": s.context.get("seed", s.name),
        "hours": s.hours,
        "night": None if sun is None else float(sun) < 0.0,
        "metres": _metres(s),
        "weather": s.context.get("weather"),
        "sun_altitude_deg": None if sun is None else float(sun),
        "precipitation": None if rain is None else float(rain),
    }
    if "world" in s.truths:
        for hazard, t in tally(s.detected[practical], s.truths["world"], s.hours).items():
            if hazard in SCORED_HAZARDS:
                row |= {f"{k}_{hazard.value}": getattr(t, k) for k in ("tp", "fp", "fn")}
    for truth, spans in s.truths.items():
        row |= {f"{truth}_{h.value}": sum(x.hazard is h for x in spans) for h in SCORED_HAZARDS}
    false = [
        m.cause
        for m in s.mistakes
        if (m.identifier, m.truth, m.missed, m.hazard)
        == (practical, "world", False, HazardType.EGO_TAILGATING)
    ]
    row["false_tailgating_explained"] = sum(c in {e.value for e in EXPLAINED} for c in false)
    return row | dict(s.facts)


def _metres(s: Segment) -> float | None:
    """Returns the distance in m that the ego drove in the evaluated time; None where no speed is known."""
    judged = s.t >= evaluated_from(s.t)
    known = judged & np.isfinite(s.motion[:, 0]) if len(s.motion) == len(s.t) else judged & False
    if np.count_nonzero(known) < 2:
        return None
    v, t = s.motion[known, 0], s.t[known]
    return float(0.5 * np.sum((v[1:] + v[:-1]) * np.diff(t)))


def _row(s: Score) -> dict[str, Any]:
    """Returns a hazard's score as plain data; the median lead time in s is None where none is known."""
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
        "recall_weighted": total.weighed.recall,
        "recall_weighted_interval": s.weighed,
        "effective_size": round(total.weighed.size, 1),
        "lead_time_median_s": leads[len(leads) // 2] if leads else None,
    }


def read_labels(path: Path) -> dict[str, list[Span]]:
    """Returns human labels by recording ("" where the file has no column `recording`), of both worlds.

    CSV with the columns hazard, start_s, end_s, world (sim or channels), annotator, note.

    Raises:
        FileError: the file cannot be read.
        ConfigError: a row lacks a column or has a value that is not allowed.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise FileError(f"{path}: cannot be read as labels ({on_a_line(error)})") from error
    out: dict[str, list[Span]] = {}
    for number, row in enumerate(rows, start=2):
        out.setdefault(row.get("recording") or "", []).append(_label(f"{path}:{number}", row))
    return out


def _label(where: str, row: dict[str, Any]) -> Span:
    """Returns the labelled span of a row; raises ConfigError with `where` if a column is not usable."""
    missing = [c for c in LABEL_COLUMNS if row.get(c) is None]
    if missing:
        raise ConfigError(f"{where}: lacks the columns {', '.join(missing)}")
    if row["world"] not in ("sim", "channels"):
        raise ConfigError(f"{where}: world must be sim or channels, got {row['world']!r}")
    try:
        hazard = HazardType(row["hazard"])
        start, end = float(row["start_s"]), float(row["end_s"])
    except ValueError as error:
        raise ConfigError(f"{where}: {on_a_line(error)}") from error
    if not start <= end:
        raise ConfigError(f"{where}: end_s must not be before start_s, got {start:g} to {end:g}")
    return Span(hazard, start, end)
