"""How results of statistics are written: intervals, rates, shares and p values.

A rate by `rate_text`, any other interval by `interval_text`, a p value by `p_text`.
"""

from __future__ import annotations

from skidpad.evidence.statistics import (
    DISPERSION_ASSUMED,
    EVER_SIGNIFICANT,
    UNITS_FROM,
    Interval,
    Rate,
    share_bound,
)

ASSUMED = f"if variance/mean is at most {DISPERSION_ASSUMED:.0f}"  # of counts
NO_LIMITS = "no limits: they need 8 units that are not all alike"


def interval_text(interval: Interval | None, units: int | None = None, unit: str = "run") -> str:
    """Returns text such as `95 % 0.1 to 1.46`; without limits that of `no_limits_text`.

    NO_LIMITS where the number of units is not given.
    """
    if interval is not None:
        return f"95 % {range_text(interval)}"
    return NO_LIMITS if units is None else no_limits_text(units, unit)


def range_text(interval: Interval) -> str:
    """Returns the limits as text, `0.1 to 1.46`."""
    return f"{_plain(interval.low)} to {_plain(interval.high)}"


def no_limits_text(units: int, unit: str = "run") -> str:
    """Returns text such as `3 runs give no limits, 8 would`.

    From UNITS_FROM on: `all 12 runs are alike, at most 22 % differ (95 %)`.
    """
    if units == 1:
        return f"1 {unit} says nothing of others"
    if units < UNITS_FROM:
        return f"{units} {unit}s give no limits, {UNITS_FROM} would"
    percent = 100.0 * share_bound(0, units)
    return f"all {units} {unit}s are alike, at most {percent:.0f} % differ (95 %)"


def rate_text(rate: Rate, unit: str = "run", per: str = "run") -> str:
    """Returns text such as `0.60 per run, 95 % 0.31 to 1.14 if variance/mean is at most 10`.

    Without limits what stands for them. unit: what `Rate.runs` are; per: the unit of exposure.
    """
    text = f"{rate.rate:.2f} per {per}"
    if rate.interval is not None:
        text += f", {interval_text(rate.interval)} {ASSUMED}"
    remark = rate_remark(rate, unit)
    return f"{text}; {remark}" if remark else text


def runs_with_text(rate: Rate, unit: str = "run") -> str:
    """Returns text such as `none of 10 runs had one, at most 26 % do (95 %)`, however events clump."""
    if rate.runs == 1:
        return f"1 {unit} says nothing of others"
    had = "none" if rate.runs_with == 0 else f"{rate.runs_with}"
    text = f"{had} of {rate.runs} {unit}s had one"
    return (
        text
        if rate.most_runs == 1.0
        else f"{text}, at most {100.0 * rate.most_runs:.0f} % do (95 %)"
    )


def rate_remark(rate: Rate, unit: str = "run") -> str:
    """Returns why a rate has no limits or that its counts vary too much, else "" (`unit`: "run", ...)."""
    if rate.interval is None:
        return runs_with_text(rate, unit)
    if rate.exceeds_assumption:
        return f"variance/mean {rate.dispersion:.0f}, above the assumed {DISPERSION_ASSUMED:.0f}"
    return ""


def share_text(share: float, interval: Interval | None) -> str:
    """Returns text such as `5.00 %, 95 % 0.1 to 14.6 %` of shares from 0 to 1."""
    if interval is None:
        return f"{100.0 * share:.2f} %, {interval_text(None)}"
    percent = Interval(100.0 * interval.low, 100.0 * interval.high)
    return f"{100.0 * share:.2f} %, {interval_text(percent)} %"


def p_text(p: float | None) -> str:
    """Returns `p = 0.25` or `p < 0.001`; for None `no test below 6 pairs`."""
    if p is None:
        return f"no test below {EVER_SIGNIFICANT} pairs"
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"


def _plain(value: float) -> str:
    """Returns a finite number as text with three digits and no negative zero."""
    return f"{value + 0.0:.3g}"
