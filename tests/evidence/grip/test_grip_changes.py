"""Changed outcome and harder control: each shows what was put in, with interval and effect size."""

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.grip.study import (
    Pair,
    changed_outcome,
    compare_pair,
    completion,
    completion_p,
)

N = 40


def side(completed, steer_std, corrections) -> pl.DataFrame:
    return pl.DataFrame(
        {
            "seed": range(N),
            "completion": completed,
            "triggered": [True] * N,
            "steer_std": steer_std,
            "steer_corrections": corrections,
        }
    )


def pair(lost: int = 0, gained: int = 0, wider: float = 0.0) -> Pair:
    """The first `lost` seeds collide with reduced friction only, the next `gained` without it."""
    seed = np.arange(N)
    level = 0.02 + 0.0005 * seed  # a level of each seed's own, which pairing takes out
    noise = 0.001 * np.resize([1.0, -1.0], N)  # of mean 0 by construction
    before = ~((seed >= lost) & (seed < lost + gained))
    return Pair(
        "front_accident", "fixed", "icy_30",
        side(before, level, np.full(N, 0.5)),
        side(seed >= lost, level + wider + noise, 0.5 + 20.0 * (wider + noise)),
    )  # fmt: skip


@pytest.mark.req("B-143")
def test_a_changed_outcome_is_a_collision_on_one_side_only():
    assert changed_outcome(pair()).value == 0.0
    both_ways = changed_outcome(pair(lost=6, gained=4))
    assert (both_ways.value, both_ways.n) == (0.25, N)
    low, high = both_ways.interval
    assert 0.0 < low < 0.25 < high < 1.0


@pytest.mark.req("B-143", "B-147")
def test_losses_and_gains_that_cancel_change_outcomes_but_not_completion():
    even = pair(lost=5, gained=5)
    assert completion(even.original).value == completion(even.reduced).value
    assert completion_p(even) == 1.0
    assert completion_p(pair(lost=10)) == pytest.approx(2.0 * 0.5**10)


@pytest.mark.req("B-144")
@pytest.mark.parametrize("column", ["steer_std", "steer_corrections"])
def test_harder_control_shows_with_interval_and_effect_size(column):
    scale = 1.0 if column == "steer_std" else 20.0
    found, nothing = compare_pair(pair(wider=0.004), column), compare_pair(pair(), column)
    assert found is not None
    assert nothing is not None
    assert found.mean == pytest.approx(0.004 * scale, rel=0.1)
    assert found.interval.low > 0.0
    assert found.effect > 2.0  # the noise is 0.001, four times less
    assert nothing.interval.low < 0.0 < nothing.interval.high
    assert abs(nothing.effect) < 0.5


@pytest.mark.req("B-144")
def test_pairing_takes_the_seeds_own_level_out():
    p = pair(wider=0.002)
    unpaired = p.original["steer_std"].std()
    assert unpaired > 0.002  # hidden between seeds
    found = compare_pair(p, "steer_std")
    assert found is not None
    assert found.interval.low > 0.001
