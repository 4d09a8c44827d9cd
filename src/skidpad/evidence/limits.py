"""Limits of counts and means from arrays, calibrated by simulation (docs/statistics.md, decision T-6).

`evidence.statistics` decides whether they are printed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri, stdtrit

from skidpad.core.arrays import Floats

CONFIDENCE = 0.95
DISPERSION_ERROR = 12.0  # widens an excess of variance seen in few runs with events
COUNT_TAIL = 0.015  # of each limit of a count
EVENTS_SPARED = 0.75  # less for the lower limit, which is given only from two runs with events on
SKEW_LONG = 3.5  # widens the limit on the side of the longer tail
SKEW_SHORT = 0.5  # widens the other one


def count_limits(
    totals: ArrayLike, with_events: ArrayLike, dispersions: ArrayLike, runs: int
) -> tuple[Floats, Floats]:
    """Returns limits of expected totals of events, at least two runs having one; arrays broadcast.

    Exact Poisson limits of T / phi clumps of phi events each. phi is the dispersion index, its excess
    over 1 widened by 12 / (runs with events), times Student's over the normal quantile. Source of the
    exact limits: Garwood (1936), Biometrika 28, 437-442; of scaling them by the dispersion: McCullagh
    and Nelder (1989), Generalized Linear Models, 2nd ed., section 6.2.3. Widening and tails are
    calibrated by simulation.
    """
    from scipy import stats

    t, k, d = (np.asarray(v, dtype=np.float64) for v in (totals, with_events, dispersions))
    tail = (1.0 - CONFIDENCE) / 2.0
    student = float(stdtrit(runs - 1, 1.0 - tail) / stats.norm.ppf(1.0 - tail))
    phi = student * (1.0 + np.maximum(d - 1.0, 0.0) * (1.0 + DISPERSION_ERROR / k))
    spared = np.maximum(2.0 * (t / phi - EVENTS_SPARED), 0.0)
    low = np.where(spared > 0.0, chdtri(np.maximum(spared, 1e-9), 1.0 - COUNT_TAIL), 0.0)
    return 0.5 * phi * low, 0.5 * phi * chdtri(2.0 * t / phi + 2.0, COUNT_TAIL)


def skew_limits(values: Floats) -> tuple[Floats, Floats]:
    """Returns limits of means over the last axis of values (..., n) that are not all alike.

    Student's limits, widened on the side of the longer tail by 3.5 g / sqrt(n) and on the other by
    0.5 g / sqrt(n), g the sample skewness. The order of the correction and its side follow Johnson
    (1978), JASA 73, 536-544, equation 2.5; the factors are calibrated by simulation.
    """
    n = values.shape[-1]
    off = values - values.mean(axis=-1, keepdims=True)
    below, above = mean_widths(n, (off**2).sum(axis=-1), (off**3).sum(axis=-1))
    return values.mean(axis=-1) - below, values.mean(axis=-1) + above


def mean_widths(n: int, squares: ArrayLike, cubes: ArrayLike) -> tuple[Floats, Floats]:
    """Returns how far the limits of a mean lie below and above it, from sums of powers of n deviations."""
    squares, cubes = np.asarray(squares), np.asarray(cubes)
    skew = cubes / n / (squares / n) ** 1.5 * np.sqrt(n - 1.0) / (n - 2.0)  # G1 / sqrt(n)
    half = stdtrit(n - 1, 0.5 + 0.5 * CONFIDENCE) * np.sqrt(squares / (n - 1) / n)
    up, down = np.maximum(skew, 0.0), np.maximum(-skew, 0.0)
    return (
        half * (1.0 + SKEW_LONG * down + SKEW_SHORT * up),
        half * (1.0 + SKEW_LONG * up + SKEW_SHORT * down),
    )
