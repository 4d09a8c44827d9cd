"""A speed plan along the route: limits, bends, lines, leaders, and paths that cross it.

The ego is rolled out along its path with the Intelligent Driver Model (Treiber and Kesting 2013,
eqs. 11.14, 11.15) against the nearest of: the leader in its corridor, a line at which it must
stop, and the place where a predicted path crosses its own.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.stack.channels.route import PathPoints, locate

ROLL_STEP = 0.25  # s
A_HARDEST = -8.0  # m/s^2
SEARCH_AHEAD = 90  # points of the path on which objects are looked for
BACK = 15  # points behind the ego likewise
CROSSING_MARGIN = 1.5  # s between the ego and who crosses its path
FADE = 10.0  # m in which the ego's offset from the path fades by 1/e
LINE_MARGIN = 1.0  # m kept to a line
ALONG = 0.5  # cosine: objects that move with the path are leaders and not crossers
SPEED_FACTOR = 0.9  # of the limit


class PlanParams(NamedTuple):
    """What the kernel needs: size of the own body, and a manner that all channels share."""

    half_length: float  # m
    half_width: float
    headway: float = 1.6  # s; comfortable time gaps of 1.2 to 2.0 s in ISO 15622
    gap_min: float = 3.0  # m to a standing object
    a_max: float = 1.5  # m/s^2
    b_comfort: float = 2.0  # m/s^2
    a_lateral: float = 2.0  # m/s^2 in bends, comfort limit of ISO 11270 is 3
    speed_factor: float = SPEED_FACTOR
    margin: float = 0.3  # m kept beside the own body


class Blocks(NamedTuple):
    """What limits the ego along its path; arrays (k,)."""

    s: Floats  # m from the ego's centre to the near end of what blocks, now
    v: Floats  # m/s along the path


@inner_kernel
def idm(v: float, v_desired: float, gap: float, v_lead: float, p: PlanParams) -> float:
    """Returns the acceleration in m/s^2 behind a leader at `gap` m (inf: none), A_HARDEST at least."""
    if v <= v_desired:
        free = p.a_max * (1.0 - (v / max(v_desired, 0.1)) ** 4)
    else:
        free = -p.b_comfort * (1.0 - (v_desired / v) ** (4.0 * p.a_max / p.b_comfort))
    if gap == np.inf:
        return free
    dynamic = v * p.headway + v * (v - v_lead) / (2.0 * sqrt(p.a_max * p.b_comfort))
    wanted = p.gap_min + max(0.0, dynamic)
    return max(A_HARDEST, free - p.a_max * (wanted / max(gap, 0.1)) ** 2)


@inner_kernel
def desired_speeds(path: PathPoints, at: int, n: int, p: PlanParams, out: Floats) -> None:
    """Writes the m/s that limits and bends allow at the n points from `at` on, braking ahead of each."""
    for k in range(n):
        j = min(at + k, path.x.size - 1)
        v = p.speed_factor * path.limit[j]
        bend = abs(path.curvature[j])
        if bend * v * v > p.a_lateral:
            v = sqrt(p.a_lateral / bend)
        out[k] = v
    for k in range(n - 2, -1, -1):
        out[k] = min(out[k], sqrt(out[k + 1] ** 2 + 2.0 * p.b_comfort))


@kernel
def find_blocks(
    path: PathPoints,
    at: int,
    v: float,
    objects: Floats,
    sizes: Floats,
    predictions: Floats,
    times: Floats,
    p: PlanParams,
) -> Blocks:
    """Returns per object what it blocks: leaders with their speed, crossers standing, inf for others.

    objects (n, 5): x, y, heading, vx, vy; sizes (n, 2): length, width; predictions (n, q, 2) at `times`
    (q,) in s; at: point of the path at the ego. Crossers count within CROSSING_MARGIN s of the ego.
    """
    n = objects.shape[0]
    s, speed = np.full(n, np.inf), np.zeros(n)
    for i in range(n):
        for k in range(times.size):
            x, y = predictions[i, k, 0], predictions[i, k, 1]
            j, offset = locate(
                path, x, y, at + (SEARCH_AHEAD - BACK) // 2, SEARCH_AHEAD // 2 + BACK
            )
            h = path.heading[j]
            dx = (x - path.x[j]) * np.cos(h) + (y - path.y[j]) * np.sin(h)
            if abs(dx) > 2.0:
                continue  # before or beyond the stretch
            c = abs(np.cos(objects[i, 2] - h))
            sn = abs(np.sin(objects[i, 2] - h))
            half_l = 0.5 * (c * sizes[i, 0] + sn * sizes[i, 1])
            half_w = 0.5 * (sn * sizes[i, 0] + c * sizes[i, 1])
            if abs(offset) > half_w + p.half_width + p.margin:
                continue
            ahead = (j - at) + dx - half_l
            if ahead < -half_l:
                break  # behind the ego's centre: it has to see to itself
            along = objects[i, 3] * np.cos(h) + objects[i, 4] * np.sin(h)
            if k > 0:
                arrival = max(ahead - p.half_length, 0.0) / max(v, 2.0)
                if along > ALONG * np.hypot(objects[i, 3], objects[i, 4]):
                    early = arrival < times[k] - CROSSING_MARGIN
                else:
                    early = abs(arrival - times[k]) > CROSSING_MARGIN and arrival < times[k]
                if early:
                    continue
            if k > 0 and along < ALONG * np.hypot(objects[i, 3], objects[i, 4]):
                s[i], speed[i] = ahead, 0.0  # it crosses: keep out of where it will be
            else:
                s[i], speed[i] = ahead - along * times[k], max(along, 0.0)
            break
    return Blocks(s, speed)


@kernel
def roll_out(
    path: PathPoints,
    at: int,
    offset: float,
    v: float,
    blocks: Blocks,
    s_stop: float,
    horizon: float,
    step: float,
    p: PlanParams,
    out: Floats,
) -> float:
    """Fills out (m, 3) with x, y, t every `step` s; returns the first acceleration wanted, m/s^2.

    at: point of the path at the ego; offset: m of it left of the path; v: m/s.
    s_stop: m from the ego's centre to a line at which it must stop, inf: none.
    """
    reach = int(v * horizon + 0.5 * p.a_max * horizon * horizon + v * v / (2.0 * p.b_comfort)) + 10
    speeds = np.empty(reach)
    desired_speeds(path, at, reach, p, speeds)
    s, t, wanted, row = 0.0, 0.0, 0.0, 0
    first = True
    dt = ROLL_STEP
    while row < out.shape[0]:
        if t >= row * step - 1e-9:
            _point(path, at, s, offset, out[row])
            out[row, 2] = t
            row += 1
        v_desired = speeds[min(int(s), reach - 1)]
        a = idm(v, v_desired, np.inf, 0.0, p)
        for i in range(blocks.s.size):
            if blocks.s[i] < np.inf:
                gap = blocks.s[i] + blocks.v[i] * t - s - p.half_length
                a = min(a, idm(v, v_desired, gap, blocks.v[i], p))
        if s_stop < np.inf:
            gap = s_stop - s - p.half_length - LINE_MARGIN + p.gap_min
            a = min(a, idm(v, v_desired, gap, 0.0, p))
        if first:
            wanted, first = a, False
        v_next = max(v + a * dt, 0.0)
        s += 0.5 * (v + v_next) * dt
        v = v_next
        t += dt
    return wanted


@inner_kernel
def _point(path: PathPoints, at: int, s: float, offset: float, out: Floats) -> None:
    """Writes x and y in m of the path `s` m beyond point `at`, at an offset that fades, into `out`."""
    j = min(at + int(s), path.x.size - 2)
    u = min(max(at + s - j, 0.0), 1.0)
    h = path.heading[j] + u * (path.heading[j + 1] - path.heading[j])
    e = offset * np.exp(-s / FADE)
    out[0] = path.x[j] + u * (path.x[j + 1] - path.x[j]) - e * np.sin(h)
    out[1] = path.y[j] + u * (path.y[j + 1] - path.y[j]) + e * np.cos(h)
