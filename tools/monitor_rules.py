"""Rules of the monitor judged on the same drives: counts per recording, then a table with intervals.

    python tools/monitor_rules.py DIR... --out docs/results/channels/rules.json --commit C --date D

DIR: folders of `skidpad channels drive`; what is judged once stays beside its recording. Of
risky drivers each true hazard counts with its weight in the recall, precision and false alarms do not.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import monitor_variants
from monitor_variants import (
    OFF_CENTRE,
    Fused,
    Integrated,
    MapVote,
    Patient,
    Smoothed,
    Steady,
    hold,
    majority,
    off_centre,
)
from skidpad.campaign.recipes.channels import SEEDS_EACH
from skidpad.core.channels import Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import SCORED_HAZARDS
from skidpad.evidence.channels.judging.curves import SIDES, Looked, look, spans
from skidpad.evidence.channels.judging.kept import code_hash
from skidpad.evidence.channels.judging.reference import FACTORS, SPARES, TAILS, reference
from skidpad.evidence.channels.judging.segments import evaluated_from, grip_of, weights_from
from skidpad.evidence.channels.judging.truth.simulator import simulator_truth
from skidpad.evidence.channels.matching import Span, Tally, Weighed, score, tally
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.vote import CHI2_LIMIT, Tracked
from skidpad.evidence.statistics import event_rate
from skidpad.recording.channels.context import context_of
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.drives import extend_way
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.roads.bundled import bundled_maps, load_map
from skidpad.roads.queries import RoadMap

LOCALISATION = HazardType.INCONSISTENT_LOCALISATION
BEFORE, TRACKED, REFERENCE = "before: a dry road, vote", "tracked", "reference "
EACH_CYCLE = "own grip, each cycle by itself"
LONG = 2.0  # s of cycles whose majority decides; `tracked` takes 1 s
PLACES = ("innovation", "chi-square", "map-matched")  # begins of names of rules for positions alone
LIMITS = {LOCALISATION: FACTORS} | dict.fromkeys(TAILS, SPARES)
LEAP = 1.0  # m, of `tracked`
LEAPS = (0.8, 0.9, 1.1)  # m, tried
CHI2_HIGH, CHI2_END = 33.0, 20.0  # tried: at which a vote begins; at which an alarm ends
Held = Sequence[bool] | NDArray[np.bool_]
Found = Mapping[str, Sequence[Span]]  # by rule


def found_gaps(
    channels: Sequence[str], looked: Sequence[Looked], grip: float, begin: float
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of both tailgating hazards."""
    rules = {
        BEFORE: Tracked(channels, SafeDistance(), smoothing=0.0),
        TRACKED: Tracked(channels),
        EACH_CYCLE: Tracked(channels, smoothing=0.0),
        "own grip, fusion": Fused(channels, smoothing=0.0),
        "own grip, integrated probability": Integrated(channels),
        "own grip, smoothed tracks": Smoothed(channels, smoothing=0.0),
        "own grip, integrated, hysteresis": Patient(channels),
        "own grip, fusion, integrated, hysteresis": Steady(channels),
        "told the grip": Tracked(channels, SafeDistance.on(grip), smoothing=0.0),
    }
    t = np.array([cycle.t for cycle in looked])
    for name, rule in rules.items():
        rows = [rule.distances(*cycle) for cycle in looked]
        short = {h: np.array([float(row[s] > 0.0) for row in rows]) for h, s in SIDES.items()}
        yield name, [s for h, p in short.items() for s in spans(h, t, p, 0.5, 1, begin)]
        if name == EACH_CYCLE:
            most = {h: majority(p, LONG) for h, p in short.items()}
            found = [s for h, p in most.items() for s in spans(h, t, p, 0.5, 1, begin)]
            yield f"own grip, smoothed over {LONG:g} s", found


def found_places(
    channels: Sequence[str], looked: Sequence[Looked], begin: float, map: RoadMap | None = None
) -> Iterator[tuple[str, list[Span]]]:
    """What each rule finds of inconsistent positions; without a map none asks one."""
    tracked = Tracked(channels)
    t = np.array([cycle.t for cycle in looked])
    chi2 = np.array([tracked._offset(c.t, c.frames) for c in looked])
    leaps = np.array([tracked._leap(c.t, c.frames) for c in looked])
    leap, apart, lasts = leaps > LEAP, chi2 > CHI2_LIMIT, chi2 > CHI2_END
    high = leap | (chi2 > CHI2_HIGH)
    rules: dict[str, Held] = {BEFORE: apart, TRACKED: leap | apart}
    rules |= {f"innovation over {at:g} m, or vote": (leaps > at) | apart for at in LEAPS}
    rules |= {"chi-square over 33": high, "chi-square over 33, hysteresis": hold(high, lasts)}
    if map is not None:
        vote = MapVote(channels, map)
        matched = leap | np.array([vote.update(c.t, c.frames) for c in looked])
        off = off_centre(map, looked) > OFF_CENTRE
        rules |= {
            "map-matched by the ego, innovation": (leap & off) | apart,
            "map-matched by the ego, both": (leap | apart) & off,
        }
        rules |= {"map-matched vote": matched, "map-matched, hysteresis": hold(matched, lasts)}
    for name, held in rules.items():
        yield name, list(spans(LOCALISATION, t, np.array(held, dtype=float), 0.5, 1, begin))


def judge(path: Path, with_reference: bool) -> dict[str, Any]:
    """Counts of every rule and of the reference's curve in one recording, and the ego's way."""
    source = McapRecording(path)
    context, rows = context_of(source), list(cycles(source))
    begin = evaluated_from(np.array([c.t for c in rows]))
    looked, weigh = look(source.channels, rows), weights_from(context).weigh
    true = [weigh(h) for h in simulator_truth(rows, source.channels) if h.t_end >= begin]
    hours = max(rows[-1].t - begin, 0.0) / 3600.0 if rows else 0.0
    found: dict[str, list[Span]] = dict(found_gaps(source.channels, looked, grip_of(rows), begin))
    map = context.get("map", "")
    known = load_map(map) if map in bundled_maps() else None
    for name, places in found_places(source.channels, looked, begin, known):
        found.setdefault(name, []).extend(places)
    swept = reference(rows, source.channels, begin) if with_reference else {}
    for hazard, limits in swept.items():
        for limit, at in limits.items():
            found.setdefault(f"{REFERENCE}{limit:g}", []).extend(
                s for s in at if s.hazard is hazard
            )
    counts = {name: _counts(name, at, true, hours) for name, at in found.items()}
    return {"hours": hours, "ice": "_ice" in path.stem, "counts": counts, "map": map,
            "risky": context.get("stratum") == "risky", "way": thinned_way(rows)}  # fmt: skip


def thinned_way(rows: Sequence[Cycle]) -> list[tuple[float, float]]:
    """Where the ego truly was: its first place, then one whenever it has moved on by a step, in m."""
    way: list[tuple[float, float]] = []
    for row in rows:
        if row.truth is not None:
            extend_way(way, *row.truth.ego[:2].tolist())
    return way


def is_of_reference(name: str) -> bool:
    """Returns whether a name of counts is a point of the reference's curve."""
    return name.startswith(REFERENCE)


def is_of_rule(name: str) -> bool:
    """Returns whether a name of counts is a rule."""
    return not is_of_reference(name)


def _counts(
    name: str, found: Sequence[Span], true: Sequence[Span], hours: float
) -> dict[str, list[float]]:
    """Of the hazards that the rule judges."""
    rows = tally(found, true, hours)
    limit = name.removeprefix(REFERENCE)
    if limit != name:
        judged = [h for h, limits in LIMITS.items() if float(limit) in limits]
    elif name in (BEFORE, TRACKED):
        judged = [*SCORED_HAZARDS]
    else:
        judged = [LOCALISATION] if name.startswith(PLACES) else [*SIDES]
    return {h.value: [rows[h].tp, rows[h].fp, rows[h].fn, *rows[h].weighed] for h in judged}


@lru_cache(maxsize=1)
def judging_hash() -> str:
    """Of all code that judges: rows of other code are not mixed with these."""
    total = hashlib.sha256(code_hash().encode())
    for file in (Path(__file__), Path(monitor_variants.__file__)):
        total.update(file.read_bytes())
    return total.hexdigest()[:16]


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


def summary(
    rows: Sequence[Mapping[str, Any]], is_wanted: Callable[[str], bool] = lambda _: True
) -> dict[str, Any]:
    """Of one kind of drives: hours and, by rule and hazard, counts and shares with intervals."""
    names = dict.fromkeys(name for row in rows for name in row["counts"] if is_wanted(name))
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
    code = judging_hash()
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
