"""What patches and materials of the road do at a wheel, compiled: one call a tick for all vehicles."""

from __future__ import annotations

from math import cos, isnan, sin, sqrt
from typing import NamedTuple

from skidpad.core.arrays import Floats, Ints
from skidpad.core.environment.surface import PATH_OFFSET, PATH_WIDTH
from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.core.states import ActorStates
from skidpad.physics.grip import grip_of_row, mu_at, stiffness_at
from skidpad.roads.kernels import (
    REACH,
    S_ROAD,
    SAME,
    WIDTH,
    Z_WEIGHT,
    LaneArrays,
    X,
    Y,
    Z,
    closest_on_segment,
    project_within,
    segment_kernel,
)
from skidpad.simulation.world.placed import Places

NO_PATCH = -1.0  # stiffness and film where no patch says them
ANY = 2**40  # a lane id that means all lanes, a road id that means none
NEAR_SAMPLES = 12  # m, more than from a vehicle's origin to its wheels
BOTH, LEFT, RIGHT, PATHS, BESIDE = range(5)  # halves of a lane, its wheel paths, and the rest of it


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
    near: Ints  # (P,) room for the patches near a vehicle


class WheelPlaces(NamedTuple):
    """Where the wheels of w vehicles are, and what tyres they have."""

    place: Floats  # (w, 4, 2) forward and left of the vehicle's origin, m
    kind: Ints  # (w,) row of `outside`


@kernel
def fill_patches(
    map: Held[LaneArrays], patches: Held[PatchArrays], wheels: WheelPlaces, states: ActorStates,
    placed: Places, share: Floats, stiffness: Floats, film: Floats,
) -> None:  # fmt: skip
    """Set what patches do to all wheels, (w, 4) at FL, FR, RL, RR; 1 and NO_PATCH where none is.

    The slippery one of the patches at a wheel counts; the lane's material multiplies its share. One
    body: inner kernels that are handed so many arrays for every wheel and patch would cost most.
    placed: of the vehicles, where they stood last: it makes the search short and changes nothing else.
    """
    a, p = map.value, patches.value
    everywhere = len(p.material) > 0
    for i in range(len(wheels.kind)):
        for k in range(4):
            share[i, k], stiffness[i, k], film[i, k] = 1.0, NO_PATCH, NO_PATCH
        if not states.present[i]:
            continue
        count = 0
        for n in range(len(p.ratio)):
            if _is_in(p.bounds[n], states.x[i], states.y[i]):
                p.near[count] = n
                count += 1
        if count == 0 and not everywhere:
            continue
        c, s = cos(states.yaw[i]), sin(states.yaw[i])
        v = sqrt(states.vx[i] * states.vx[i] + states.vy[i] * states.vy[i])
        kind, z = wheels.kind[i], states.z[i]
        bare = mu_at(grip_of_row(p.outside, kind), v)
        for k in range(4):
            forward, left = wheels.place[i, k, 0], wheels.place[i, k, 1]
            x = states.x[i] + forward * c - left * s
            y = states.y[i] + forward * s + left * c
            lane, offset, s_road, searched, found = -1, 0.0, 0.0, False, False
            for m in range(count):
                n = p.near[m]
                road = p.stretch[n, 0]
                if road != ANY:
                    if not searched:
                        lane, offset, s_road = _place(a, placed[i].lane, placed[i].sample, x, y, z)
                        searched = True
                    covers = lane >= 0 and _is_on_stretch(
                        road, p.stretch[n, 1], p.stretch[n, 2], p.s[n, 0], p.s[n, 1],
                        a.road[lane], a.lane_id[lane], offset, s_road,
                    )  # fmt: skip
                elif p.circle[n, 2] >= 0.0:
                    dx, dy = x - p.circle[n, 0], y - p.circle[n, 1]
                    covers = sqrt(dx * dx + dy * dy) <= p.circle[n, 2]
                else:
                    covers = _is_inside(p.corner, p.corner_start[n], p.corner_start[n + 1], x, y)
                if not covers:
                    continue
                own, own_stiffness, own_film = p.ratio[n], NO_PATCH, NO_PATCH
                if isnan(own):
                    covered = grip_of_row(p.covered[kind], n)
                    own = mu_at(covered, v) / bare
                    own_stiffness, own_film = stiffness_at(covered, v), covered.film
                if not found or own < share[i, k]:
                    share[i, k], stiffness[i, k], film[i, k] = own, own_stiffness, own_film
                    found = True
            if everywhere:
                if not searched:
                    lane, offset, s_road = _place(a, placed[i].lane, placed[i].sample, x, y, z)
                if lane >= 0:
                    for n in range(p.material_start[lane], p.material_start[lane + 1]):
                        if p.material[n, 0] <= s_road < p.material[n, 1]:
                            share[i, k] *= p.material[n, 2]


@inner_kernel
def _is_in(bounds: Floats, x: float, y: float) -> bool:
    """Returns whether (x, y) lies within (x_min, y_min, x_max, y_max)."""
    return bool(bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3])


@inner_kernel
def _is_on_stretch(
    road: int, lane: int, side: int, low: float, high: float, on_road: int, on_lane: int,
    offset: float, s_road: float,
) -> bool:  # fmt: skip
    """Returns whether a place on the road lies on the stretch: its road, lane, side and low..high in m."""
    if on_road != road or (lane != ANY and lane != on_lane):
        return False
    if side >= PATHS:
        on_path = abs(abs(offset) - PATH_OFFSET) <= 0.5 * PATH_WIDTH
        return on_path == (side == PATHS) and low <= s_road <= high
    if side != BOTH and (offset > 0.0) != (side == LEFT):
        return False
    return low <= s_road <= high


@inner_kernel
def _place(
    a: LaneArrays, near: int, sample: int, x: float, y: float, z: float
) -> tuple[int, float, float]:
    """Lane, offset to the left in m and s along the road of a point; lane -1: it is on none.

    near, sample: lane of the vehicle, and its sample there, when it was placed last.
    """
    lane, s, offset = project_within(a, x, y, z, True, _near_bound(a, near, sample, x, y, z))
    if lane < 0:
        return -1, 0.0, 0.0
    i, u = segment_kernel(a, lane, s)
    p, q = a.sample[i], a.sample[i + 1]
    if abs(offset) > 0.5 * ((1.0 - u) * p[WIDTH] + u * q[WIDTH]):
        return -1, 0.0, 0.0
    return lane, offset, float((1.0 - u) * p[S_ROAD] + u * q[S_ROAD])


@inner_kernel
def _near_bound(a: LaneArrays, lane: int, sample: int, x: float, y: float, z: float) -> float:
    """More than the squared distance in m^2, as lanes are compared, from a point to this driving lane.

    sample: of the lane, some m from the point. REACH^2 where the lane is none, or ends before the point.
    """
    if lane < 0 or a.drivable[lane] == 0:
        return REACH * REACH
    first, last = a.first[lane], a.first[lane] + a.size[lane] - 2
    i = min(max(sample, first), last)
    for _ in range(2 * NEAR_SAMPLES):
        p, q = a.sample[i], a.sample[i + 1]
        cx, cy = q[X] - p[X], q[Y] - p[Y]
        along = (x - p[X]) * cx + (y - p[Y]) * cy
        if along < 0.0:
            i -= 1
        elif along > cx * cx + cy * cy:
            i += 1
        else:
            share, _, d_sq, missed = closest_on_segment(a, i, x, y)
            if missed != 0.0:
                return REACH * REACH
            rise = Z_WEIGHT * (z - (p[Z] + share * (q[Z] - p[Z])))
            return float(min(d_sq + rise * rise + 4.0 * SAME, REACH * REACH))
        if i < first or i > last:
            return REACH * REACH
    return REACH * REACH


@inner_kernel
def _is_inside(corner: Floats, first: int, last: int, x: float, y: float) -> bool:
    """Whether a point lies inside a polygon, by the even-odd rule."""
    inside = False
    x0, y0 = corner[last - 1, 0], corner[last - 1, 1]
    for k in range(first, last):
        x1, y1 = corner[k, 0], corner[k, 1]
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
        x0, y0 = x1, y1
    return inside
