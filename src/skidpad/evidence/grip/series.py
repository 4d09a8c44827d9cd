"""One representative series from many runs, and how sure its distance to another is (B-123, G-4)."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.randomness import stream
from skidpad.evidence.grip.warping import Cost, warping_distance
from skidpad.evidence.limits import CONFIDENCE
from skidpad.evidence.statistics import Interval

RESAMPLES = 200  # decision G-4
STRIDE = 4  # 20 Hz to 5 Hz, for resamples only (decision G-4)


def stack_runs(runs: list[Floats]) -> Floats:
    """Returns (n, T) from n series of their own lengths; NaN after the end of each."""
    out = np.full((len(runs), max((len(r) for r in runs), default=0)), np.nan)
    for row, run in zip(out, runs, strict=True):
        row[: len(run)] = run
    return out


def median_series(runs: Floats) -> Floats:
    """Returns the median per tick over the runs still alive, until fewer than half are (B-123).

    runs: (n, T), NaN after the end of a run. Returns (T',), T' <= T.
    """
    alive = np.count_nonzero(~np.isnan(runs), axis=0)
    enough = 2 * alive >= len(runs)
    end = int(np.argmin(enough)) if not enough.all() else runs.shape[1]
    order, tick = np.sort(runs[:, :end], axis=0), np.arange(end)  # what is absent comes last
    lower, upper = order[(alive[:end] - 1) // 2, tick], order[alive[:end] // 2, tick]
    median: Floats = 0.5 * (lower + upper)
    return median


def median_warping(a: Floats, b: Floats, cost: Cost = Cost.SQUARED) -> float:
    """Returns the warping distance between the medians of two sets of runs (n, T), (m, U) (B-108)."""
    return warping_distance(median_series(a), median_series(b), cost)


def warping_interval(a: Floats, b: Floats, cost: Cost = Cost.SQUARED) -> Interval:
    """Returns limits of `median_warping` over resampled runs, paired where both sets are equally many.

    Resamples run at 5 Hz; the squared cost grows with the number of ticks, so they are scaled back
    to full rate.
    """
    draw = stream(0, "warping", len(a), len(b))
    scale = np.sqrt(STRIDE) if cost is Cost.SQUARED else STRIDE
    slow_a, slow_b = a[:, ::STRIDE], b[:, ::STRIDE]
    distances = []
    for _ in range(RESAMPLES):
        pick_a = draw.integers(0, len(a), len(a))
        pick_b = pick_a if len(a) == len(b) else draw.integers(0, len(b), len(b))
        distances.append(scale * median_warping(slow_a[pick_a], slow_b[pick_b], cost))
    tail = 100.0 * (1.0 - CONFIDENCE) / 2.0
    low, high = np.percentile(distances, [tail, 100.0 - tail])
    return Interval(float(low), float(high))


def noise_floor(runs: Floats, cost: Cost = Cost.SQUARED) -> float | None:
    """Returns the distance between the medians of the two halves of runs under one condition.

    It is what chance alone gives (decision G-4). None below four runs.
    """
    if len(runs) < 4:
        return None
    return median_warping(runs[0::2], runs[1::2], cost)
