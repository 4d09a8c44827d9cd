"""How often the intervals of `skidpad risk` hold the truth in the simulator itself.

    skidpad risk FILE ... --out DIR                                   # the encounter, and its answer
    python tools/risk_coverage.py count DIR --runs 400000             # brute force: independent draws
    python tools/risk_coverage.py repeat DIR --repetitions 200 --per-level 100 --samples 500
    python tools/risk_coverage.py table DIR

`count` and `repeat` share the processors of the machine, go on where they were left, and end before
another piece after --minutes. Every piece is a line of a file in DIR and depends on its number alone.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from functools import partial
from math import inf, isfinite
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
from msgspec import Struct
from scipy.special import ndtr
from scipy.stats import binomtest

from skidpad.core.arrays import Floats
from skidpad.recording.campaign.risks import read_risk
from skidpad.recording.campaign.searches import read_lines
from skidpad.search.probability import (
    Limit,
    compare_estimates,
    explore,
    importance_estimate,
    joint_interval,
    sample_mixture,
    subset_estimate,
)
from skidpad.search.risk import OBJECTIVE
from skidpad.search.trial import Point, drive_point, unit_tuple

COUNTED, REPEATED = "counted.jsonl", "repeated.jsonl"
BLOCK = 500  # draws of a piece


class Block(Struct, frozen=True):
    """So many independent draws: how many fail, how many were refused, and what they cost."""

    number: int
    runs: int
    failures: int
    faults: int
    simulated_s: float
    processor_s: float


class Ends(Struct, frozen=True):
    """An estimate with its interval; high: None where it has no upper end."""

    p: float
    low: float
    high: float | None

    def holds(self, p: float) -> bool:
        """Returns whether a probability lies in the interval."""
        return self.low <= p <= (inf if self.high is None else self.high)


class Repeated(Struct, frozen=True):
    """One whole estimate with draws of its own."""

    number: int
    runs: int
    is_determined: bool
    estimates: dict[str, Ends]  # by method, and "printed interval", which joins both
    processor_s: float


P = TypeVar("P", Block, Repeated)


def limit_of(folder: Path) -> tuple[Limit, int, dict[str, float]]:
    """Returns the margin of runs of a folder's encounter, its dimensions, and what was spent so far."""
    asked = read_risk(folder)
    template, spent = asked.template, {"runs": 0.0, "faults": 0.0, "simulated_s": 0.0}

    def limit(z: Floats) -> Floats:
        trials = [
            drive_point(Point(template, asked.space, k, unit_tuple(u), OBJECTIVE))
            for k, u in enumerate(ndtr(z))
        ]
        spent["runs"] += len(trials)
        spent["faults"] += sum(bool(t.fault) for t in trials)
        spent["simulated_s"] += sum(t.simulated_s for t in trials)
        return np.array([t.margin for t in trials])

    return limit, len(asked.space.variables), spent


def count(folder: Path, number: int) -> Block:
    """Drives a block of independent draws."""
    begin = time.process_time()
    limit, dimensions, spent = limit_of(folder)
    margins = limit(np.random.default_rng((1, number)).standard_normal((BLOCK, dimensions)))
    return Block(
        number, BLOCK, int((margins <= 0.0).sum()), int(spent["faults"]), spent["simulated_s"],
        time.process_time() - begin,
    )  # fmt: skip


def repeat(folder: Path, repetitions: int, per_level: int, samples: int, number: int) -> Repeated:
    """Makes an estimate by both methods, as `skidpad risk` does."""
    begin = time.process_time()
    limit, dimensions, spent = limit_of(folder)
    rng = np.random.default_rng((2, number))
    found = explore(limit, dimensions, rng, repetitions, per_level)
    subset = subset_estimate(found)
    estimates = {subset.method: Ends(subset.p, subset.low, _end(subset.high))}
    is_determined = False
    if len(found.failing):
        weighted = importance_estimate(sample_mixture(limit, found.failing, rng, samples))
        estimates[weighted.method] = Ends(weighted.p, weighted.low, _end(weighted.high))
        low, high = joint_interval(weighted, subset)
        estimates["printed interval"] = Ends(weighted.p, low, _end(high))
        is_determined = compare_estimates(weighted, subset).is_determined
    return Repeated(
        number, int(spent["runs"]), is_determined, estimates, time.process_time() - begin
    )


def _end(value: float) -> float | None:
    return value if isfinite(value) else None


def drive(
    path: Path, kind: type[P], work: Callable[[int], P], pieces: Iterable[int], minutes: float,
    workers: int,
) -> None:  # fmt: skip
    """Does the pieces that a file lacks, and appends each when it is done."""
    until = time.time() + 60.0 * minutes
    known = {piece.number for piece in read_lines(path, kind)}
    waiting = iter([k for k in pieces if k not in known])
    with ProcessPoolExecutor(workers) as pool, path.open("ab") as file:
        going = {pool.submit(work, k) for _, k in zip(range(workers), waiting, strict=False)}
        while going:
            done, going = wait(going, return_when=FIRST_COMPLETED)
            for one in done:
                file.write(msgspec.json.Encoder().encode_lines([one.result()]))
                file.flush()
                k = next(waiting, None) if time.time() < until else None
                if k is not None:
                    going.add(pool.submit(work, k))


def table(folder: Path) -> str:
    """Returns what brute force counted, and how often each interval holds it, as tables of a page."""
    blocks, repeated = (
        read_lines(folder / COUNTED, Block),
        read_lines(folder / REPEATED, Repeated),
    )
    runs, bad = sum(b.runs for b in blocks), sum(b.failures for b in blocks)
    ends = binomtest(bad, runs).proportion_ci(0.95, "exact")
    cost = 1e3 * sum(b.processor_s for b in blocks) / runs
    counted = (
        f"brute force: {bad} of {runs} fail, {bad / runs:.2e} ({ends.low:.2e} to {ends.high:.2e}); "
        f"{sum(b.faults for b in blocks)} faults; {sum(b.simulated_s for b in blocks):.3g} simulated "
        f"seconds, {cost:.1f} ms of processor time a run"
    )
    lines = [counted]
    if repeated:
        lines += ["", *_coverage(repeated, (bad / runs, float(ends.low), float(ends.high)))]
    return "\n".join(lines)


def _coverage(repeated: Sequence[Repeated], truths: tuple[float, float, float]) -> list[str]:
    n = len(repeated)
    heads = ("method", "reached a failure", "holds the counted share, %", "if it is its lower end, %",
             "its upper end, %", "half-width, median, %")  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for name in ("subset simulation", "importance sampling", "printed interval"):
        found = [r.estimates[name] for r in repeated if name in r.estimates]
        reached = [e for e in found if e.p > 0.0]
        shares = [f"{100.0 * sum(e.holds(p) for e in found) / n:.1f}" for p in truths]
        widths = [inf if e.high is None else 100.0 * (e.high / e.p - 1.0) for e in reached]
        row = (name, f"{len(reached)} of {n}", *shares, f"{np.median(widths):.0f}")
        lines.append(f"| {' | '.join(row)} |")
    determined = sum(r.is_determined for r in repeated)
    mean = float(np.mean([r.runs for r in repeated]))
    return [*lines, "", f"determined: {determined} of {n}; {mean:.0f} runs each"]


def main() -> None:
    """Counts, repeats or prints."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=["count", "repeat", "table"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--chains", type=int, default=10, help="repetitions inside an estimate")
    parser.add_argument("--per-level", type=int, default=100)
    parser.add_argument("--samples", type=int, default=500)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--minutes", type=float, default=inf)
    asked = parser.parse_args()
    folder = asked.folder
    if asked.what == "count":
        work, pieces = partial(count, folder), range(asked.runs // BLOCK)
        drive(folder / COUNTED, Block, work, pieces, asked.minutes, asked.workers)
    elif asked.what == "repeat":
        once = partial(repeat, folder, asked.chains, asked.per_level, asked.samples)
        numbers = range(asked.repetitions)
        drive(folder / REPEATED, Repeated, once, numbers, asked.minutes, asked.workers)
    elif not (folder / COUNTED).is_file():
        parser.error(f"{folder} has no {COUNTED}: run count first")
    if (folder / COUNTED).is_file():
        sys.stdout.write(table(folder) + "\n")


if __name__ == "__main__":
    main()
