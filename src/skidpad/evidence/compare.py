"""Two campaigns, seed by seed: what changed, and whether chance explains it (decision T-6).

The seed is the unit: runs of one seed share their traffic in all weathers, so their differences are
averaged first. A gate judges a family of hypotheses, one per rule and driver, by sign changes
(mid-p) and Holm.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import ceil, log2

import polars as pl

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.text.wording import count_text, list_text
from skidpad.evidence.comparisons import LIST_COLUMNS, Flaw, parse_comparison
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.statistics import (
    EVER_SIGNIFICANT,
    Comparison,
    compare_pairs,
    holm,
    sign_tests,
)
from skidpad.evidence.statistics_text import p_text
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.campaign.results import definitions_of

ALPHA = 0.05
PAIRED_BY = ("config", "weather", "seed")


@dataclass(frozen=True, slots=True)
class Change:
    """How one column changed for one driver ("" is all drivers): second minus first campaign."""

    config: str
    column: str
    comparison: Comparison  # over seeds
    differences: Floats  # (seeds,), means over weathers
    runs: int
    same: int  # of the runs: pairs with equal logs

    @property
    def subject(self) -> str:
        """Returns the group that is compared: `configuration 2` or `all configurations`."""
        return f"configuration {self.config}" if self.config else "all configurations"


@dataclass(frozen=True, slots=True)
class Rule:
    """A regression: the mean difference of `column` compares so with `limit`."""

    text: str
    column: str
    compare: Callable[[float, float], bool]
    limit: float

    def p(self, change: Change) -> float:
        """Returns the one-sided mid-p against "the mean difference is not beyond the limit"."""
        greater, less = sign_tests((change.differences - self.limit)[None, :], mid=True)
        return float((greater if self.compare in (operator.gt, operator.ge) else less)[0])


class Answer(str, Enum):
    """What a gate says of one rule and driver."""

    FIRED = "regression"
    PASSED = "passed"
    UNDECIDED = "undecided"  # no outcome with so few seeds could fire


@dataclass(frozen=True, slots=True)
class RuleJudgement:
    """A rule, judged for one driver."""

    rule: Rule
    change: Change
    answer: Answer
    p: float | None  # adjusted; None: by the point estimate, or undecided
    seeds_needed: int

    @property
    def text(self) -> str:
        """Returns the comparison as one fragment of a sentence."""
        c = self.change
        told = f"{c.subject}, {c.comparison.mean:+.3g}"
        if self.answer is Answer.UNDECIDED:
            seeds = count_text(c.comparison.n, "seed")
            return f"{told}, {seeds}: needs about {self.seeds_needed} seeds"
        return told if self.p is None else f"{told}, adjusted {p_text(self.p)}"


def judge_rules(
    rules: Sequence[Rule], changes: Sequence[Change], *, point: bool
) -> list[RuleJudgement]:
    """Judges every rule for every driver whose change is of its column, in the order of the rules.

    point: by the mean difference alone, without a test. Otherwise the p values are adjusted for all
    (Holm) and fire at ALPHA; with fewer than `seeds_to_fire` seeds the answer is undecided.
    """
    pairs = [(r, c) for r in rules for c in changes if c.column == r.column]
    if point:
        fired = [r.compare(c.comparison.mean, r.limit) for r, c in pairs]
        answers = [Answer.FIRED if f else Answer.PASSED for f in fired]
        return [RuleJudgement(r, c, a, None, 0) for (r, c), a in zip(pairs, answers, strict=True)]
    needed = seeds_to_fire(len(pairs))
    judged = []
    for (rule, change), p in zip(pairs, holm([r.p(c) for r, c in pairs]), strict=True):
        if change.comparison.n < needed:
            judged.append(RuleJudgement(rule, change, Answer.UNDECIDED, None, needed))
        else:
            answer = Answer.FIRED if p <= ALPHA else Answer.PASSED
            judged.append(RuleJudgement(rule, change, answer, p, needed))
    return judged


def summarise_changes(changes: Sequence[Change]) -> str:
    """Returns one sentence on which columns changed beyond chance, two-sided, adjusted for all (Holm)."""
    if not changes:
        return "No run was finished in both: nothing can be compared."
    if all(c.same == c.runs for c in changes):
        return "Nothing changed: both runs of every pair are the same drive."
    tested = [c for c in changes if c.comparison.p is not None]
    adjusted = holm([c.comparison.p for c in tested if c.comparison.p is not None])
    sure = [c for c, p in zip(tested, adjusted, strict=True) if p <= ALPHA]
    if not sure:
        return f"{count_text(len(changes), 'difference')} compared: none is beyond chance."
    named = list_text([f"{c.column} ({c.subject}, {c.comparison.mean:+.3g})" for c in sure])
    return f"Changed beyond chance: {named}."


def seeds_to_fire(hypotheses: int) -> int:
    """Returns the least seeds with which one of so many hypotheses can be below 5 %, one-sided, adjusted.

    Six at least: with fewer the mid-p raises more than 5 % of false alarms.
    """
    return max(EVER_SIGNIFICANT, ceil(log2(max(hypotheses, 1) / ALPHA)))


def flaws(a: pl.DataFrame, b: pl.DataFrame, rules: Sequence[Rule]) -> dict[Flaw, str]:
    """Returns what keeps the rules from being judged, a sentence each; {}: nothing.

    Runs without a partner, crashed runs, and columns of rules without values to compare.
    """
    found = {}
    by = list(PAIRED_BY)
    alone = [len(x.join(y, on=by, how="anti", nulls_equal=True)) for x, y in ((a, b), (b, a))]
    if any(alone):
        found[Flaw.MISSING] = (
            f"without a partner: {count_text(alone[0], 'run')} of A, {alone[1]} of B"
        )
    crashed = [int(t["outcome"].is_in(NOT_RUN).sum()) for t in (a, b)]
    if any(crashed):
        found[Flaw.CRASHED] = (
            f"crashed, timed out or failed: {count_text(crashed[0], 'run')} of A, {crashed[1]} of B"
        )
    empty = sorted({who for rule in rules for who in _empty(a, b, rule.column)})
    if empty:
        found[Flaw.EMPTY] = f"without values to compare: {', '.join(empty)}"
    return found


def _empty(a: pl.DataFrame, b: pl.DataFrame, column: str) -> list[str]:
    """Returns the column, or its configurations that had values before, where it cannot be judged."""
    pairs = _pairs(a, b)
    whole = pairs.drop_nulls([column, f"{column}_b"])
    if not len(whole):
        return [column]
    had = set(pairs.drop_nulls([column])["config"]) - set(whole["config"])
    return [f"{column} of configuration {config}" for config in had]


def _pairs(a: pl.DataFrame, b: pl.DataFrame) -> pl.DataFrame:
    """Returns the runs of both that were driven to their end, side by side; columns of b end in `_b`."""
    a, b = (t.filter(~pl.col("outcome").is_in(NOT_RUN)) for t in (a, b))
    return a.join(b, on=list(PAIRED_BY), suffix="_b")


def parse_rule(text: str) -> Rule:
    """Returns the rule in a text such as `fatal_collisions > 0.1`, about the mean difference.

    The comparison is one of > >= < <=; ConfigError for any other form or an unknown column.
    """
    return Rule(text, *parse_comparison("--fail-if", text, columns(), LIST_COLUMNS))


def columns() -> list[str]:
    """Returns the names of the columns that can be compared."""
    return [name for name, _, _ in definitions_of(Metrics)]


def compare_campaigns(
    a: pl.DataFrame, b: pl.DataFrame, wanted: Sequence[str]
) -> tuple[list[Change], int, int]:
    """Returns changes per column, over all drivers and per driver, and the runs of each without a partner.

    A driver that is the only one is listed once. ConfigError when no run of one is in the other;
    crashed ones are in it and are not compared.
    """
    if not len(a.join(b, on=list(PAIRED_BY))):
        raise ConfigError("the two campaigns share no run: same configuration, weather and seed")
    pairs = _pairs(a, b)
    a, b = (t.filter(~pl.col("outcome").is_in(NOT_RUN)) for t in (a, b))
    configs = sorted(pairs["config"].unique().to_list())
    changes = []
    for config in configs if len(configs) == 1 else ["", *configs]:
        runs = pairs if config == "" else pairs.filter(pl.col("config") == config)
        changes += [c for column in wanted if (c := _change(runs, config, column))]
    return changes, len(a) - len(pairs), len(b) - len(pairs)


def _change(runs: pl.DataFrame, config: str, column: str) -> Change | None:
    """Returns the mean difference b less a per seed; None without a run that has both values."""
    both = runs.drop_nulls([column, f"{column}_b"])
    if not len(both):
        return None
    same = int((both["log_hash"] == both["log_hash_b"]).sum())
    change = pl.col(f"{column}_b").cast(pl.Float64) - pl.col(column).cast(pl.Float64)
    seeds = both.group_by("seed").agg(change.mean().alias("d")).sort("seed")["d"].to_numpy()
    return Change(config, column, compare_pairs(seeds), seeds, len(both), same)
