"""Static segments (guardrails, walls, outlines) and the grid that finds those near a place."""

from __future__ import annotations

from math import cos, floor, radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel

CELL = 20.0  # m, a few car lengths
CELLS_MAX = 250_000  # larger maps get larger cells
SHORTEST = 1e-3  # m, a shorter one has no direction
JOINT = 0.05  # m between the ends of two segments below which one goes on as the other
STRAIGHT = cos(radians(30.0))  # of the turn at a joint: beyond it, it is a corner that sticks out


class Segments(NamedTuple):
    """m segments with their heights, and a grid over them in compressed rows."""

    x0: Floats  # (m,)
    y0: Floats
    x1: Floats
    y1: Floats
    z_low: Floats
    z_high: Floats
    joined: NDArray[np.bool_]  # (m, 2) whether the wall goes on beyond (x0, y0), beyond (x1, y1)
    origin: Floats  # (2,) corner of the grid
    shape: Ints  # (2,) cells along x and y
    cell: float  # m
    first: Ints  # (cells + 1,) where a cell's list begins in `member`
    member: Ints  # segment indices


def _cell_size(low: Floats, high: Floats) -> float:
    """Returns the edge in m of a grid cell between two corners, so that the cells stay few."""
    extent = np.maximum(high - low, 1.0)
    return float(max(CELL, np.sqrt(extent[0] * extent[1] / CELLS_MAX), extent.max() / 1.0e5))


def _cells_of(i: Floats, origin: Floats, cell: float, shape: Ints) -> list[int]:
    """Returns the indices of grid cells that the bounding box of a segment `i` (x0, y0, x1, y1) touches."""
    low = np.floor((np.minimum(i[:2], i[2:]) - origin) / cell).astype(int)
    high = np.floor((np.maximum(i[:2], i[2:]) - origin) / cell).astype(int)
    nx = int(shape[0])
    return [
        int(v) * nx + int(u) for v in range(low[1], high[1] + 1) for u in range(low[0], high[0] + 1)
    ]


def _find_joints(lines: Floats, lengths: Floats) -> NDArray[np.bool_]:
    """Returns for each line (m, 4), shape (m, 2), whether another one goes on where it begins and ends."""
    joined = np.zeros((len(lines), 2), dtype=np.bool_)
    known = np.flatnonzero(lengths > SHORTEST)
    n = len(known)
    if not n:
        return joined
    from scipy.spatial import cKDTree  # large; maps without walls need none

    along = (lines[known, 2:] - lines[known, :2]) / lengths[known, None]
    ends = np.concatenate([lines[known, :2], lines[known, 2:]])
    outward = np.concatenate([-along, along])
    p, q = cKDTree(ends).query_pairs(JOINT, output_type="ndarray").T
    goes_on = (p % n != q % n) & (np.sum(outward[p] * outward[q], axis=1) < -STRAIGHT)
    for end in (p[goes_on], q[goes_on]):
        joined[known[end % n], end // n] = True
    return joined


def static_segments(lines: Floats, z_low: Floats, z_high: Floats) -> Segments:
    """Returns segments from lines (m, 4) as x0 y0 x1 y1, each between two heights (m,), with their grid.

    Segments shorter than SHORTEST have no direction and keep their index, but are never found.
    """
    lines = np.asarray(lines, dtype=np.float64).reshape(-1, 4)
    ends = lines.reshape(-1, 2)
    low = ends.min(axis=0) if len(ends) else np.zeros(2)
    high = ends.max(axis=0) if len(ends) else np.zeros(2)
    cell = _cell_size(low, high)
    shape = np.floor((high - low) / cell).astype(np.int64) + 1
    lists: list[list[int]] = [[] for _ in range(int(shape[0] * shape[1]))]
    lengths = np.hypot(lines[:, 2] - lines[:, 0], lines[:, 3] - lines[:, 1])
    for m in np.flatnonzero(lengths > SHORTEST):
        for place in _cells_of(lines[m], low, cell, shape):
            lists[place].append(int(m))
    first = np.concatenate([[0], np.cumsum([len(entry) for entry in lists])]).astype(np.int64)
    member = np.array([m for entry in lists for m in entry], dtype=np.int64)
    x0, y0, x1, y1 = np.ascontiguousarray(lines.T)
    heights = np.array(z_low, dtype=np.float64), np.array(z_high, dtype=np.float64)
    joined = _find_joints(lines, lengths)
    return Segments(x0, y0, x1, y1, *heights, joined, low, shape, cell, first, member)


@inner_kernel
def candidates(s: Segments, x: float, y: float, reach: float, out: Ints) -> int:
    """Writes indices of segments whose bounding boxes come within `reach` of a place, ascending.

    Fills `out` as far as it goes, the rest is dropped, and returns how many.
    """
    count = 0
    u_low = max(floor((x - reach - s.origin[0]) / s.cell), 0)
    u_high = min(floor((x + reach - s.origin[0]) / s.cell), s.shape[0] - 1)
    v_low = max(floor((y - reach - s.origin[1]) / s.cell), 0)
    v_high = min(floor((y + reach - s.origin[1]) / s.cell), s.shape[1] - 1)
    for v in range(v_low, v_high + 1):
        for u in range(u_low, u_high + 1):
            cell = v * s.shape[0] + u
            for k in range(s.first[cell], s.first[cell + 1]):
                m = s.member[k]
                if min(s.x0[m], s.x1[m]) > x + reach or max(s.x0[m], s.x1[m]) < x - reach:
                    continue
                if min(s.y0[m], s.y1[m]) > y + reach or max(s.y0[m], s.y1[m]) < y - reach:
                    continue
                place = count
                while place > 0 and out[place - 1] > m:
                    place -= 1
                if count >= out.shape[0] or (place > 0 and out[place - 1] == m):
                    continue
                for q in range(count, place, -1):
                    out[q] = out[q - 1]
                out[place] = m
                count += 1
    return count
