"""Durations as counts of ticks: repeated addition of 0.05 s hits neither 1.0 nor 1.5 (A-100)."""

from __future__ import annotations

from math import ceil, floor

ROUNDING = 1e-6  # of a tick


def ticks_to_reach(duration: float, dt: float) -> int:
    """Returns the smallest number of ticks of dt s that lasts at least `duration` s: 2 for 0.067 at 0.05."""
    return ceil(duration / dt - ROUNDING)


def ticks_within(duration: float, dt: float) -> int:
    """Returns the largest number of ticks of dt s that lasts at most `duration` s: 3 for 0.17 at 0.05."""
    return floor(duration / dt + ROUNDING)
