"""Intervals, comparisons and corrections (decisions X-9, R-7, T-6). Every number in a report passes here.

A printed interval holds the truth in 95 % of cases given that it is printed, and what is printed is
never chosen by the estimate that it qualifies. docs/statistics.md has the simulated coverage of each
method and what it assumes; `tools/coverage_table.py` makes it.

An interval is None where no limits hold, below 8 units or when all units are alike; a `Rate` then still
has its share of runs with an event, whose bound assumes nothing. `statistics_text` writes them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil, floor, log2
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from skidpad.core.arrays import Floats
from skidpad.core.errors import require_range
from skidpad.core.maths.randomness import stream
from skidpad.evidence.limits import CONFIDENCE, count_limits, mean_widths, skew_limits

UNITS_FROM = 8  # runs, seeds, segments or vehicles, below which no limits are given
RUNS_WITH_EVENT_FROM = 2  # below, nothing tells clumps from single events
DISPERSION_ASSUMED = 10.0  # largest variance / mean of counts for which limits of rates hold
RESAMPLES = 4000
EVER_SIGNIFICANT = 6  # fewer pairs cannot give p < 0.05: 2 / 2^5 > 0.05
EXACT_PAIRS = 12  # up to here all 2^n sign changes are tried


class Interval(NamedTuple):
    """Confidence limits of an estimate."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Rate:
    """Events per unit of exposure, with its limits and the share of runs that had any."""

    events: int
    runs: int
    runs_with: int  # an event
    exposure: float  # runs, km, hours
    rate: float
    interval: Interval | None  # None: fewer than 8 runs, or fewer than 2 with an event
    dispersion: float | None  # variance / mean of the counts, None: not defined

    @property
    def most_runs(self) -> float:
        """Returns the largest share of runs that have an event, at one-sided 95 %, however events clump."""
        return share_bound(self.runs_with, self.runs)

    @property
    def exceeds_assumption(self) -> bool:
        """Returns whether the counts vary more than the limits of rates assume."""
        return (self.dispersion or 0.0) > DISPERSION_ASSUMED


@dataclass(frozen=True, slots=True)
class Comparison:
    """Mean of paired differences, its interval and one-sided p values."""

    n: int
    mean: float
    interval: Interval | None  # None: fewer than 8 pairs, or all differences are alike
    p_greater: float  # against "the mean difference is <= 0"
    p_less: float
    spread: float  # standard deviation of the differences, 0 for one pair

    @property
    def effect(self) -> float | None:
        """Returns mean over standard deviation (Cohen's d_z); None where the pairs do not vary."""
        return self.mean / self.spread if self.spread > 0.0 else None

    @property
    def p(self) -> float | None:
        """Returns the two-sided p; None below six pairs, of which no outcome could be significant."""
        if self.n < EVER_SIGNIFICANT:
            return None
        return min(1.0, 2.0 * min(self.p_greater, self.p_less))

    @property
    def is_clear(self) -> bool:
        """Returns whether the interval has only one sign; False without one."""
        i = self.interval
        return i is not None and (i.low > 0.0 or i.high < 0.0)


def poisson_interval(count: int, exposure: float = 1.0, confidence: float = CONFIDENCE) -> Interval:
    """Returns exact limits of a Poisson rate. Source: Garwood (1936), Biometrika 28."""
    from scipy import stats

    tail = (1.0 - confidence) / 2.0
    low = stats.chi2.ppf(tail, 2 * count) / 2.0 if count else 0.0
    high = stats.chi2.ppf(1.0 - tail, 2 * count + 2) / 2.0
    return Interval(float(low) / exposure, float(high) / exposure)


def dispersion_index(counts: ArrayLike, exposures: ArrayLike | None = None) -> float | None:
    """Returns variance over mean of counts, 1 for Poisson; None below two runs or without events.

    Of unequal exposures it is Pearson's: squared deviations over expectations, per run but one. Runs
    without exposure say nothing and do not count.
    """
    c = np.asarray(counts, dtype=np.float64)
    e = np.ones_like(c) if exposures is None else np.asarray(exposures, dtype=np.float64)
    c, e = c[e > 0.0], e[e > 0.0]
    if c.size < 2 or c.sum() == 0.0:
        return None
    expected = c.sum() * e / e.sum()
    return float(np.sum((c - expected) ** 2 / expected) / (c.size - 1))


def event_rate(counts: Sequence[int], exposures: Sequence[float] | None = None) -> Rate:
    """Returns the rate of events over independent runs (n,), with limits by `count_limits`.

    The limits hold while the variance of counts is at most 10 times their mean. With fewer than two
    runs with an event, no data can tell rare clumps from single events: then, and with fewer than
    UNITS_FROM runs, the rate has no limits, and what holds is `most_runs`. ValueError without exposure.
    """
    c = np.asarray(counts, dtype=np.int64)
    e = np.ones(c.size) if exposures is None else np.asarray(exposures, dtype=np.float64)
    if c.size == 0 or e.sum() <= 0.0:
        raise ValueError("a rate needs at least one run with exposure > 0")
    total, with_events, exposure = int(c.sum()), int((c > 0).sum()), float(e.sum())
    spread = dispersion_index(c, e)
    interval = None
    if c.size >= UNITS_FROM and with_events >= RUNS_WITH_EVENT_FROM:
        low, high = count_limits(total, with_events, spread or 0.0, c.size)
        interval = Interval(float(low) / exposure, float(high) / exposure)
    return Rate(total, c.size, with_events, exposure, total / exposure, interval, spread)


def mean_limits(values: ArrayLike) -> Interval | None:
    """Returns limits of the mean of values (n,); None: fewer than eight, or all of them alike."""
    v = np.asarray(values, dtype=np.float64)
    if v.size < UNITS_FROM or is_alike(v):
        return None
    low, high = skew_limits(v)
    return Interval(float(low), float(high))


def is_alike(values: Floats) -> bool:
    """Returns whether values (n,) differ by no more than rounding."""
    return bool(np.ptp(values) <= 1e-12 * max(1.0, float(np.abs(values).max())))


def ratio_limits(values: ArrayLike, weights: ArrayLike) -> Interval | None:
    """Returns limits of sum(values) / sum(weights) over units (n,); None as for `mean_limits`.

    Those of the mean of what each unit contributes: the effects of leaving it out. Source: Efron and
    Tibshirani (1993), An Introduction to the Bootstrap, chapter 11, infinitesimal jackknife of a ratio.
    """
    v, w = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    ratio = v.sum() / w.sum()
    off = (v - ratio * w) / (1.0 - w / w.sum()) * v.size / w.sum() if v.size > 1 else v - v
    if v.size < UNITS_FROM or is_alike(off):
        return None
    low, high = skew_limits(off - off.mean())
    return Interval(float(ratio + low), float(ratio + high))


def linear_ratio_limits(
    units: int,
    sums: tuple[float, float],
    products: tuple[float, float, float],
    cubes: tuple[float, float, float, float],
) -> Interval | None:
    """Returns limits of sum(y) / sum(x) over 30 units or more, from sums alone; None: all are alike.

    sums: of y and x; products: of y y, x y and x x; cubes: of y y y, y y x, y x x and x x x. By Taylor
    linearisation, var = k / (k - 1) sum((y - R x)^2) / sum(x)^2, widened for skewness as in
    `skew_limits`. Source: Woodruff (1971), JASA 66, 411-414; SAS/STAT, The SURVEYMEANS procedure, Ratio.
    """
    (y, x), (yy, xy, xx) = sums, products
    ratio = y / x
    squares = yy - 2.0 * ratio * xy + ratio**2 * xx
    if squares <= 1e-12 * yy:
        return None
    yyy, yyx, yxx, xxx = cubes
    thirds = yyy - 3.0 * ratio * yyx + 3.0 * ratio**2 * yxx - ratio**3 * xxx
    below, above = (units / x * float(width) for width in mean_widths(units, squares, thirds))
    return Interval(ratio - below, ratio + above)


def compare_pairs(differences: ArrayLike) -> Comparison:
    """Returns test and interval of the mean of differences of runs with equal seeds (n,), n >= 1.

    The test changes signs: all of them up to 12 pairs, else 4000 drawn ones, the same at every call;
    the interval is that of `mean_limits`. Source: Fisher (1935), The design of experiments, section 21.
    """
    d = np.asarray(differences, dtype=np.float64)
    if d.size == 0:
        raise ValueError("a paired comparison needs at least one pair")
    p_greater, p_less = sign_tests(d[None, :])
    return Comparison(
        n=d.size,
        mean=float(d.mean()),
        interval=mean_limits(d),
        p_greater=float(p_greater[0]),
        p_less=float(p_less[0]),
        spread=float(d.std(ddof=1)) if d.size > 1 else 0.0,
    )


def sign_tests(differences: Floats, *, mid: bool = False) -> tuple[Floats, Floats]:
    """Returns one-sided p values (greater, less) of each row of differences (rows, n), by changing signs.

    mid: changes that give the very sum seen count half, which makes up for the many ties of counts;
    false alarms are then 5 % at most on average, not for every distribution. Source: Lancaster (1961),
    JASA 56, 223-234.
    """
    n = differences.shape[1]
    if n <= EXACT_PAIRS:
        signs = np.array(list(product((1.0, -1.0), repeat=n)))
    else:
        drawn = stream(0, "sign changes", n).integers(0, 2, (RESAMPLES - 1, n))
        signs = np.concatenate([np.ones((1, n)), 1.0 - 2.0 * drawn])
    near = 1e-9 * np.maximum(1.0, np.abs(differences).sum(axis=1))
    seen, sums = differences.sum(axis=1), signs @ differences.T
    greater, less = (sums >= seen - near).mean(axis=0), (sums <= seen + near).mean(axis=0)
    ties = 0.5 * (greater + less - 1.0) if mid else 0.0
    return greater - ties, less - ties


def pairs_needed(comparison: Comparison, smallest: float, power: float = 0.8) -> int | None:
    """Returns the pairs until a mean difference like the one seen, at least `smallest`, would be found.

    By the normal approximation at 5 %, two-sided; None when the pairs do not vary or beyond 10 000.
    """
    from scipy import stats

    z = stats.norm.ppf(1.0 - (1.0 - CONFIDENCE) / 2.0) + stats.norm.ppf(power)
    difference = max(abs(comparison.mean), smallest)
    if comparison.spread == 0.0 or difference == 0.0:
        return None
    needed = ceil((z * comparison.spread / difference) ** 2)
    return None if needed > 10_000 else max(needed, EVER_SIGNIFICANT)


def mcnemar(only_a: int, only_b: int) -> float:
    """Returns the exact two-sided p of paired yes/no outcomes from the pairs that differ (X-9).

    1 without such a pair. Source: McNemar (1947), Psychometrika 12.
    """
    from scipy import stats

    if only_a + only_b == 0:
        return 1.0
    return float(stats.binomtest(only_a, only_a + only_b).pvalue)


def clopper_pearson(k: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """Returns exact limits of a share k of n; 0 to 1 for n = 0.

    Source: Clopper and Pearson (1934), Biometrika 26.
    """
    from scipy import stats

    require_range("successes", k, 0, n)
    if n == 0:
        return Interval(0.0, 1.0)
    limits = stats.binomtest(k, n).proportion_ci(confidence, method="exact")
    return Interval(float(limits.low), float(limits.high))


def share_bound(k: int, n: int, confidence: float = CONFIDENCE) -> float:
    """Returns the largest share that k of n leave possible, one-sided and exact.

    Source: as `clopper_pearson`.
    """
    from scipy import stats

    require_range("successes", k, 0, n)
    return 1.0 if k == n else float(stats.beta.ppf(confidence, k + 1, n - k))


def median_time(times: ArrayLike, end: float) -> tuple[float, Interval | None]:
    """Returns the median of times watched until `end`, and its exact 95 % interval; inf: beyond it.

    times (n,), n >= 1: inf or NaN where nothing happened. The limits are order statistics, so that
    no form of the distribution is assumed; fewer than six times have none. Source: Thompson
    (1936), Ann. Math. Stat. 7, confidence ranges for the median.
    """
    from scipy import stats

    t = np.asarray(times, dtype=np.float64)
    if t.size == 0:
        raise ValueError("a median needs at least one time")
    t = np.sort(np.where(t <= end, t, np.inf))
    middle = float(t[(t.size - 1) // 2]), float(t[t.size // 2])
    median = 0.5 * sum(middle) if np.isfinite(middle[1]) else middle[1]
    below = int(stats.binom.ppf((1.0 - CONFIDENCE) / 2.0, t.size, 0.5))
    if below == 0:
        return median, None
    return median, Interval(float(t[below - 1]), float(t[t.size - below]))


def seeds_for_verdict(claims: int, alpha: float = 0.05) -> int:
    """Returns the least seeds with which a sign-change test can show any of so many claims, Holm-adjusted."""
    return floor(1.0 + log2(max(claims, 1) / alpha)) + 1


def holm(p_values: Sequence[float]) -> list[float]:
    """Returns the adjusted p values of a family, in its order.

    Source: Holm (1979), Scandinavian Journal of Statistics 6.
    """
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    steps = (p.size - np.arange(p.size)) * p[order]
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return [float(v) for v in adjusted]
