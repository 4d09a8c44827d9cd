"""How results of statistics are written."""

from __future__ import annotations

import pytest

from skidpad.evidence.statistics import Interval, event_rate
from skidpad.evidence.statistics_text import interval_text, p_text, rate_text, share_text


@pytest.mark.req("T-6")
def test_a_rate_without_limits_says_how_many_runs_had_an_event() -> None:
    assert (
        rate_text(event_rate([0] * 10))
        == "0.00 per run; none of 10 runs had one, at most 26 % do (95 %)"
    )
    assert rate_text(event_rate([7] + [0] * 9), "seed").endswith(
        "1 of 10 seeds had one, at most 39 % do (95 %)"
    )
    assert rate_text(event_rate([3])) == "3.00 per run; 1 run says nothing of others"
    assert rate_text(event_rate([3, 3, 3])) == "3.00 per run; 3 of 3 runs had one"
    assert rate_text(event_rate([0, 40] * 5)).endswith("variance/mean 22, above the assumed 10")
    assert (
        rate_text(event_rate([1, 1] * 5), per="h")
        == "1.00 per h, 95 % 0.355 to 2.03 if variance/mean is at most 10"
    )


def test_words() -> None:
    assert (p_text(0.2539), p_text(2e-6)) == ("p = 0.25", "p < 0.001")


def test_a_share_and_its_interval_are_told_in_one_unit() -> None:
    assert share_text(0.05, Interval(0.001, 0.1456)) == "5.00 %, 95 % 0.1 to 14.6 %"
    assert interval_text(Interval(-0.0, 0.25)) == "95 % 0 to 0.25"
