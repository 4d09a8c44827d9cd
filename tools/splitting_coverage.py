"""Coverage of splitting on a closed form: how often the interval of ten repetitions holds the truth.

    python tools/splitting_coverage.py --intervals 400

A random walk begins at height 1, goes up with probability 1/3 and else down, and reaches height N before
the ground with 1 / (2^N - 1). One row per probability and number of paths; printed as it is made.
"""

from __future__ import annotations

import argparse
import random
from dataclasses import dataclass

import numpy as np

from skidpad.search.splitting import split_paths, splitting_estimate

CASES = ((7, 100), (14, 40), (14, 100), (20, 40), (20, 100), (20, 300))  # N, paths
REPETITIONS = 10


@dataclass
class Walk:
    """Holds the heights of one walk; score: how far below the goal it stayed."""

    heights: list[int]
    score: float


class Walks:
    """Begins walks at height 1, and goes on with others from where they came nearer to the goal."""

    def __init__(self, goal: int, seed: int) -> None:
        self.goal, self.random = goal, random.Random(seed).random

    def begin(self, number: int) -> Walk:
        """Returns a walk from the beginning."""
        del number
        return self._go_on([1])

    def branch(self, path: Walk, below: float, name: str) -> Walk:
        """Returns a walk that leaves `path` where it is first less than `below` from the goal."""
        del name
        first = next(k for k, h in enumerate(path.heights) if self.goal - h < below)
        return self._go_on(path.heights[: first + 1])

    def _go_on(self, heights: list[int]) -> Walk:
        """Returns the walk to its end."""
        heights = list(heights)
        while 0 < heights[-1] < self.goal:
            heights.append(heights[-1] + (1 if self.random() < 1.0 / 3.0 else -1))
        return Walk(heights, float(self.goal - max(heights)))


def main() -> None:
    """Prints a row of a table per case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, default=400)
    wanted = parser.parse_args().intervals
    print(
        "| probability | paths | interval holds it | above it | mean over truth | half-width | walks |"
    )
    print("|---|---|---|---|---|---|---|")
    for goal, count in CASES:
        truth, rng, walks = 1.0 / (2.0**goal - 1.0), np.random.default_rng(goal), Walks(goal, count)
        found = []
        for _ in range(wanted):
            ten = [split_paths(walks, count, rng) for _ in range(REPETITIONS)]
            found.append(splitting_estimate([s.p for s in ten], sum(s.paths for s in ten)))
        holds = np.mean([e.low <= truth <= e.high for e in found])
        above = np.mean([e.low > truth for e in found])
        mean, width = (
            np.mean([e.p for e in found]) / truth,
            np.median([e.half_width for e in found]),
        )
        runs = np.mean([e.runs for e in found])
        print(
            f"| {truth:.1e} | {count} | {holds:.1%} | {above:.1%} | {mean:.3f} | {width:.0%} | {runs:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
