"""How often the printed intervals hold the truth, simulated: the tables of docs/statistics.md.

`python tools/coverage_table.py docs/statistics.md` writes them, `--draws` sets the draws of a cell.
Every number is conditional on the interval being printed. A cell fails when its coverage is below 93 %
by more than two standard errors of its draws.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import exp, log, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from result_texts import markdown
from skidpad.core.randomness import stream
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


@dataclass(frozen=True, slots=True)
class Kind:
    """A distribution of one unit's value, with its mean."""

    family: str
    name: str
    mean: float
    draw: Callable[[np.random.Generator, tuple[int, int]], Floats]


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


def count_kinds() -> Iterator[Kind]:
    """Counts of events: Poisson, negative binomial, Poisson with log-normal means, bursts."""
    for mean in MEANS:
        yield Kind("Poisson", f"mean {mean:g}", mean, lambda r, s, m=mean: r.poisson(m, s))
        for d in DISPERSIONS[1:]:
            yield Kind(
                f"negative binomial, variance/mean {d:g}", f"mean {mean:g}", mean,
                lambda r, s, m=mean, d=d: r.negative_binomial(m / (d - 1.0), 1.0 / d, s),
            )  # fmt: skip
    for mean in MEANS[1:]:
        for d in (3.0, 10.0):
            v = log(1.0 + (d - 1.0) / mean)
            yield Kind(
                f"log-normal means, variance/mean {d:g}", f"mean {mean:g}", mean,
                lambda r, s, m=mean, v=v: r.poisson(r.lognormal(log(m) - v / 2.0, sqrt(v), s)),
            )  # fmt: skip
    for size in (2, 5, 10, 20):
        for share in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5):
            yield Kind(
                f"bursts of {size}", f"in {100 * share:g} % of runs", size * share,
                lambda r, s, b=size, q=share: b * (r.random(s) < q),
            )  # fmt: skip


def value_kinds() -> Iterator[Kind]:
    """Values that are not counts, and paired differences."""
    smooth: dict[str, tuple[float, Callable[[np.random.Generator, tuple[int, int]], Floats]]] = {
        "normal": (3.0, lambda r, s: r.normal(3.0, 1.0, s)),
        "uniform": (0.5, lambda r, s: r.random(s)),
        "beta(2, 8)": (0.2, lambda r, s: r.beta(2.0, 8.0, s)),
        "exponential": (1.0, lambda r, s: r.exponential(1.0, s)),
        "Student's with 3 degrees": (0.0, lambda r, s: r.standard_t(3.0, s)),
        "log-normal, sigma 0.5": (exp(0.125), lambda r, s: r.lognormal(0.0, 0.5, s)),
        "log-normal, sigma 1": (exp(0.5), lambda r, s: r.lognormal(0.0, 1.0, s)),
    }
    for name, (mean, draw) in smooth.items():
        yield Kind("mean", name, mean, draw)
    for p in (0.02, 0.05, 0.1, 0.2, 0.5, 0.9):
        yield Kind(
            "mean", f"0 or 90, 90 in {100 * p:g} %", 90.0 * p,
            lambda r, s, p=p: 90.0 * (r.random(s) < p),
        )  # fmt: skip
    for d in (1.0, 3.0, 10.0):
        yield Kind(
            "difference", f"counts of mean 2 and 1, variance/mean {d:g}", 1.0,
            lambda r, s, d=d: (_counts(r, 2.0, d, s) - _counts(r, 1.0, d, s)).astype(float),
        )  # fmt: skip
    for q in (0.02, 0.05, 0.1):
        yield Kind(
            "difference", f"bursts of 10 in {200 * q:g} % and {100 * q:g} % of runs", 10.0 * q,
            lambda r, s, q=q: 10.0 * (r.random(s) < 2 * q) - 10.0 * (r.random(s) < q),
        )  # fmt: skip


def _counts(rng: np.random.Generator, mean: float, d: float, shape: tuple[int, int]) -> Floats:
    if d == 1.0:
        return rng.poisson(mean, shape)
    return rng.negative_binomial(mean / (d - 1.0), 1.0 / d, shape)


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


BEGIN, END = "<!-- coverage of intervals: begin -->\n", "<!-- coverage of intervals: end -->\n"


def main() -> None:
    """Print the tables, or put them into a page."""
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
        return
    page = options.page.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    options.page.write_text(before + BEGIN + "\n" + text + "\n" + END + rest.split(END)[1])


if __name__ == "__main__":
    main()
