"""How often the printed intervals hold the truth, simulated: the tables of docs/statistics.md.

`python tools/coverage_table.py docs/statistics.md` writes them, `--draws` sets the draws of a cell.
Every number is conditional on the interval being printed. A cell fails when its coverage is below 93 %
by more than two standard errors of its draws.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import exp, log, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from result_texts import markdown
from skidpad.core.maths.randomness import stream
from skidpad.evidence.limits import count_limits, skew_limits
from skidpad.evidence.statistics import RUNS_WITH_EVENT_FROM, UNITS_FROM, ratio_limits

Floats = NDArray[np.float64]

DRAWS = 4000
LEAST = 0.93
ROUNDS = 40  # of DRAWS until so many of a rare kind are printed
FEW = 200  # fewer printed ones of all rounds judge nothing
SIZES = (8, 10, 15, 20, 30, 60)
MEANS = (0.02, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
DISPERSIONS = (1.0, 2.0, 3.0, 5.0, 10.0)


Shape = tuple[int, int]
Draw = Callable[[np.random.Generator, Shape], Floats]


@dataclass(frozen=True, slots=True)
class Kind:
    """A distribution of one unit's value, with its mean."""

    family: str
    name: str
    mean: float
    draw: Draw


@dataclass(frozen=True, slots=True)
class Covered:
    """What became of one cell's draws."""

    kind: Kind
    n: int
    printed: float  # share of draws
    draws: int  # printed ones
    coverage: float
    width: float  # median width over that of exact Poisson limits; 0: not compared

    @property
    def fails(self) -> bool:
        """Whether the coverage is below 93 % by more than two standard errors."""
        return self.coverage < LEAST - 2.0 * sqrt(LEAST * (1.0 - LEAST) / self.draws)


def counts_of(mean: float, dispersion: float) -> Draw:
    """Poisson counts, or negative binomial ones with that variance over mean."""

    def draw(rng: np.random.Generator, shape: Shape) -> Floats:
        if dispersion == 1.0:
            return rng.poisson(mean, shape).astype(np.float64)
        n, p = mean / (dispersion - 1.0), 1.0 / dispersion
        return rng.negative_binomial(n, p, shape).astype(np.float64)

    return draw


def mixed_counts_of(mean: float, dispersion: float) -> Draw:
    """Poisson counts whose means are log-normal."""
    v = log(1.0 + (dispersion - 1.0) / mean)

    def draw(rng: np.random.Generator, shape: Shape) -> Floats:
        means = rng.lognormal(log(mean) - v / 2.0, sqrt(v), shape)
        return rng.poisson(means).astype(np.float64)

    return draw


def two_valued(value: float, share: float) -> Draw:
    """A value in a share of units, else 0."""
    return lambda rng, shape: np.where(rng.random(shape) < share, value, 0.0)


def difference_of(more: Draw, less: Draw) -> Draw:
    """Of two independent units."""
    return lambda rng, shape: more(rng, shape) - less(rng, shape)


def count_kinds() -> Iterator[Kind]:
    """Counts of events: Poisson, negative binomial, Poisson with log-normal means, bursts."""
    for mean in MEANS:
        for d in DISPERSIONS:
            family = "Poisson" if d == 1.0 else f"negative binomial, variance/mean {d:g}"
            yield Kind(family, f"mean {mean:g}", mean, counts_of(mean, d))
        for d in (3.0, 10.0) if mean > min(MEANS) else ():
            family = f"log-normal means, variance/mean {d:g}"
            yield Kind(family, f"mean {mean:g}", mean, mixed_counts_of(mean, d))
    for size in (2, 5, 10, 20):
        for share in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5):
            name = f"in {100 * share:g} % of runs"
            yield Kind(f"bursts of {size}", name, size * share, two_valued(size, share))


SMOOTH: dict[str, tuple[float, Draw]] = {
    "normal": (3.0, lambda rng, shape: rng.normal(3.0, 1.0, shape)),
    "uniform": (0.5, lambda rng, shape: rng.random(shape)),
    "beta(2, 8)": (0.2, lambda rng, shape: rng.beta(2.0, 8.0, shape)),
    "exponential": (1.0, lambda rng, shape: rng.exponential(1.0, shape)),
    "Student's with 3 degrees": (0.0, lambda rng, shape: rng.standard_t(3.0, shape)),
    "log-normal, sigma 0.5": (exp(0.125), lambda rng, shape: rng.lognormal(0.0, 0.5, shape)),
    "log-normal, sigma 1": (exp(0.5), lambda rng, shape: rng.lognormal(0.0, 1.0, shape)),
}


def value_kinds() -> Iterator[Kind]:
    """Values that are not counts, and paired differences."""
    for name, (mean, draw) in SMOOTH.items():
        yield Kind("mean", name, mean, draw)
    for p in (0.02, 0.05, 0.1, 0.2, 0.5, 0.9):
        yield Kind("mean", f"0 or 90, 90 in {100 * p:g} %", 90.0 * p, two_valued(90.0, p))
    for d in (1.0, 3.0, 10.0):
        name = f"counts of mean 2 and 1, variance/mean {d:g}"
        yield Kind("difference", name, 1.0, difference_of(counts_of(2.0, d), counts_of(1.0, d)))
    for q in (0.02, 0.05, 0.1):
        name = f"bursts of 10 in {200 * q:g} % and {100 * q:g} % of runs"
        draw = difference_of(two_valued(10.0, 2.0 * q), two_valued(10.0, q))
        yield Kind("difference", name, 10.0 * q, draw)


def cover_counts(kind: Kind, n: int, draws: int = DRAWS) -> Covered | None:
    """Of limits of rates; None where hardly any are printed."""

    def printed(c: Floats) -> NDArray[np.bool_]:
        enough = (c > 0).sum(axis=1) >= RUNS_WITH_EVENT_FROM
        return enough if n >= UNITS_FROM else np.zeros_like(enough)

    counts, share = _printed(kind, n, draws, printed)
    if counts is None:
        return None
    total = counts.sum(axis=1)
    spread = counts.var(axis=1, ddof=1) / counts.mean(axis=1)
    low, high = count_limits(total, (counts > 0).sum(axis=1), spread, n)
    held = _held(low, high, kind.mean * n)
    exact = 0.5 * (chdtri(2.0 * total + 2.0, 0.025) - chdtri(2.0 * total, 0.975))
    ratio = float(np.median(high - low) / np.median(exact)) if kind.family == "Poisson" else 0.0
    return Covered(kind, n, share, len(counts), held, ratio)


def cover_values(kind: Kind, n: int, draws: int = DRAWS) -> Covered | None:
    """Of limits of means and differences; None where hardly any are printed."""
    values, share = _printed(kind, n, draws, lambda v: np.ptp(v, axis=1) > 0.0)
    if values is None:
        return None
    low, high = skew_limits(values)
    return Covered(kind, n, share, len(values), _held(low, high, kind.mean), 0.0)


def _printed(
    kind: Kind, n: int, draws: int, printed: Callable[[Floats], NDArray[np.bool_]]
) -> tuple[Floats | None, float]:
    """Draws whose limits are printed, up to `draws`, and their share of all; None: too few."""
    rng = stream(34, "coverage", n, f"{kind.family} {kind.name}")
    found, seen, rounds = [], 0, 0
    while seen < draws and rounds < ROUNDS and (rounds == 0 or seen * ROUNDS > FEW * rounds):
        values = kind.draw(rng, (draws, n))
        found.append(values[printed(values)])
        seen, rounds = seen + len(found[-1]), rounds + 1
    if seen < FEW:
        return None, seen / (draws * rounds)
    return np.concatenate(found)[:draws], seen / (draws * rounds)


def _held(low: Floats, high: Floats, truth: float) -> float:
    near = 1e-9 * max(1.0, abs(truth))
    return float(((low <= truth + near) & (truth <= high + near)).mean())


def cover_ratio(n: int, draws: int) -> float:
    """Coverage of a share of sums over n segments whose shares and sizes differ."""
    rng = stream(34, "coverage of ratios", n)
    cases = rng.integers(5, 40, (draws, n))
    hits = rng.binomial(cases, rng.beta(12.0, 8.0, (draws, n)))
    limits = [ratio_limits(h, c) for h, c in zip(hits, cases, strict=True)]
    return float(np.mean([i.low <= 0.6 <= i.high for i in limits if i]))


def all_cells(draws: int) -> list[Covered]:
    """Every cell of both tables."""
    counts = [cover_counts(k, n, draws) for k in count_kinds() for n in SIZES]
    values = [cover_values(k, n, draws) for k in value_kinds() for n in SIZES]
    return [c for c in (*counts, *values) if c]


def tables(cells: list[Covered], draws: int) -> str:
    """Coverage in percent by family and size, the least of each family's cells."""
    head = ("", *(f"n = {n}" for n in SIZES))
    rates = [c for c in cells if c.kind.family not in ("mean", "difference")]
    rows = [
        [
            family,
            *(_least([c for c in rates if c.kind.family == family and c.n == n]) for n in SIZES),
        ]
        for family in dict.fromkeys(c.kind.family for c in rates)
    ]
    width = [
        f"{max((c.width for c in rates if c.width and c.n == n), default=0.0):.2f}" for n in SIZES
    ]
    others = [c for c in cells if c not in rates]
    by_kind = {(c.kind.family, c.kind.name): c.kind for c in others}
    others_rows = [
        [f"{family}: {name}",
         *(_least([c for c in others if c.kind is kind and c.n == n]) for n in SIZES)]
        for (family, name), kind in by_kind.items()
    ]  # fmt: skip
    ratios = ["share over segments", *(f"{100 * cover_ratio(n, draws):.1f}" for n in SIZES)]
    fails = sum(c.fails for c in cells)
    return (
        f"Rates: the least coverage of the means or shares of each row, in %.\n\n"
        f"{markdown(head, [*rows, ['median width over exact Poisson', *width]])}\n"
        f"Means, paired differences and ratios, in %.\n\n"
        f"{markdown(head, [*others_rows, ratios])}\n"
        f"{len(cells)} cells of {draws} draws at most, {fails} of them below 93 % by more than two "
        f"standard errors.\n"
    )


def _least(cells: list[Covered]) -> str:
    return f"{100.0 * min(c.coverage for c in cells):.1f}" if cells else ""


def write_block(page: Path, name: str, text: str) -> None:
    """Put text between the page's marks of that name."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
    before, rest = page.read_text(encoding="utf-8").split(begin)
    page.write_text(before + begin + "\n" + text + "\n" + end + rest.split(end)[1])


def main() -> int:
    """Print the tables, or put them into a page; 1 when a cell fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", nargs="?", type=Path)
    parser.add_argument("--draws", type=int, default=DRAWS)
    options = parser.parse_args()
    cells = all_cells(options.draws)
    text = tables(cells, options.draws)
    for c in cells:
        if c.fails:
            print(f"fails: {c.kind.family}, {c.kind.name}, n = {c.n}: {c.coverage:.3f}")
    if options.page is None:
        print(text)
    else:
        write_block(options.page, "coverage of intervals", text)
    return int(any(c.fails for c in cells))


if __name__ == "__main__":
    sys.exit(main())
