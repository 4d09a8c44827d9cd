"""What patches and materials of the road do at a wheel, compiled: one call a tick for all vehicles."""

from __future__ import annotations

from math import cos, isnan, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import Held, inner_kernel, kernel
from skidpad.core.states import ActorStates
from skidpad.physics.grip import GripParams, mu_at, stiffness_at
from skidpad.roads.kernels import LaneArrays, project_kernel, s_road_kernel, sample_kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
NO_PATCH = -1.0  # stiffness and film where no patch says them
ANY = 2**40  # a lane id that means all lanes, a road id that means none
BOTH, LEFT, RIGHT = range(3)  # halves of a lane
Effect = tuple[float, float, float]  # share of friction, stiffness, film in m


class PatchArrays(NamedTuple):
    """P patches, T kinds of tyres, K stretches of material on L lanes."""

    bounds: Floats  # (P, 4) least x and y, largest x and y at which a vehicle may touch one
    circle: Floats  # (P, 3) x, y, radius; below 0: it is none
    corner_start: Ints  # (P + 1,)
    corner: Floats  # (C, 2) of polygons
    stretch: Ints  # (P, 3) road or ANY, lane or ANY, half of the lane
    s: Floats  # (P, 2) from and to along the road, m
    ratio: Floats  # (P,) of the friction there; NaN: something lies there
    outside: Floats  # (T, fields of GripParams)
    covered: Floats  # (T, P, fields of GripParams)
    material_start: Ints  # (L + 1,)
    material: Floats  # (K, 3) from and to along the road, and the share


class WheelPlaces(NamedTuple):
    """Where the wheels of w vehicles are, and what tyres they have."""

    place: Floats  # (w, 4, 2) forward and left of the vehicle's origin, m
    kind: Ints  # (w,) row of `outside`


@kernel
def fill_patches(
    map: Held[LaneArrays], patches: Held[PatchArrays], wheels: WheelPlaces, states: ActorStates,
    share: Floats, stiffness: Floats, film: Floats,
) -> None:  # fmt: skip
    """Set what patches do to all wheels, (w, 4) at FL, FR, RL, RR; 1 and NO_PATCH where none is."""
    p = patches.value
    for i in range(len(wheels.kind)):
        for k in range(4):
            share[i, k], stiffness[i, k], film[i, k] = 1.0, NO_PATCH, NO_PATCH
        if not (states.present[i] and _is_near(p, states.x[i], states.y[i])):
            continue
        c, s = cos(states.yaw[i]), sin(states.yaw[i])
        v = sqrt(states.vx[i] * states.vx[i] + states.vy[i] * states.vy[i])
        for k in range(4):
            forward, left = wheels.place[i, k, 0], wheels.place[i, k, 1]
            x = states.x[i] + forward * c - left * s
            y = states.y[i] + forward * s + left * c
            found = _effect(map.value, p, x, y, states.z[i], v, wheels.kind[i])
            share[i, k], stiffness[i, k], film[i, k] = found


@kernel
def find_effect(
    map: Held[LaneArrays], patches: Held[PatchArrays], x: float, y: float, z: float, v: float,
    kind: int,
) -> Effect:  # fmt: skip
    """What a wheel with this kind of tyre meets at a point at a speed in m/s."""
    return _effect(map.value, patches.value, x, y, z, v, kind)


@inner_kernel
def _is_near(p: PatchArrays, x: float, y: float) -> bool:
    if len(p.material) > 0:
        return True
    for k in range(len(p.ratio)):
        b = p.bounds[k]
        if b[0] <= x <= b[2] and b[1] <= y <= b[3]:
            return True
    return False


@inner_kernel
def _effect(
    a: LaneArrays, p: PatchArrays, x: float, y: float, z: float, v: float, kind: int
) -> Effect:
    """The slippery one of the patches there; the lane's material multiplies its share."""
    lane, offset, s_road, placed = -1, 0.0, 0.0, False
    share, stiffness, film, found = 1.0, NO_PATCH, NO_PATCH, False
    for k in range(len(p.ratio)):
        b = p.bounds[k]
        if not (b[0] <= x <= b[2] and b[1] <= y <= b[3]):
            continue
        if p.stretch[k, 0] != ANY and not placed:
            lane, offset, s_road = _place(a, x, y, z)
            placed = True
        if not _covers(a, p, k, x, y, lane, offset, s_road):
            continue
        own_share, own_stiffness, own_film = p.ratio[k], NO_PATCH, NO_PATCH
        if isnan(own_share):
            covered = _params(p.covered[kind], k)
            own_share = mu_at(covered, v) / mu_at(_params(p.outside, kind), v)
            own_stiffness, own_film = stiffness_at(covered, v), covered.film
        if not found or own_share < share:
            share, stiffness, film, found = own_share, own_stiffness, own_film, True
    if len(p.material) > 0:
        if not placed:
            lane, offset, s_road = _place(a, x, y, z)
        share *= _material_share(p, lane, s_road)
    return share, stiffness, film


@inner_kernel
def _place(a: LaneArrays, x: float, y: float, z: float) -> tuple[int, float, float]:
    """Lane, offset to the left in m and s along the road of a point; lane -1: it is on none."""
    lane, s, offset = project_kernel(a, x, y, z, True)
    if lane < 0:
        return -1, 0.0, 0.0
    width = sample_kernel(a, lane, s)[5]
    if abs(offset) > 0.5 * width:
        return -1, 0.0, 0.0
    return lane, offset, s_road_kernel(a, lane, s)


@inner_kernel
def _covers(
    a: LaneArrays, p: PatchArrays, k: int, x: float, y: float, lane: int, offset: float,
    s_road: float,
) -> bool:  # fmt: skip
    if p.stretch[k, 0] == ANY:
        if p.circle[k, 2] >= 0.0:
            dx, dy = x - p.circle[k, 0], y - p.circle[k, 1]
            return bool(sqrt(dx * dx + dy * dy) <= p.circle[k, 2])
        return _is_inside(p.corner, p.corner_start[k], p.corner_start[k + 1], x, y)
    if lane < 0 or a.road[lane] != p.stretch[k, 0]:
        return False
    any_lane = p.stretch[k, 1] == ANY
    if not any_lane and p.stretch[k, 1] != a.lane_id[lane]:
        return False
    if p.stretch[k, 2] != BOTH and (offset > 0.0) != (p.stretch[k, 2] == LEFT):
        return False
    return bool(p.s[k, 0] <= s_road <= p.s[k, 1])


@inner_kernel
def _is_inside(corner: Floats, first: int, last: int, x: float, y: float) -> bool:
    """Even-odd rule."""
    inside = False
    x0, y0 = corner[last - 1, 0], corner[last - 1, 1]
    for k in range(first, last):
        x1, y1 = corner[k, 0], corner[k, 1]
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
        x0, y0 = x1, y1
    return inside


@inner_kernel
def _material_share(p: PatchArrays, lane: int, s_road: float) -> float:
    if lane < 0:
        return 1.0
    for k in range(p.material_start[lane], p.material_start[lane + 1]):
        if p.material[k, 0] <= s_road < p.material[k, 1]:
            return float(p.material[k, 2])
    return 1.0


@inner_kernel
def _params(rows: Floats, i: int) -> GripParams:
    g = rows[i]
    return GripParams(g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8])
