"""Changes of speed within limits of jerk, against hand-derived times and peaks."""

from __future__ import annotations

from math import inf, sqrt

import pytest

from skidpad.scenarios.actions.jerk import Jerk, smooth_pieces


def ends(pieces):
    """Speed and acceleration at the end of the last piece."""
    return pieces[-1].at(pieces[-1].duration)


@pytest.mark.osc("SpeedProfileAction")
def test_the_fastest_change_rises_holds_and_falls():
    """By 6 m/s: 3 m/s2 after 1.5 s, held for 6 / 3 - 0.5 * 3 * (1/2 + 1/3) = 0.75 s, 0 after 1 s."""
    pieces = list(smooth_pieces(10.0, 16.0, 3.0, Jerk(2.0, 3.0), None))
    assert [p.duration for p in pieces] == pytest.approx([1.5, 0.75, 1.0])
    assert ends(pieces) == pytest.approx((16.0, 0.0))


def test_braking_begins_with_the_downward_limit():
    pieces = list(smooth_pieces(10.0, 9.0, 9.0, Jerk(2.0, 3.0), None))
    assert [p.jerk for p in pieces] == pytest.approx([-3.0, 0.0, 2.0])
    assert pieces[1].a == pytest.approx(-sqrt(2.0 / (1.0 / 2.0 + 1.0 / 3.0)))
    assert ends(pieces) == pytest.approx((9.0, 0.0))


@pytest.mark.parametrize("jerk", [Jerk(2.0, 3.0), Jerk(2.0, inf), Jerk(inf, 1.0)])
def test_a_time_is_kept_where_the_limits_allow_it_else_it_takes_longer(jerk):
    kept = list(smooth_pieces(10.0, 16.0, 3.0, jerk, 6.0))
    assert sum(p.duration for p in kept) == pytest.approx(6.0)
    assert ends(kept)[0] == pytest.approx(16.0)
    fastest = sum(p.duration for p in smooth_pieces(10.0, 16.0, 3.0, jerk, None))
    hasty = list(smooth_pieces(10.0, 16.0, 3.0, jerk, 1.0))
    assert sum(p.duration for p in hasty) == pytest.approx(fastest)
    assert ends(hasty)[0] == pytest.approx(16.0)


def test_a_speed_that_stays_takes_its_time():
    (piece,) = smooth_pieces(10.0, 10.0, 3.0, Jerk(1.0, 1.0), 4.0)
    assert piece.duration == 4.0
    assert ends([piece]) == (10.0, 0.0)
