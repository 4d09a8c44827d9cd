"""Contrasts: differences that a claim says are positive, drawn from results by rows of data.

A criterion names columns, rows and an amount; its label, its test and its margin are written from
them. One whose columns or runs are not in the results cannot be drawn.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from typing import Any, ClassVar, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import ArrayLike

from skidpad.core.text.wording import list_text
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.statistics import Interval, compare_pairs, pairs_needed
from skidpad.evidence.statistics_text import no_limits_text
from skidpad.recording.campaign.quantities import heading_of

NOT_RUN = frozenset(  # leave every denominator (L-7)
    {Outcome.AGENT_ERROR.value, Outcome.CRASHED.value, Outcome.TIMEOUT.value}
)
DRIVES_APART = ("config", "variant", "controller", "friction", "seed")  # not of the same run
SIGNS = "sign changes of the means per seed, exact up to 12"
SEGMENTS = "sign changes, exact up to 12"


@dataclass(frozen=True, slots=True)
class Contrast:
    """A difference that the claim says is positive."""

    label: str
    mean: float
    interval: Interval | None
    p_claimed: float  # of this or more if the difference were <= 0
    p_against: float  # of this or less if it were >= the margin
    margin: float  # a smaller difference does not matter
    units: int  # seeds or runs behind it
    units_needed: int | None  # None: cannot be said
    identical: bool = False  # all pairs are the same drive
    without_limits: str = ""  # what stands where there is no interval
    words: str = ""  # what stands in place of a number that is no estimate

    @property
    def small(self) -> bool:
        """Returns whether what was found lies below the margin."""
        return self.mean < self.margin


@dataclass(frozen=True, slots=True)
class Amount:
    """A margin or a bound, with its unit for reading."""

    value: float
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}".rstrip()


class Rows(NamedTuple):
    """Rows of a table, by name."""

    name: str
    are: pl.Expr


def rows_of(column: str, *values: str, name: str = "") -> Rows:
    """Returns the rows whose `column` has one of `values`, named by them or by `name`."""
    return Rows(name or ", ".join(values), pl.col(column).is_in(values))


class Criterion(ABC):
    """What a finding asks of results."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    @abstractmethod
    def test(self) -> tuple[str, ...]:
        """Returns how it is tested, in phrases."""

    @property
    def amounts(self) -> tuple[Amount, ...]:
        """Returns the margins and bounds by which it is judged: the amounts among its fields."""
        values = (getattr(self, field.name) for field in fields(self))
        return tuple(v for v in values if isinstance(v, Amount))

    @abstractmethod
    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns the contrast; None when its columns or rows are not in `table`."""


class Claim(Enum):
    """What a pair of runs is said to show about a column; d is the difference of its sides."""

    MORE = "d"
    HARDLY_MORE = "amount - d"
    EQUAL = "amount - |d|"
    OFTEN_OTHER = "(d != 0) - amount"


@dataclass(frozen=True, slots=True, kw_only=True)
class Paired(Criterion):
    """A claim about `column` on one side and on the other of runs that agree in `by`."""

    column: str
    more: Rows
    less: Rows
    by: tuple[str, ...]
    amount: Amount  # of MORE the margin, of all others the bound
    claim: Claim = Claim.MORE
    where: Rows | None = None

    @property
    def test(self) -> tuple[str, ...]:
        """Returns the phrases for sign changes of paired differences."""
        return (f"paired by {list_text(self.by)}", SIGNS)

    @property
    def label(self) -> str:
        """Returns what is positive if the claim is true, in words."""
        within = f" in {self.where.name}" if self.where and self.where.name else ""
        sides = f"{heading_of(self.column)}{within}, {self.more.name} minus {self.less.name}"
        return {
            Claim.MORE: sides,
            Claim.HARDLY_MORE: f"{self.amount} minus the difference of {sides}",
            Claim.EQUAL: f"{self.amount} minus the change of {sides}",
            Claim.OFTEN_OTHER: f"share of pairs with another {sides}, beyond {self.amount}",
        }[self.claim]

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns the contrast of the differences of pairs; None without the columns or a pair."""
        needed = (pl.col(self.column), self.more.are, self.less.are)
        if not has_columns(table, *needed, *([self.where.are] if self.where else [])):
            return None
        rows = table.filter(self.where.are) if self.where else table
        pairs, same = paired_runs(rows, self.more.are, self.less.are, self.by, self.column)
        if not len(pairs):
            return None
        d, bound = pl.col("difference"), self.amount.value
        shown = {
            Claim.MORE: d,
            Claim.HARDLY_MORE: bound - d,
            Claim.EQUAL: bound - d.abs(),
            Claim.OFTEN_OTHER: (d != 0.0).cast(pl.Float64) - bound,
        }[self.claim]
        margin = bound if self.claim is Claim.MORE else 0.0
        return contrast_pairs(self.label, per_seed(pairs, shown), margin, same)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outweighs(Criterion):
    """The effect of one factor on `column` is larger than that of the other, whatever its sign."""

    column: str
    factor: str  # a column; its greatest against its least value
    other: str
    by: tuple[str, ...]
    margin: Amount

    @property
    def test(self) -> tuple[str, ...]:
        """Returns the phrases for sign changes of paired differences."""
        return (f"paired by {list_text(self.by)}", SIGNS)

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns the contrast of the differences of two effects per pair.

        None without the columns, without a pair, or with other numbers of pairs for the two factors.
        """
        if not {self.column, self.factor, self.other} <= set(table.columns):
            return None
        first, second = (
            per_seed(
                paired_runs(table, highest(f).are, lowest(f).are, self.by, self.column)[0],
                pl.col("difference"),
            )
            for f in (self.factor, self.other)
        )
        if not len(first) or len(first) != len(second):
            return None
        label = f"{heading_of(self.column)}, effect of {self.factor} minus effect of {self.other}"
        return contrast_pairs(label, first - second.abs(), self.margin.value)


def highest(column: str) -> Rows:
    """Returns the rows in which a factor has its greatest value."""
    return Rows(f"highest {column}", pl.col(column) == pl.col(column).max())


def lowest(column: str) -> Rows:
    """Returns the rows in which a factor has its least value."""
    return Rows(f"lowest {column}", pl.col(column) == pl.col(column).min())


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean(Criterion):
    """The mean of `value` over rows is positive; rows without a value count not."""

    label: str
    value: pl.Expr
    margin: Amount = Amount(0.0)
    where: pl.Expr | None = None
    by: tuple[str, ...] = ()  # the order of rows
    over: str = "runs"  # what a row is

    @property
    def test(self) -> tuple[str, ...]:
        """Returns the phrases for sign changes."""
        return (f"means over {self.over}", SIGNS if "seed" in self.by else SEGMENTS)

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns the contrast of the values of all rows; sums within `value` are over the whole table.

        None without the columns or a row with a value. Equal drives count once.
        """
        where = pl.lit(True) if self.where is None else self.where
        if not has_columns(table, self.value, where):
            return None
        table = distinct(table)
        rows = table.sort([c for c in self.by if c in table.columns]) if self.by else table
        rows = rows.with_columns(shown=self.value.cast(pl.Float64), counts=where)
        rows = rows.filter("counts").drop_nulls("shown")
        values = per_seed(rows, pl.col("shown")) if "seed" in self.by else rows["shown"]
        return contrast_pairs(self.label, values, self.margin.value) if len(values) else None


@dataclass(frozen=True, slots=True)
class Never(Criterion):
    """A deterministic claim: one case that breaks it contradicts, none shows it."""

    cases: str  # what is counted
    count: Callable[[pl.DataFrame], tuple[int, int]]  # cases that break it, and all

    @property
    def test(self) -> tuple[str, ...]:
        """Returns the phrase for counting."""
        return (f"counting {self.cases}; one contradicts",)

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        """Returns a contrast that is certain either way, so its p values are 0 and 1; None without a case."""
        broken, judged = self.count(table)
        if not judged:
            return None
        value = 0.5 - broken
        p_claimed, p_against = (1.0, 0.0) if broken else (0.0, 1.0)
        label = f"0.5 minus the number of {self.cases}"
        sure = Interval(value, value)
        words = f"{self.cases}: {broken} of {judged}; one is enough"
        return Contrast(label, value, sure, p_claimed, p_against, 0.0, judged, judged, words=words)


def drop_unfinished(table: pl.DataFrame) -> pl.DataFrame:
    """Returns the table without the runs that leave every denominator (L-7): crashed, timed out, failed."""
    return table.filter(~pl.col("outcome").is_in(NOT_RUN)) if "outcome" in table.columns else table


def distinct(table: pl.DataFrame) -> pl.DataFrame:
    """Returns each drive once: what moved alike with one driver and seed is one drive in any weather (T-3).

    The first row stays; all rows stay where a hash is missing.
    """
    table = table.with_columns(drive=drive_hash(table))
    if not table["drive"].has_nulls():
        apart = [c for c in DRIVES_APART if c in table.columns]
        table = table.unique([*apart, "drive"], keep="first", maintain_order=True)
    return table.drop("drive")


def drive_hash(table: pl.DataFrame) -> pl.Expr:
    """Returns what tells drives apart: the hash of the motion, in older results that of the whole log."""
    known = [pl.col(c) for c in ("motion_hash", "log_hash") if c in table.columns]
    return pl.coalesce(known) if known else pl.lit(None, pl.String)


def per_seed(rows: pl.DataFrame, value: pl.Expr) -> pl.Series:
    """Returns the mean of `value` per seed, by rising seed; of each row where there is no column `seed`.

    What shares a seed is not independent, so seeds are the units.
    """
    rows = rows.with_columns(shown=value)
    if "seed" not in rows.columns:
        return rows["shown"]
    return (
        rows.group_by("seed", maintain_order=True).agg(pl.col("shown").mean()).sort("seed")["shown"]
    )


def paired_runs(
    table: pl.DataFrame, more: pl.Expr, less: pl.Expr, by: Sequence[str], column: str
) -> tuple[pl.DataFrame, bool]:
    """Returns `difference` of `column` between the rows of `more` and of `less` that agree in `by`.

    Several rows of one side that agree are averaged, and of one seed the same two drives are one
    pair, in how many weathers ever they were driven. Also whether all pairs are equal drives.
    """
    keys = [k for k in by if k in table.columns]
    hashes = drive_hash(table)
    known = not table.select(hashes.has_nulls()).item()
    wanted = [
        pl.col(column).cast(pl.Float64).mean().alias("value"),
        hashes.unique().sort().alias("hashes"),
    ]
    sides = [
        table.filter(side).group_by(keys, maintain_order=True).agg(wanted) for side in (more, less)
    ]
    both = sides[0].join(sides[1], on=keys, suffix="_less").drop_nulls(["value", "value_less"])
    both = both.sort(keys)
    same = known and len(both) > 0 and bool((both["hashes"] == both["hashes_less"]).all())
    same = same and bool((both["value"] == both["value_less"]).all())
    if known and "seed" in keys:
        once = ["seed", "hashes", "hashes_less"]
        both = both.unique(once, keep="first", maintain_order=True)
    return both.with_columns(difference=pl.col("value") - pl.col("value_less")), same


def contrast_pairs(
    label: str, values: ArrayLike, margin: float, identical: bool = False
) -> Contrast:
    """Returns a contrast from values that are claimed positive: differences of runs that share a seed."""
    c = compare_pairs(values)
    below = compare_pairs(np.asarray(values, dtype=np.float64) - margin) if margin else c
    return Contrast(
        label=label,
        mean=c.mean,
        interval=c.interval,
        p_claimed=c.p_greater,
        p_against=below.p_less,
        margin=margin,
        units=c.n,
        units_needed=pairs_needed(c, margin),
        identical=identical,
        without_limits=no_limits_text(c.n, "unit"),
    )


def has_columns(table: pl.DataFrame, *needed: pl.Expr) -> bool:
    """Returns whether all columns that expressions read are in the table."""
    return {name for e in needed for name in e.meta.root_names()} <= set(table.columns)
