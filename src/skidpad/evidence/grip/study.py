"""What the runs of a friction campaign say: completion, distances between series, delays.

Everything compares original with reduced friction in one scenario and weather; runs with equal seeds
are pairs. Published quantities: B-104 to B-108, B-126, B-140 to B-149.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
import polars as pl
from dtaidistance import dtw

from skidpad.core.arrays import Floats
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import DT
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.limits import CONFIDENCE
from skidpad.evidence.statistics import (
    Comparison,
    Interval,
    clopper_pearson,
    compare_pairs,
    mcnemar,
    mean_limits,
)
from skidpad.recording.campaign.grip import COLUMNS

RESAMPLES = 200  # decision G-4
STRIDE = 4  # 20 Hz to 5 Hz, for resamples only (decision G-4)


# One representative series from many runs, and how sure its distance to another is (B-123, G-4).


# Dynamic time warping between two series of one quantity (B-107, decision G-4).


class Cost(str, Enum):
    """What one pair of values costs."""

    SQUARED = "squared"  # root of the sum of squared differences: what the published values show
    ABSOLUTE = "absolute"  # sum of absolute differences


INNER = {Cost.SQUARED: "squared euclidean", Cost.ABSOLUTE: "euclidean"}


def warping_distance(a: Floats, b: Floats, cost: Cost = Cost.SQUARED) -> float:
    """Returns the least cost of aligning a (n,) with b (m,) by steps (1,0), (0,1), (1,1); not normalised.

    ValueError for an empty series.
    """
    a, b = (np.ascontiguousarray(x, dtype=np.float64) for x in (a, b))
    if not (a.size and b.size):
        raise ValueError("warping needs at least one value in each series")
    # Pruning by the library's Euclidean bound loses alignments that equal the bound: it says inf.
    return float(dtw.distance_fast(a, b, inner_dist=INNER[cost], use_pruning=False))


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


ORIGINAL, REDUCED = "original", "reduced"
METRICS = ("x", "y", "v", "cvip", "steer", "brake", "throttle")  # B-107
SHIFT_MAX = 8.0  # s, longest delay that is looked for
SHIFT_STEP = 4  # samples: 5 Hz
CELL = ("scenario", "cutin", "weather")


@dataclass(frozen=True, slots=True)
class Share:
    """k of n runs, with exact limits."""

    k: int
    n: int

    @property
    def value(self) -> float | None:
        """Returns the share; None without runs."""
        return self.k / self.n if self.n else None

    @property
    def interval(self) -> Interval:
        """Returns the limits by Clopper and Pearson, 95 %."""
        return clopper_pearson(self.k, self.n)


@dataclass(frozen=True, slots=True)
class Pair:
    """One scenario in one weather, with both frictions."""

    scenario: str
    cutin: str
    weather: str
    original: pl.DataFrame  # finished runs, sorted by seed
    reduced: pl.DataFrame

    def side(self, friction: str) -> pl.DataFrame:
        """Returns the runs with one setting of friction."""
        return self.original if friction == ORIGINAL else self.reduced

    @property
    def common(self) -> pl.DataFrame:
        """Returns both sides joined by seed; columns of the reduced one end in `_reduced`."""
        return self.original.join(self.reduced, on="seed", suffix="_reduced").sort("seed")

    @property
    def identical(self) -> bool:
        """Returns whether every pair is the same drive; False without a pair."""
        both = self.common
        return len(both) > 0 and bool((both["log_hash"] == both["log_hash_reduced"]).all())


def pairs(results: pl.DataFrame) -> list[Pair]:
    """Returns all cells of a campaign, sorted, without the runs that crashed or failed."""
    finished = results.filter(~pl.col("outcome").is_in(NOT_RUN)).sort(*CELL, "seed")
    found = []
    for (scenario, cutin, weather), rows in finished.group_by(CELL, maintain_order=True):
        sides = (rows.filter(pl.col("friction") == f) for f in (ORIGINAL, REDUCED))
        found.append(Pair(str(scenario), str(cutin), str(weather), *sides))
    return found


def completion(runs: pl.DataFrame, given_triggered: bool = False) -> Share:
    """Returns the runs without an accident, of all or of those whose scenario happened (G-2).

    A run that ended in a collision counts as triggered: the accident is what the scenario is about.
    """
    if given_triggered:
        runs = runs.filter(pl.col("triggered") | ~pl.col("completion"))
    return Share(int(runs["completion"].sum()), len(runs))


def completion_p(pair: Pair) -> float:
    """Returns the p value of completion over pairs of equal seed, by McNemar's exact test."""
    both = pair.common
    worse = int((both["completion"] & ~both["completion_reduced"]).sum())
    better = int((~both["completion"] & both["completion_reduced"]).sum())
    return mcnemar(worse, better)


def changed_outcome(pair: Pair) -> Share:
    """Returns the pairs of which one ended in a collision and the other did not (B-143)."""
    both = pair.common
    return Share(int((both["completion"] != both["completion_reduced"]).sum()), len(both))


def mean_interval(values: pl.Series) -> tuple[float, Interval | None] | None:
    """Returns the mean over runs with its limits, None where they are too few; None without a value."""
    known = values.drop_nulls().to_numpy()
    if not known.size:
        return None
    return float(known.mean()), mean_limits(known)


def compare_pair(pair: Pair, column: str) -> Comparison | None:
    """Returns reduced minus original, paired by seed; None without a pair that has both."""
    both = pair.common.drop_nulls([column, f"{column}_reduced"])
    difference = both[f"{column}_reduced"].cast(pl.Float64) - both[column].cast(pl.Float64)
    return compare_pairs(difference.to_numpy()) if len(both) else None


@dataclass(frozen=True)
class CellSeries:
    """The recorded series of one cell: per quantity (n, T), NaN after the end of a run."""

    values: dict[str, Floats]

    def median(self, metric: str) -> Floats:
        """Returns the representative series of a metric (B-123)."""
        return median_series(self.values[metric])


def cell_series(runs: pl.DataFrame, read: Callable[[int], pl.DataFrame]) -> CellSeries:
    """Returns the series of these runs; `read` gives the table of a seed."""
    tables = [read(seed).to_numpy().astype(np.float64) for seed in runs["seed"].to_list()]
    return CellSeries(
        {name: stack_runs([t[:, k] for t in tables]) for k, name in enumerate(COLUMNS)}
    )


@dataclass(frozen=True, slots=True)
class Distance:
    """How far the series with reduced friction lie from those with original friction."""

    metric: str
    value: float
    interval: Interval | None
    floor: float | None  # what chance alone gives


def distances(
    original: CellSeries, reduced: CellSeries, identical: bool, resample: bool = True
) -> Iterator[Distance]:
    """Yields the distance of every metric (B-107, B-108, G-4); identical drives need no resampling."""
    for metric in METRICS:
        a, b = original.values[metric], reduced.values[metric]
        if identical:
            yield Distance(metric, 0.0, Interval(0.0, 0.0), noise_floor(a))
            continue
        limits = warping_interval(a, b) if resample and len(a) > 1 and len(b) > 1 else None
        yield Distance(metric, median_warping(a, b), limits, noise_floor(a))


def delays(original: CellSeries, reduced: CellSeries) -> Floats:
    """Returns (n,) s by which each run with reduced friction is late against its pair (B-142).

    By the best constant shift of its speed series; NaN where no shift halves the difference.
    """
    both = zip(original.values["v"], reduced.values["v"], strict=False)
    return np.array([_delay(a, b) for a, b in both])


def _delay(a: Floats, b: Floats) -> float:
    """Returns by how many s `b` lags `a`; nan if too short or where no shift halves the error."""
    a, b = a[~np.isnan(a)][::SHIFT_STEP], b[~np.isnan(b)][::SHIFT_STEP]
    reach = round(SHIFT_MAX / (DT * SHIFT_STEP))
    n = min(len(a), len(b))
    if n < 2 * reach:
        return float("nan")
    a, b = a[:n], b[:n]
    costs = []
    for shift in range(-reach, reach + 1):
        late, early = (b[shift:], a[: n - shift]) if shift >= 0 else (b[: n + shift], a[-shift:])
        costs.append(float(np.mean((late - early) ** 2)))
    best = int(np.argmin(costs))
    explained = costs[best] <= 0.5 * costs[reach]
    return (best - reach) * DT * SHIFT_STEP if explained else float("nan")
