"""Claims that a rate of events lies below a limit."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import polars as pl
from scipy import stats

from skidpad.evidence.contrasts import Amount, Contrast, Criterion, distinct, has_columns
from skidpad.evidence.statistics import Interval, Rate, event_rate
from skidpad.evidence.statistics_text import NO_LIMITS, runs_with_text

RUNS_WITHOUT_EVENT = 3.7  # / limit: runs without an event that bound a rate, -ln(0.025)


@dataclass(frozen=True, slots=True, kw_only=True)
class RateBelow(Criterion):
    """Events per run, or hour, are fewer than the limit."""

    what: str  # the events
    events: pl.Expr  # their number, in total
    limit: Amount
    exposure: pl.Expr = pl.len()  # runs or hours, in total
    where: pl.Expr | None = None
    given: pl.Expr | None = None  # a total that must be positive, or there is nothing to say

    @property
    def test(self) -> tuple[str, ...]:
        """Returns the name of the exact test."""
        return (f"exact Poisson against {self.limit}",)

    @property
    def amounts(self) -> tuple[Amount, ...]:
        """Returns no amount: the limit is the claim."""
        return ()

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns the contrast of sums over the rows; None without the columns, a row, or what is `given`."""
        given = pl.lit(1) if self.given is None else self.given
        where = pl.lit(True) if self.where is None else self.where
        if not has_columns(table, self.events, self.exposure, given, where):
            return None
        rows = distinct(table.filter(where))
        events, exposure, known = rows.select(e=self.events, x=self.exposure, g=given).row(0)
        if not len(rows) or not known:
            return None
        label = f"{self.limit} minus {self.what}"
        return rate_below(label, int(events), exposure, self.limit.value, self._rate(rows))

    def _rate(self, rows: pl.DataFrame) -> Rate | None:
        """Returns the rate over seeds; None where rows have no seeds."""
        if "seed" not in rows.columns:
            return None
        seeds = rows.group_by("seed").agg(e=self.events, x=self.exposure).filter(pl.col("x") > 0)
        return event_rate(seeds["e"].to_list(), seeds["x"].cast(pl.Float64).to_list())


def rate_below(
    label: str, events: int, runs: float, limit: float, rate: Rate | None = None
) -> Contrast:
    """Returns the claim that a rate per run, or hour, lies below `limit`, by exact Poisson tests.

    These take events as single ones. The limits are those of `rate`, over seeds, which may clump.
    """
    found = rate.interval if rate else None
    return Contrast(
        label=label,
        mean=limit - events / runs,
        interval=found and Interval(limit - found.high, limit - found.low),
        p_claimed=float(stats.poisson.cdf(events, limit * runs)),
        p_against=float(stats.poisson.sf(events - 1, limit * runs)),
        margin=0.0,
        units=max(1, round(runs)),
        units_needed=ceil(RUNS_WITHOUT_EVENT / limit),
        without_limits=runs_with_text(rate, "seed") if rate else NO_LIMITS,
    )
