"""Intervals, comparisons and corrections (decisions X-9, R-7). Every number in a report passes here.

Counts of crashes are small and clump: exact methods where they exist, else those that hold 94 % in
simulation (tests/evidence/test_promises.py says where), and None, "too few", where nothing does.
Nothing is resampled below 30 units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import product
from math import ceil, floor, log2
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.special import stdtrit

from skidpad.core.errors import require_range
from skidpad.core.randomness import stream

Floats = NDArray[np.float64]

CONFIDENCE = 0.95
DISPERSION_MAX = 1.2  # above, counts vary more than Poisson
CLUMPED_EVENTS = 25  # fewer of counts that vary more than Poisson: too few
BOOTSTRAP_FROM = 30  # units
MEAN_FROM = 6  # values
SKEW_MAX = 1.0  # of fewer than 30 values
SKEW_WIDENS = 1.5
RESAMPLES = 4000
EVER_SIGNIFICANT = 6  # fewer pairs cannot give p < 0.05: 2 / 2^5 > 0.05
EXACT_PAIRS = 12  # up to here all 2^n sign changes are tried


class Interval(NamedTuple):
    """Confidence limits."""

    low: float
    high: float


class Method(str, Enum):
    """How an interval was made."""

    POISSON = "exact Poisson"
    SCORE = "score limits with the spread of runs"


@dataclass(frozen=True, slots=True)
class Rate:
    """Events per unit of exposure, with its interval."""

    events: int
    runs: int
    exposure: float  # runs, km, hours
    rate: float
    interval: Interval | None  # None: too few
    method: Method
    dispersion: float | None  # variance / mean of the counts, None: not defined


@dataclass(frozen=True, slots=True)
class Comparison:
    """Mean of paired differences, its interval and one-sided p values."""

    n: int
    mean: float
    interval: Interval
    p_greater: float  # against "the mean difference is <= 0"
    p_less: float
    spread: float  # standard deviation of the differences, 0 for one pair

    @property
    def effect(self) -> float | None:
        """Mean over standard deviation (Cohen's d_z); None where the pairs do not vary."""
        return self.mean / self.spread if self.spread > 0.0 else None

    @property
    def p(self) -> float:
        """Two-sided."""
        return min(1.0, 2.0 * min(self.p_greater, self.p_less))


def poisson_interval(count: int, exposure: float = 1.0, confidence: float = CONFIDENCE) -> Interval:
    """Exact limits of a Poisson rate. Source: Garwood (1936), Biometrika 28."""
    tail = (1.0 - confidence) / 2.0
    low = stats.chi2.ppf(tail, 2 * count) / 2.0 if count else 0.0
    high = stats.chi2.ppf(1.0 - tail, 2 * count + 2) / 2.0
    return Interval(float(low) / exposure, float(high) / exposure)


def dispersion_index(counts: ArrayLike, exposures: ArrayLike | None = None) -> float | None:
    """Variance over mean of counts, 1 for Poisson; None below two runs or without events.

    Of unequal exposures it is Pearson's: squared deviations over expectations, per run but one.
    """
    c = np.asarray(counts, dtype=np.float64)
    e = np.ones_like(c) if exposures is None else np.asarray(exposures, dtype=np.float64)
    use = e > 0.0
    if c.size < 2 or c.sum() == 0.0 or not use.any():
        return None
    expected = c.sum() * e[use] / e.sum()
    return float(np.sum((c[use] - expected) ** 2 / expected) / (c.size - 1))


def bootstrap_interval(
    values: ArrayLike, weights: ArrayLike | None = None, confidence: float = CONFIDENCE
) -> Interval:
    """Percentile limits of sum(values) / sum(weights) over resampled runs or drive segments (n,).

    weights: exposure of each, 1 by default. The resamples are the same at every call.
    """
    v = np.asarray(values, dtype=np.float64)
    w = np.ones_like(v) if weights is None else np.asarray(weights, dtype=np.float64)
    picks = stream(0, "bootstrap", v.size).integers(0, v.size, (RESAMPLES, v.size))
    means = v[picks].sum(axis=1) / w[picks].sum(axis=1)
    tail = 100.0 * (1.0 - confidence) / 2.0
    low, high = np.percentile(means, [tail, 100.0 - tail])
    return Interval(float(low), float(high))


def event_rate(counts: Sequence[int], exposures: Sequence[float] | None = None) -> Rate:
    """Rate of events over runs: exact Poisson of a single run, else score limits.

    Score limits take the variance of a count as its mean times the dispersion index of these runs (at
    least 1, widened for its own error), and Student's quantile. In simulation they hold 94.5 % or more
    from two runs on, for Poisson counts and for negative binomial ones with a dispersion of up to 3 and
    a mean of 1 or up to 20 and a mean of 5. Fewer than 25 events that clump have no interval.
    """
    c = np.asarray(counts, dtype=np.int64)
    e = np.ones(c.size) if exposures is None else np.asarray(exposures, dtype=np.float64)
    if c.size == 0 or e.sum() <= 0.0:
        raise ValueError("a rate needs at least one run with exposure > 0")
    total, exposure = int(c.sum()), float(e.sum())
    if c.size == 1:
        limits = poisson_interval(total, exposure)
        return Rate(total, 1, exposure, total / exposure, limits, Method.POISSON, None)
    spread = dispersion_index(c, e)
    few = total < CLUMPED_EVENTS and (spread or 0.0) > DISPERSION_MAX
    interval = None if few else _score_limits(total, exposure, c.size, spread)
    return Rate(total, c.size, exposure, total / exposure, interval, Method.SCORE, spread)


def _score_limits(total: int, exposure: float, runs: int, spread: float | None) -> Interval:
    """Rates whose distance from the one seen is at most Student's quantile times its deviation."""
    over = max((spread or 0.0) - 1.0, 0.0) * (1.0 + np.sqrt(2.0 / (runs - 1)))
    width = stats.t.ppf(1.0 - (1.0 - CONFIDENCE) / 2.0, runs - 1) ** 2 * (1.0 + over)
    middle = total + width / 2.0
    half = float(np.sqrt(width * total + width**2 / 4.0))
    return Interval(max(middle - half, 0.0) / exposure, (middle + half) / exposure)


def mean_limits(values: ArrayLike) -> Interval | None:
    """Limits of the mean of values (n,) that are not counts; None: too few, or too skew for so few.

    Student's limits, widened by the skewness seen. In simulation they hold 94 % or more for
    normal, uniform, beta and exponential values and log-normal ones with a sigma of 0.5.
    """
    v = np.asarray(values, dtype=np.float64)
    n = v.size
    spread = float(v.std(ddof=1)) if n > 1 else 0.0
    if n < MEAN_FROM:
        return None
    if spread <= 1e-12 * max(1.0, float(np.abs(v).max())):
        return Interval(float(v[0]), float(v[0]))
    skew = abs(float(stats.skew(v, bias=False)))
    if n < BOOTSTRAP_FROM and skew > SKEW_MAX:
        return None
    half = stats.t.ppf(1.0 - (1.0 - CONFIDENCE) / 2.0, n - 1) * spread / np.sqrt(n)
    half *= 1.0 + skew / (SKEW_WIDENS * np.sqrt(n))
    return Interval(float(v.mean() - half), float(v.mean() + half))


def ratio_limits(values: ArrayLike, weights: ArrayLike) -> Interval | None:
    """Limits of sum(values) / sum(weights) over units (n,); None: fewer than six.

    Resampled from 30 units on, else Student's limits by leaving out one unit after the other.
    """
    v, w = np.asarray(values, dtype=np.float64), np.asarray(weights, dtype=np.float64)
    if v.size >= BOOTSTRAP_FROM:
        return bootstrap_interval(v, w)
    if v.size < MEAN_FROM:
        return None
    ratio = v.sum() / w.sum()
    off = (v - ratio * w) / (1.0 - w / w.sum()) * v.size / w.sum()
    half = stats.t.ppf(1.0 - (1.0 - CONFIDENCE) / 2.0, v.size - 1) * off.std(ddof=1)
    half /= np.sqrt(v.size)
    return Interval(float(ratio - half), float(ratio + half))


def linear_ratio_limits(
    units: int, sums: tuple[float, float], products: tuple[float, float, float]
) -> Interval:
    """Limits of sum(y) / sum(x) over 30 units or more, from sums alone.

    sums: of y and x; products: of y y, x y and x x. By Taylor linearisation, var = k / (k - 1)
    sum((y - R x)^2) / sum(x)^2, with Student's quantile. Source: Woodruff (1971), JASA 66, 411-414;
    SAS/STAT, The SURVEYMEANS procedure, Ratio.
    """
    (y, x), (yy, xy, xx) = sums, products
    ratio = y / x
    spread = max(yy - 2.0 * ratio * xy + ratio * ratio * xx, 0.0)
    half = float(stdtrit(units - 1, 0.5 + 0.5 * CONFIDENCE))
    half *= float(np.sqrt(units / (units - 1) * spread)) / x
    return Interval(ratio - half, ratio + half)


def compare_pairs(differences: ArrayLike) -> Comparison:
    """Test and interval of the mean of differences of runs with equal seeds (n,), n >= 1.

    By changing signs: all of them up to 12 pairs, else 4000 drawn ones, the same at every call. The
    interval holds the shifts that this test does not reject; below 6 pairs it is unbounded. Source:
    Fisher (1935), The design of experiments, section 21; Hartigan (1969), JASA 64.
    """
    d = np.asarray(differences, dtype=np.float64)
    if d.size == 0:
        raise ValueError("a paired comparison needs at least one pair")
    if d.size <= EXACT_PAIRS:
        signs = np.array(list(product((1.0, -1.0), repeat=d.size)))
    else:
        drawn = stream(0, "sign changes", d.size).integers(0, 2, (RESAMPLES - 1, d.size))
        signs = np.concatenate([np.ones((1, d.size)), 1.0 - 2.0 * drawn])
    sums, seen = signs @ d, d.sum()
    near = 1e-9 * max(1.0, float(np.abs(d).sum()))
    return Comparison(
        n=d.size,
        mean=float(d.mean()),
        interval=_unrejected(signs < 0.0, d),
        p_greater=float(np.mean(sums >= seen - near)),
        p_less=float(np.mean(sums <= seen + near)),
        spread=float(d.std(ddof=1)) if d.size > 1 else 0.0,
    )


def _unrejected(flipped: NDArray[np.bool_], d: Floats) -> Interval:
    """Shifts that the sign changes `flipped` (k, n) of d (n,) do not reject.

    A change outdoes the data after a shift just when the mean of what it flips lies below the
    shift, so the limits are ordered means of subsets; a change that flips nothing always counts.
    """
    size = flipped.sum(axis=1)
    means = np.divide(flipped @ d, size, out=np.full(size.shape, np.inf), where=size > 0)
    cut = int((1.0 - CONFIDENCE) / 2.0 * means.size + 1e-9)
    low = np.sort(np.where(size > 0, means, -np.inf))[cut]
    return Interval(float(low), float(np.sort(means)[-1 - cut]))


def pairs_needed(comparison: Comparison, smallest: float, power: float = 0.8) -> int | None:
    """Pairs until a mean difference like the one seen, at least `smallest`, would be found.

    By the normal approximation at 5 %, two-sided; None when the pairs do not vary or beyond 10 000.
    """
    z = stats.norm.ppf(1.0 - (1.0 - CONFIDENCE) / 2.0) + stats.norm.ppf(power)
    difference = max(abs(comparison.mean), smallest)
    if comparison.spread == 0.0 or difference == 0.0:
        return None
    needed = ceil((z * comparison.spread / difference) ** 2)
    return None if needed > 10_000 else max(needed, EVER_SIGNIFICANT)


def mcnemar(only_a: int, only_b: int) -> float:
    """Exact two-sided p of paired yes/no outcomes from the pairs that differ (completion, X-9).

    Source: McNemar (1947), Psychometrika 12.
    """
    if only_a + only_b == 0:
        return 1.0
    return float(stats.binomtest(only_a, only_a + only_b).pvalue)


def clopper_pearson(k: int, n: int, confidence: float = CONFIDENCE) -> Interval:
    """Exact limits of a share k of n. Source: Clopper and Pearson (1934), Biometrika 26."""
    require_range("successes", k, 0, n)
    if n == 0:
        return Interval(0.0, 1.0)
    limits = stats.binomtest(k, n).proportion_ci(confidence, method="exact")
    return Interval(float(limits.low), float(limits.high))


def median_time(times: ArrayLike, end: float) -> tuple[float, Interval]:
    """Median of times that were watched until `end`, and its exact 95 % interval; inf: beyond it.

    times (n,), n >= 1: inf or NaN where nothing happened. The limits are order statistics, so that
    no form of the distribution is assumed; too few times have the limits 0 and inf. Source: Thompson
    (1936), Ann. Math. Stat. 7, confidence ranges for the median.
    """
    t = np.asarray(times, dtype=np.float64)
    if t.size == 0:
        raise ValueError("a median needs at least one time")
    t = np.sort(np.where(t <= end, t, np.inf))
    middle = float(t[(t.size - 1) // 2]), float(t[t.size // 2])
    median = 0.5 * sum(middle) if np.isfinite(middle[1]) else middle[1]
    below = int(stats.binom.ppf((1.0 - CONFIDENCE) / 2.0, t.size, 0.5))
    if below == 0:
        return median, Interval(0.0, np.inf)
    return median, Interval(float(t[below - 1]), float(t[t.size - below]))


def seeds_for_verdict(claims: int, alpha: float = 0.05) -> int:
    """Least seeds with which a sign-change test can show any of so many claims, Holm-adjusted."""
    return floor(1.0 + log2(max(claims, 1) / alpha)) + 1


def holm(p_values: Sequence[float]) -> list[float]:
    """Adjusted p values of a family. Source: Holm (1979), Scandinavian Journal of Statistics 6."""
    p = np.asarray(p_values, dtype=np.float64)
    order = np.argsort(p, kind="stable")
    steps = (p.size - np.arange(p.size)) * p[order]
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return [float(v) for v in adjusted]


def interval_text(interval: Interval | None) -> str:
    """`95 % 0.1 to 1.46`, `95 % unbounded`, `too few for an interval`."""
    if interval is None:
        return "too few for an interval"
    if not np.isfinite(interval).any():
        return "95 % unbounded"
    return f"95 % {interval.low:.3g} to {interval.high:.3g}"


def share_text(share: float, interval: Interval | None) -> str:
    """`5.00 %, 95 % 0.1 to 14.6 %` of shares from 0 to 1."""
    if interval is None:
        return f"{100.0 * share:.2f} %, {interval_text(None)}"
    percent = Interval(100.0 * interval.low, 100.0 * interval.high)
    unit = " %" if np.isfinite(percent).any() else ""
    return f"{100.0 * share:.2f} %, {interval_text(percent)}{unit}"


def p_text(p: float) -> str:
    """`p = 0.25`, `p < 0.001`."""
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
