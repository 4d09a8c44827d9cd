"""Questions about lanes that Python asks: the kernels of `kernels`, the map held behind a pointer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import Held, kernel
from skidpad.roads import along, kernels
from skidpad.roads.kernels import LaneArrays

Point = tuple[int, float, float, float, float, float, float, float, float]
Sample = tuple[float, float, float, float, float, float, float, float, float]


@kernel
def project(map: Held[LaneArrays], x: float, y: float, z: float, driving: bool) -> Point:
    """Returns the point on the map nearest to (x, y, z) in m; see `kernels.project_point`.

    driving: only driving lanes and ramps.
    """
    return kernels.project_point(map.value, x, y, z, driving)


@kernel
def advance(map: Held[LaneArrays], lane: int, s: float, distance: float, heading: float) -> Point:
    """Returns the point `distance` in m further along the lanes; see `along.advance_point`."""
    return along.advance_point(map.value, lane, s, distance, heading)


@kernel
def trace_lane(
    map: Held[LaneArrays], lane: int, s: float, step: float, heading: float,
    out: NDArray[np.float64],
) -> int:  # fmt: skip
    """Fills rows of out, (n, 4), with x, y, z, curvature of places 1, 2, .. n steps further.

    Returns how many there are before the road ends; each is what `advance` gives for its distance.
    """
    for i in range(len(out)):
        point = along.advance_point(map.value, lane, s, (i + 1) * step, heading)
        if point[0] < 0:
            return i
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = point[3], point[4], point[5], point[7]
    return len(out)


@kernel
def sample(map: Held[LaneArrays], lane: int, s: float) -> Sample:
    """Returns the interpolated sample of a lane at s in m; see `kernels.sample_kernel`."""
    return kernels.sample_kernel(map.value, lane, s)


@kernel
def signal_ahead(
    map: Held[LaneArrays], lane: int, s: float, distance: float, kind: int
) -> tuple[int, float]:
    """Returns row and distance in m of the next signal of a kind; see `along.signal_ahead`."""
    return along.signal_ahead(map.value, lane, s, distance, kind)
