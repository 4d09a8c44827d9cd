"""Questions about lanes that Python asks: the kernels of `kernels`, the map held behind a pointer."""

from __future__ import annotations

from skidpad.core.jit import Held, kernel
from skidpad.roads import kernels
from skidpad.roads.kernels import LaneArrays

Point = tuple[int, float, float, float, float, float, float, float, float]
Sample = tuple[float, float, float, float, float, float, float, float, float]


@kernel
def project(map: Held[LaneArrays], x: float, y: float, z: float, driving: bool) -> Point:
    """See `kernels.project_point`."""
    return kernels.project_point(map.value, x, y, z, driving)


@kernel
def advance(map: Held[LaneArrays], lane: int, s: float, distance: float, heading: float) -> Point:
    """See `kernels.advance_point`."""
    return kernels.advance_point(map.value, lane, s, distance, heading)


@kernel
def sample(map: Held[LaneArrays], lane: int, s: float) -> Sample:
    """See `kernels.sample_kernel`."""
    return kernels.sample_kernel(map.value, lane, s)


@kernel
def signal_ahead(
    map: Held[LaneArrays], lane: int, s: float, distance: float, kind: int
) -> tuple[int, float]:
    """See `kernels.signal_ahead`."""
    return kernels.signal_ahead(map.value, lane, s, distance, kind)
