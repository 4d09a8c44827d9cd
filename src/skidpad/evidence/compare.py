"""Two campaigns, run by run: what changed, paired by driver, weather and seed."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import polars as pl

from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.told import told
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.statistics import Comparison, compare_pairs
from skidpad.recording.matrix import Metrics
from skidpad.recording.results import definitions_of

PAIRED_BY = ("config", "weather", "seed")
OPERATORS: dict[str, Callable[[float, float], bool]] = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
RULE = re.compile(r"^\s*(\w+)\s*(>=|<=|>|<)\s*([-+]?[0-9.]+(?:e[-+]?\d+)?)\s*$")


@dataclass(frozen=True, slots=True)
class Change:
    """How one column changed for one driver ("" is all drivers): second minus first campaign."""

    config: str
    column: str
    comparison: Comparison
    same: int  # pairs with equal logs


@dataclass(frozen=True, slots=True)
class Rule:
    """A regression: the mean difference of `column` compares so with `limit`."""

    text: str
    column: str
    compare: Callable[[float, float], bool]
    limit: float

    def broken_by(self, change: Change, surely: bool) -> bool:
        """Whether the change is a regression; `surely` asks the whole interval to be one."""
        c = change.comparison
        if not surely:
            return self.compare(c.mean, self.limit)
        return c.interval is not None and all(self.compare(v, self.limit) for v in c.interval)


class Flaw(str, Enum):
    """Why a gate cannot be trusted; each fails it unless it is allowed by name."""

    MISSING = "missing"  # a run of one campaign is not in the other
    CRASHED = "crashed"  # a run crashed, timed out, or its stack failed
    EMPTY = "empty"  # what a rule judges has no values in both


def flaws(a: pl.DataFrame, b: pl.DataFrame, rules: Sequence[Rule]) -> dict[Flaw, str]:
    """What is wrong with the data that the rules judge, each with a sentence."""
    found = {}
    by = list(PAIRED_BY)
    alone = [len(x.join(y, on=by, how="anti", nulls_equal=True)) for x, y in ((a, b), (b, a))]
    if any(alone):
        found[Flaw.MISSING] = f"without a partner: {alone[0]} runs of A, {alone[1]} of B"
    crashed = [int(t["outcome"].is_in(NOT_RUN).sum()) for t in (a, b)]
    if any(crashed):
        found[Flaw.CRASHED] = (
            f"crashed, timed out or failed: {crashed[0]} runs of A, {crashed[1]} of B"
        )
    empty = sorted({who for rule in rules for who in _empty(a, b, rule.column)})
    if empty:
        found[Flaw.EMPTY] = f"without values to compare: {', '.join(empty)}"
    return found


def _empty(a: pl.DataFrame, b: pl.DataFrame, column: str) -> list[str]:
    """Where a column cannot be judged: for all drivers, or for one that had values before."""
    pairs = _pairs(a, b)
    whole = pairs.drop_nulls([column, f"{column}_b"])
    if not len(whole):
        return [column]
    had = set(pairs.drop_nulls([column])["config"]) - set(whole["config"])
    return [f"{column} of configuration {config}" for config in had]


def _pairs(a: pl.DataFrame, b: pl.DataFrame) -> pl.DataFrame:
    """Runs of both that were driven to their end, side by side."""
    a, b = (t.filter(~pl.col("outcome").is_in(NOT_RUN)) for t in (a, b))
    return a.join(b, on=list(PAIRED_BY), suffix="_b")


def parse_rule(text: str) -> Rule:
    """`fatal_collisions > 0.1`: column, one of > >= < <=, number; about the mean difference."""
    return Rule(text, *parse_comparison("--fail-if", text, columns()))


def parse_comparison(
    option: str, text: str, known: list[str] | tuple[str, ...]
) -> tuple[str, Callable[[float, float], bool], float]:
    """A name among `known`, a comparison and a number; ConfigError says what `option` takes."""
    match = RULE.match(text)
    if not match:
        raise ConfigError(f"{option} takes COLUMN > NUMBER (or >=, <, <=), got {told(text, 200)}")
    column, sign, number = match.groups()
    require_choice("column", column, known)
    try:
        limit = float(number)
    except ValueError:
        raise ConfigError(
            f"{option}: {told(number, 100)} is no number, in {told(text, 200)}"
        ) from None
    return column, OPERATORS[sign], limit


def columns() -> list[str]:
    """The columns that can be compared."""
    return [name for name, _, _ in definitions_of(Metrics)]


def compare_campaigns(
    a: pl.DataFrame, b: pl.DataFrame, wanted: Sequence[str]
) -> tuple[list[Change], int, int]:
    """Changes per column, over all drivers and per driver; and the runs without a partner in each.

    ConfigError when no run of one is in the other; crashed ones are in it and are not compared.
    """
    if not len(a.join(b, on=list(PAIRED_BY))):
        raise ConfigError("the two campaigns share no run: same configuration, weather and seed")
    pairs = _pairs(a, b)
    a, b = (t.filter(~pl.col("outcome").is_in(NOT_RUN)) for t in (a, b))
    changes = []
    for config in ["", *sorted(pairs["config"].unique().to_list())]:
        runs = pairs if config == "" else pairs.filter(pl.col("config") == config)
        same = int((runs["log_hash"] == runs["log_hash_b"]).sum())
        for column in wanted:
            both = runs.drop_nulls([column, f"{column}_b"])
            if len(both):
                difference = (both[f"{column}_b"] - both[column]).cast(pl.Float64).to_numpy()
                changes.append(Change(config, column, compare_pairs(difference), same))
    return changes, len(a) - len(pairs), len(b) - len(pairs)
