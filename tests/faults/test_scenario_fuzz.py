"""Mutated scenarios that are still scenarios: half of them compile, and a play ends in no fault."""

from __future__ import annotations

import random

import numpy as np

from support.faults.readers import READERS, beside, story_of
from support.faults.scenario_mutation import mutated_story, seeds

COMPILED = 0.5  # of the inputs at least


def test_the_seeds_are_clean_and_half_of_the_mutants_too(tmp_path):
    path = tmp_path / "a.xosc"
    beside(path)
    for k, seed in enumerate(seeds()):
        path.write_bytes(seed)
        assert story_of(path).scenario is not None, (k, story_of(path).findings)
    kept = []
    for number in range(120):
        rng = random.Random(number)
        path.write_bytes(mutated_story(rng, rng.choice(seeds())))
        kept.append(story_of(path).scenario is not None)
    assert np.mean(kept) >= COMPILED
    assert READERS["storyboard"].share == 1.0
