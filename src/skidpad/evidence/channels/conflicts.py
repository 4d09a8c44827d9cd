"""When two boxes in motion meet, and how nearly they do not: exact between samples (C-091, C-092).

Within a step of `Movers` both boxes keep their headings and move on straight lines. So the times of
overlap are where four pairs of parallel limits (separating axes) hold, which are intervals of one
line for equal times, and a polygon in the plane of both times for a shift between them.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.evidence.channels.boxes import HORIZON, STEP

PET_SAFE = 2.0  # s, the post-encroachment time without risk (C-094)
TINY = 1e-12
CORNERS = 16  # of a square cut by eight lines, at most 12


@inner_kernel
def _axes(a: Floats, half_a: Floats, b: Floats, half_b: Floats, out: Floats) -> None:
    """Writes into out (4, 3) two boxes' edge normals x, y and the m between centres at which they touch."""
    ac, as_, bc, bs = a[2], a[3], b[2], b[3]
    al, aw, bl, bw = half_a[0], half_a[1], half_b[0], half_b[1]
    cc, cs = abs(ac * bc + as_ * bs), abs(as_ * bc - ac * bs)
    out[0, 0], out[0, 1], out[0, 2] = ac, as_, al + bl * cc + bw * cs
    out[1, 0], out[1, 1], out[1, 2] = -as_, ac, aw + bl * cs + bw * cc
    out[2, 0], out[2, 1], out[2, 2] = bc, bs, bl + al * cc + aw * cs
    out[3, 0], out[3, 1], out[3, 2] = -bs, bc, bw + al * cs + aw * cc


@inner_kernel
def _entry(x: float, y: float, dx: float, dy: float, axes: Floats) -> float:
    """Returns the share of a step after which two boxes overlap; inf: never in this step.

    x, y: m from one centre to the other; dx, dy: by how much that changes in the step; axes: of `_axes`.
    """
    low, high = 0.0, 1.0
    for m in range(4):
        q = axes[m, 0] * x + axes[m, 1] * y
        r = axes[m, 0] * dx + axes[m, 1] * dy
        h = axes[m, 2]
        if abs(r) < TINY:
            if abs(q) > h:
                return np.inf
            continue
        one, two = (-h - q) / r, (h - q) / r
        low, high = max(low, min(one, two)), min(high, max(one, two))
    return low if low <= high else np.inf


@inner_kernel
def first_overlap(a: Floats, half_a: Floats, b: Floats, half_b: Floats) -> float:
    """Returns the time in s of the first overlap of two motions (SAMPLES, 4); inf when they never meet.

    half_a, half_b: (2,) half length and half width in m.
    """
    axes = np.empty((4, 3))
    reach = half_a[0] + half_a[1] + half_b[0] + half_b[1]
    n = a.shape[0]
    for k in range(n):
        x, y = b[k, 0] - a[k, 0], b[k, 1] - a[k, 1]
        dx = dy = 0.0
        if k < n - 1:
            dx, dy = b[k + 1, 0] - a[k + 1, 0] - x, b[k + 1, 1] - a[k + 1, 1] - y
        room = reach + abs(dx) + abs(dy)
        if x * x + y * y > room * room:  # an upper bound of the way is enough, and fast
            continue
        _axes(a[k], half_a, b[k], half_b, axes)
        share = _entry(x, y, dx, dy, axes)
        if share < np.inf:
            return (k + share) * STEP
    return np.inf


@inner_kernel
def _cut_polygon(corners: Floats, n: int, c: float, cs: float, cu: float, out: Floats) -> int:
    """Writes the part of a polygon where c + cs s + cu u <= 0 into `out`; returns its number of corners.

    corners: (n, 2) in (s, u).
    """
    m = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = c + cs * corners[i, 0] + cu * corners[i, 1]
        there = c + cs * corners[j, 0] + cu * corners[j, 1]
        if here <= 0.0:
            out[m, 0], out[m, 1] = corners[i, 0], corners[i, 1]
            m += 1
        if (here < 0.0 < there) or (there < 0.0 < here):
            f = here / (here - there)
            out[m, 0] = corners[i, 0] + f * (corners[j, 0] - corners[i, 0])
            out[m, 1] = corners[i, 1] + f * (corners[j, 1] - corners[i, 1])
            m += 1
    return m


@inner_kernel
def _shared_corners(
    a: Floats, i: int, half_a: Floats, b: Floats, j: int, half_b: Floats, axes: Floats, room: Floats
) -> int:
    """Writes into room[0] the corners (s, u) of where two boxes overlap; returns how many there are.

    s: share of step i of motion a, u: share of step j of motion b, each 0 to 1. 0 corners: no overlap.
    """
    x, y = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
    ax, ay = a[i + 1, 0] - a[i, 0], a[i + 1, 1] - a[i, 1]
    bx, by = b[j + 1, 0] - b[j, 0], b[j + 1, 1] - b[j, 1]
    _axes(a[i], half_a, b[j], half_b, axes)
    for k in range(4):
        room[0, k, 0] = 1.0 if k == 1 or k == 2 else 0.0
        room[0, k, 1] = 1.0 if k >= 2 else 0.0
    n = 4
    for m in range(4):
        q = axes[m, 0] * x + axes[m, 1] * y
        cs = -(axes[m, 0] * ax + axes[m, 1] * ay)
        cu = axes[m, 0] * bx + axes[m, 1] * by
        n = _cut_polygon(room[0], n, q - axes[m, 2], cs, cu, room[1])
        n = _cut_polygon(room[1], n, -q - axes[m, 2], -cs, -cu, room[0])
        if n == 0:
            return 0
    return n


@inner_kernel
def _stride(motion: Floats) -> float:
    """Returns the longest step in m between neighbouring samples of a motion; 0 for one sample."""
    longest = 0.0
    for k in range(motion.shape[0] - 1):
        d = np.hypot(motion[k + 1, 0] - motion[k, 0], motion[k + 1, 1] - motion[k, 1])
        longest = max(longest, d)
    return longest


@kernel
def encroachment(a: Floats, half_a: Floats, b: Floats, half_b: Floats) -> tuple[float, float]:
    """Returns the post-encroachment time in s of two motions (SAMPLES, 4) that never meet, and nearness.

    The time is the smallest shift in s that makes them touch, inf above PET_SAFE. Nearness in
    [0, 1] is the greatest (1 - shift / PET_SAFE)(1 - t / HORIZON) over all places that both
    sweep, t being when the second of them comes there: less for what is later or farther apart.
    """
    steps = a.shape[0] - 1
    axes, room = np.empty((4, 3)), np.empty((2, CORNERS, 2))
    reach = half_a[0] + half_a[1] + half_b[0] + half_b[1] + _stride(a) + _stride(b)
    reach_sq = reach * reach
    least, nearness = np.inf, 0.0
    for shift in range(round(PET_SAFE / STEP) + 1):
        soonest = max(shift - 1, 0) * STEP
        if soonest >= least and 1.0 - soonest / PET_SAFE <= nearness:
            break
        for early in range(steps - shift):
            for swap in range(2 if shift > 0 else 1):
                i, j = (early, early + shift) if swap == 0 else (early + shift, early)
                x, y = b[j, 0] - a[i, 0], b[j, 1] - a[i, 1]
                if x * x + y * y > reach_sq:
                    continue
                for k in range(_shared_corners(a, i, half_a, b, j, half_b, axes, room)):
                    t_a, t_b = (i + room[0, k, 0]) * STEP, (j + room[0, k, 1]) * STEP
                    apart = abs(t_b - t_a)
                    if apart > PET_SAFE:
                        continue
                    least = min(least, apart)
                    near = (1.0 - apart / PET_SAFE) * (1.0 - max(t_a, t_b) / HORIZON)
                    nearness = max(nearness, near)
    return least, nearness
