"""Comparisons that the answers of the matrix page rest on: paired by seed, corrected as a family."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TypeVar

import polars as pl

from skidpad.evidence.contrasts import paired_runs, per_seed
from skidpad.evidence.statistics import Interval, compare_pairs, holm
from skidpad.report.matrix.data import EVENTS, Matrix, WeatherGroup

ALPHA = 0.05
BY_RUN = ("weather", "seed")
BY_SEED = ("seed",)
K = TypeVar("K")


@dataclass(frozen=True, slots=True)
class Contrast:
    """The mean difference of two sides that share seeds."""

    mean: float
    seeds: int
    interval: Interval | None
    p: float  # two-sided; adjusted in a family
    identical: bool  # both sides are the same drives

    @property
    def is_sure(self) -> bool:
        """Returns True when chance alone does not explain the difference: p below ALPHA, other drives."""
        return self.p < ALPHA and not self.identical


def contrast(matrix: Matrix, more: pl.Expr, less: pl.Expr, by: Iterable[str]) -> Contrast | None:
    """Returns the crashes (EVENTS) of one side minus the other, per seed; None where no pair was driven.

    more, less: conditions on runs; by: columns that a pair shares.
    """
    pairs, same = paired_runs(matrix.finished, more, less, tuple(by), EVENTS)
    if not len(pairs):
        return None
    c = compare_pairs(per_seed(pairs, pl.col("difference")))
    return Contrast(c.mean, c.n, c.interval, 1.0 if c.p is None else c.p, same)


def by_configuration(
    matrix: Matrix, groups: Iterable[WeatherGroup]
) -> dict[tuple[WeatherGroup, str, str], Contrast]:
    """Returns second minus first of every two compared configurations, by (group, first, second).

    The p values are adjusted as one family.
    """
    found = {}
    for group in groups:
        there = pl.col("weather").is_in(group.weathers)
        for a, b in combinations(matrix.comparison_configs, 2):
            more, less = ((pl.col("config") == config) & there for config in (b, a))
            if (c := contrast(matrix, more, less, BY_RUN)) is not None:
                found[group, a, b] = c
    return _adjust_family(found)


def by_weather(matrix: Matrix) -> dict[tuple[str, WeatherGroup], Contrast]:
    """Returns every climate minus the first one by (configuration, climate), p adjusted as one family."""
    first, *rest = matrix.climates
    found = {}
    for config in matrix.comparison_configs:
        for group in rest:
            more, less = (
                (pl.col("config") == config) & pl.col("weather").is_in(g.weathers)
                for g in (group, first)
            )
            if (c := contrast(matrix, more, less, BY_SEED)) is not None:
                found[config, group] = c
    return _adjust_family(found)


def _adjust_family(family: dict[K, Contrast]) -> dict[K, Contrast]:
    """Returns the contrasts with p values adjusted for the family (Holm)."""
    ps = holm([c.p for c in family.values()]) if family else []
    return {key: replace(c, p=p) for (key, c), p in zip(family.items(), ps, strict=True)}
