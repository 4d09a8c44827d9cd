"""Dynamic time warping between two series of one quantity (B-107, decision G-4)."""

from __future__ import annotations

from enum import Enum

import numpy as np
from dtaidistance import dtw

from skidpad.core.arrays import Floats


class Cost(str, Enum):
    """What one pair of values costs."""

    SQUARED = "squared"  # root of the sum of squared differences: what the published values show
    ABSOLUTE = "absolute"  # sum of absolute differences


INNER = {Cost.SQUARED: "squared euclidean", Cost.ABSOLUTE: "euclidean"}


def warping_distance(
    a: Floats, b: Floats, cost: Cost = Cost.SQUARED, max_shift: int | None = None
) -> float:
    """Returns the least cost of aligning a (n,) with b (m,) by steps (1,0), (0,1), (1,1); not normalised.

    max_shift: samples by which an alignment may leave the band between the diagonals through the
    two ends (for n = m this is Sakoe and Chiba's |i - j| <= max_shift); None: no limit. The
    library counts one more in its `window`, where 1 is the diagonal alone. ValueError for an empty
    series.
    """
    a, b = (np.ascontiguousarray(x, dtype=np.float64) for x in (a, b))
    if not (a.size and b.size):
        raise ValueError("warping needs at least one value in each series")
    window = None if max_shift is None else max_shift + 1
    # Pruning by the library's Euclidean bound loses alignments that equal the bound: it says inf.
    return float(dtw.distance_fast(a, b, window=window, inner_dist=INNER[cost], use_pruning=False))
