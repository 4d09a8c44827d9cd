"""Plots under a film: values where there are some, the moment, the crash."""

from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.cockpit.plots import CRASH, FOOT, GAP, LEFT, LIMIT, NOW, PLOT, RIGHT, ROW, SPEED, Plots
from skidpad.cockpit.source import Curves

WIDTH = 800
N = 101


def source(gap, limit=()):
    """Moments 0 to 200 of a run that crashes at tick 25 and at tick 150."""
    n = 201
    curves = Curves([30.0] * n, [None] * n, [None] * n, gap, [0.5] * n, limit=limit)
    return SimpleNamespace(
        curves=lambda part: curves,
        marks=[(25, "crash", "contact"), (150, "crash", "contact"), (120, "marking", "solid")],
        tick=lambda k: k,
        ticks=n,
        step=1,
    )


def columns(picture, row, ink):
    """Columns of a plot in which an ink stands."""
    low = (row + 1) * ROW - 4
    near = np.abs(picture[low - PLOT : low + 1].astype(int) - ink).sum(axis=2) < 30
    return {int(c) for c in np.flatnonzero(near.any(axis=0))}


@pytest.mark.req("A-275")
def test_a_film_s_plots_show_its_stretch_and_its_moment():
    gap = [None if 120 <= k < 160 else 40.0 for k in range(201)]
    gap[140] = 10.0  # alone
    plots = Plots(source(gap), range(100, 201), WIDTH)
    shown = plots.at(125)
    assert shown.shape == (3 * ROW + FOOT, WIDTH, 3)
    scale = (WIDTH - LEFT - RIGHT) / (N - 1)
    there = columns(shown, 1, GAP)
    assert {LEFT + round(scale * k) for k in (5, 15, 40, 65, 95)} <= there
    assert not there & set(range(LEFT + round(scale * 21) + 2, LEFT + round(scale * 39) - 2))
    assert not there & set(range(LEFT + round(scale * 41) + 2, LEFT + round(scale * 59) - 2))
    # the crash of the stretch alone, and the moment, in each plot
    for row in range(3):
        assert columns(shown, row, CRASH) == {LEFT + round(scale * 50) + d for d in (-1, 0, 1)}
        for k in (125, 180):
            assert columns(plots.at(k), row, NOW) == {
                LEFT + round(scale * (k - 100)) + d for d in (-1, 0, 1)
            }
    assert columns(shown, 0, SPEED)
    assert not columns(shown, 0, LIMIT)


def test_the_speed_envelope_is_drawn_where_there_is_one():
    limit = [50.0 if k < 150 else None for k in range(201)]
    shown = Plots(source([None] * 201, limit), range(100, 201), WIDTH).at(100)
    half = LEFT + (WIDTH - LEFT - RIGHT) // 2
    there = columns(shown, 0, LIMIT)
    assert half - 20 in there
    assert half + 20 not in there
    assert not columns(shown, 1, GAP)
