"""The friction at which half of the seeds have had an accident: known curves, and honest limits."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.evidence.grip.threshold import as_studied, situations, threshold

LEVELS = [0.9, 0.7, 0.5, 0.3, 0.2, 0.1]


def drives(critical, levels=LEVELS):
    """(seeds, levels): completed above the critical friction of each seed."""
    return np.array([[mu > c for mu in levels] for c in critical])


def test_half_of_the_seeds_lie_on_each_side():
    found = threshold(drives([0.15] * 10 + [0.4] * 10), LEVELS)
    # the median seed fails at 0.1 or 0.3, and not yet one level above
    assert found.mu == pytest.approx(0.5 * (0.2 + 0.4), abs=0.051)
    assert (found.interval.low, found.interval.high) == (pytest.approx(0.1), pytest.approx(0.5))


@given(st.lists(st.floats(0.0, 0.85), min_size=6, max_size=40))
def test_the_interval_holds_the_median_critical_friction(critical):
    found = threshold(drives(critical), LEVELS)
    # the lower and upper median of the true values lie between the ends
    values = np.sort(critical)
    low, high = values[(len(values) - 1) // 2], values[len(values) // 2]
    assert found.interval.low <= high
    assert found.interval.high >= low
    if found.mu is not None:
        assert found.interval.low <= found.mu <= found.interval.high
        assert found.mu >= LEVELS[-1]


def test_more_fragile_drives_have_a_higher_threshold():
    some = threshold(drives([0.15] * 20), LEVELS)
    more = threshold(drives([0.45] * 20), LEVELS)
    assert some.mu < more.mu


def test_without_accidents_there_is_no_threshold():
    found = threshold(drives([0.0] * 20), LEVELS)
    assert found.mu is None
    assert found.text == "below 0.1"
    assert found.interval.high == pytest.approx(0.1)


def test_few_seeds_bound_nothing():
    found = threshold(drives([0.4] * 4), LEVELS)
    assert found.interval.low == 0.0
    assert found.interval.high == pytest.approx(0.9)


def table(completed):
    rows = [
        {
            "driver": "acc", "actors": "ideal", "start": "1 s", "deceleration": 4.0, "speed_kmh": 80.0,
            "gap_m": 22.0, "road_mu": mu, "preset": preset, "seed": seed, "outcome": "completed",
            "completion": completed(mu, seed), "min_cvip_m": 5.0 + mu, "log_hash": f"{mu} {seed}",
        }
        for seed in range(1, 21)
        for mu, preset in (
            (0.9, "icy_0"), (0.6, "icy_10"), (0.28, "icy_30"), (0.14, "icy_70"), (0.135, "icy_100"),
        )
    ]  # fmt: skip
    return pl.DataFrame(rows)


def test_a_situation_that_fails_on_dry_road_does_not_tell():
    (good,) = situations(table(lambda mu, seed: mu > 0.2))
    (bad,) = situations(table(lambda mu, seed: mu > 0.2 and seed > 2))
    assert good.tells
    assert not bad.tells
    assert (bad.baseline.k, bad.baseline.n) == (18, 20)


def test_drives_that_are_completed_again_are_counted():
    (one,) = situations(table(lambda mu, seed: mu != 0.28))
    assert (one.recovered_share.k, one.recovered_share.n) == (40, 40)


@pytest.mark.req("B-140")
def test_claims_of_the_study_are_judged_on_a_map():
    (true,) = situations(table(lambda mu, seed: mu > 0.2))
    verdicts = {j.finding.id: j.verdict.value for j in true.judgements}
    assert verdicts["BF-02"] == "supported"
    assert verdicts["BF-03"] == "supported"
    (other,) = situations(table(lambda mu, seed: True))
    verdicts = {j.finding.id: j.verdict.value for j in other.judgements}
    assert verdicts["BF-02"] == "contradicted"
    assert verdicts["BF-03"] == "contradicted"


def test_dry_road_stands_for_the_original_friction():
    studied = as_studied(table(lambda mu, seed: mu > 0.2))
    original = studied.filter(pl.col("friction") == "original")
    assert original["completion"].all()
    assert set(original["weather"]) == {"icy_0", "icy_10", "icy_30", "icy_70", "icy_100"}
