"""Agreement of two channels on the ego and on the objects around it (C-050 to C-060).

Kernels return NaN for "not evaluated"; the panel turns it into a mask.
"""

from __future__ import annotations

from math import hypot

import numpy as np
from scipy.optimize import linear_sum_assignment

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import kernel

VARIANCE_WINDOW = 5  # samples (C-052)
PAIRING_DISTANCE = 4.0  # m (C-054)


@kernel
def location_similarity(ego_a: Floats, ego_b: Floats) -> float:
    """Returns 1 / (1 + d) of two ego positions d m apart (C-050)."""
    return 1.0 / (1.0 + hypot(ego_a[0] - ego_b[0], ego_a[1] - ego_b[1]))


@kernel
def angle_similarity(a: float, b: float) -> float:
    """Returns 1 - |a - b| / pi with the difference wrapped to [0, pi], in rad (C-053)."""
    difference = abs(a - b) % (2.0 * np.pi)
    return 1.0 - min(difference, 2.0 * np.pi - difference) / np.pi


@kernel
def sample_variance(values: Floats) -> float:
    """Returns the sample variance (divisor n - 1) of a full window; NaN while a value is missing (C-052)."""
    mean = np.mean(values)
    total = 0.0
    for v in values:
        total += (v - mean) ** 2
    return total / (len(values) - 1)


@kernel
def count_similarity(n_a: int, n_b: int) -> float:
    """Returns 1 / (1 + |n_a - n_b|) (C-056)."""
    return 1.0 / (1.0 + abs(n_a - n_b))


@kernel
def pair_points(a: Floats, b: Floats, max_distance: float) -> Ints:
    """Returns one-to-one pairs (p, 2) of rows of a (n, >=2) and b (m, >=2), nearest pair first (C-054).

    No pair is further apart than `max_distance`, in m; ties go to the earlier rows.
    """
    n, m = a.shape[0], b.shape[0]
    capacity = 64
    rows, columns, squares = (
        np.empty(capacity, np.int64),
        np.empty(capacity, np.int64),
        np.empty(capacity),
    )
    found = 0
    limit = max_distance * max_distance
    for i in range(n):
        for j in range(m):
            dx = a[i, 0] - b[j, 0]
            if abs(dx) > max_distance:
                continue
            square = dx * dx + (a[i, 1] - b[j, 1]) ** 2
            if square > limit:
                continue
            if found == capacity:
                rows = np.concatenate((rows, np.empty(capacity, np.int64)))
                columns = np.concatenate((columns, np.empty(capacity, np.int64)))
                squares = np.concatenate((squares, np.empty(capacity)))
                capacity *= 2
            rows[found], columns[found], squares[found] = i, j, square
            found += 1
    order = np.argsort(squares[:found], kind="mergesort")
    free_a, free_b = np.ones(n, np.bool_), np.ones(m, np.bool_)
    pairs = np.empty((min(n, m), 2), np.int64)
    k = 0
    for c in order:
        i, j = rows[c], columns[c]
        if free_a[i] and free_b[j]:
            free_a[i] = free_b[j] = False
            pairs[k, 0], pairs[k, 1] = i, j
            k += 1
    return pairs[:k]


def match_points(a: Floats, b: Floats, max_distance: float) -> Ints:
    """Returns `pair_points`, or the best assignment where taking the nearest first leaves a pair out."""
    pairs: Ints = pair_points(a, b, max_distance)
    if len(pairs) == min(len(a), len(b)):
        return pairs
    squares = ((a[:, None, :2] - b[None, :, :2]) ** 2).sum(axis=2)
    far = squares > max_distance * max_distance
    if min((~far).any(axis=0).sum(), (~far).any(axis=1).sum()) == len(pairs):
        return pairs
    cost = np.where(far, max_distance * max_distance * (len(a) + len(b) + 1.0), squares)
    rows, columns = linear_sum_assignment(cost)
    best: Ints = np.column_stack([rows, columns])[~far[rows, columns]].astype(np.int64)
    if len(best) <= len(pairs):
        return pairs
    order = np.argsort(squares[best[:, 0], best[:, 1]], kind="stable")
    ordered: Ints = best[order]
    return ordered


@kernel
def polygon_area(polygon: Floats, size: int) -> float:
    """Returns the area in m^2 of the first `size` vertices of (k, 2), by the shoelace formula (C-059)."""
    total = 0.0
    for i in range(size):
        j = i + 1 if i + 1 < size else 0
        total += polygon[i, 0] * polygon[j, 1] - polygon[i, 1] * polygon[j, 0]
    return 0.5 * abs(total)


@kernel
def polygon_areas(polygons: Floats, size: Ints) -> Floats:
    """Returns the areas (n,) in m^2 of polygons (n, k, 2) with `size` (n,) vertices each."""
    out = np.empty(len(size))
    for i in range(len(size)):
        out[i] = polygon_area(polygons[i], size[i])
    return out


@kernel
def area_ratio(a: float, b: float) -> float:
    """Returns smaller over larger area (C-058): 1 for two areas of zero, 0 for one (C-059), nan of nan."""
    if a != a or b != b:
        return np.nan
    larger = max(a, b)
    if larger > 0.0:
        return min(a, b) / larger
    return 1.0 if a == b else np.nan


@kernel
def object_similarity(
    objects_a: Floats, areas_a: Floats, objects_b: Floats, areas_b: Floats, pairs: Ints
) -> tuple[float, float, float]:
    """Returns location, orientation and area similarity: means over pairs (C-055, C-057, C-058).

    objects (n, 5), areas (n,) in m^2, pairs (p, 2). Both channels empty: 1; no pair: NaN (C-060).
    """
    if objects_a.shape[0] == 0 and objects_b.shape[0] == 0:
        return 1.0, 1.0, 1.0
    if pairs.shape[0] == 0:
        return np.nan, np.nan, np.nan
    location = orientation = area = 0.0
    areas = 0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        location += location_similarity(objects_a[i], objects_b[j])
        orientation += angle_similarity(objects_a[i, 2], objects_b[j, 2])
        ratio = area_ratio(areas_a[i], areas_b[j])
        if np.isfinite(ratio):  # a shape that is not a number is left out, not a disagreement
            area += ratio
            areas += 1
    p = pairs.shape[0]
    return location / p, orientation / p, area / areas if areas > 0 else np.nan


@kernel
def class_agreement(classes_a: Ints, classes_b: Ints, pairs: Ints) -> float:
    """Returns the share of pairs with equal classes where both channels name one (C-097); NaN without any.

    A class below 0 is not named.
    """
    known = equal = 0
    for k in range(pairs.shape[0]):
        a, b = classes_a[pairs[k, 0]], classes_b[pairs[k, 1]]
        if a >= 0 and b >= 0:
            known += 1
            equal += 1 if a == b else 0
    return equal / known if known > 0 else np.nan
