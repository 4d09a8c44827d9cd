"""How rare a failure is, by splitting: paths that came near it are copied, and their copies go on anew.

Adaptive multilevel splitting (Cerou and Guyader 2007) in the form for processes in discrete time, whose
estimate is unbiased for any number of paths and any level function (Brehier, Gazeau, Goudenege, Lelievre
and Rousset 2016, arXiv:1505.02674). In each round the half of the paths that stayed farthest from a
failure is given up. In place of each, another path is followed from where it first came nearer than all
of these, with draws of its own. What is split is behind `Process`, so closed forms test it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, log, sqrt
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy import stats

from skidpad.search.probability import CONFIDENCE, Estimate

METHOD = "splitting"
GIVEN_UP = 0.5  # share of the paths that a round replaces at least
ROUNDS_MAX = 60  # 0.5 to this power is given up as too rare


class Path(Protocol):
    """One course of a process from its beginning to its end."""

    @property
    def score(self) -> float:
        """Returns the least level that it reached; a failure has at most 0."""
        ...


P = TypeVar("P", bound=Path)


class Process(Protocol[P]):
    """What is split: it begins independent paths, and follows others anew from one of their moments."""

    def begin(self, number: int) -> P:
        """Returns a path of its own from the beginning."""
        ...

    def branch(self, path: P, below: float, name: str) -> P:
        """Returns a path that leaves `path` at its first level under `below`, by draws of this name."""
        ...


@dataclass(frozen=True, slots=True)
class Split(Generic[P]):
    """What one repetition came to.

    Attributes:
        p: unbiased estimate of the probability.
        levels: under which each round went on.
        failing: paths of the end that fail.
        ancestors: different first paths from which these stem.
        paths: that were followed in all.
    """

    p: float
    levels: tuple[float, ...]
    failing: tuple[P, ...]
    ancestors: int
    paths: int


def split_paths(
    process: Process[P], count: int, rng: np.random.Generator, floor: float = 0.0
) -> Split[P]:
    """Runs one repetition of splitting.

    Args:
        process: begins paths and lets them branch.
        count: paths side by side.
        rng: chooses which paths are followed.
        floor: level below which nothing branches any more; what lies below is counted.
    """
    paths = [process.begin(k) for k in range(count)]
    roots, followed, log_p = np.arange(count), count, 0.0
    levels: list[float] = []
    for turn in range(ROUNDS_MAX):
        scores = np.array([path.score for path in paths])
        bound = float(np.sort(scores)[-round(GIVEN_UP * count)])
        if bound <= floor:
            break
        kept, given_up = np.flatnonzero(scores < bound), np.flatnonzero(scores >= bound)
        if not len(kept):
            break
        levels.append(bound)
        log_p += log(len(kept) / count)
        parents = rng.choice(kept, len(given_up))
        for place, parent in zip(given_up, parents, strict=True):
            paths[place] = process.branch(paths[parent], bound, f"{turn}.{place}")
        roots[given_up] = roots[parents]
        followed += len(given_up)
    failing = [k for k, path in enumerate(paths) if path.score <= 0.0]
    return Split(
        p=exp(log_p) * len(failing) / count,
        levels=tuple(levels),
        failing=tuple(paths[k] for k in failing),
        ancestors=len(np.unique(roots[failing])),
        paths=followed,
    )


def splitting_estimate(found: Sequence[float], runs: int) -> Estimate:
    """Returns the mean of the repetitions' estimates with its interval.

    Estimates are about log-normal, and the interval is Cox's for the mean of such a distribution with
    Student's quantile (Olsson 2005). Where a repetition reached no failure, it is Student's of the
    logarithm of the mean; where none did, the estimate is 0 without an upper end. runs: of all.
    """
    n, p = len(found), float(np.mean(found))
    if p == 0.0:
        return Estimate(METHOD, 0.0, 0.0, inf, runs)
    if min(found) > 0.0:
        spread = float(np.var(np.log(found), ddof=1))
        middle = float(np.mean(np.log(found))) + 0.5 * spread
        error = sqrt(spread / n + spread**2 / (2.0 * (n - 1)))
    else:
        middle, error = log(p), float(np.std(found, ddof=1)) / sqrt(n) / p
    reach = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)) * error
    low, high = min(exp(middle - reach), p), max(exp(middle + reach), p)
    return Estimate(METHOD, p, low, min(high, 1.0), runs)
