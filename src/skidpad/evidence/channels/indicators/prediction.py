"""Agreement of plans and predictions, across channels and with what happened (C-070 to C-079).

Kernels return NaN for "not evaluated"; the panel turns it into a mask.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import kernel
from skidpad.evidence.channels.indicators.similarity import pair_points

WAYPOINT_DECAY = 0.95  # per way-point (C-070)
WAYPOINT_STEP = 0.2  # s between way-points
WAYPOINTS = 26  # plans are compared over 5 s at most
HISTORY_DECAY = 0.9  # per older plan (C-078)
MATCH_TOLERANCE = 1.0  # m (C-075)


@kernel
def trajectory_similarity(a: Floats, b: Floats, decay: float) -> float:
    """Returns the weighted mean of 1 / (1 + d_n) over corresponding way-points (C-070 to C-073).

    a, b (m, 2) at common times; the weight of way-point n is decay^(n - 1). NaN when m is 0.
    """
    total = weights = 0.0
    weight = 1.0
    for n in range(a.shape[0]):
        total += weight / (1.0 + np.hypot(a[n, 0] - b[n, 0], a[n, 1] - b[n, 1]))
        weights += weight
        weight *= decay
    return total / weights if weights > 0.0 else np.nan


@kernel
def object_trajectory_similarity(
    ways_a: Floats, inside_a: Ints, ways_b: Floats, inside_b: Ints, pairs: Ints, decay: float
) -> float:
    """Returns the mean over pairs (p, 2) of the similarity of their predictions (C-073).

    ways (n, m, 2) are sampled at common times and extended at last velocity, inside (n,) is each
    one's own duration in way-points; the longer of the two counts. Pairs without any prediction
    in one channel are left out; both channels empty: 1; nothing to compare: NaN (C-060).
    """
    if ways_a.shape[0] == 0 and ways_b.shape[0] == 0:
        return 1.0
    total = 0.0
    compared = 0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        if inside_a[i] == 0 or inside_b[j] == 0:
            continue
        m = max(inside_a[i], inside_b[j])
        total += trajectory_similarity(ways_a[i, :m], ways_b[j, :m], decay)
        compared += 1
    return total / compared if compared > 0 else np.nan


@kernel
def discrete_frechet(a: Floats, b: Floats) -> float:
    """Returns the discrete Frechet distance in m of polylines a (n, 2) and b (m, 2); NaN for an empty one."""
    n, m = a.shape[0], b.shape[0]
    if n == 0 or m == 0:
        return np.nan
    row = np.empty(m)
    for i in range(n):
        diagonal = 0.0
        for j in range(m):
            d = np.hypot(a[i, 0] - b[j, 0], a[i, 1] - b[j, 1])
            above = row[j]
            if i == 0 and j == 0:
                reach = d
            elif i == 0:
                reach = row[j - 1]
            elif j == 0:
                reach = above
            else:
                reach = min(above, diagonal, row[j - 1])
            diagonal = above
            row[j] = max(d, reach)
    return float(row[m - 1])


@kernel
def plan_agreement(a: Floats, b: Floats) -> float:
    """Returns 1 / (1 + Frechet distance) of two plans (m, 2) over their overlap; NaN below two way-points."""
    if a.shape[0] < 2:
        return np.nan
    return 1.0 / (1.0 + discrete_frechet(a, b))


@kernel
def cross_channel_agreement(a: Floats, b: Floats) -> float:
    """Returns `plan_agreement` after moving b's start onto a's (C-079): a, b (m, 2) at common times."""
    moved = b.copy()
    for n in range(b.shape[0]):
        moved[n, 0] += a[0, 0] - b[0, 0]
        moved[n, 1] += a[0, 1] - b[0, 1]
    return plan_agreement(a, moved)


@kernel
def weighted_history(scores: Floats, decay: float) -> float:
    """Returns the weighted mean of scores (h,), newest first, each older one times `decay` (C-078, DC-08).

    Scores that are not finite are left out; nan without any.
    """
    total = weights = 0.0
    weight = 1.0
    for score in scores:
        if np.isfinite(score):
            total += weight * score
            weights += weight
        weight *= decay
    return total / weights if weights > 0.0 else np.nan


@kernel
def follow_up(
    predicted: Floats,
    inside: Ints,
    ids_then: Ints,
    actual: Floats,
    ids_now: Ints,
    tolerance: float,
    search: float,
) -> tuple[int, int, int]:
    """Returns how many objects followed their prediction, missed it, or left (C-075, C-076).

    predicted (n, >=2) is where they should be now, inside (n,) > 0 where a prediction reaches
    that far, actual (m, >=2) where objects are. With identities an object is looked up by its own;
    without (any id below 0), the nearest within `search` m is taken, one to one (decision C-10). An
    object followed when it is within `tolerance` m, left when it has no partner.
    """
    followed = missed = left = 0
    by_id = len(ids_then) > 0 and np.all(ids_then >= 0) and np.all(ids_now >= 0)
    partner = np.full(predicted.shape[0], -1, np.int64)
    if by_id:
        for i in range(predicted.shape[0]):
            for j in range(actual.shape[0]):
                if ids_now[j] == ids_then[i]:
                    partner[i] = j
                    break
    else:
        pairs = pair_points(predicted, actual, search)
        for k in range(pairs.shape[0]):
            partner[pairs[k, 0]] = pairs[k, 1]
    for i in range(predicted.shape[0]):
        if inside[i] == 0:
            continue
        j = partner[i]
        if j < 0:
            left += 1
        elif np.hypot(predicted[i, 0] - actual[j, 0], predicted[i, 1] - actual[j, 1]) <= tolerance:
            followed += 1
        else:
            missed += 1
    return followed, missed, left
