"""The lanes that a driver follows, and where the vehicle is along them."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from skidpad.core.arrays import Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.kernels.splitmix import GOLDEN, scrambled, unit
from skidpad.simulation.world.traffic.network import Network

PATH = 12  # lanes remembered ahead, the present one first
LOOKAHEAD = 250.0  # m of path that a driver knows
SALT = np.uint64(0xD1B54A32D192ED03)


@kernel
def uniform(key: np.uint64, tick: int, salt: int) -> float:
    """Returns a number in [0, 1) that depends on (key, tick, salt) alone."""
    counter = np.uint64(key) + GOLDEN * np.uint64(2 * tick + 1)
    return unit(scrambled(counter + SALT * np.uint64(salt)))


@inner_kernel
def wrapped(angle: float) -> float:
    """Returns the angle in rad wrapped to [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi


@inner_kernel
def choose_branch(net: Network, lane: int, key: np.uint64, turn: int, free_choice: bool) -> int:
    """Returns the lane to take after `lane`, the straightest, or one drawn per driver and turn; -1: none."""
    here = net.lane[lane]
    if not free_choice or here.nexts < 2:
        return int(here.ahead)
    choice = net.next_lane[here.next_first + int(uniform(key, turn, 1) * here.nexts)]
    kind = net.lane[choice].kind
    return int(choice if kind == 0 or kind == 7 else here.ahead)  # LaneKind.DRIVING, RAMP


@inner_kernel
def extend(net: Network, path: Ints32, s: float, key: np.uint64, turn: int, free: bool) -> None:
    """Appends lanes to `path` until it reaches LOOKAHEAD, is full, or the road ends.

    s: m along its first lane; turn: number of lanes entered, which with key decides draws.
    """
    known = -s
    for k in range(PATH - 1):
        if path[k] < 0:
            return
        known += net.lane[path[k]].length
        if path[k + 1] < 0 and known < LOOKAHEAD:
            path[k + 1] = choose_branch(net, path[k], key, turn + k, free)


@kernel
def begin(path: Ints32, lane: int) -> None:
    """Empties the path and begins it with `lane`."""
    for k in range(PATH):
        path[k] = -1
    path[0] = lane


@kernel
def straight_path(net: Network, lane: int, out: Ints32) -> None:
    """Fills `out` with `lane` and its straightest successors, -1 behind the road's end."""
    for k in range(len(out)):
        out[k] = lane
        if lane >= 0:
            lane = net.lane[lane].ahead


@inner_kernel
def along(net: Network, lane: int, at: int, x: float, y: float) -> tuple[int, float]:
    """Returns the segment of `lane` beside (x, y), searched from sample `at`, and the share along it.

    The segment is the sample at its begin. A share below 0 or above 1: before the first or behind the
    last sample.
    """
    first = net.lane[lane].first
    last = first + net.lane[lane].size - 2
    at = min(max(at, first), last)
    forward = False
    while True:
        p, q = net.point[at], net.point[at + 1]
        dx, dy = q.x - p.x, q.y - p.y
        t = ((x - p.x) * dx + (y - p.y) * dy) / (dx * dx + dy * dy)
        if t > 1.0 and at < last:
            at += 1
            forward = True
        elif t < 0.0 and at > first and not forward:  # never back again: joints can open outwards
            at -= 1
        else:
            return at, t


@inner_kernel
def offset_from(net: Network, at: int, t: float, x: float, y: float) -> tuple[float, float]:
    """Returns the m by which (x, y) lies left of the lane, and the lane's heading there in rad.

    at, t: sample of the lane and share of the way to the next one, as `along` returns them; t is held
    within 0 and 1.
    """
    p, q = net.point[at], net.point[at + 1]
    u = min(max(t, 0.0), 1.0)
    heading = p.heading + u * wrapped(q.heading - p.heading)
    x_ref, y_ref = p.x + u * (q.x - p.x), p.y + u * (q.y - p.y)
    return -(x - x_ref) * sin(heading) + (y - y_ref) * cos(heading), heading
