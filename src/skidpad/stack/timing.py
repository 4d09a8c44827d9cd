"""Durations as counts of ticks: repeated addition of 0.05 s hits neither 1.0 nor 1.5 (A-100)."""

from __future__ import annotations

from math import ceil, floor

ROUNDING = 1e-6  # of a tick


def ticks_to_reach(duration: float, dt: float) -> int:
    """Smallest number of ticks that lasts at least `duration`: 2 for 0.067 s at 0.05 s."""
    return ceil(duration / dt - ROUNDING)


def ticks_within(duration: float, dt: float) -> int:
    """Largest number of ticks that lasts at most `duration`: 3 for 0.17 s at 0.05 s."""
    return floor(duration / dt + ROUNDING)
