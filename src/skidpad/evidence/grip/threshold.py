"""At which friction following a braking lead ends in an accident, from the runs of a threshold map.

Every seed is one drive, repeated on less and less friction. Its critical friction lies between the
highest level on which it ended in an accident and the next higher one; half of the seeds have had
theirs at the median, whose interval by order statistics assumes no form of the curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.grip.findings import FINDINGS, LEAD
from skidpad.evidence.grip.study import ORIGINAL, REDUCED, Share, completion
from skidpad.evidence.statistics import Interval, median_time
from skidpad.evidence.verdicts import Judgement, judge

SITUATION = ("driver", "actors", "start", "deceleration")
BASELINE_MIN = 0.95  # share completed on dry road, below which a situation says nothing of friction
JUDGED = ("BF-01", "BF-02", "BF-03", "BF-10")  # what a lead slowdown alone can judge


@dataclass(frozen=True, slots=True)
class Threshold:
    """The friction at which half of the seeds have had an accident, coming from dry road."""

    mu: float | None  # None: fewer than half of them ever had one
    interval: Interval  # 0 where even the least driven level does not bound it
    least: float  # the least level that was driven

    @property
    def text(self) -> str:
        """Returns text such as `0.21 (95 % 0.18 to 0.24)` or `below 0.1`."""
        if self.mu is None:
            return f"below {self.least:.2g}"
        low, high = self.interval
        return f"{self.mu:.2g} (95 % {low:.2g} to {high:.2g})"


@dataclass(frozen=True)
class Situation:
    """One driver behind one lead, on all levels of friction."""

    driver: str
    actors: str
    start: str
    deceleration: float
    speed_kmh: float
    gap_m: float
    runs: pl.DataFrame  # finished ones

    @cached_property
    def levels(self) -> list[float]:
        """Returns the levels of friction, the dry road first."""
        found: list[float] = self.runs["road_mu"].unique().sort(descending=True).to_list()
        return found

    def at(self, mu: float) -> Share:
        """Returns the runs without an accident at a level of friction."""
        return completion(self.runs.filter(pl.col("road_mu") == mu))

    @property
    def baseline(self) -> Share:
        """Returns the runs without an accident on dry road."""
        return self.at(self.levels[0])

    @property
    def tells(self) -> bool:
        """Returns whether it is completed on dry road, so that what happens on less friction is due to that.

        BASELINE_MIN of its runs must be.
        """
        return (self.baseline.value or 0.0) >= BASELINE_MIN

    @cached_property
    def outcomes(self) -> NDArray[np.bool_]:
        """Returns (seeds, levels) whether a seed's drive was completed, of seeds that finished everywhere."""
        table = self.runs.sort("road_mu", "seed", descending=[True, False])
        wide = table.pivot(on="road_mu", index="seed", values="completion", maintain_order=True)
        return wide.sort("seed").drop_nulls().drop("seed").to_numpy().astype(np.bool_)

    @cached_property
    def threshold(self) -> Threshold:
        """Returns the friction at which completion falls to a half."""
        return threshold(self.outcomes, self.levels)

    @property
    def recovered_share(self) -> Share:
        """Returns the share of drives below their seed's critical friction that were completed again."""
        failed = np.logical_not(self.outcomes)
        below = np.cumsum(failed, axis=1) - failed > 0
        return Share(int(np.sum(below & ~failed)), int(np.sum(below)))

    @cached_property
    def judgements(self) -> list[Judgement]:
        """Returns the study's claims on a lead that slows down, Holm-adjusted within this situation."""
        wanted = [f for f in FINDINGS if f.id in JUDGED]
        table = as_studied(self.runs)
        return judge(wanted, [table] * len(wanted))


def situations(results: pl.DataFrame) -> list[Situation]:
    """Returns all situations of a map, in the order of the table."""
    finished = results.filter(~pl.col("outcome").is_in(NOT_RUN))
    order = ("driver", "actors", "speed_kmh", "gap_m", "deceleration")
    found = []
    for key, runs in finished.sort(*order, "road_mu", "seed").group_by(
        SITUATION, maintain_order=True
    ):
        driver, actors, start, braking = key
        speed, gap = runs.select("speed_kmh", "gap_m").row(0)
        found.append(
            Situation(str(driver), str(actors), str(start), float(braking), speed, gap, runs)
        )
    return found


def threshold(completed: NDArray[np.bool_], levels: Sequence[float]) -> Threshold:
    """Returns the median critical friction of seeds.

    completed: (seeds, levels), levels falling from dry. The limits are widened by the distance of
    levels, between which nothing was driven.
    """
    dry, least = levels[0], levels[-1]
    if not len(completed):
        return Threshold(None, Interval(0.0, dry), least)
    first = np.where(np.any(~completed, axis=1), np.argmin(completed, axis=1), len(levels))
    mu = np.asarray(levels, dtype=np.float64)
    under = np.append(mu, -inf)[first]  # the accident happened here ...
    over = np.append(mu[0], mu)[first]  # ... and not yet here
    middle, late = median_time(dry - under, dry - least)
    above, early = median_time(dry - over, dry - least)
    low = dry - late.high if late and isfinite(late.high) else 0.0
    interval = Interval(low, dry - early.low if early else dry)
    if not isfinite(middle):
        return Threshold(None, interval, least)
    return Threshold(dry - 0.5 * (middle + above), interval, least)


def as_studied(runs: pl.DataFrame) -> pl.DataFrame:
    """Returns the runs with columns as the study's findings read them: levels as weathers.

    The dry road stands for original friction in every weather; levels without a preset are left out.
    """
    known = runs.filter(pl.col("preset") != "")
    named = known.with_columns(
        scenario=pl.lit(LEAD), weather="preset", cutin=pl.lit("fixed"), friction=pl.lit(REDUCED)
    )
    dry = named.filter(pl.col("road_mu") == pl.col("road_mu").max())
    weathers = named["weather"].unique(maintain_order=True).to_list()
    same = [dry.with_columns(weather=pl.lit(w), friction=pl.lit(ORIGINAL)) for w in weathers]
    return pl.concat([named, *same])
