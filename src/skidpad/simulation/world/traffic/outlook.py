"""What a driver sees ahead along its path: limits, bends, lights, the road's end, merging traffic."""

from __future__ import annotations

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.simulation.world.traffic.care import (
    Care,
    bend_speed_sq,
    braking,
    firm_braking,
    reach,
    sight_speed,
    speed_choice,
)
from skidpad.simulation.world.traffic.network import Network
from skidpad.simulation.world.traffic.occupancy import NOBODY, SLOTS
from skidpad.simulation.world.traffic.path import PATH
from skidpad.simulation.world.traffic.right_of_way import leads_to
from skidpad.simulation.world.traffic.state import Drivers, View

REACH_LIGHT = 150.0  # m
MERGE_REACH = 60.0  # m before a merge within which the streams watch each other, at least
MERGE_TIME = 6.0  # s before it, at speed: a gap then opens at 2 m/s^2, comfortably
MERGE_LANES = 4  # of the other branch that are searched backwards: maps cut a road into short lanes
YELLOW_BRAKE = 3.0  # m/s^2, drivers stop at yellow if this is enough
STANDS = 0.5  # m/s, slower ones wait
STOP_MARGIN = 1.0  # m kept to a stop line, beside the IDM's standstill gap
PREVIEW_STEP = 5.0  # m between two looks at limit and bend
STRAIGHT = 1.0e-5  # 1/m, less is no bend
V_PREVIEW = 10.0  # m/s, look at least this far beyond the comfortable braking distance, in m


@kernel
def desired_speed(
    net: Network, me: Any, trait: Any, path: NDArray[np.int32], v: float, care: Care
) -> float:
    """Returns the m/s that limits, bends, patches and sight ahead along `path` allow.

    Each is reached by comfortable braking from the present speed v. me, trait: rows of DRIVER and TRAIT.
    """
    b = braking(care, v)
    known = v * v / (2.0 * b) + V_PREVIEW
    factor = trait.factor * speed_choice(care, v)
    here = net.point[me.at]
    own = factor if here.patch >= 1.0 else trait.factor * speed_choice(care, v, here.patch)
    best_sq = min(min(here.limit, me.cap) * own, sight_speed(care, v)) ** 2
    start = -me.s
    for k in range(PATH):
        if path[k] < 0 or start > known:
            break
        lane = net.lane[path[k]]
        spacing = lane.length / (lane.size - 1)
        step = max(1, int(PREVIEW_STEP / spacing))
        for j in range(me.at - lane.first if k == 0 else 0, lane.size, step):
            distance = start + j * spacing
            if distance > known:
                break
            point = net.point[lane.first + j]
            if point.patch < 1.0:
                own = trait.factor * speed_choice(care, v, point.patch)
            else:
                own = factor
            cap_sq = (min(point.limit, me.cap) * own) ** 2
            if abs(point.curvature) > STRAIGHT:
                bend_sq = bend_speed_sq(care, point.curvature, trait.a_curve)
                cap_sq = min(cap_sq, bend_sq * point.patch)
            best_sq = min(best_sq, cap_sq + 2.0 * b * max(distance, 0.0))
        start += lane.length
    return sqrt(best_sq)


@inner_kernel
def stop_gap(view: View, d: Drivers, i: int) -> float:
    """Returns the m from the front bumper to the next light at which driver i has to stop; inf: none."""
    net, v = view.streets.net, view.placed[i].speed
    b = firm_braking(view.care, v, YELLOW_BRAKE)
    start = -d.state[i].s - view.placed[i].half_length
    for k in range(PATH):
        if d.path[i, k] < 0 or start > REACH_LIGHT:
            break
        lane = net.lane[d.path[i, k]]
        for row in range(lane.stop_first, lane.stop_first + lane.stops):
            gap = start + net.stop[row].s - STOP_MARGIN
            light = view.lights[net.stop[row].row]
            if gap < -STOP_MARGIN or gap > REACH_LIGHT or light > 1:
                continue  # passed, too far, or neither LightState.RED nor YELLOW
            if light == 0 or v * v <= 2.0 * b * max(gap, 0.0):
                return float(max(gap, 0.1))
        start += lane.length
    return np.inf


@inner_kernel
def end_gap(view: View, d: Drivers, i: int) -> float:
    """Returns the m to the end of the road along the path; inf: not within what the driver knows."""
    known = -d.state[i].s
    for k in range(PATH):
        if d.path[i, k] < 0:
            last = view.streets.net.lane[d.path[i, k - 1]]
            return max(known, 0.1) if last.ahead < 0 else np.inf
        known += view.streets.net.lane[d.path[i, k]].length
    return np.inf


@inner_kernel
def _right_of_way_decides(
    view: View, d: Drivers, i: int, j: int, lanes: tuple[int, int, int], before: float
) -> bool:
    """Returns whether right of way, not the order of arrival, decides between drivers i and j at a merge.

    A driver with priority does not follow one that can still wait for it. A driver that yields waits at
    its line (`right_of_way`) and does not follow one that stands at its own: each would wait for the other.
    lanes: my lane of the junction, theirs, and the one on which j is. before: m from the front of j to
    the beginning of theirs, negative on it.
    """
    mine, theirs, here = lanes
    entry, other = view.streets.entry[mine], view.placed[j]
    if not view.care.on:
        return False
    for c in range(entry.first, entry.first + entry.size):
        row = view.streets.conflict[c]
        if row.other != theirs or not row.joins:
            continue
        if row.yields:
            inside = view.streets.entry[d.path[i, 0]].junction == entry.junction
            return bool(here != theirs and (not inside or other.speed < STANDS))
        if here == theirs:
            return bool(other.speed < STANDS and -before < row.other_start)
        firm = firm_braking(view.care, other.speed, YELLOW_BRAKE)
        return bool(other.speed < STANDS or other.speed**2 <= 2.0 * firm * max(before, 0.0))
    return False


@inner_kernel
def merge_gap(view: View, d: Drivers, i: int) -> tuple[int, float]:
    """Returns the row that arrives at a merge ahead just before driver i on another branch, and the gap in m.

    -1, inf for none.
    """
    net, occ = view.streets.net, view.occ
    start = net.lane[d.path[i, 0]].length - d.state[i].s
    v = view.placed[i].speed
    far = max(reach(view.care, v, MERGE_REACH), v * MERGE_TIME)
    best, best_gap = NOBODY, np.inf
    for k in range(1, PATH):
        if d.path[i, k] < 0 or start > far:
            break
        lane = net.lane[d.path[i, k]]
        for p in range(lane.prev_first, lane.prev_first + lane.prevs):
            other_lane = net.prev_lane[p]
            if other_lane == d.path[i, k - 1]:
                continue
            lane_before = net.lane[other_lane].length
            way, here = (
                0.0,
                other_lane,
            )  # m from the beginning of the merge back to the end of `here`
            for _ in range(MERGE_LANES):
                row = net.lane[here]
                entry = occ.head[here]
                while entry != NOBODY:
                    j = entry // SLOTS
                    gap = start - (way + row.length - occ.s[entry])
                    comes = (
                        here == other_lane or not d.state[j].active or leads_to(d, j, other_lane)
                    )
                    if j != i and comes and start - gap < far and 0.0 < gap < best_gap:
                        before = start - gap - lane_before - view.placed[j].half_length
                        lanes = (d.path[i, k - 1], other_lane, here)
                        if not _right_of_way_decides(view, d, i, j, lanes, before):
                            best, best_gap = j, gap
                    entry = occ.next[entry]
                way += row.length
                if way > far or row.prevs != 1:
                    break
                here = net.prev_lane[row.prev_first]
        start += lane.length
    if best == NOBODY:
        return NOBODY, np.inf
    return best, best_gap - view.placed[i].half_length - view.placed[best].half_length
