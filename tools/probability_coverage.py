"""Coverage of the probability methods on closed forms: how often each 95 % interval holds the truth.

    python tools/probability_coverage.py --repetitions 5000 --out docs/results/probability/coverage.csv

Three limits whose probability is known: one half-space, two opposite ones, and all that lies farther
from the origin than a radius (the hardest for importance sampling, as failures lie in every direction).
One row per limit and probability; printed as it is made.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np
from scipy import stats

from skidpad.core.arrays import Floats
from skidpad.search.probability import (
    Limit,
    compare_estimates,
    explore,
    importance_estimate,
    joint_interval,
    sample_mixture,
    subset_estimate,
)

PROBABILITIES = (1e-3, 1e-5, 1e-7, 1e-9)


@dataclass(frozen=True)
class Shape:
    """A limit by its probability, in so many dimensions."""

    name: str
    dimensions: int
    limit: Callable[[float, int], Limit]


def half_space(p: float, d: int) -> Limit:
    """Return the margin to a plane; d dimensions."""
    reach = -float(stats.norm.ppf(p))
    return lambda z: np.asarray(reach - z.sum(axis=1) / sqrt(d))


def two_half_spaces(p: float, d: int) -> Limit:
    """Return the margin to the nearer of two opposite planes; d dimensions."""
    reach = -float(stats.norm.ppf(0.5 * p))
    return lambda z: np.asarray(reach - np.abs(z.sum(axis=1)) / sqrt(d))


def outside(p: float, d: int) -> Limit:
    """Return the margin to a sphere from inside; d dimensions."""
    reach = sqrt(float(stats.chi2.isf(p, d)))
    return lambda z: np.asarray(reach - np.linalg.norm(z, axis=1))


SHAPES = (
    Shape("half-space", 3, half_space),
    Shape("two half-spaces", 3, two_half_spaces),
    Shape("outside of a circle", 2, outside),
    Shape("outside of a sphere", 5, outside),
)
HEADS = (
    "| failures | probability | subset simulation | importance sampling | printed interval | "
    "determined | half-widths | runs |"
)
COLUMNS = (
    "limit", "dimensions", "p", "repetitions", "subset", "importance", "joint", "determined",
    "joint_if_determined", "half_width_subset", "half_width_importance", "runs",
)  # fmt: skip


def measure(shape: Shape, p: float, asked: argparse.Namespace) -> dict[str, object]:
    """Return one row: coverage of each interval, and how often the methods determine the result."""
    limit, d = shape.limit(p, shape.dimensions), shape.dimensions
    rows = []
    for seed in range(asked.repetitions):
        rng = np.random.default_rng([seed, d])
        found = explore(limit, d, rng, asked.chains, asked.per_level)
        one = subset_estimate(found)
        other = importance_estimate(sample_mixture(limit, found.failing, rng, asked.samples))
        low, high = joint_interval(one, other)
        rows.append((
            one.low <= p <= one.high, other.low <= p <= other.high, low <= p <= high,
            compare_estimates(one, other).is_determined, one.half_width, other.half_width,
            found.runs + asked.samples,
        ))  # fmt: skip
    table: Floats = np.array(rows, dtype=np.float64)
    sure = table[:, 3] > 0
    return dict(zip(COLUMNS, (
        shape.name, d, p, asked.repetitions, *(round(float(table[:, k].mean()), 4) for k in range(4)),
        round(float(table[sure, 2].mean()), 4) if sure.any() else "",
        round(float(np.median(table[:, 4])), 3), round(float(np.median(table[:, 5])), 3),
        round(float(table[:, 6].mean())),
    ), strict=True))  # fmt: skip


def page_table(path: Path) -> str:
    """Return the rows of a CSV as the table of docs/search.md: shares in %, half-widths in %."""
    lines = [HEADS, "|---|---|---|---|---|---|---|---|"]
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            of = [
                f"{100 * float(row[k]):.1f}"
                for k in ("subset", "importance", "joint", "determined")
            ]
            widths = [
                f"{100 * float(row[f'half_width_{k}']):.0f}" for k in ("subset", "importance")
            ]
            lines.append(
                f"| {row['limit']}, {row['dimensions']} dimensions | {float(row['p']):.0e} | "
                f"{' | '.join(of)} | {' and '.join(widths)} | {row['runs']} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Measure every shape and probability; write a row as soon as it is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--chains", type=int, default=10)
    parser.add_argument("--per-level", type=int, default=300)
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    rows = []
    for shape in SHAPES:
        for p in PROBABILITIES:
            rows.append(measure(shape, p, asked))
            print(*rows[-1].values(), flush=True)
            if asked.out is not None:
                asked.out.parent.mkdir(parents=True, exist_ok=True)
                with asked.out.open("w", newline="") as file:
                    writer = csv.DictWriter(file, COLUMNS)
                    writer.writeheader()
                    writer.writerows(rows)


if __name__ == "__main__":
    main()
