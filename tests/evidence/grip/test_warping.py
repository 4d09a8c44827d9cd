from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.evidence.grip.study import Cost, warping_distance

SERIES = st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=9).map(np.array)


def by_recursion(a: np.ndarray, b: np.ndarray, cost: Cost) -> float:
    """The textbook recurrence."""
    n, m = len(a), len(b)
    total = np.full((n + 1, m + 1), math.inf)
    total[0, 0] = 0.0
    for i in range(n):
        for j in range(m):
            d = abs(a[i] - b[j])
            step = d * d if cost is Cost.SQUARED else d
            total[i + 1, j + 1] = step + min(total[i, j], total[i, j + 1], total[i + 1, j])
    return math.sqrt(total[n, m]) if cost is Cost.SQUARED else float(total[n, m])


@pytest.mark.req("B-107")
@given(SERIES, SERIES, st.sampled_from(Cost))
def test_warping_agrees_with_the_recurrence(a: np.ndarray, b: np.ndarray, cost: Cost) -> None:
    expected = by_recursion(a, b, cost)
    assert warping_distance(a, b, cost) == pytest.approx(expected, abs=1e-9)


@pytest.mark.req("B-107")
@given(SERIES)
def test_a_series_has_no_distance_to_itself_or_to_a_slower_copy(a: np.ndarray) -> None:
    assert warping_distance(a, a) == 0.0
    assert warping_distance(a, np.repeat(a, 3)) == 0.0


@pytest.mark.req("B-107")
def test_brakes_of_0_half_and_1_give_roots_of_quarters() -> None:
    d = warping_distance(np.array([0.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.5, 0.0, 0.0]))
    assert d == pytest.approx(math.sqrt(1 / 4))


def test_an_empty_series_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one"):
        warping_distance(np.array([]), np.array([1.0]))
