"""Probabilities of closed forms, intervals that hold them, and when two methods determine a result."""

from math import inf, sqrt

import numpy as np
import pytest
from scipy import stats

from skidpad.search.probability import (
    DEFENCE,
    Estimate,
    compare_estimates,
    counting_estimate,
    explore,
    importance_estimate,
    joint_interval,
    sample_mixture,
    subset_estimate,
)

D = 3


def plane(p):
    reach = -stats.norm.ppf(p)
    return lambda z: reach - z.sum(axis=1) / sqrt(z.shape[1])


def planes(p):
    reach = -stats.norm.ppf(p / 2)
    return lambda z: reach - np.abs(z.sum(axis=1)) / sqrt(z.shape[1])


def estimates(limit, seed, repetitions=10, per_level=300, samples=2000):
    rng = np.random.default_rng(seed)
    found = explore(limit, D, rng, repetitions, per_level)
    return (
        found,
        subset_estimate(found),
        importance_estimate(sample_mixture(limit, found.failing, rng, samples), found.runs),
    )


@pytest.mark.parametrize("p", [1e-3, 1e-9])
@pytest.mark.parametrize("shape", [plane, planes])
def test_intervals_hold_the_probability_of_closed_forms(shape, p):
    """25 repetitions; the page shows 5000. The joint interval misses where both methods do."""
    limit, rows = shape(p), []
    for seed in range(25):
        _, one, other = estimates(limit, seed)
        low, high = joint_interval(one, other)
        rows.append((low <= p <= high, other.low <= p <= other.high, other.p))
    table = np.array(rows, dtype=float)
    assert table[:, 0].mean() >= 0.93
    assert table[:, 1].sum() >= 20, "binomial: fewer than 20 of 25 at 95 % has a chance of 0.1 %"
    assert table[:, 2].mean() == pytest.approx(p, rel=0.1)


def test_a_limit_is_asked_as_often_as_is_said_and_for_many_samples_at_once():
    asked = []

    def limit(z):
        asked.append(len(z))
        return plane(1e-4)(z)

    found, one, other = estimates(limit, 1, repetitions=4, per_level=100, samples=500)
    assert one.runs == found.runs == sum(asked[:-1])
    assert other.runs == sum(asked)
    assert len(asked) < 60, "batches, not samples"


def test_the_first_level_is_independent_draws():
    found, _, _ = estimates(plane(0.2), 3)
    assert len(found.first) == 3000
    counted = counting_estimate(found.first)
    assert counted.low <= 0.2 <= counted.high
    exact = stats.binomtest(round(counted.p * 3000), 3000).proportion_ci(0.95, "exact")
    assert (counted.low, counted.high) == pytest.approx((exact.low, exact.high))


def test_counting_nothing_gives_an_upper_bound():
    counted = counting_estimate(np.ones(100))
    assert (counted.p, counted.low) == (0.0, 0.0)
    assert counted.high == pytest.approx(1.0 - 0.025 ** (1 / 100))


def test_what_never_fails_is_given_up_as_too_rare():
    rng = np.random.default_rng(1)
    found = explore(lambda z: np.exp(-(z**2).sum(axis=1)) + 0.1, D, rng, 2, 100)
    assert len(found.failing) == 0
    assert subset_estimate(found) == Estimate("subset simulation", 0.0, 0.0, inf, found.runs)


def test_no_weight_is_above_one_over_the_defence():
    rng = np.random.default_rng(1)
    samples = sample_mixture(plane(1e-3), rng.standard_normal((20, D)) + 3.0, rng, 5000)
    assert samples.weights.max() <= 1.0 / DEFENCE + 1e-9
    # its density integrates to 1: the mean weight over all samples is 1
    assert samples.weights.mean() == pytest.approx(1.0, abs=0.2)


def test_ancestors_are_counted_from_the_first_level():
    found, _, _ = estimates(plane(1e-5), 5, repetitions=3, per_level=200)
    assert all(1 <= c.ancestors <= 20 for c in found.chains)


@pytest.mark.parametrize(
    ("one", "other", "why_not"),
    [
        ((1e-4, 0.8e-4, 1.25e-4), (1.1e-4, 0.9e-4, 1.35e-4), ""),
        ((1e-4, 0.8e-4, 1.25e-4), (1.0e-4, 0.5e-4, 2.0e-4), "half-width of b is 100%"),
        ((1e-4, 0.9e-4, 1.1e-4), (2.0e-4, 1.8e-4, 2.2e-4), "both differ: their ratio is 0.50"),
        ((1e-4, 0.7e-4, 1.45e-4), (1.3e-4, 0.9e-4, 1.9e-4), "only known to lie within"),
        ((0.0, 0.0, inf), (1e-4, 0.9e-4, 1.1e-4), "no failure was reached"),
    ],
)
def test_two_methods_determine_a_result_only_when_narrow_and_alike(one, other, why_not):
    agreed = compare_estimates(Estimate("a", *one, 100), Estimate("b", *other, 100))
    assert agreed.is_determined == (not why_not)
    assert why_not in agreed.why_not
