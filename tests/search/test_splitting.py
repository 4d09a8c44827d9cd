"""Splitting against a closed form: a random walk that drifts down reaches a height before the ground.

From height 1 with steps of +1 (probability 1/3) and -1 it reaches N before 0 with 1 / (2^N - 1).
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from math import log

import numpy as np
import pytest

from skidpad.search.splitting import split_paths, splitting_estimate


@dataclass
class Walk:
    """Heights of one walk. score: how far below the goal it stayed."""

    heights: list[int]
    goal: int

    @property
    def score(self):
        return float(self.goal - max(self.heights))


class Walks:
    """Walks from height 1 to the ground or to the goal."""

    def __init__(self, goal, seed):
        self.goal, self.random = goal, random.Random(seed).random

    def begin(self, number):
        return self.go_on([1])

    def branch(self, path, below, name):
        first = next(k for k, h in enumerate(path.heights) if self.goal - h < below)
        return self.go_on(path.heights[: first + 1])

    def go_on(self, heights):
        heights = list(heights)
        while 0 < heights[-1] < self.goal:
            heights.append(heights[-1] + (1 if self.random() < 1.0 / 3.0 else -1))
        return Walk(heights, self.goal)


def repeat(goal, count, repetitions, seed):
    rng = np.random.default_rng(seed)
    walks = Walks(goal, seed)
    return [split_paths(walks, count, rng) for _ in range(repetitions)]


@pytest.mark.parametrize("goal", [4, 8, 14, 20])  # 0.07, 4e-3, 6e-5, 1e-6
def test_it_is_unbiased_down_to_one_in_a_million(goal):
    found = repeat(goal, 60, 60, goal)
    truth = 1.0 / (2.0**goal - 1.0)
    ps = np.array([one.p for one in found])
    assert ps.mean() == pytest.approx(truth, abs=4.0 * ps.std(ddof=1) / np.sqrt(len(ps)))
    assert ps.std() / truth < 3.0 * np.sqrt(-log(truth) / 60)  # near that of ideal splitting
    for one in found:
        assert list(one.levels) == sorted(one.levels, reverse=True)
        assert one.ancestors <= len(one.failing) <= 60
        assert all(w.heights[0] == 1 and w.heights[-1] == goal for w in one.failing)


def test_the_interval_of_ten_repetitions_holds_the_truth():
    truth, found = 1.0 / (2.0**14 - 1.0), [one.p for one in repeat(14, 40, 200, 1)]
    inside = [
        e.low <= truth <= e.high
        for e in (splitting_estimate(found[k : k + 10], 1) for k in range(0, 200, 10))
    ]
    assert np.mean(inside) >= 0.8  # 20 intervals of 95 %


def test_below_the_floor_paths_are_counted_only():
    found = split_paths(Walks(6, 2), 400, np.random.default_rng(3), floor=3.0)
    assert min(found.levels) > 3.0
    assert found.p == pytest.approx(1.0 / 63.0, rel=0.6)


def test_without_a_failure_there_is_no_upper_end():
    nothing = splitting_estimate([0.0, 0.0], 7)
    assert (nothing.p, nothing.low, nothing.high) == (0.0, 0.0, np.inf)

    class Flat(Walks):
        def go_on(self, heights):
            return Walk([1], self.goal)

    flat = split_paths(Flat(5, 1), 20, np.random.default_rng(1))
    assert (flat.p, flat.levels, flat.paths) == (0.0, (), 20)
