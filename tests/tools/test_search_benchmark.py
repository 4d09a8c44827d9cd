"""The benchmark of samplers: costs, medians with their intervals, and which failures are distinct."""

import pytest

import search_benchmark as bench
from skidpad.core.maths.space import Choice, Space, Uniform, Variable
from skidpad.recording.campaign.searches import Trial

SPACE = Space((Variable("x", Uniform(0.0, 10.0)), Variable("who", Choice(("car", "van")))))


def trial(
    k, margin=1.0, x=5.0, who="car", bound="", seconds=16.0, replay=None, side="front", kmh=None
):
    reference = None if replay is None else trial(k, 0.5, seconds=replay, kmh=3.0)
    return Trial(
        number=k, unit=(0.5, 0.5), values={"x": x, "who": who}, margin=margin, bound=bound,
        simulated_s=seconds, reference=reference, other="lead", side=side,
        contact_kmh=kmh,
    )  # fmt: skip


def test_cost_counts_replays_in_units_of_the_longest_run():
    trials = [trial(0), trial(1, -1.0, replay=8.0), trial(2, -1.0, bound="braking", replay=16.0)]
    assert [bench.cost_of(t, "cut-in") for t in trials] == [1.0, 1.5, 2.0]
    assert bench.first_cost(trials, "cut-in") == 4.5, "the second one could not be avoided"
    assert bench.first_cost(trials[:2], "cut-in") is None


def test_the_budget_pays_for_no_run_beyond_it():
    trials = [trial(k) for k in range(bench.RUNS + 5)]
    assert len(bench.within_budget(trials, "cut-in")) == bench.RUNS
    assert bench.is_over(trials[: bench.RUNS], "cut-in")
    assert not bench.is_over(trials[: bench.RUNS - 1], "cut-in")
    twice = [trial(k, replay=16.0) for k in range(bench.RUNS // 2)]
    assert bench.is_over(twice, "cut-in")


def test_failures_are_distinct_by_kind_word_and_tenth_of_the_range():
    bad = {"margin": -1.0, "bound": "braking"}
    trials = [
        trial(0, x=5.1, **bad), trial(1, x=5.9, **bad), trial(2, x=6.1, **bad),
        trial(3, x=5.1, who="van", **bad), trial(4, x=5.1, side="rear", **bad),
        trial(5, x=1.0, margin=-1.0), trial(6, x=2.0), trial(7, x=10.0, **bad),
    ]  # fmt: skip
    assert bench.count_distinct(trials, SPACE) == 5


@pytest.mark.parametrize(
    ("costs", "text"),
    [
        ([3.0], "3 (too few for an interval)"),
        # n = 10: the second and the ninth hold the median with 97.9 %
        (list(map(float, range(1, 11))), "6 (2 to 9)"),
        ([*map(float, range(1, 5)), *[None] * 6], "above 1000 (2 to above 1000)"),
    ],
)
def test_a_median_has_the_interval_of_order_statistics(costs, text):
    assert bench.median_text(costs) == text


def test_the_share_has_its_exact_interval():
    assert bench.share_text([]) == "not measured"
    good = [trial(k) for k in range(999)]
    text = bench.share_text([*good, trial(999)])
    assert text == "0 of 1000 (0.0e+00 to 3.7e-03), not yet known to be within 0.0001 to 0.001"
    bad = [trial(k, -1.0, bound="braking") for k in range(10)]
    assert bench.share_text([*good, *bad]).endswith("outside of 0.0001 to 0.001")
