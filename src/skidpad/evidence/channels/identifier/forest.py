"""Boosted decision trees as plain arrays, and their evaluation: no library, no pickle (C-15)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.errors import FileError
from skidpad.core.kernels.jit import kernel


class Forest(NamedTuple):
    """Nodes of all trees in one table. A leaf has feature -1; x <= threshold goes left."""

    roots: Ints  # (trees,) first node of each tree
    feature: Ints  # (nodes,)
    threshold: Floats  # (nodes,)
    left: Ints  # (nodes,)
    right: Ints
    missing_left: Ints  # (nodes,) 1: a value that was not evaluated goes left
    value: Floats  # (nodes,) of leaves, log-odds
    baseline: Floats  # (1,) log-odds without any tree


def check_forest(forest: Forest, features: int) -> Forest:
    """Returns `forest` when every walk through it stays inside and ends; else raises FileError.

    features: how many features a row has.
    """
    n = forest.feature.size
    same = all(a.shape == (n,) for a in forest[1:7]) and forest.baseline.shape == (1,)
    if not same or n == 0:
        raise FileError("a model's trees must be tables of one length")
    inner = forest.feature >= 0
    at = np.arange(n)[inner]
    forward = (forest.left[inner] > at) & (forest.right[inner] > at)  # so every walk ends
    inside = (forest.left[inner] < n) & (forest.right[inner] < n)
    roots = (forest.roots >= 0) & (forest.roots < n)
    if not (forward.all() and inside.all() and roots.all() and (forest.feature < features).all()):
        raise FileError("a model's trees point outside their tables")
    if not (np.isfinite(forest.value).all() and np.isfinite(forest.baseline).all()):
        raise FileError("a model's values must be finite")
    return forest


@kernel
def probabilities(forest: Forest, x: Floats, out: Floats) -> None:
    """Writes the probability for each row of features x (m, f) into out (m,)."""
    for i in range(x.shape[0]):
        total = forest.baseline[0]
        for r in range(forest.roots.size):
            node = forest.roots[r]
            while forest.feature[node] >= 0:
                v = x[i, forest.feature[node]]
                if np.isnan(v):
                    goes_left = forest.missing_left[node] > 0
                else:
                    goes_left = v <= forest.threshold[node]
                node = forest.left[node] if goes_left else forest.right[node]
            total += forest.value[node]
        out[i] = 1.0 / (1.0 + np.exp(-total))
