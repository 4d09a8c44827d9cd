from __future__ import annotations

from itertools import pairwise
from math import comb, exp, factorial, isclose

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from skidpad.core.randomness import stream
from skidpad.evidence.statistics import (
    Interval,
    Method,
    bootstrap_interval,
    clopper_pearson,
    compare_pairs,
    dispersion_index,
    event_rate,
    holm,
    mcnemar,
    median_time,
    p_text,
    pairs_needed,
    poisson_interval,
    seeds_for_verdict,
    share_text,
)


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


def test_a_single_run_is_exact_and_several_show_their_spread() -> None:
    one = event_rate([4], [2.0])
    assert (one.method, one.dispersion) == (Method.POISSON, None)
    assert one.interval == pytest.approx(poisson_interval(4, 2.0))
    even, uneven = event_rate([40, 41, 39, 40, 40, 40]), event_rate([80, 1, 79, 0, 40, 40])
    assert even.rate == uneven.rate == 40.0
    assert even.interval is not None
    assert uneven.interval is not None
    assert uneven.interval.high - uneven.interval.low > 5 * (even.interval.high - even.interval.low)
    none = event_rate([0] * 40)
    assert none.interval is not None
    assert none.interval == pytest.approx((0.0, 4.09 / 40), abs=1e-3)  # exact: 3.69 / 40
    with pytest.raises(ValueError, match="at least one run"):
        event_rate([])


def test_few_events_that_clump_have_no_interval() -> None:
    assert event_rate([0, 0, 9]).interval is None
    assert event_rate([0, 0, 29]).interval is not None
    assert event_rate([3, 3, 3]).interval is not None


def test_score_limits_are_where_the_rate_is_a_quantile_away() -> None:
    counts = [3, 9, 1, 12, 4, 7, 2, 2]
    found = event_rate(counts)
    assert found.interval is not None
    spread = np.var(counts, ddof=1) / np.mean(counts)
    widened = 1.0 + (spread - 1.0) * (1.0 + np.sqrt(2.0 / 7.0))
    for rate in found.interval:
        deviation = np.sqrt(widened * rate / 8)
        assert abs(rate - 5.0) / deviation == pytest.approx(stats.t.ppf(0.975, 7))


def test_bootstrap_agrees_with_the_normal_limit_and_is_repeatable() -> None:
    x = np.random.default_rng(3).normal(5.0, 2.0, 400)
    low, high = bootstrap_interval(x)
    half = 1.96 * x.std() / 20.0
    assert low == pytest.approx(x.mean() - half, abs=0.03)
    assert high == pytest.approx(x.mean() + half, abs=0.03)
    assert bootstrap_interval(x) == (low, high)
    assert bootstrap_interval([2.0, 4.0], [1.0, 2.0]) == (2.0, 2.0)


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


@pytest.mark.parametrize("n", [6, 10, 20])
def test_the_interval_of_paired_differences_covers_what_it_promises(n: int) -> None:
    """2000 draws of counts as uneven as crashes: about 95 % of the intervals hold the truth."""
    rng = np.random.default_rng(n)
    counts = rng.negative_binomial(0.5, 1.0 / 3.0, (2, 2000, n))  # mean 1, variance 3
    held = [
        c.low <= 0.0 <= c.high for c in (compare_pairs(d).interval for d in counts[0] - counts[1])
    ]
    assert np.mean(held) > 0.94


def test_few_pairs_have_no_limits_and_six_have_their_extremes() -> None:
    assert compare_pairs([1.0, 2.0, 3.0, 4.0, 5.0]).interval == (-np.inf, np.inf)
    assert compare_pairs([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).interval == (1.0, 6.0)


@given(st.lists(st.floats(-9.0, 9.0), min_size=6, max_size=9, unique=True))
def test_the_interval_holds_the_shifts_that_are_not_rejected(d: list[float]) -> None:
    low, high = compare_pairs(d).interval
    for edge, inside in ((low, 1.0), (high, -1.0)):
        for step in (1e-3, -1e-3):
            shifted = compare_pairs(np.array(d) - (edge + step * inside))
            tail = shifted.p_greater if inside > 0 else shifted.p_less
            assert (tail > 0.025) == (step > 0.0) or high - low < 2e-3


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


def test_words() -> None:
    assert (p_text(0.2539), p_text(2e-6)) == ("p = 0.25", "p < 0.001")


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
    assert median_time([3.0, 5.0, np.inf], 500.0) == (5.0, Interval(0.0, np.inf))
    assert median_time([1.0, 2.0, 4.0, 600.0], 500.0)[0] == 3.0


@pytest.mark.req("R-7")
def test_the_least_seeds_are_those_with_which_a_claim_can_be_shown():
    for claims in range(1, 60):
        n = seeds_for_verdict(claims)
        assert 2.0 ** (1 - n) < 0.05 / claims <= 2.0 ** (2 - n)


def test_a_share_and_its_interval_are_told_in_one_unit() -> None:
    assert share_text(0.05, Interval(0.001, 0.1456)) == "5.00 %, 95 % 0.1 to 14.6 %"
    assert share_text(0.05, Interval(-np.inf, np.inf)) == "5.00 %, 95 % unbounded"
