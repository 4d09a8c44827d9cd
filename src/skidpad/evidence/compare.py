"""Two campaigns, run by run: what changed, paired by driver, weather and seed."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import polars as pl

from skidpad.core.errors import ConfigError, require_choice
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
        values = c.interval if surely else (c.mean,)
        return all(self.compare(v, self.limit) for v in values)


def parse_rule(text: str) -> Rule:
    """`fatal_collisions > 0.1`: column, one of > >= < <=, number; about the mean difference."""
    match = RULE.match(text)
    if not match:
        raise ConfigError(f"--fail-if takes COLUMN > NUMBER (or >=, <, <=), got {text!r}")
    column, sign, number = match.groups()
    require_choice("column", column, columns())
    return Rule(text, column, OPERATORS[sign], float(number))


def columns() -> list[str]:
    """The columns that can be compared."""
    return [name for name, _, _ in definitions_of(Metrics)]


def compare_campaigns(
    a: pl.DataFrame, b: pl.DataFrame, wanted: Sequence[str]
) -> tuple[list[Change], int, int]:
    """Changes per column, over all drivers and per driver; and the runs without a partner in each.

    ConfigError when no run of one has a partner in the other.
    """
    a, b = (t.filter(~pl.col("outcome").is_in(NOT_RUN)) for t in (a, b))
    pairs = a.join(b, on=list(PAIRED_BY), suffix="_b")
    if not len(pairs):
        raise ConfigError("the two campaigns share no run: same configuration, weather and seed")
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
