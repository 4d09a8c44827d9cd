"""Rules of the monitor judged on the same drives: counts per recording, then a table with intervals.

    python tools/monitor_rules.py DIR... --out docs/results/channels/rules.json --commit C --date D

DIR: folders of `skidpad channels drive`; what is judged once stays beside its recording (.rules). Of
risky drivers each true hazard counts with its weight in the recall, precision and false alarms do not.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from math import erf, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS, Signal
from skidpad.evidence.channels.judging.curves import SIDES, Looked, look, spans
from skidpad.evidence.channels.judging.kept import code_hash
from skidpad.evidence.channels.judging.reference import reference
from skidpad.evidence.channels.judging.segments import evaluated_from, grip_of
from skidpad.evidence.channels.judging.truth.simulator import simulator_truth
from skidpad.evidence.channels.judging.weights import weights_from
from skidpad.evidence.channels.matching import Span, Tally, Weighed, score, tally
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.tracks import Track
from skidpad.evidence.channels.tracked.vote import CHI2_LIMIT, Tracked
from skidpad.recording.channels import McapRecording
from skidpad.recording.context import context_of
from skidpad.recording.cycles import cycles

LOCALISATION = HazardType.INCONSISTENT_LOCALISATION
LEAPS = (0.8, 0.9, 1.0, 1.1)  # m
SURE_OF_MEAN = 0.95  # of a probability over the last half second
MEMORY = 0.4  # s
Found = Mapping[str, Sequence[Span]]  # by rule


class Fused(Tracked):
    """Where two channels have one object, both tracks get their mean by inverse covariances."""

    def _learn_grip(self, t: float, frames: Any) -> None:
        super()._learn_grip(t, frames)
        fused = {}
        for c, tracks in enumerate(self.tracks):
            for track in tracks:
                others = [o for d in range(len(self.tracks)) if d != c and (o := self._same(d, track))]
                fused[id(track)] = (track, _mean_state([track, *others]))
        for track, (gap, v) in fused.values():
            track.gap, track.v = gap, v


class Integrated(Tracked):
    """A gap is short when its probability, averaged over the last half second, is above a limit."""

    def distances(self, t: float, seen: Any, frames: Any) -> dict[Signal, float]:
        super().distances(t, seen, frames)
        out = dict.fromkeys((Signal.FRONT_DEFICIT, Signal.REAR_DEFICIT, Signal.UNSEEN_DEFICIT), 0.0)
        self.means = {
            id(track): 0.75 * getattr(self, "means", {}).get(id(track), 0.0) + 0.25 * _probability(track)
            for tracks in self.tracks
            for track in tracks
        }
        for tracks, one in zip(self.tracks, seen, strict=True):
            for track in tracks:
                if self.means[id(track)] > SURE_OF_MEAN and one is not None and one.v_ego >= 2.0:
                    out[Signal.REAR_DEFICIT if track.behind else Signal.FRONT_DEFICIT] = 1.0
        return out


def _probability(track: Track) -> float:
    return 0.5 * (1.0 + erf(track.deficit / max(track.sigma, 1e-6) / sqrt(2.0)))


def _mean_state(tracks: Sequence[Track]) -> tuple[float, float]:
    """Gap and speed of one object, weighted by the inverse of each track's covariance."""
    weights = [np.linalg.inv([[k.p[0], k.p[2]], [k.p[2], k.p[1]]]) for k in tracks]
    states = [w @ [k.gap, k.v] for w, k in zip(weights, tracks, strict=True)]
    gap, v = np.linalg.solve(sum(weights), sum(states))
    return float(gap), float(v)


def found_gaps(
    channels: Sequence[str], looked: Sequence[Looked], grip: float, begin: float
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of both tailgating hazards."""
    dry, told = SafeDistance(), SafeDistance.on(grip)
    rules = {
        "today: a dry road, vote": Tracked(channels, dry),
        "fusion by covariances": Fused(channels, dry),
        "integrated probability": Integrated(channels, dry),
        "grip from own signals": Tracked(channels),
        "own grip, fusion": Fused(channels),
        "own grip, integrated probability": Integrated(channels),
        "told the grip": Tracked(channels, told),
    }
    t = np.array([cycle.t for cycle in looked])
    for name, rule in rules.items():
        rows = [rule.distances(*cycle) for cycle in looked]
        short = {h: np.array([float(row[s] > 0.0) for row in rows]) for h, s in SIDES.items()}
        yield name, [s for h, p in short.items() for s in spans(h, t, p, 0.5, 1, begin)]


def found_places(
    channels: Sequence[str], looked: Sequence[Looked], begin: float
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of inconsistent positions."""
    tracked = Tracked(channels)
    t = np.array([cycle.t for cycle in looked])
    chi2 = np.array([tracked._offset(c.t, c.frames) for c in looked]) > CHI2_LIMIT
    leaps = np.array([tracked._leap(c.t, c.frames) for c in looked])
    rules = {"today: a dry road, vote": chi2} | {
        f"innovation over {leap:g} m, or today's": chi2 | (leaps > leap) for leap in LEAPS
    }
    for name, held in rules.items():
        yield name, list(spans(LOCALISATION, t, held.astype(float), 0.5, 1, begin))


def judge(path: Path) -> dict[str, Any]:
    """Counts of every rule and of the reference's curve in one recording."""
    source = McapRecording(path)
    context, rows = context_of(source), list(cycles(source))
    begin = evaluated_from(np.array([c.t for c in rows]))
    looked, weigh = look(source.channels, rows), weights_from(context).weigh
    true = [weigh(h) for h in simulator_truth(rows, source.channels) if h.t_end >= begin]
    hours = max(rows[-1].t - begin, 0.0) / 3600.0 if rows else 0.0
    found: dict[str, list[Span]] = dict(found_gaps(source.channels, looked, grip_of(rows), begin))
    for name, places in found_places(source.channels, looked, begin):
        found.setdefault(name, []).extend(places)
    for hazard, limits in reference(rows, source.channels, begin).items():
        for limit, at in limits.items():
            found.setdefault(f"reference {limit:g}", []).extend(s for s in at if s.hazard is hazard)
    counts = {name: _counts(at, true, hours) for name, at in found.items()}
    return {"hours": hours, "ice": "_ice" in context.get("route", ""), "counts": counts,
            "risky": context.get("stratum") == "risky"}  # fmt: skip


def _counts(found: Sequence[Span], true: Sequence[Span], hours: float) -> dict[str, list[float]]:
    rows = tally(found, true, hours)
    return {h.value: [rows[h].tp, rows[h].fp, rows[h].fn, *rows[h].weighed] for h in SCORED_HAZARDS}


def kept(path: Path, code: str) -> dict[str, Any]:
    """The counts of a recording, from before where the same code made them."""
    file = path.with_suffix(".rules")
    if file.is_file():
        known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if known["code"] == code:
            return known
    row = judge(path) | {"code": code}
    file.write_text(json.dumps(row), encoding="utf-8")
    print(path.name, flush=True)
    return row


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of one kind of drives: hours and, by rule and hazard, counts and shares with intervals."""
    names = dict.fromkeys(name for row in rows for name in row["counts"])
    rules: dict[str, dict[str, Any]] = {}
    for name in names:
        for hazard in (h.value for h in SCORED_HAZARDS):
            known = [_tally(row, name, hazard) for row in rows]
            s = score(known)
            judged = name.startswith("reference") or any(c in name for c in _of(hazard))
            if judged:
                rules.setdefault(name, {})[hazard] = {
                    "tp": s.total.tp, "fp": s.total.fp, "fn": s.total.fn,
                    "precision": s.total.precision, "precision_interval": s.precision,
                    "recall": s.total.recall, "recall_interval": s.recall,
                    "recall_weighted": s.total.weighed.recall, "recall_weighted_interval": s.weighed,
                    "effective_size": s.total.weighed.size,
                    "false_alarms_per_hour": s.total.false_alarms_per_hour,
                    "false_alarms_interval": _rate([(k.fp, k.hours) for k in known]),
                }  # fmt: skip
    return {"hours": sum(row["hours"] for row in rows), "segments": len(rows), "rules": rules}
