"""Who is on which lane: linked lists per lane, and the neighbours ahead and behind."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.traffic.network import Network

SLOTS = 4  # lanes on which one actor can stand at once
NOBODY = -1


class Occupancy(NamedTuple):
    """Linked lists: lane l holds the slots head[l], next[head[l]], ... until -1."""

    head: Ints32  # (L,)
    next: Ints32  # (n * SLOTS,)
    s: Floats  # (n * SLOTS,) m along that lane
    used: Ints32  # (n,) slots in use


def occupancy(lanes: int, actors: int) -> Occupancy:
    """Returns empty lists of the actors on each lane."""
    slots = actors * SLOTS
    return Occupancy(
        head=np.full(lanes, NOBODY, dtype=np.int32),
        next=np.full(slots, NOBODY, dtype=np.int32),
        s=np.zeros(slots),
        used=np.zeros(actors, dtype=np.int32),
    )


@kernel
def add(occ: Occupancy, actor: int, lane: int, s: float) -> None:
    """Enters `actor` into a lane's list, unless it is there already or has no slot left."""
    if lane < 0 or occ.used[actor] == SLOTS:
        return
    entry = occ.head[lane]
    while entry != NOBODY:
        if entry // SLOTS == actor:
            return
        entry = occ.next[entry]
    slot = actor * SLOTS + occ.used[actor]
    occ.used[actor] += 1
    occ.s[slot] = s
    occ.next[slot] = occ.head[lane]
    occ.head[lane] = slot


@inner_kernel
def beside(net: Network, lane: int, s: float, other: int) -> float:
    """Returns `s` on a neighbour lane of the same section: lanes of a section scale with their length."""
    return float(s * net.lane[other].length / net.lane[lane].length)


@inner_kernel
def fill(net: Network, placed: Places, occ: Occupancy) -> None:
    """Empties all lists and enters every present actor into each lane that its body overlaps."""
    for lane in range(len(occ.head)):
        occ.head[lane] = NOBODY
    for i in range(len(occ.used)):
        occ.used[i] = 0
    for i in range(len(placed)):
        lane = placed[i].lane
        if not placed[i].present or lane < 0:
            continue
        s = placed[i].s
        half_lane = net.point[net.lane[lane].first].half_width
        turn = placed[i].yaw - placed[i].heading
        wide = placed[i].half_width * abs(cos(turn)) + placed[i].half_length * abs(sin(turn))
        if abs(placed[i].offset) - wide > half_lane:
            continue  # parked or walking beside the road
        add(occ, i, lane, s)
        if placed[i].offset + wide > half_lane and net.lane[lane].left >= 0:
            add(occ, i, net.lane[lane].left, beside(net, lane, s, net.lane[lane].left))
        if placed[i].offset - wide < -half_lane and net.lane[lane].right >= 0:
            add(occ, i, net.lane[lane].right, beside(net, lane, s, net.lane[lane].right))


@inner_kernel
def find_ahead(
    net: Network, occ: Occupancy, placed: Places, path: Ints32, s: float, me: int, reach: float
) -> tuple[int, float]:
    """Returns the nearest actor ahead along `path` (lanes, -1 ends it): row and gap in m; -1, inf for none.

    s: m along its first lane; reach: m between reference points. The gap is bumper to bumper along the
    road; negative while bodies overlap lengthwise.
    """
    start = -s
    for k in range(len(path)):
        lane = path[k]
        if lane < 0 or start > reach:
            break
        nearest, distance = NOBODY, np.inf
        entry = occ.head[lane]
        while entry != NOBODY:
            other = entry // SLOTS
            d = start + occ.s[entry]
            if other != me and 0.0 <= d < distance:
                nearest, distance = other, d
            entry = occ.next[entry]
        if nearest != NOBODY:
            if distance > reach:
                break
            return nearest, distance - placed[me].half_length - placed[nearest].half_length
        start += net.lane[lane].length
    return NOBODY, np.inf


@inner_kernel
def last_on(occ: Occupancy, lane: int, start: float, me: int) -> tuple[int, float]:
    """Returns the row on `lane` least behind `start` m along it, and by how many m; -1, inf for none."""
    nearest, distance = NOBODY, np.inf
    if lane < 0:
        return nearest, distance
    entry = occ.head[lane]
    while entry != NOBODY:
        other = entry // SLOTS
        d = start - occ.s[entry]
        if other != me and 0.0 < d < distance:
            nearest, distance = other, d
        entry = occ.next[entry]
    return nearest, distance


@kernel
def find_behind(
    net: Network, occ: Occupancy, placed: Places, lane: int, s: float, me: int, reach: float
) -> tuple[int, float]:
    """Returns the nearest actor behind along the straightest predecessors and what joins them.

    Row and gap as of `find_ahead`.
    """
    start = s
    nearest, distance = last_on(occ, lane, start, me)
    for _ in range(8):
        if nearest != NOBODY or lane < 0 or start > reach:
            break
        row = net.lane[lane]
        for p in range(row.prev_first, row.prev_first + row.prevs):
            joining = net.prev_lane[p]
            other, d = last_on(occ, joining, start + net.lane[joining].length, me)
            if d < distance:
                nearest, distance = other, d
        lane = row.behind
        if lane >= 0:
            start += net.lane[lane].length
    if nearest == NOBODY or distance > reach:
        return NOBODY, np.inf
    return nearest, distance - placed[me].half_length - placed[nearest].half_length
