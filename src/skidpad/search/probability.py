"""How rare a failure is: subset simulation, importance sampling and plain counting.

All methods see independent standard normal coordinates z (n, d) and a limit, the margin of a run: a
failure has a margin of at most 0. They know nothing of driving, so closed forms test them.

- Subset simulation (Au and Beck 2001; algorithm as in Zuev, arXiv:1505.03506): the failure as the last
  of nested events, each with a probability of 0.1 given the one before, sampled by the modified
  Metropolis algorithm. Several independent repetitions say how uncertain the result is.
- Importance sampling: from a mixture of normals around the failures that all repetitions found, and one
  tenth from where nothing is changed, so that no weight is above ten. Its samples are independent.
- Counting: failures among independent draws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import exp, inf, log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.special import logsumexp

from skidpad.core.arrays import Floats

Limit = Callable[[Floats], Floats]  # z (n, d) to margins (n,)

SHARE = 0.1  # of the samples of a level that begin the next one (Zuev 2013: 0.1 to 0.3)
LEVELS_MAX = 12  # 0.1 to this power is given up as too rare
ACCEPTED = 0.44  # aimed share of accepted moves (Zuev et al. 2012: between 0.3 and 0.5)
STEPS = (0.2, 2.0)  # bounds of the half-width of a move
KERNEL = 0.8  # deviation of the mixture's normals: tested on closed forms
DEFENCE = 0.1  # share of the mixture that is the unchanged distribution
CENTRES_MAX = 2000  # of the mixture
BLOCK = 2000  # samples whose densities are computed at once
CONFIDENCE = 0.95
HALF_WIDTH = 0.5  # largest relative half-width of an estimate that determines something
WITHIN = (0.5, 2.0)  # where the interval of the ratio of two methods must lie


@dataclass(frozen=True, slots=True)
class Estimate:
    """A probability with its 95 % interval, by one method."""

    method: str
    p: float
    low: float
    high: float
    runs: int

    @property
    def half_width(self) -> float:
        """Returns the relative half-width, by which the upper end lies above p; inf where p is 0."""
        return self.high / self.p - 1.0 if self.p > 0.0 else inf


@dataclass(slots=True)
class Chains:
    """What one repetition of subset simulation went through."""

    log_p: float = 0.0  # natural logarithm of what was reached
    is_over: bool = False
    levels: list[float] = field(default_factory=list)  # margins that bound each event
    step: float = 1.0
    z: Floats = field(default_factory=lambda: np.empty((0, 0)))
    margins: Floats = field(default_factory=lambda: np.empty(0))
    ancestors: int = 0  # different first samples from which the last level stems
    roots: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))


@dataclass(frozen=True, slots=True)
class Exploration:
    """All repetitions of subset simulation.

    Attributes:
        chains: one per repetition.
        first: (repetitions * n,) margins of the first level, which are independent draws.
        runs: how often the limit was asked.
    """

    chains: tuple[Chains, ...]
    first: Floats
    runs: int

    @property
    def failing(self) -> Floats:
        """Returns (n, d) failures of the last levels of all repetitions."""
        return np.concatenate([c.z[c.margins <= 0.0] for c in self.chains])


def explore(
    limit: Limit, dimensions: int, rng: np.random.Generator, repetitions: int, per_level: int
) -> Exploration:
    """Run repetitions of subset simulation side by side, so that a limit is asked for many at once.

    Args:
        limit: the margin of each sample.
        dimensions: of z.
        rng: the source of all draws.
        repetitions: independent ones, 2 or more for an interval.
        per_level: samples of a level; a tenth of them begins the chains of the next one.
    """
    z = rng.standard_normal((repetitions, per_level, dimensions))
    margins = limit(z.reshape(-1, dimensions)).reshape(repetitions, per_level)
    every = [
        Chains(z=z[r], margins=margins[r], roots=np.arange(per_level)) for r in range(repetitions)
    ]
    runs = z.shape[0] * z.shape[1]
    keep = round(SHARE * per_level)
    for _ in range(LEVELS_MAX):
        going = [c for c in every if not _conclude(c, keep)]
        if not going:
            break
        runs += _descend(limit, going, rng, keep, round(1.0 / SHARE))
    for chains in every:
        chains.ancestors = len(np.unique(chains.roots[chains.margins <= 0.0]))
    return Exploration(tuple(every), margins.reshape(-1), runs)


def _conclude(chains: Chains, keep: int) -> bool:
    """Ends a repetition whose level holds enough failures and returns True; else notes the next bound."""
    if chains.is_over:
        return True
    bound = float(np.sort(chains.margins, kind="stable")[keep - 1])
    if bound <= 0.0:
        chains.log_p += log(float(np.mean(chains.margins <= 0.0)))
        chains.is_over = True
        return True
    chains.levels.append(bound)
    chains.log_p += log(SHARE)
    return False


def _descend(
    limit: Limit, going: list[Chains], rng: np.random.Generator, keep: int, length: int
) -> int:
    """Replaces each repetition's samples by those of the next event; returns the number of runs.

    They come from chains of `length` that begin at its `keep` best samples.
    """
    best = [np.argsort(c.margins, kind="stable")[:keep] for c in going]
    at = np.stack([c.z[b] for c, b in zip(going, best, strict=True)])
    margins = np.stack([c.margins[b] for c, b in zip(going, best, strict=True)])
    roots = [c.roots[b] for c, b in zip(going, best, strict=True)]
    bounds = np.array([c.levels[-1] for c in going])[:, None]
    steps = np.array([c.step for c in going])[:, None, None]
    kept_z, kept_margins = [at], [margins]
    accepted = np.zeros(len(going))
    for _ in range(length - 1):
        moved = at + steps * rng.uniform(-1.0, 1.0, at.shape)
        likely = rng.random(at.shape) < np.exp(0.5 * (at**2 - moved**2))
        moved = np.where(likely, moved, at)
        found = limit(moved.reshape(-1, at.shape[2])).reshape(margins.shape)
        inside = found <= bounds
        accepted += inside.mean(axis=1)
        at = np.where(inside[:, :, None], moved, at)
        margins = np.where(inside, found, margins)
        kept_z.append(at)
        kept_margins.append(margins)
    for k, chains in enumerate(going):
        chains.z = np.concatenate([z[k] for z in kept_z])
        chains.margins = np.concatenate([m[k] for m in kept_margins])
        chains.roots = np.tile(roots[k], length)
        share = accepted[k] / (length - 1)
        chains.step = float(np.clip(chains.step * exp(share - ACCEPTED), *STEPS))
    return (length - 1) * len(going) * keep


def subset_estimate(found: Exploration) -> Estimate:
    """Return the geometric mean of the repetitions with Student's interval of its logarithm.

    A repetition that reached no failure within LEVELS_MAX levels makes the estimate 0.
    """
    logs = np.array([c.log_p for c in found.chains])
    if not all(c.is_over for c in found.chains):
        return Estimate("subset simulation", 0.0, 0.0, inf, found.runs)
    n = len(logs)
    reach = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1) * logs.std(ddof=1) / sqrt(n)
    mean = logs.mean()
    return Estimate(
        "subset simulation", exp(mean), exp(mean - reach), min(exp(mean + reach), 1.0), found.runs
    )


def counting_estimate(margins: Floats) -> Estimate:
    """Return the share of failures among independent draws with its exact interval."""
    n, k = len(margins), int(np.sum(margins <= 0.0))
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = float(stats.beta.ppf(tail, k, n - k + 1)) if k else 0.0
    high = float(stats.beta.ppf(1.0 - tail, k + 1, n - k)) if k < n else 1.0
    return Estimate("counting", k / n, low, high, n)


@dataclass(frozen=True, slots=True)
class Weighted:
    """Independent samples of the mixture: where, how much each counts, and its margin."""

    z: Floats  # (n, d)
    weights: Floats  # (n,) density without change over that of the mixture
    margins: Floats  # (n,)

    @property
    def effective(self) -> float:
        """Returns how many failures of equal weight tell as much (Kish's effective sample size).

        0.0 without a failure.
        """
        w = self.weights[self.margins <= 0.0]
        return float(w.sum() ** 2 / (w**2).sum()) if len(w) else 0.0


def sample_mixture(limit: Limit, failing: Floats, rng: np.random.Generator, count: int) -> Weighted:
    """Draws from the mixture around failures, asks the limit and returns the weighted samples.

    Args:
        limit: the margin of each sample.
        failing: (n, d) failures that were found, n at least 1.
        rng: the source of all draws.
        count: samples.
    """
    centres = failing[rng.permutation(len(failing))[:CENTRES_MAX]]
    d = failing.shape[1]
    z = centres[rng.integers(len(centres), size=count)]
    z = z + KERNEL * rng.standard_normal((count, d))
    plain = rng.random(count) < DEFENCE
    z[plain] = rng.standard_normal((int(plain.sum()), d))
    weights = np.concatenate([_weights(part, centres) for part in _blocks(z)])
    return Weighted(z, weights, limit(z))


def _blocks(z: Floats) -> list[Floats]:
    """Returns the rows of z in blocks of at most BLOCK."""
    return [z[k : k + BLOCK] for k in range(0, len(z), BLOCK)]


def _weights(z: Floats, centres: Floats) -> Floats:
    """Returns (n,) density of the standard normal over that of the mixture, at most 1 / DEFENCE."""
    d = z.shape[1]
    plain = -0.5 * (z**2).sum(axis=1)
    apart = (z**2).sum(axis=1)[:, None] + (centres**2).sum(axis=1)[None, :] - 2.0 * z @ centres.T
    kernels = -0.5 * np.maximum(apart, 0.0) / KERNEL**2 - d * log(KERNEL)
    mixture = logsumexp(kernels, axis=1) - log(len(centres))
    both = np.logaddexp(log(1.0 - DEFENCE) + mixture, log(DEFENCE) + plain)
    return np.asarray(np.exp(plain - both))


def importance_estimate(samples: Weighted, runs_before: int = 0) -> Estimate:
    """Returns the weighted share of failures with the normal interval of its logarithm.

    0, with no upper end, where no sample fails. runs_before: of the exploration, which count as well.
    """
    terms = np.where(samples.margins <= 0.0, samples.weights, 0.0)
    p, n = float(terms.mean()), len(terms)
    if p == 0.0:
        return Estimate("importance sampling", 0.0, 0.0, inf, n + runs_before)
    reach = stats.norm.ppf(0.5 + 0.5 * CONFIDENCE) * terms.std(ddof=1) / sqrt(n) / p
    return Estimate(
        "importance sampling", p, p * exp(-reach), min(p * exp(reach), 1.0), n + runs_before
    )


@dataclass(frozen=True, slots=True)
class Agreement:
    """Whether two estimates determine a probability, and why not."""

    ratio: float
    low: float
    high: float
    why_not: str  # "" where they do

    @property
    def is_determined(self) -> bool:
        """Returns whether both are narrow enough and agree."""
        return not self.why_not


def compare_estimates(one: Estimate, other: Estimate) -> Agreement:
    """Return the ratio of two estimates with its 95 % interval, and whether they agree.

    They do when the interval contains 1 and lies within 0.5 to 2, each with a relative half-width of
    at most 50 %.
    """
    if one.p == 0.0 or other.p == 0.0:
        return Agreement(inf, 0.0, inf, "no failure was reached by one of the two methods")
    ratio = one.p / other.p
    spread = sqrt(log(one.high / one.p) ** 2 + log(other.high / other.p) ** 2)
    low, high = ratio * exp(-spread), ratio * exp(spread)
    for e in (one, other):
        if e.half_width > HALF_WIDTH:
            why = f"the half-width of {e.method} is {e.half_width:.0%}, above {HALF_WIDTH:.0%}"
            return Agreement(ratio, low, high, why)
    if not low <= 1.0 <= high:
        why = f"both differ: their ratio is {ratio:.2f} [{low:.2f}, {high:.2f}]"
        return Agreement(ratio, low, high, why)
    if low < WITHIN[0] or high > WITHIN[1]:
        why = f"their ratio is only known to lie within {low:.2f} and {high:.2f}"
        return Agreement(ratio, low, high, why)
    return Agreement(ratio, low, high, "")


def joint_interval(one: Estimate, other: Estimate) -> tuple[float, float]:
    """Return the interval that holds those of both methods: it misses only where both do."""
    return min(one.low, other.low), max(one.high, other.high)
