"""What intervals and verdicts promise, held against simulation.

2000 draws of each case; `--draws 20000` takes more of them. A share is allowed two standard errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
import polars as pl
import pytest

import coverage_table as coverage
from skidpad.core.maths.randomness import stream
from skidpad.evidence.contrasts import Amount, Contrast, contrast_pairs
from skidpad.evidence.statistics import (
    CONFIDENCE,
    event_rate,
    mean_limits,
    poisson_interval,
    ratio_limits,
    seeds_for_verdict,
    share_bound,
)
from skidpad.evidence.verdicts import Finding, Verdict, judge

FALSE_VERDICTS = 0.05


@pytest.fixture(scope="module")
def draws(request: pytest.FixtureRequest) -> int:
    return int(request.config.getoption("--draws"))


def slack(share: float, draws: int) -> float:
    return 2.0 * sqrt(share * (1.0 - share) / draws)


SLICE = (8, 10, 20)  # `tools/coverage_table.py` has all sizes


@pytest.mark.req("R-7", "T-6", "A-279")
@pytest.mark.parametrize("n", SLICE)
def test_limits_of_rates_hold_the_truth_given_that_they_are_printed(n: int, draws: int) -> None:
    cells = [c for kind in coverage.count_kinds() if (c := coverage.cover_counts(kind, n, draws))]
    assert len(cells) > 50
    assert not [c for c in cells if c.fails]
    assert max(c.width for c in cells) <= 1.5, "of Poisson counts, over exact limits"


@pytest.mark.req("R-7", "T-6")
@pytest.mark.parametrize("n", SLICE)
def test_limits_of_means_and_differences_hold_the_truth_given_that_they_are_printed(
    n: int, draws: int
) -> None:
    cells = [c for kind in coverage.value_kinds() if (c := coverage.cover_values(kind, n, draws))]
    assert len(cells) > 15
    assert not [c for c in cells if c.fails]


@pytest.mark.req("R-7", "T-6")
def test_the_share_of_runs_with_an_event_is_bounded_however_events_clump(draws: int) -> None:
    rng = stream(9, "test", "shares")
    for n in (3, 10, 60):
        for share in (0.02, 0.1, 0.5):
            seen = rng.binomial(n, share, draws)
            held = np.mean([share <= share_bound(int(k), n) for k in seen])
            assert held >= CONFIDENCE - slack(CONFIDENCE, draws)


@pytest.mark.req("R-7", "T-6")
def test_what_is_printed_of_a_rate_does_not_depend_on_how_much_the_counts_vary() -> None:
    assert event_rate([1, 1] + [0] * 8).interval is not None
    assert event_rate([9, 9] + [0] * 8).interval is not None, "clumps do not hide it"
    assert event_rate([9] + [0] * 9).interval is None
    assert event_rate([1] + [0] * 9).interval is None


def test_unequal_exposures_count_by_their_length(draws: int) -> None:
    rng = stream(9, "test", "exposures")
    hours = np.array([0.2, 0.2, 0.5, 0.7, 1.0, 1.0, 2.0, 4.0])
    held = 0
    for _ in range(draws):
        found = event_rate(rng.poisson(3.0 * hours).tolist(), hours.tolist()).interval
        held += found is None or found.low <= 3.0 <= found.high
    assert held / draws >= CONFIDENCE - slack(CONFIDENCE, draws)


@pytest.mark.req("R-7", "T-6")
def test_few_or_equal_values_have_no_limits() -> None:
    assert mean_limits([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) is None
    assert mean_limits([2.0] * 8) is None, "none of them says what the next one is"
    assert mean_limits([0.0] * 9 + [50.0]) is not None
    assert ratio_limits([1.0] * 7, [2.0] * 7) is None


@pytest.mark.req("R-7", "T-6")
def test_ratios_over_segments_hold_the_truth(draws: int) -> None:
    assert coverage.cover_ratio(8, draws) >= coverage.LEAST - slack(coverage.LEAST, draws)


@pytest.mark.req("R-7")
def test_exact_poisson_limits_are_never_short(draws: int) -> None:
    rng = stream(9, "test", "exact")
    for mean in (0.3, 2.0, 9.0):
        limits = {k: poisson_interval(k) for k in range(60)}
        counts = rng.poisson(mean, draws)
        held = np.mean([limits[int(k)].low <= mean <= limits[int(k)].high for k in counts])
        assert held >= CONFIDENCE - slack(CONFIDENCE, draws)


# --- verdicts under the null


@dataclass(frozen=True)
class Drawn:
    """A criterion whose differences are known."""

    values: np.ndarray
    margin: float
    test: tuple[str, ...] = ()
    amounts: tuple[Amount, ...] = ()

    def draw(self, table: pl.DataFrame) -> Contrast | None:
        del table
        return contrast_pairs("d", self.values, self.margin)


TABLE = pl.DataFrame({"seed": [1]})


def verdicts(differences: np.ndarray, margin: float) -> set[Verdict]:
    """Of one report with a claim per row of `differences`."""
    claims = [Finding("X", "", "", "", (Drawn(d, margin),)) for d in differences]
    return {j.verdict for j in judge(claims, [TABLE] * len(claims))}


@pytest.mark.req("R-7", "X-7")
@pytest.mark.parametrize("claims", [1, 8])
def test_where_nothing_differs_hardly_any_report_supports_a_claim(claims: int, draws: int) -> None:
    """Differences of equal, clumped counts, with as many seeds as a verdict takes."""
    n = seeds_for_verdict(claims)
    reports = draws // (4 * claims)
    rng = stream(9, "test", "null", claims)
    counts = rng.negative_binomial(0.5, 1.0 / 3.0, (2, reports, claims, n)).astype(float)
    wrong = [Verdict.SUPPORTED in verdicts(d, 0.1) for d in counts[0] - counts[1]]
    assert np.mean(wrong) <= FALSE_VERDICTS + slack(FALSE_VERDICTS, reports)


@pytest.mark.req("R-7", "X-7")
def test_where_a_claim_is_just_true_hardly_any_report_contradicts_it(draws: int) -> None:
    """The difference is the margin itself: neither too small nor reversed."""
    n, reports = seeds_for_verdict(4), draws // 4
    rng = stream(9, "test", "margin")
    counts = rng.negative_binomial(0.5, 1.0 / 3.0, (2, reports, 4, n)).astype(float)
    wrong = [Verdict.CONTRADICTED in verdicts(d + 0.5, 0.5) for d in counts[0] - counts[1]]
    assert np.mean(wrong) <= FALSE_VERDICTS + slack(FALSE_VERDICTS, reports)


@pytest.mark.req("R-7")
@pytest.mark.parametrize("claims", [1, 8, 20])
def test_fewer_seeds_than_the_page_says_decide_nothing(claims: int) -> None:
    """However clear the difference: every run of one side outdoes every run of the other."""
    n = seeds_for_verdict(claims)
    clear = np.full((claims, n), 9.0) + np.arange(n)
    assert verdicts(clear, 0.1) == {Verdict.SUPPORTED}
    one = np.vstack([clear[:1, 1:], np.zeros((claims - 1, n - 1))])  # the others show nothing
    assert Verdict.SUPPORTED not in verdicts(one, 0.1)
