from __future__ import annotations

from itertools import pairwise
from math import comb, exp, factorial, isclose

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from skidpad.core.maths.randomness import stream
from skidpad.evidence.limits import count_limits
from skidpad.evidence.statistics import (
    clopper_pearson,
    compare_pairs,
    dispersion_index,
    event_rate,
    holm,
    linear_ratio_limits,
    mcnemar,
    mean_limits,
    median_time,
    pairs_needed,
    poisson_interval,
    seeds_for_verdict,
    share_bound,
)
from skidpad.evidence.statistics_text import interval_text, p_text


def poisson_cdf(k: int, mean: float) -> float:
    return sum(exp(-mean) * mean**i / factorial(i) for i in range(k + 1))


@pytest.mark.req("A-279")
@given(st.integers(0, 60))
def test_poisson_limits_are_where_the_tails_hold_two_and_a_half_percent(k: int) -> None:
    low, high = poisson_interval(k)
    assert poisson_cdf(k, high) == pytest.approx(0.025, abs=1e-9)
    if k:
        assert 1.0 - poisson_cdf(k - 1, low) == pytest.approx(0.025, abs=1e-9)
    else:
        assert low == 0.0


def binomial_tail(a: int, n: int) -> float:
    return sum(comb(n, i) for i in range(a, n + 1)) / 2**n


def test_dispersion_is_one_for_poisson_counts_and_none_without_events() -> None:
    counts = np.random.default_rng(2).poisson(3.0, 20_000)
    assert dispersion_index(counts) == pytest.approx(1.0, abs=0.05)
    assert dispersion_index([0, 0, 0]) is None
    assert dispersion_index([4]) is None
    assert dispersion_index([0, 8]) == 8.0
    assert dispersion_index([0, 8, 0], [1.0, 1.0, 0.0]) == 8.0, (
        "a run without exposure says nothing"
    )
    assert dispersion_index([4, 0], [1.0, 0.0]) is None


@pytest.mark.req("T-6")
def test_limits_of_even_counts_are_near_the_exact_ones_and_those_of_uneven_ones_wider() -> None:
    even = event_rate([40, 41, 39, 40, 40, 40, 38, 42])
    uneven = event_rate([80, 1, 79, 0, 40, 40, 2, 78])
    assert even.rate == uneven.rate == 40.0
    assert even.interval is not None
    assert uneven.interval is not None
    exact = poisson_interval(320, 8.0)
    assert exact.low > even.interval.low > exact.low - 2.0
    assert exact.high < even.interval.high < exact.high + 2.0
    assert uneven.interval.high - uneven.interval.low > 5 * (even.interval.high - even.interval.low)
    assert (even.exceeds_assumption, uneven.exceeds_assumption) == (False, True)
    with pytest.raises(ValueError, match="at least one run"):
        event_rate([])


@pytest.mark.req("T-6")
def test_count_limits_are_exact_limits_of_clumps() -> None:
    """By an independent route: the tails of a Poisson number of clumps."""
    total, k, n, spread = 24, 6, 12, 3.0
    low, high = (float(v) for v in count_limits(total, k, spread, n))
    phi = (
        (1.0 + (spread - 1.0) * (1.0 + 12.0 / k))
        * stats.t.ppf(0.975, n - 1)
        / stats.norm.ppf(0.975)
    )
    clumps = total / phi
    assert stats.gamma.sf(low / phi, clumps - 0.75) == pytest.approx(0.985)
    assert stats.gamma.cdf(high / phi, clumps + 1.0) == pytest.approx(0.985)


@pytest.mark.req("T-6")
@pytest.mark.parametrize(("k", "n"), [(0, 10), (1, 10), (0, 1), (7, 40)])
def test_a_share_bound_is_where_so_few_have_a_chance_of_five_percent(k: int, n: int) -> None:
    assert stats.binom.cdf(k, n, share_bound(k, n)) == pytest.approx(0.05)
    assert share_bound(n, n) == 1.0


@pytest.mark.req("T-6")
def test_the_limits_of_a_mean_are_students_widened_where_the_longer_tail_is() -> None:
    even = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0])
    found = mean_limits(even)
    half = stats.t.ppf(0.975, 8) * even.std(ddof=1) / 3.0
    assert found == pytest.approx((5.0 - half, 5.0 + half))
    skew = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 40.0])
    found, mirrored = mean_limits(skew), mean_limits(-skew)
    assert found is not None
    assert mirrored == pytest.approx((-found.high, -found.low))
    half, g = stats.t.ppf(0.975, 8) * skew.std(ddof=1) / 3.0, stats.skew(skew, bias=False) / 3.0
    assert found.high - skew.mean() == pytest.approx(half * (1.0 + 3.5 * g))
    assert skew.mean() - found.low == pytest.approx(half * (1.0 + 0.5 * g))


@pytest.mark.req("T-6")
def test_limits_from_sums_are_those_of_the_units() -> None:
    rng = np.random.default_rng(5)
    x = rng.integers(100, 900, 40).astype(float)
    y = rng.binomial(x.astype(int), rng.beta(1.0, 9.0, 40)).astype(float)
    products = (float(y @ y), float(x @ y), float(x @ x))
    cubes = tuple(float(v.sum()) for v in (y**3, y * y * x, y * x * x, x**3))
    found = linear_ratio_limits(40, (float(y.sum()), float(x.sum())), products, cubes)
    units = mean_limits((y - y.sum() / x.sum() * x) * 40.0 / x.sum() + y.sum() / x.sum())
    assert found == pytest.approx(units)
    same = (4.0 * 40, 8.0 * 40, 16.0 * 40)
    assert linear_ratio_limits(40, (80.0, 160.0), same, (8.0, 16.0, 32.0, 64.0)) is None


@given(st.lists(st.integers(-1000, 1000), min_size=2, max_size=9))
def test_sign_changes_agree_with_scipy(whole: list[int]) -> None:
    d = [float(v) for v in whole]  # whole, as scipy knows ties only where sums are exact
    c = compare_pairs(d)
    expected = stats.permutation_test(
        (d, np.zeros(len(d))),
        lambda x, y, axis: np.mean(x - y, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=10_000,
        alternative="greater",
    )
    assert c.p_greater == pytest.approx(expected.pvalue, abs=1e-9)
    mirrored = compare_pairs([-v for v in d])
    assert (mirrored.p_less, mirrored.mean) == (c.p_greater, pytest.approx(-c.mean))


@pytest.mark.req("T-6")
def test_few_or_equal_pairs_have_neither_limits_nor_a_p_value() -> None:
    one = compare_pairs([3.0])
    assert (one.interval, one.p, one.is_clear) == (None, None, False)
    assert p_text(one.p) == "no test below 6 pairs"
    assert interval_text(one.interval, one.n, "seed") == "1 seed says nothing of others"
    assert interval_text(compare_pairs([1.0, 2.0]).interval, 2) == "2 runs give no limits, 8 would"
    alike = compare_pairs([0.0] * 12)
    assert alike.p == 1.0
    assert interval_text(alike.interval, 12, "pair") == (
        "all 12 pairs are alike, at most 22 % differ (95 %)"
    )
    assert compare_pairs(np.arange(8.0)).interval == mean_limits(np.arange(8.0))


def test_many_pairs_find_a_shift_and_say_how_many_were_needed() -> None:
    d = np.random.default_rng(4).normal(1.0, 2.0, 60)
    c = compare_pairs(d)
    assert c.p < 0.01
    assert c.effect == pytest.approx(d.mean() / d.std(ddof=1))
    exact = (stats.norm.ppf(0.975) + stats.norm.ppf(0.8)) ** 2 * d.var(ddof=1) / d.mean() ** 2
    assert pairs_needed(c, 0.1) == pytest.approx(exact, abs=1.0)
    assert compare_pairs([1.0, 1.0]).effect is None


@pytest.mark.parametrize(("b", "c"), [(0, 0), (5, 0), (7, 2), (3, 3)])
def test_mcnemar_is_a_coin_toss_over_the_pairs_that_differ(b: int, c: int) -> None:
    n, k = b + c, max(b, c)
    assert mcnemar(b, c) == pytest.approx(min(1.0, 2.0 * binomial_tail(k, n)) if n else 1.0)


@given(st.integers(1, 60), st.data())
def test_share_limits(n: int, data: st.DataObject) -> None:
    k = data.draw(st.integers(0, n))
    low, high = clopper_pearson(k, n)
    if k:
        assert stats.binom.sf(k - 1, n, low) == pytest.approx(0.025, abs=1e-6)
    if k < n:
        assert stats.binom.cdf(k, n, high) == pytest.approx(0.025, abs=1e-6)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_holm_rejects_what_the_step_down_rule_rejects(p: list[float]) -> None:
    adjusted = holm(p)
    order = np.argsort(p, kind="stable")
    rejecting = True
    for rank, k in enumerate(order):
        bound = 0.05 / (len(p) - rank)
        rejecting = rejecting and p[k] <= bound
        if not isclose(p[k], bound):
            assert (adjusted[k] <= 0.05) == rejecting
    assert all(adjusted[a] <= adjusted[b] for a, b in pairwise(order))


@pytest.mark.req("R-7")
@pytest.mark.parametrize("n", [6, 7, 12, 25])
@pytest.mark.parametrize("end", [2.0, 0.4, 10.0])
def test_the_interval_of_a_censored_median_covers_it(n, end):
    rng = stream(5, "test", "median", n)
    true = float(np.log(2.0))  # of a unit exponential
    hits = 0
    for _ in range(2000):
        low, high = median_time(rng.exponential(1.0, n), end)[1]
        hits += min(low, end) <= true <= high  # inf is: beyond the end
    assert hits / 2000 >= 0.94


@pytest.mark.req("R-7")
def test_a_median_beyond_the_end_is_said_to_be_there():
    assert median_time([3.0, np.inf, np.nan], 500.0)[0] == np.inf
    assert median_time([3.0, 5.0, np.inf], 500.0) == (5.0, None)
    assert median_time([1.0, 2.0, 4.0, 600.0], 500.0)[0] == 3.0


@pytest.mark.req("R-7")
def test_the_least_seeds_are_those_with_which_a_claim_can_be_shown():
    for claims in range(1, 60):
        n = seeds_for_verdict(claims)
        assert 2.0 ** (1 - n) < 0.05 / claims <= 2.0 ** (2 - n)
