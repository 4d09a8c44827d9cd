from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.evidence.grip.study import (
    Cost,
    median_series,
    median_warping,
    noise_floor,
    stack_runs,
    warping_interval,
)


@pytest.mark.req("B-123")
def test_the_median_is_over_runs_still_alive_until_fewer_than_half_are() -> None:
    runs = stack_runs([np.array(r) for r in ([1.0, 1, 1, 9], [2.0, 2, 8], [3.0, 5], [4.0])])
    assert median_series(runs).tolist() == [2.5, 2.0, 4.5]


@pytest.mark.req("B-123")
def test_an_even_number_of_runs_gives_half_a_brake() -> None:
    assert median_series(np.array([[0.0, 1.0], [1.0, 1.0]])).tolist() == [0.5, 1.0]


@given(st.permutations(range(5)))
def test_the_median_does_not_depend_on_the_order_of_runs(order: list[int]) -> None:
    runs = np.random.default_rng(1).normal(size=(5, 8))
    assert median_series(runs[order]).tolist() == median_series(runs).tolist()


@pytest.mark.req("B-107", "B-108")
@pytest.mark.parametrize("cost", Cost)
def test_interval_holds_the_distance_and_is_repeatable(cost: Cost) -> None:
    rng, t = np.random.default_rng(2), np.arange(160) / 20.0
    a = np.sin(t) + 0.05 * rng.normal(size=(20, 1))
    b = np.sin(t) + 1.5 + 0.05 * rng.normal(size=(20, 1))
    low, high = warping_interval(a, b, cost)
    assert low < median_warping(a, b, cost) < high
    assert high < 1.3 * low
    assert warping_interval(a, b, cost) == (low, high)


@pytest.mark.req("B-107")
def test_equal_sets_have_no_distance_at_all() -> None:
    runs = np.random.default_rng(3).normal(size=(6, 40))
    assert median_warping(runs, runs) == 0.0
    assert warping_interval(runs, runs) == (0.0, 0.0)


def test_noise_floor_is_what_chance_gives() -> None:
    rng = np.random.default_rng(4)
    assert noise_floor(np.ones((4, 9))) == 0.0
    assert noise_floor(np.ones((3, 9))) is None
    small, large = (noise_floor(rng.normal(0.0, s, (40, 100))) for s in (0.1, 1.0))
    assert small is not None
    assert large is not None
    assert math.isclose(large / small, 10.0, rel_tol=0.5)
