"""Which pixels of a view a small volume of the world can cover: spans of its convex outline, by row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.raster.view import View

MOST = 96  # points on screen: 16 corners, and where their 120 edges pass the near plane
CUT = 0.3  # m, the plane before the camera at which edges are cut


@inner_kernel
def project_corners(view: View, corners: Floats, out: Floats) -> int:
    """Writes image points in px of corners in the world, (n, 3) in m, to `out`; returns how many.

    A corner less than CUT m before the camera gives way to the points where its lines to all corners
    beyond meet that plane, so the order is no outline's; 0 where no corner lies beyond. out: (MOST, 2)
    is enough for 16 corners.
    """
    r, n, count = view.rotation, corners.shape[0], 0
    camera = np.empty((n, 3))
    for i in range(n):
        dx = corners[i, 0] - view.centre[0]
        dy = corners[i, 1] - view.centre[1]
        dz = corners[i, 2] - view.centre[2]
        for a in range(3):
            camera[i, a] = r[a, 0] * dx + r[a, 1] * dy + r[a, 2] * dz
    for i in range(n):
        if camera[i, 2] >= CUT:
            out[count, 0] = view.cx + view.focal * camera[i, 0] / camera[i, 2]
            out[count, 1] = view.cy + view.focal * camera[i, 1] / camera[i, 2]
            count += 1
            continue
        for j in range(n):
            if camera[j, 2] <= CUT:
                continue
            t = (CUT - camera[i, 2]) / (camera[j, 2] - camera[i, 2])
            x = camera[i, 0] + t * (camera[j, 0] - camera[i, 0])
            y = camera[i, 1] + t * (camera[j, 1] - camera[i, 1])
            out[count, 0] = view.cx + view.focal * x / CUT
            out[count, 1] = view.cy + view.focal * y / CUT
            count += 1
    return count


@inner_kernel
def _turns_left(p: Floats, a: int, b: int, c: int) -> bool:
    """Returns whether points a, b and c of p (n, 2) make a left turn."""
    return bool(
        (p[b, 0] - p[a, 0]) * (p[c, 1] - p[a, 1]) - (p[b, 1] - p[a, 1]) * (p[c, 0] - p[a, 0]) > 0.0
    )


@inner_kernel
def hull(points: Floats, count: int, ring: NDArray[np.int64]) -> int:
    """Writes indices of the convex hull of points (count, 2), sorted in place, into `ring`; returns how many.

    Source: Andrew (1979).
    """
    for i in range(1, count):
        x, y, j = points[i, 0], points[i, 1], i - 1
        while j >= 0 and (points[j, 0] > x or (points[j, 0] == x and points[j, 1] > y)):
            points[j + 1, 0], points[j + 1, 1] = points[j, 0], points[j, 1]
            j -= 1
        points[j + 1, 0], points[j + 1, 1] = x, y
    k = 0
    for i in range(count):
        while k >= 2 and not _turns_left(points, ring[k - 2], ring[k - 1], i):
            k -= 1
        ring[k] = i
        k += 1
    low = k + 1
    for i in range(count - 2, -1, -1):
        while k >= low and not _turns_left(points, ring[k - 2], ring[k - 1], i):
            k -= 1
        ring[k] = i
        k += 1
    return k


@kernel
def spans(
    view: View, corners: Floats, points: Floats, ring: NDArray[np.int64], out: NDArray[np.int64]
) -> tuple[int, int]:
    """Returns first and end row of the convex hull of corners (n <= 16, 3); writes its columns into `out`.

    out: (rows of the picture, 2) first and end column; points (MOST, 2), ring (2 * MOST,): room.
    (0, 0) where it is not in the picture.
    """
    count = project_corners(view, corners, points)
    if count < 3:
        return 0, 0
    low, high = np.inf, -np.inf
    for i in range(count):
        low, high = min(low, points[i, 1]), max(high, points[i, 1])
    first = int(max(low, float(view.top)))
    end = int(min(high + 1.0, float(view.height)))
    if first >= end:
        return 0, 0
    width = view.width
    out[first:end, 0] = width
    out[first:end, 1] = 0
    size = hull(points, count, ring)
    for k in range(size - 1):
        a, b = ring[k], ring[k + 1]
        if points[a, 1] > points[b, 1]:
            a, b = b, a
        x0, y0, x1, y1 = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
        slope = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
        for row in range(max(first, int(max(y0, 0.0))), min(end, int(max(y1, -1.0)) + 1)):
            upper, lower = max(float(row), y0), min(row + 1.0, y1)
            xa = x0 + (upper - y0) * slope if y1 > y0 else x0
            xb = x0 + (lower - y0) * slope if y1 > y0 else x1
            left, right = min(xa, xb), max(xa, xb)
            out[row, 0] = min(out[row, 0], int(min(max(left, 0.0), float(width))))
            out[row, 1] = max(out[row, 1], int(min(max(right + 1.0, 0.0), float(width))))
    return first, end
