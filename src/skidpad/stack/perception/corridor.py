"""Kernels that read one distance from the pixels of a depth and label image pair.

Image rows run down, columns right; a pixel left of the principal column lies left of the ego.
Depth arrives as inverse depth, 0 where there is nothing.
"""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import Segments
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.vocabulary import SemanticClass


class Labels(NamedTuple):
    """Classes that stand side by side in SemanticClass, so that one comparison finds them."""

    first: int
    size: int


VEHICLES = Labels(int(SemanticClass.CAR), 3)  # car, truck, bus (D-011)
# From pedestrian to dynamic: whoever uses the road, and whatever lies on it.
ROAD_USERS = Labels(int(SemanticClass.PEDESTRIAN), 10)


class Corridor(NamedTuple):
    """What a tier keeps: |d| < min(half_width + widening * Z, half_width_max), near < Z < far."""

    focal: float  # px
    cx: float  # px
    row_first: int  # rows row_first <= row < row_end are read
    row_end: int
    half_width: float  # m at Z = 0
    widening: float  # m per m
    half_width_max: float  # m
    near: float  # m
    far: float  # m
    min_vehicle: float  # px in the rows read, fewer: no target
    min_kept: float  # px in the corridor, fewer: no target
    wanted: Labels = VEHICLES  # classes


@kernel
def lateral_offset(z: float, u: float, c: Corridor, sin_yaw: float, kappa: float) -> float:
    """Returns the m by which column u at depth z m lies left of the lane's path (eq. 5, 7; A-041, A-042).

    sin_yaw: of the heading error to the lane, left positive; kappa: half the lane's curvature.
    """
    return (c.cx - u) * z / c.focal + z * sin_yaw - kappa * z * z


@kernel
def half_width(z: float, c: Corridor) -> float:
    """Returns the half-width of the corridor at depth z in m (eq. 8)."""
    return min(c.half_width + c.widening * z, c.half_width_max)


@kernel
def in_width(z: float, u: float, c: Corridor, sin_yaw: float, kappa: float) -> bool:
    """Returns whether column u at depth z m is strictly inside in width."""
    return bool(abs(lateral_offset(z, u, c, sin_yaw, kappa)) < half_width(z, c))


@kernel
def in_corridor(z: float, u: float, c: Corridor, sin_yaw: float, kappa: float) -> bool:
    """Returns whether column u at depth z m is strictly inside in depth and width (A-054)."""
    return bool(c.near < z < c.far and in_width(z, u, c, sin_yaw, kappa))


@inner_kernel
def _is_one(label: np.uint8, first: np.uint8, count: np.uint8) -> bool:
    """Returns whether the label is one of the `count` labels from `first` on."""
    return bool(np.uint8(label - first) < count)


@kernel
def reachable_columns(c: Corridor, sin_yaw: float, kappa: float, width: int) -> tuple[int, int]:
    """Returns columns first <= u < end outside which no depth lies in the corridor.

    |d| < w means (cx - u) / f within kappa Z - sin_yaw +- w / Z. The first term is linear in Z
    and w / Z falls with Z, so the extremes over [near, far] bound both.
    """
    spread = half_width(c.near, c) / c.near
    low = min(kappa * c.near, kappa * c.far) - sin_yaw - spread
    high = max(kappa * c.near, kappa * c.far) - sin_yaw + spread
    first = int(max(0.0, np.floor(c.cx - high * c.focal)))
    end = int(min(float(width), np.ceil(c.cx - low * c.focal) + 1.0))
    return min(first, width), max(end, 0)


@inner_kernel
def _found_in_row(
    labels: NDArray[np.uint8], row: int, col_first: int, col_end: int, wanted: Labels
) -> int:
    """Returns how many pixels of a row in col_first <= u < col_end have a wanted label.

    Counted without a branch, so that the compiler takes many pixels at once.
    """
    first, classes = np.uint8(wanted.first), np.uint8(wanted.size)
    count = np.int32(0)
    for u in range(col_first, col_end):
        count += np.int32(_is_one(labels[row, u], first, classes))
    return int(count)


@inner_kernel
def _count_beside(labels: NDArray[np.uint8], c: Corridor, col_first: int, col_end: int) -> int:
    """Returns how many wanted pixels the corridor's rows have in col_first <= column < col_end."""
    count = 0
    for row in range(c.row_first, c.row_end):
        count += _found_in_row(labels, row, col_first, col_end, c.wanted)
    return count


@inner_kernel
def select(values: NDArray[np.float32], n: int, k: int) -> float:
    """Returns the k-th smallest (from 0) of values[:n]; reorders them so that smaller ones come first."""
    left, right = 0, n - 1
    while left < right:
        pivot = values[(left + right) // 2]
        i, j = left, right
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k <= j:
            right = j
        elif k >= i:
            left = i
        else:
            break
    return float(values[k])


@kernel
def percentile(values: NDArray[np.float32], n: int, fraction: float) -> float:
    """Returns the percentile of values[:n], interpolated between neighbours; reorders them.

    fraction: 0 to 1; n >= 1.
    """
    position = fraction * (n - 1)
    k = floor(position)
    low = select(values, n, k)
    if k + 1 >= n:
        return low
    high = values[k + 1]
    for i in range(k + 2, n):
        high = min(high, values[i])
    return low + (position - k) * (float(high) - low)


@kernel
def read_pixels(
    inverse_depth: NDArray[np.float32],
    labels: NDArray[np.uint8],
    c: Corridor,
    fraction: float,
    sin_yaw: float,
    kappa: float,
    scratch: NDArray[np.float32],
) -> float:
    """Returns the tier's distance in m, NaN for no target (A-044 to A-054).

    inverse_depth (H, W) 1/m, labels (H, W) of the same view; scratch: room for every pixel read;
    fraction: of the percentile; sin_yaw, kappa: as in `lateral_offset`.
    """
    width = labels.shape[1]
    first, end = reachable_columns(c, sin_yaw, kappa, width)
    class_first, classes = np.uint8(c.wanted.first), np.uint8(c.wanted.size)
    vehicle = 0
    kept = 0
    for row in range(c.row_first, c.row_end):
        here = _found_in_row(labels, row, first, end, c.wanted)
        if here == 0:  # most rows show none
            continue
        vehicle += here
        for u in range(first, end):
            if _is_one(labels[row, u], class_first, classes):
                inverse = inverse_depth[row, u]
                if inverse > 0.0:
                    z = 1.0 / float(inverse)
                    if in_corridor(z, float(u), c, sin_yaw, kappa):
                        scratch[kept] = z
                        kept += 1
    if kept < c.min_kept or kept == 0:
        return np.nan
    if vehicle < c.min_vehicle:  # the rest of the image decides
        vehicle += _count_beside(labels, c, 0, first)
        vehicle += _count_beside(labels, c, end, width)
        if vehicle < c.min_vehicle:
            return np.nan
    return percentile(scratch, kept, fraction)


@kernel
def read_segments(
    runs: Segments,
    c: Corridor,
    near: float,
    far: float,
    fraction: float,
    sin_yaw: float,
    kappa: float,
    room: Floats,
) -> float:
    """Returns the same distance from runs of pixels, each weighing as many pixels as it covers (M-3).

    near, far: m, instead of the corridor's; room (n, 2) for every run.
    """
    class_first, classes = np.uint8(c.wanted.first), np.uint8(c.wanted.size)
    vehicle = 0.0
    kept = 0
    total = 0.0
    for i in range(len(runs.u)):
        top, bottom = float(runs.top[i]), float(runs.bottom[i])
        rows = min(bottom, float(c.row_end)) - max(top, float(c.row_first))
        if rows <= 0.0 or not _is_one(runs.label[i], class_first, classes):
            continue
        pixels = rows * float(runs.width[i])
        vehicle += pixels
        depth = float(runs.depth[i])
        if near < depth < far and in_width(depth, float(runs.u[i]), c, sin_yaw, kappa):
            insert(room, kept, depth, pixels)
            total += pixels
            kept += 1
    if vehicle < c.min_vehicle or total < c.min_kept or kept == 0:
        return np.nan
    return weighted_percentile(room, kept, fraction * max(total - 1.0, 0.0))


@kernel
def insert(sorted: Floats, n: int, value: float, weight: float) -> None:
    """Inserts a row with value and weight into the first n rows, which are sorted by value."""
    k = n
    while k > 0 and sorted[k - 1, 0] > value:
        sorted[k, 0], sorted[k, 1] = sorted[k - 1, 0], sorted[k - 1, 1]
        k -= 1
    sorted[k, 0], sorted[k, 1] = value, weight


@kernel
def weighted_percentile(sorted: Floats, n: int, position: float) -> float:
    """Returns the value at a position among n values that each stand as often as their weight says.

    Interpolated as in `percentile`; sorted: as `insert` leaves it; position: counted from 0.
    """
    k = floor(position)
    passed = 0.0
    low = sorted[n - 1, 0]
    high = low
    found = False
    for i in range(n):
        passed += sorted[i, 1]
        if not found and passed > k:
            low = sorted[i, 0]
            found = True
        if passed > k + 1.0:
            high = sorted[i, 0]
            break
    return float(low + (position - k) * (high - low))
