"""What the runs of a friction campaign say: completion, distances between series, delays.

Everything compares original with reduced friction in one scenario and weather; runs with equal seeds
are pairs. Published quantities: B-104 to B-108, B-126, B-140 to B-149.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import polars as pl

from skidpad.core.arrays import Floats
from skidpad.core.setup import DT
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.grip.series import (
    median_series,
    median_warping,
    noise_floor,
    stack_runs,
    warping_interval,
)
from skidpad.evidence.statistics import (
    Comparison,
    Interval,
    clopper_pearson,
    compare_pairs,
    mcnemar,
    mean_limits,
)
from skidpad.recording.campaign.grip import COLUMNS

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
