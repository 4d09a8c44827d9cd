"""Rules of the monitor judged on the same drives: counts per recording, then a table with intervals.

    python tools/monitor_rules.py DIR... --out docs/results/channels/rules.json --commit C --date D

DIR: folders of `skidpad channels drive`; what is judged once stays beside its recording. Of
risky drivers each true hazard counts with its weight in the recall, precision and false alarms do not.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from math import erf, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d

from skidpad.campaign.channels import SEEDS_EACH
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS, Signal
from skidpad.evidence.channels.judging.curves import SIDES, Looked, look, spans
from skidpad.evidence.channels.judging.kept import code_hash
from skidpad.evidence.channels.judging.reference import FACTORS, SPARES, TAILS, reference
from skidpad.evidence.channels.judging.segments import evaluated_from, grip_of
from skidpad.evidence.channels.judging.truth.simulator import simulator_truth
from skidpad.evidence.channels.judging.weights import weights_from
from skidpad.evidence.channels.matching import Span, Tally, Weighed, score, tally
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.tracks import COAST, Track
from skidpad.evidence.channels.tracked.vote import CHI2_LIMIT, Tracked
from skidpad.evidence.statistics import event_rate
from skidpad.recording.channels import McapRecording
from skidpad.recording.context import context_of
from skidpad.recording.cycles import cycles
from skidpad.roads.bundled import bundled_maps, load_map
from skidpad.roads.queries import RoadMap
from skidpad.stack.channels.channel import CYCLE

LOCALISATION = HazardType.INCONSISTENT_LOCALISATION
TODAY, INNOVATION, REFERENCE = "today: a dry road, vote", "innovation", "reference "
LIMITS = {LOCALISATION: FACTORS} | dict.fromkeys(TAILS, SPARES)
OWN_GRIP = "grip from own signals"
LEAPS = (0.8, 0.9, 1.0, 1.1)  # m
SURE_OF_MEAN = 0.95  # of a probability over the last half second
MEMORY = 0.4  # s
SMOOTHED = (1.0, 2.0)  # s of cycles whose majority decides, half of them later: the delay is half
OFF_CENTRE, MEAN_S = 0.8, 0.5  # m from the lane's centre by which the map doubts a position; s
MATCHED = "matched to the map"
OFF_ROAD = 5.0  # m, of a place that no lane is near
Floats = NDArray[np.float64]
Found = Mapping[str, Sequence[Span]]  # by rule


class Fused(Tracked):
    """Where channels have one object, it is judged by their mean, by inverse covariances."""

    def _follow(self, t: float, seen: Any) -> None:
        for tracks, one in zip(self.tracks, seen, strict=True):
            tracks.observe(t, one)
        own = {
            id(k): (k.gap, k.v, k.p, fused_state([k, *self._others(c, k)]))
            for c, tracks in enumerate(self.tracks)
            for k in tracks
        }
        for tracks, one in zip(self.tracks, seen, strict=True):
            for k in tracks:
                gap, v, p, (k.gap, k.v, k.p) = own[id(k)]
                if one is not None:
                    k.judge(t, one.v_ego, tracks.safe, tracks.sure)
                k.gap, k.v, k.p = gap, v, p
            for key in [key for key, k in tracks.tracks.items() if t - k.t > COAST + 1e-6]:
                del tracks.tracks[key]

    def _others(self, channel: int, track: Track) -> list[Track]:
        rest = (c for c in range(len(self.tracks)) if c != channel)
        return [o for c in rest if (o := self._same(c, track)) is not None]


class Integrated(Tracked):
    """A gap is short when its probability, averaged over the last half second, is above a limit."""

    def distances(self, t: float, seen: Any, frames: Any) -> dict[Signal, float]:
        """1 where a gap is short, on either side."""
        super().distances(t, seen, frames)
        out = dict.fromkeys((Signal.FRONT_DEFICIT, Signal.REAR_DEFICIT, Signal.UNSEEN_DEFICIT), 0.0)
        self.means: dict[int, float] = {
            id(track): 0.75 * getattr(self, "means", {}).get(id(track), 0.0)
            + 0.25 * _probability(track)
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


def fused_state(tracks: Sequence[Track]) -> tuple[float, float, tuple[float, float, float]]:
    """Gap, speed and covariances of one object, weighted by the inverse of each track's covariance."""
    weights = [np.linalg.inv([[k.p[0], k.p[2]], [k.p[2], k.p[1]]]) for k in tracks]
    states = [w @ [k.gap, k.v] for w, k in zip(weights, tracks, strict=True)]
    p = np.linalg.inv(np.sum(weights, axis=0))
    gap, v = (p @ np.sum(states, axis=0)).tolist()
    return gap, v, (float(p[0, 0]), float(p[1, 1]), float(p[0, 1]))


def found_gaps(
    channels: Sequence[str], looked: Sequence[Looked], grip: float, begin: float
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of both tailgating hazards."""
    dry, told = SafeDistance(), SafeDistance.on(grip)
    rules = {
        TODAY: Tracked(channels, dry),
        OWN_GRIP: Tracked(channels),
        "own grip, fusion": Fused(channels),
        "own grip, integrated probability": Integrated(channels),
        "told the grip": Tracked(channels, told),
    }
    t = np.array([cycle.t for cycle in looked])
    for name, rule in rules.items():
        rows = [rule.distances(*cycle) for cycle in looked]
        short = {h: np.array([float(row[s] > 0.0) for row in rows]) for h, s in SIDES.items()}
        yield name, [s for h, p in short.items() for s in spans(h, t, p, 0.5, 1, begin)]
        if name == OWN_GRIP:
            for length in SMOOTHED:
                smooth = {h: smoothed(p, length) for h, p in short.items()}
                found = [s for h, p in smooth.items() for s in spans(h, t, p, 0.5, 1, begin)]
                yield f"own grip, smoothed over {length:g} s", found


def smoothed(short: Floats, length: float) -> Floats:
    """Whether a gap is short in most of the cycles around each one (fixed-lag smoothing)."""
    majority: Floats = median_filter(short, size=round(length / CYCLE) | 1, mode="nearest")
    return majority


def off_centre(map: RoadMap, looked: Sequence[Looked]) -> Floats:
    """(T,) m by which the channel that is farthest from a lane's centre lies off it, mean of 0.5 s."""
    worst = np.zeros(len(looked))
    for k, cycle in enumerate(looked):
        for frame in cycle.frames:
            if frame is not None and np.isfinite(frame.ego[:2]).all():
                point = map.project(float(frame.ego[0]), float(frame.ego[1]), 0.0)
                worst[k] = max(worst[k], OFF_ROAD if point is None else abs(point.offset))
    mean: Floats = uniform_filter1d(worst, size=round(MEAN_S / CYCLE), mode="nearest")
    return mean


def found_places(
    channels: Sequence[str], looked: Sequence[Looked], begin: float, map: RoadMap | None = None
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of inconsistent positions."""
    tracked = Tracked(channels)
    t = np.array([cycle.t for cycle in looked])
    chi2 = np.array([tracked._offset(c.t, c.frames) for c in looked]) > CHI2_LIMIT
    leaps = np.array([tracked._leap(c.t, c.frames) for c in looked])
    rules = {TODAY: chi2} | {
        f"{INNOVATION} over {leap:g} m, or today's": chi2 | (leaps > leap) for leap in LEAPS
    }
    if map is not None:
        doubt = off_centre(map, looked) > OFF_CENTRE
        rules[f"{MATCHED}, innovation alone"] = chi2 | ((leaps > 1.0) & doubt)
        rules[f"{MATCHED}, innovation and today's"] = (chi2 | (leaps > 1.0)) & doubt
    for name, held in rules.items():
        yield name, list(spans(LOCALISATION, t, held.astype(float), 0.5, 1, begin))


def judge(path: Path, with_reference: bool) -> dict[str, Any]:
    """Counts of every rule and of the reference's curve in one recording."""
    source = McapRecording(path)
    context, rows = context_of(source), list(cycles(source))
    begin = evaluated_from(np.array([c.t for c in rows]))
    looked, weigh = look(source.channels, rows), weights_from(context).weigh
    true = [weigh(h) for h in simulator_truth(rows, source.channels) if h.t_end >= begin]
    hours = max(rows[-1].t - begin, 0.0) / 3600.0 if rows else 0.0
    found: dict[str, list[Span]] = dict(found_gaps(source.channels, looked, grip_of(rows), begin))
    map = load_map(context["map"]) if context.get("map") in bundled_maps() else None
    for name, places in found_places(source.channels, looked, begin, map):
        found.setdefault(name, []).extend(places)
    swept = reference(rows, source.channels, begin) if with_reference else {}
    for hazard, limits in swept.items():
        for limit, at in limits.items():
            found.setdefault(f"{REFERENCE}{limit:g}", []).extend(
                s for s in at if s.hazard is hazard
            )
    counts = {name: _counts(name, at, true, hours) for name, at in found.items()}
    return {"hours": hours, "ice": "_ice" in path.stem, "counts": counts,
            "risky": context.get("stratum") == "risky"}  # fmt: skip


def _counts(
    name: str, found: Sequence[Span], true: Sequence[Span], hours: float
) -> dict[str, list[float]]:
    """Of the hazards that the rule judges."""
    rows = tally(found, true, hours)
    limit = name.removeprefix(REFERENCE)
    if limit != name:
        judged = [h for h, limits in LIMITS.items() if float(limit) in limits]
    elif name == TODAY:
        judged = [*SCORED_HAZARDS]
    else:
        judged = [LOCALISATION] if name.startswith((INNOVATION, MATCHED)) else [*SIDES]
    return {h.value: [rows[h].tp, rows[h].fp, rows[h].fn, *rows[h].weighed] for h in judged}


def read_or_judge(path: Path, code: str, with_reference: bool) -> dict[str, Any]:
    """The counts of a recording, from before where the same code made them."""
    file = path.with_suffix(".reference" if with_reference else ".rules")
    if file.is_file():
        known: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        if known["code"] == code:
            return known
    row = judge(path, with_reference) | {"code": code}
    file.write_text(json.dumps(row), encoding="utf-8")
    print(path.name, flush=True)
    return row


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of one kind of drives: hours and, by rule and hazard, counts and shares with intervals."""
    names = dict.fromkeys(name for row in rows for name in row["counts"])
    rules: dict[str, dict[str, Any]] = {}
    for name in names:
        for hazard in (h.value for h in SCORED_HAZARDS):
            if hazard in rows[0]["counts"][name]:
                known = [_tally(row, name, hazard) for row in rows]
                s = score(known)
                false = event_rate([k.fp for k in known], [k.hours for k in known])
                rules.setdefault(name, {})[hazard] = {
                    "tp": s.total.tp, "fp": s.total.fp, "fn": s.total.fn,
                    "precision": s.total.precision, "precision_interval": s.precision,
                    "recall": s.total.recall, "recall_interval": s.recall,
                    "recall_weighted": s.total.weighed.recall, "recall_weighted_interval": s.weighed,
                    "effective_size": s.total.weighed.size,
                    "false_alarms_per_hour": s.total.false_alarms_per_hour,
                    "false_alarms_interval": false.interval,
                }  # fmt: skip
    return {"hours": sum(row["hours"] for row in rows), "segments": len(rows), "rules": rules}


def _tally(row: Mapping[str, Any], name: str, hazard: str) -> Tally:
    tp, fp, fn, *weighed = row["counts"][name][hazard]
    return Tally(tp, fp, fn, row["hours"], (), Weighed(*weighed))


def judge_folders(
    folders: Sequence[Path], with_reference: bool, workers: int = 1
) -> dict[str, Any]:
    """Seeds and summaries by kind of drives of all complete recordings in the folders."""
    files = sorted(p for folder in folders for p in folder.rglob("*.mcap"))
    paths = [p for p in files if p.with_suffix(".json").is_file()]
    code = code_hash()
    judge_one = partial(read_or_judge, code=code, with_reference=with_reference)
    if workers > 1:
        with ProcessPoolExecutor(workers) as pool:
            rows = list(pool.map(judge_one, paths))
    else:
        rows = [judge_one(path) for path in paths]
    seeds = {int(path.stem.rsplit("-", 1)[1]) // SEEDS_EACH * SEEDS_EACH for path in paths}
    parts = {
        "natural": [r for r in rows if not r["ice"] and not r["risky"]],
        "risky": [r for r in rows if r["risky"]],
        "on ice": [r for r in rows if r["ice"]],
    }
    drives = {name: summary(part) for name, part in parts.items() if part}
    return {"first_seeds": sorted(seeds), "drives": drives}


def main(words: Sequence[str] | None = None) -> int:
    """Judge what is new, write the table of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", help="folders with recordings")
    parser.add_argument(
        "--reference", type=Path, nargs="*", default=[], help="folders for the reference's curve"
    )
    parser.add_argument("--out", type=Path, required=True, help="file to write")
    parser.add_argument("--commit", default="unknown", help="of the code that drove")
    parser.add_argument("--date", default="", help="of the drives")
    parser.add_argument("--workers", type=int, default=1, help="processes that judge")
    asked = parser.parse_args(words)
    table = {
        "commit": asked.commit,
        "date": asked.date,
        **judge_folders(asked.folders, False, asked.workers),
    }
    if asked.reference:
        table["reference"] = judge_folders(asked.reference, True, asked.workers)
    asked.out.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
