"""Compiled questions about lanes, for the facade in `queries` and for kernels of other houses.

All take `LaneArrays` first. Lane -1 means none. World frame, ISO 8855, SI.
"""

from __future__ import annotations

from math import ceil, floor, inf, nan, pi, sqrt
from typing import NamedTuple

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel

REACH = 20.0  # m, beyond this there is no lane
Z_WEIGHT = 2.0  # heights count double, so that a road 8 m above is 16 m away
HALF_STEP_SQ = 0.3  # m^2, more than the squared half distance of samples
SAME = 1e-6  # m^2, squared distances closer than this are equal: the lower lane index wins
FOOT = 1e-3  # m along a lane by which the foot of a perpendicular may lie outside its segment


# Columns of LaneArrays.sample
X, Y, Z, HEADING, S, CURVATURE, GRADE, BANK, WIDTH, LIMIT, S_ROAD, COS, SIN = range(13)


class LaneArrays(NamedTuple):
    """A baked map in the form that kernels read; N samples, L lanes, K signals."""

    sample: Floats  # (N, 13) columns X to SIN (of the heading); heading continuous within a lane
    lane_of: Ints32  # (N,)
    first: Ints32  # (L,) first sample
    size: Ints32  # (L,)
    length: Floats  # (L,) m
    road: Ints32  # (L,)
    lane_id: Ints32  # (L,)
    junction: Ints32  # (L,) or -1
    drivable: Ints32  # (L,) 1 for driving lanes and ramps
    left: Ints32  # (L,)
    right: Ints32  # (L,)
    opposite: Ints32  # (L,)
    next_start: Ints32  # (L + 1,)
    next_lane: Ints32
    prev_start: Ints32  # (L + 1,)
    prev_lane: Ints32
    signal_start: Ints32  # (L + 1,) signals of lane i, by s: rows signal_row[start[i]:start[i + 1]]
    signal_row: Ints32  # (K,) row of SignalTable
    signal_s: Floats  # (K,) m along the lane, in the order of signal_row
    signal_kind: Ints32  # (K,) SignalKind, in the order of signal_row
    cell_size: float  # m, edge of a cell of the search grid
    cell_origin: Floats  # (2,)
    cell_start: Ints32  # (rows + 1, columns) samples of a cell: cell_sample[start:next start]
    cell_sample: Ints32  # (N,)
    cell_point: Floats  # (N, 3) x, y, z in the order of cell_sample: read one after the other


@inner_kernel
def wrapped(angle: float) -> float:
    """Returns the angle in rad wrapped to (-pi, pi]."""
    return pi - (pi - angle) % (2.0 * pi)


@inner_kernel
def closest_on_segment(
    a: LaneArrays, i: int, x: float, y: float
) -> tuple[float, float, float, float]:
    """Returns the closest point of the curve between samples i and i + 1, by Newton steps from the chord.

    As (share in [0, 1], left offset, squared plane distance, distance by which the point lies before
    (negative) or beyond the ends).
    """
    p, q = a.sample[i], a.sample[i + 1]
    cx, cy = q[X] - p[X], q[Y] - p[Y]
    u = ((x - p[X]) * cx + (y - p[Y]) * cy) / (cx * cx + cy * cy)
    u = min(max(u, 0.0), 1.0)
    px, py, tx, ty = hermite(a, i, u)
    for _ in range(2):
        ds = sqrt(tx * tx + ty * ty)
        along = ((x - px) * tx + (y - py) * ty) / ds
        across = ((y - py) * tx - (x - px) * ty) / ds
        # On the inner side of a bend a metre along the lane is a longer way around the point.
        step = along / (ds * max(1.0 - p[CURVATURE] * across, 0.3))
        moved = min(max(u + step, 0.0), 1.0)
        if abs(moved - u) < 1e-6:
            break
        u = moved
        px, py, tx, ty = hermite(a, i, u)
    ds = sqrt(tx * tx + ty * ty)
    across = ((y - py) * tx - (x - px) * ty) / ds
    missed = ((x - px) * tx + (y - py) * ty) / ds if u <= 0.0 or u >= 1.0 else 0.0
    return u, across, (x - px) ** 2 + (y - py) ** 2, missed


@inner_kernel
def hermite(a: LaneArrays, i: int, u: float) -> tuple[float, float, float, float]:
    """Returns x, y and their derivatives by u at u in [0, 1] on the cubic through samples i and i + 1."""
    p, q = a.sample[i], a.sample[i + 1]
    ds = q[S] - p[S]
    w = 1.0 - u
    b, db = u * u * (3.0 - 2.0 * u), 6.0 * u * w
    g0, g1 = w * w * u * ds, -u * u * w * ds
    d0, d1 = w * (1.0 - 3.0 * u) * ds, u * (3.0 * u - 2.0) * ds
    cx, cy = q[X] - p[X], q[Y] - p[Y]
    x = p[X] + b * cx + g0 * p[COS] + g1 * q[COS]
    y = p[Y] + b * cy + g0 * p[SIN] + g1 * q[SIN]
    tx = db * cx + d0 * p[COS] + d1 * q[COS]
    ty = db * cy + d0 * p[SIN] + d1 * q[SIN]
    return x, y, tx, ty


@inner_kernel
def project_kernel(
    a: LaneArrays,
    x: float,
    y: float,
    z: float,
    driving: bool = True,
) -> tuple[int, float, float]:
    """Returns the nearest lane centre to a point: (lane, s, left offset); (-1, nan, nan) beyond REACH.

    Nearest in space with heights counted double (decision M-12). driving: only driving lanes and
    ramps.
    """
    return project_within(a, x, y, z, driving, REACH * REACH)


@inner_kernel
def project_within(
    a: LaneArrays, x: float, y: float, z: float, driving: bool, best: float
) -> tuple[int, float, float]:
    """Returns the nearest lane as `project_kernel` does, faster where it is known to be near.

    best: m^2, more than the squared distance of the nearest lane by 2 SAME, or REACH^2.
    """
    if not (abs(x) < inf and abs(y) < inf and abs(z) < inf):
        return -1, nan, nan
    lane, s, offset = -1, nan, nan
    size = a.cell_size
    rows, columns = a.cell_start.shape[0] - 1, a.cell_start.shape[1]
    u, v = (x - a.cell_origin[0]) / size, (y - a.cell_origin[1]) / size
    # From far outside the grid no ring could reach it, and the cell numbers would overflow.
    margin = REACH / size + 2.0
    if not (-margin < u < columns + margin and -margin < v < rows + margin):
        return -1, nan, nan
    column, row = floor(u), floor(v)
    edge = min(u - column, column + 1 - u, v - row, row + 1 - v) * size
    for ring in range(ceil(REACH / size) + 2):
        # No sample of this ring or a later one is nearer than `near`.
        near = (ring - 1) * size + edge if ring > 0 else 0.0
        if near * near - HALF_STEP_SQ > best:
            break
        for r in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
            whole = r == row - ring or r == row + ring
            up = max(r - v, v - (r + 1), 0.0) * size
            step = 1 if whole or ring == 0 else 2 * ring
            for c in range(column - ring, column + ring + 1, step):
                if not 0 <= c < columns:
                    continue
                aside = max(c - u, u - (c + 1), 0.0) * size
                if aside * aside + up * up - HALF_STEP_SQ > best:
                    continue
                begin = a.cell_start[r, c]
                end = a.cell_start[r, c + 1] if c + 1 < columns else a.cell_start[r + 1, 0]
                for k in range(begin, end):
                    dx, dy, dz = (
                        x - a.cell_point[k, 0],
                        y - a.cell_point[k, 1],
                        z - a.cell_point[k, 2],
                    )
                    dz = max(abs(dz) - 0.1, 0.0) * Z_WEIGHT  # it may change between samples
                    if dx * dx + dy * dy + dz * dz - HALF_STEP_SQ > best:
                        continue
                    i = a.cell_sample[k]
                    j = a.lane_of[i]
                    if driving and a.drivable[j] == 0:
                        continue
                    ahead = dx * a.sample[i, COS] + dy * a.sample[i, SIN] >= 0.0
                    if ahead and i == a.first[j] + a.size[j] - 1:
                        ahead = False
                    elif not ahead and i == a.first[j]:
                        ahead = True
                    segment = i if ahead else i - 1
                    share, across, d_sq, missed = closest_on_segment(a, segment, x, y)
                    at_end = segment == a.first[j] or segment == a.first[j] + a.size[j] - 2
                    if abs(missed) > FOOT and not at_end:
                        continue  # the next segment has the foot; here height alone could win
                    z_lane = a.sample[segment, Z] + share * (
                        a.sample[segment + 1, Z] - a.sample[segment, Z]
                    )
                    # Beyond the end of a lane the next one has the foot; without its slope the end
                    # of a lane that comes down could seem nearer in height.
                    z_lane += missed * a.sample[segment, GRADE]
                    d_sq += (Z_WEIGHT * (z - z_lane)) ** 2
                    if d_sq < best - SAME or (d_sq < best + SAME and lane >= 0 and j < lane):
                        best, lane, offset = d_sq, j, across
                        s = a.sample[segment, S] + share * (
                            a.sample[segment + 1, S] - a.sample[segment, S]
                        )
    return lane, s, offset


@inner_kernel
def segment_kernel(a: LaneArrays, lane: int, s: float) -> tuple[int, float]:
    """Returns (sample, share): s lies between that sample of the lane and the next; s is clamped."""
    first = a.first[lane]
    low, high = first, first + a.size[lane] - 1
    guess = first + int(max(s, 0.0) / a.length[lane] * (a.size[lane] - 1))
    guess = min(max(guess, low), high - 1)
    if a.sample[guess, S] <= s <= a.sample[guess + 1, S]:  # samples are nearly evenly spaced
        low, high = guess, guess + 1
    while high - low > 1:
        middle = (low + high) // 2
        if a.sample[middle, S] <= s:
            low = middle
        else:
            high = middle
    share = (s - a.sample[low, S]) / (a.sample[low + 1, S] - a.sample[low, S])
    return low, min(max(share, 0.0), 1.0)


@inner_kernel
def sample_kernel(
    a: LaneArrays, lane: int, s: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Returns (x, y, z, heading, curvature, width, grade, bank, limit) of the lane centre at s.

    heading is wrapped; limit is NaN where the map gives none. s is clamped to the lane.
    """
    i, u = segment_kernel(a, lane, s)
    x, y, _, _ = hermite(a, i, u)
    p, q = a.sample[i], a.sample[i + 1]
    w = 1.0 - u
    return (
        x,
        y,
        w * p[Z] + u * q[Z],
        wrapped(w * p[HEADING] + u * q[HEADING]),
        w * p[CURVATURE] + u * q[CURVATURE],
        w * p[WIDTH] + u * q[WIDTH],
        w * p[GRADE] + u * q[GRADE],
        w * p[BANK] + u * q[BANK],
        p[LIMIT],
    )


@inner_kernel
def project_point(
    a: LaneArrays, x: float, y: float, z: float, driving: bool
) -> tuple[int, float, float, float, float, float, float, float, float]:
    """Returns (lane, s, offset, x, y, z, heading, curvature, width) of the lane centre nearest to a point.

    Lane -1 and NaN where `project_kernel` finds none.
    """
    lane, s, offset = project_kernel(a, x, y, z, driving)
    if lane < 0:
        return -1, nan, nan, nan, nan, nan, nan, nan, nan
    px, py, pz, heading, curvature, width, _, _, _ = sample_kernel(a, lane, s)
    return lane, s, offset, px, py, pz, heading, curvature, width


@kernel
def s_road_kernel(a: LaneArrays, lane: int, s: float) -> float:
    """Returns the OpenDRIVE s in m of a place s m along a lane."""
    i, u = segment_kernel(a, lane, s)
    p, q = a.sample[i], a.sample[i + 1]
    return float((1.0 - u) * p[S_ROAD] + u * q[S_ROAD])


@kernel
def lane_s_kernel(a: LaneArrays, lane: int, s_road: float) -> float:
    """Returns the m along the lane of a place given by OpenDRIVE s, clamped to the lane."""
    low = a.first[lane]
    high = low + a.size[lane] - 1
    rising = a.sample[high, S_ROAD] > a.sample[low, S_ROAD]
    while high - low > 1:
        middle = (low + high) // 2
        if (a.sample[middle, S_ROAD] <= s_road) == rising:
            low = middle
        else:
            high = middle
    from_, to = a.sample[low, S_ROAD], a.sample[high, S_ROAD]
    share = min(max((s_road - from_) / (to - from_), 0.0), 1.0)
    return float(a.sample[low, S] + share * (a.sample[high, S] - a.sample[low, S]))


@kernel
def neighbour_s(a: LaneArrays, lane: int, other: int, s: float) -> float:
    """Returns the m along a neighbouring lane of the same section abreast of s on `lane`."""
    return lane_s_kernel(a, other, s_road_kernel(a, lane, s))
