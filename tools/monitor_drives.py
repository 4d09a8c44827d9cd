"""Drives the hours on which the monitor's rules are judged, and leaves one row of counts per segment.

    python tools/channels_campaign.py --only rules --out out/channels --workers 16

Which seeds, drivers and weather belong to a part stands in docs/results/preregistration.yaml. A worker
drives a segment, judges every rule on it and removes the recording, so that OUT/rows.jsonl is all that
stays: about 10 kB per segment. Segments with a row of the same code are not driven again.
A part consists of its first segments, in the order of their seeds, that reach its hours: a segment may
end early, at a collision.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import yaml
from msgspec import structs

import monitor_rules
from skidpad.campaign.channels.routes import Condition, chosen_routes
from skidpad.campaign.recipes.channels import SEEDS_EACH, SEGMENT, drive_one, segments, warm_up
from skidpad.campaign.workers.pool import local
from skidpad.campaign.workers.worker import Job
from skidpad.core.errors import FileError
from skidpad.core.run import RunSpec
from skidpad.core.vocabulary import Stratum

ROOT = Path(__file__).resolve().parents[1]
PLAN = ROOT / "docs" / "results" / "preregistration.yaml"
ROWS = "rows.jsonl"
WAYS_SHOWN = 12  # per map: more lie over each other
SPARE = 8.0  # times the segments that a part would have if none ended early
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Part:
    """name: kind of drives. seed: `--seed` of its drives, never used before. hours: to be driven."""

    name: str
    seed: int
    hours: float
    conditions: str
    stratum: str = "natural"

    def specs(self) -> list[RunSpec]:
        """More segments than reach the hours, in the order in which they count."""
        conditions = [Condition(c) for c in self.conditions.split(",")]
        routes = chosen_routes("all", None, conditions, [Stratum(self.stratum)])
        rounds = ceil(SPARE * self.hours * 3600.0 / SEGMENT / len(routes))
        template = structs.replace(routes[0], seed=self.seed)
        return segments(routes, rounds * len(routes) * SEGMENT / 3600.0, template)


@dataclass(frozen=True)
class Task:
    """One segment for a worker. stop_at: s of the clock (epoch) from when on none is begun."""

    out: Path
    part: str
    number: int
    spec: RunSpec
    stop_at: float


def registered_parts(hours: float | None, table: str = "parts") -> list[Part]:
    """Returns the parts of the registration, which have so many hours together, or their own."""
    plan = yaml.safe_load(PLAN.read_text(encoding="utf-8"))["monitor"]
    parts = [Part(**row) for row in plan[table]]
    share = 1.0 if hours is None else hours / sum(part.hours for part in parts)
    return [Part(p.name, p.seed, p.hours * share, p.conditions, p.stratum) for p in parts]


def drive(out: Path, parts: Sequence[Part], workers: int, stop_after: float | None = None) -> bool:
    """Drive what is missing; returns whether every part has its hours."""
    out.mkdir(parents=True, exist_ok=True)
    file = out / ROWS
    rows = read_rows(file, monitor_rules.judging_hash())
    for part in parts:
        _mark_full(out, part, rows)
    tasks = _missing(out, parts, rows, stop_after)
    jobs = [Job(f"{t.part} {t.number}", drive_and_judge, t) for t in tasks]
    with file.open("a", encoding="utf-8") as sink:
        for done in local(workers, warm_up)(jobs):
            task = done.job.argument
            row = done.value if done.failure is None else _failed_row(task, done.detail)
            if row is None:
                continue
            sink.write(json.dumps(row, allow_nan=False) + "\n")
            sink.flush()
            rows.append(row)
            part = next(p for p in parts if p.name == task.part)
            _mark_full(out, part, rows)
            _say_progress(parts, rows)
    return all(is_complete(part, rows) for part in parts)


def _missing(
    out: Path, parts: Sequence[Part], rows: Sequence[Row], stop_after: float | None
) -> list[Task]:
    """Segments without a row, all parts at an equal pace; none with no time at all."""
    if stop_after is not None and stop_after <= 0.0:
        return []
    stop_at = time.time() + (1e9 if stop_after is None else stop_after)
    known = {(row["part"], row["number"]) for row in rows}
    paced = sorted(
        (
            (number / part.hours, part.name, number, spec)
            for part in parts
            if not is_complete(part, rows)
            for number, spec in enumerate(part.specs())
        ),
        key=lambda one: one[:3],
    )
    return [
        Task(out, name, number, spec, stop_at)
        for _, name, number, spec in paced
        if (name, number) not in known
    ]


def drive_and_judge(task: Task) -> Row | None:
    """In a worker: the row of a segment; None when no further one is wanted."""
    if time.time() > task.stop_at or _full(task.out, task.part).exists():
        return None
    begun = time.process_time()
    folder = task.out / "now"
    driven = drive_one(folder, task.spec)
    path = folder / task.spec.cell / f"{task.spec.name}.mcap"
    cpu_drive = time.process_time() - begun
    try:
        judged = monitor_rules.judge(path, with_reference=True)
    finally:
        for end in (".mcap", ".json"):
            path.with_suffix(end).unlink(missing_ok=True)
    return judged | {
        "part": task.part, "number": task.number, "seed": task.spec.seed,
        "code": monitor_rules.judging_hash(), "route": task.spec.cell,
        "km": round(driven.metrics.distance_m / 1000.0, 3),
        "collisions": driven.metrics.collisions, "hash": driven.key.log_hash,
        "cpu_drive_s": round(cpu_drive, 2),
        "cpu_judge_s": round(time.process_time() - begun - cpu_drive, 2),
    }  # fmt: skip


def _failed_row(task: Task, detail: str) -> Row:
    return {"part": task.part, "number": task.number, "seed": task.spec.seed, "hours": 0.0,
            "code": monitor_rules.judging_hash(), "failed": detail[-500:]}  # fmt: skip


def read_rows(file: Path, code: str | None = None) -> list[Row]:
    """The rows that one code made: this one, or that of the newest row."""
    if not file.is_file():
        return []
    lines = file.read_text(encoding="utf-8").splitlines()
    rows = [row for line in lines if (row := _row_from(line)) is not None]
    code = code or (rows[-1]["code"] if rows else "")
    return [row for row in rows if row["code"] == code]


def _row_from(line: str) -> Row | None:
    """None for a line that was cut off when the campaign was stopped."""
    try:
        row: Row = json.loads(line)
    except ValueError:
        return None
    return row


def counted_rows(part: Part, rows: Iterable[Row]) -> list[Row]:
    """The part's segments in the order of their seeds, up to the one that reaches its hours."""
    by_number = {row["number"]: row for row in rows if row["part"] == part.name}
    out: list[Row] = []
    hours = 0.0
    while hours < part.hours and len(out) in by_number:
        out.append(by_number[len(out)])
        hours += out[-1]["hours"]
    return out


def is_complete(part: Part, rows: Iterable[Row]) -> bool:
    """Returns whether the segments that count reach the part's hours."""
    return bool(sum(row["hours"] for row in counted_rows(part, rows)) >= part.hours)


def _full(out: Path, part: str) -> Path:
    """A file that tells workers that a part has its hours."""
    return out / f"{part.replace(' ', '-')}.full"


def _mark_full(out: Path, part: Part, rows: Sequence[Row]) -> None:
    if is_complete(part, rows):
        _full(out, part.name).touch()
    else:
        _full(out, part.name).unlink(missing_ok=True)


def _say_progress(parts: Sequence[Part], rows: Sequence[Row]) -> None:
    said = ", ".join(
        f"{p.name} {sum(r['hours'] for r in counted_rows(p, rows)):.2f} of {p.hours:g} h"
        for p in parts
    )
    print(said, flush=True)


def summary(parts: Sequence[Part], rows: Sequence[Row]) -> dict[str, Any]:
    """Tables of all parts as monitor_rules makes them, the ways driven, and what it cost."""
    counted = {p.name: [r for r in counted_rows(p, rows) if "failed" not in r] for p in parts}
    counted = {name: of for name, of in counted.items() if of}
    failed = [r for p in parts for r in counted_rows(p, rows) if "failed" in r]
    hours = sum(r["hours"] for of in counted.values() for r in of)
    if not hours:
        raise FileError("no driven segment of the rules has a row; drive first")

    def cost(of: str) -> float:
        return float(round(sum(r[of] for rows in counted.values() for r in rows) / hours, 1))

    return {
        "first_seeds": [p.seed * SEEDS_EACH for p in parts],
        "hours_asked": {p.name: p.hours for p in parts},
        "failed": len(failed),
        "cpu_s_per_hour": {"driving": cost("cpu_drive_s"), "judging": cost("cpu_judge_s")},
        "drives": _tables(counted, monitor_rules.is_of_rule),
        "reference": {"drives": _tables(counted, monitor_rules.is_of_reference)},
    }


def _tables(
    counted: Mapping[str, Sequence[Row]], is_wanted: Callable[[str], bool]
) -> dict[str, Any]:
    return {name: monitor_rules.summary(of, is_wanted) for name, of in counted.items()}


def ways(parts: Sequence[Part], rows: Sequence[Row]) -> dict[str, list[list[list[int]]]]:
    """By map the ways of the first egos, in whole metres, every second of their places."""
    out: dict[str, list[list[list[int]]]] = {}
    for part in parts:
        for row in counted_rows(part, rows):
            known = [] if "failed" in row else out.setdefault(row["map"], [])
            if "failed" not in row and len(known) < WAYS_SHOWN:
                known.append([[round(x), round(y)] for x, y in row["way"][::2]])
    return dict(sorted(out.items()))
