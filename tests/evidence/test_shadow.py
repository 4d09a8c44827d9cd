"""A shadow against the driver: stretches in which one brakes alone, and who braked first."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from skidpad.evidence.shadow import (
    SHORTEST,
    Foresight,
    Parting,
    Pedals,
    foresight,
    partings,
    share_apart,
)

T = np.arange(200) * 0.05


def pedals(*stretches: tuple[float, float]) -> Pedals:
    """Full brake within stretches of time."""
    brake = np.zeros(len(T))
    for begin, end in stretches:
        brake[(begin - 1e-9 <= T) & (end - 1e-9 > T)] = 1.0
    return Pedals(np.zeros(len(T)), brake)


def test_who_brakes_alone_is_listed_with_its_time():
    found = partings(T, pedals((2.0, 5.0)), pedals((1.0, 4.0), (6.0, 6.2)))
    assert [(round(p.begin, 2), round(p.end, 2), p.shadow_brakes) for p in found] == [
        (1.0, 2.0, True),
        (4.0, 5.0, False),
    ], "0.2 s are too short"
    assert isinstance(found[0], Parting)


def test_before_an_event_the_first_braking_counts():
    driver, shadow = pedals((7.4, 8.0)), pedals((5.0, 5.5), (6.0, 8.0))
    (before,) = foresight(T, np.array([8.0]), driver, shadow)
    assert (round(before.driver, 2), round(before.shadow, 2)) == (0.6, 3.0)
    assert foresight(T, np.array([1.0]), driver, shadow) == [Foresight(1.0, None, None)]


def test_moments_in_which_nobody_was_asked_do_not_count():
    driver, shadow = pedals((0.0, 10.0)), pedals()
    driver.brake[:100] = shadow.brake[:100] = np.nan
    assert share_apart(driver, shadow) == 1.0
    assert partings(T, driver, shadow)[0].begin == T[100]
    driver.brake[:] = np.nan
    assert share_apart(driver, shadow) == 0.0


@given(seed=st.integers(0, 1000))
def test_partings_are_apart_in_order_and_vanish_for_equal_drivers(seed):
    rng = np.random.default_rng(seed)
    a, b = (Pedals(np.zeros(200), np.repeat(rng.random(20), 10)) for _ in range(2))
    found = partings(T, a, b)
    assert all(p.end - p.begin >= SHORTEST for p in found)
    assert all(p.end <= q.begin for p, q in pairwise(found))
    assert partings(T, a, a) == []
    assert share_apart(a, b) == share_apart(b, a)
    swapped = [p._replace(shadow_brakes=not p.shadow_brakes) for p in partings(T, b, a)]
    assert swapped == found
