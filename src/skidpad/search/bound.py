"""The bound by braking and steering: could a failure have been avoided from the state it began in?

From the moment when the danger first could be known, the ego keeps its motion for a reaction time, then
does one of these with all of the true grip, and nothing else:

* it brakes fully along its lane;
* it steers aside: an arc of the smallest radius that the grip allows, the opposite arc until it is
  parallel to the road again, and from there on at constant speed, or braking fully.

All other road users move as recorded. What touches none of their boxes and stays on the road avoids
the failure. The bound only moves boxes: it knows no slip, load transfer or steering rate, and others do
not react to it, so that a follower that would have braked counts as an obstacle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.maths.constants import G
from skidpad.evidence.encounters import overlap_along

Beyond = Callable[[Floats, Floats, Floats], Floats]  # x, y, z: m beyond the road's edge, 0 on it

REACTION = 0.9  # s, the median of the reference driver (docs/reference-driver.md)
KNOWN = 6.0  # s of constant motion within which a contact or departure can be foreseen; assumption
PREDICTED = 0.1  # s between places of a predicted motion
OFFSETS = np.arange(0.5, 7.01, 0.5)  # m to either side that are tried
TURNING = 5.5  # m, the smallest radius of a car's path at low speed; assumption
STRAIGHTEN = 0.5  # s in which a small angle to the road is steered out; assumption
CHECKED = 2  # ticks between places at which the road's edge is looked for
BRAKING = "braking"


class Track(NamedTuple):
    """The recorded box of a road user: arrays (T,), sizes in m."""

    x: Floats
    y: Floats
    yaw: Floats
    present: Flags
    length: float
    width: float


class Motion(NamedTuple):
    """Speed along the heading in m/s and yaw rate in rad/s of a road user, arrays (T,)."""

    speed: Floats
    yaw_rate: Floats


class Path(NamedTuple):
    """The middle of the ego's lane from the start on, by way `s`, arrays (n,)."""

    s: Floats
    x: Floats
    y: Floats
    z: Floats
    heading: Floats  # rad, without jumps
    curvature: Floats  # 1/m, positive to the left


@dataclass(frozen=True, slots=True)
class Start:
    """The ego at the moment when the danger first could be known.

    Attributes:
        speed: m/s.
        offset: m to the left of the path.
        angle: rad of the heading to the left of the path's.
        curvature: 1/m of its own path, which it keeps while it reacts.
        length, width: of its box, m.
    """

    speed: float
    offset: float = 0.0
    angle: float = 0.0
    curvature: float = 0.0
    length: float = 4.7
    width: float = 1.8


def boxes_overlap(a: Track, b: Track) -> Flags:
    """Return where two boxes overlap, by the normals of their edges; places broadcast."""
    found: Flags = overlap_along(a.x, a.y, a.yaw, b.x, b.y, b.yaw, a, b)
    return found & overlap_along(b.x, b.y, b.yaw, a.x, a.y, a.yaw, b, a)


def predict_motion(track: Track, motion: Motion, rows: NDArray[np.int64]) -> Track:
    """Returns where constant speed and yaw rate lead from each row: arrays (rows, times).

    Times run from 0 to KNOWN in steps of PREDICTED; the box is always present.
    """
    t = np.arange(0.0, KNOWN + 1e-9, PREDICTED)
    v, rate = motion.speed[rows, None], motion.yaw_rate[rows, None]
    half = 0.5 * rate * t
    chord = v * t * np.sinc(half / np.pi)
    yaw = track.yaw[rows, None]
    return replace_places(
        track,
        track.x[rows, None] + chord * np.cos(yaw + half),
        track.y[rows, None] + chord * np.sin(yaw + half),
        yaw + 2.0 * half,
    )


def replace_places(track: Track, x: Floats, y: Floats, yaw: Floats) -> Track:
    """Returns a box of the same size at other places, always present."""
    return Track(x, y, yaw, np.ones(np.shape(x), dtype=bool), track.length, track.width)


def take_rows(track: Track, begin: int, end: int) -> Track:
    """Return the track from row `begin` up to, but without, row `end`."""
    x, y, yaw, present = track.x, track.y, track.yaw, track.present
    part = slice(begin, end)
    return Track(x[part], y[part], yaw[part], present[part], track.length, track.width)


def is_in_sight(eye: Track, seen: Track, others: Sequence[Track], row: int) -> bool:
    """Return whether the middle or a corner of a box can be seen from another's middle in a row.

    Only boxes of road users hide what is behind them; houses are not known here.
    """
    if not seen.present[row]:
        return False
    c, s = np.cos(seen.yaw[row]), np.sin(seen.yaw[row])
    ends = np.array([(0, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)]) * 0.49
    x = seen.x[row] + ends[:, 0] * seen.length * c - ends[:, 1] * seen.width * s
    y = seen.y[row] + ends[:, 0] * seen.length * s + ends[:, 1] * seen.width * c
    share = np.linspace(0.0, 1.0, 200)[:, None]
    ray = Track(
        eye.x[row] + share * (x - eye.x[row]), eye.y[row] + share * (y - eye.y[row]),
        np.zeros((200, 5)), np.ones((200, 5), dtype=bool), 0.0, 0.0,
    )  # fmt: skip
    hidden = np.zeros(5, dtype=bool)
    for other in others:
        if other.present[row]:
            box = replace_places(other, other.x[row], other.y[row], other.yaw[row])
            hidden |= boxes_overlap(ray, box).any(axis=0)
    return not hidden.all()


def first_known_row(foreseen: Flags) -> int:
    """Returns the first row of the stretch of foreseen rows that ends the mask; the last row without one."""
    missed = np.flatnonzero(~foreseen)
    return min(int(missed[-1]) + 1 if len(missed) else 0, len(foreseen) - 1)


def find_avoidance(
    start: Start,
    path: Path,
    others: Sequence[Track],
    beyond: Beyond,
    mu: float,
    dt: float,
    rows: int,
    reaction: float = REACTION,
) -> str:
    """Return what avoids a failure: "braking", "steering left", "steering right", or "" for nothing.

    Args:
        start: the ego when the danger first could be known.
        path: of its lane, from the start on.
        others: boxes of all others from that moment on, one row a tick.
        beyond: m by which places lie beyond the edge of the road.
        mu: friction that all tyres have.
        dt: s of a tick.
        rows: of a tick each, in which nothing may be touched.
        reaction: s in which the ego keeps speed and curvature.

    Braking is preferred, then the smallest way aside.
    """
    aside = np.concatenate([-OFFSETS, OFFSETS])
    aims = np.concatenate([[np.nan], start.offset + np.repeat(aside, 2)])
    holds = np.concatenate([[False], np.tile([True, False], len(aside))])
    ego, s = drive_manoeuvres(start, path, aims, holds, rows, mu, dt, reaction)
    free = np.ones(len(aims), dtype=bool)
    for other in others:
        n = min(len(other.x), rows)
        other = take_rows(other, 0, n)
        part = Track(ego.x[:, :n], ego.y[:, :n], ego.yaw[:, :n], ego.present[:, :n], *ego[4:])
        free &= ~(boxes_overlap(part, other) & other.present).any(axis=1)
    order = sorted(np.flatnonzero(free), key=lambda k: abs(np.nan_to_num(aims[k] - start.offset)))
    z = np.interp(s, path.s, path.z)
    for k in order:
        if _stays_on_road(replace_places(ego, ego.x[k], ego.y[k], ego.yaw[k]), z[k], beyond):
            if np.isnan(aims[k]):
                return BRAKING
            return f"steering {'left' if aims[k] > start.offset else 'right'}"
    return ""


def drive_manoeuvres(
    start: Start, path: Path, aims: Floats, holds: Flags, rows: int, mu: float, dt: float,
    reaction: float,
) -> tuple[Track, Floats]:  # fmt: skip
    """Returns the ego's box (manoeuvres, rows) in each manoeuvre, and the way along the path in m.

    Args:
        start: the ego's state in row 0.
        path: that it follows where it does not steer aside.
        aims: offset from the path that each manoeuvre steers to; NaN: it brakes along the path.
        holds: whether it keeps its speed when it is there.
        rows: of a tick each.
        mu: friction. dt: s of a tick. reaction: s before anything is done.
    """
    n, most = len(aims), mu * G
    s, d, psi = np.zeros(n), np.full(n, start.offset), np.full(n, start.angle)
    v = np.full(n, start.speed)
    side = np.nan_to_num(np.sign(aims - start.offset))
    parallel, back = np.isnan(aims), np.zeros(n, dtype=bool)
    places = np.empty((4, n, rows))
    for row in range(rows):
        heading = np.interp(s, path.s, path.heading)
        places[0, :, row] = np.interp(s, path.s, path.x) - d * np.sin(heading)
        places[1, :, row] = np.interp(s, path.s, path.y) + d * np.cos(heading)
        places[2, :, row], places[3, :, row] = heading + psi, s
        of_path = np.interp(s, path.s, path.curvature)
        tightest = np.minimum(most / np.maximum(v, 0.1) ** 2, 1.0 / TURNING)
        braking = np.zeros(n, dtype=bool)
        if row * dt < reaction - 1e-9:
            bent = np.full(n, start.curvature)
        else:
            left_over = np.nan_to_num(side * (aims - d))
            back |= left_over <= (1.0 - np.cos(psi)) / np.maximum(tightest + side * of_path, 1e-6)
            parallel |= back & (side * psi <= 0.0)
            braking = parallel & ~holds
            following = of_path / np.maximum(1.0 - of_path * d, 0.1)
            following = following - psi / (np.maximum(v, 0.1) * STRAIGHTEN)
            bent = np.where(parallel, following, np.where(back, -side, side) * tightest)
        bent = np.clip(bent, -tightest, tightest)
        left = np.sqrt(np.maximum(most**2 - (v**2 * bent) ** 2, 0.0))
        slower = np.where(braking, np.maximum(v - left * dt, 0.0), v)
        way = 0.5 * (v + slower) * dt
        along = way * np.cos(psi) / np.maximum(1.0 - of_path * d, 0.1)
        turned = way * bent - of_path * along
        d = d + way * np.sin(psi + 0.5 * turned)
        s, psi, v = s + along, psi + turned, slower
    present = np.ones((n, rows), dtype=bool)
    return Track(places[0], places[1], places[2], present, start.length, start.width), places[3]


def _stays_on_road(ego: Track, z: Floats, beyond: Beyond) -> bool:
    """Returns whether no corner goes farther beyond the road's edge than it is at the start.

    z: heights in m, one per place of `ego`.
    """
    chosen = slice(None, None, CHECKED)
    c, s = np.cos(ego.yaw[chosen]), np.sin(ego.yaw[chosen])
    for ahead, left in ((0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)):
        x = ego.x[chosen] + ahead * ego.length * c - left * ego.width * s
        y = ego.y[chosen] + ahead * ego.length * s + left * ego.width * c
        out = beyond(x, y, z[chosen])
        if (out > out[0] + 1e-6).any():
            return False
    return True


def continue_track(
    track: Track, speed: Floats, row: int, more: int, dt: float, road_heading: float
) -> list[Track]:
    """Returns two ways in which a box may go on after a row, where its motion is not its own any more.

    Both are straight and slow down as in the half second before the row, until the box stands: one
    along its heading, one along the road's, as a car that changes lanes may go on or end there. A
    manoeuvre has to avoid both. more: rows that are added, of dt s each.
    """
    back = max(row - max(round(0.5 / dt), 1), 0)
    v = float(speed[row])
    slowing = max((float(speed[back]) - v) / (max(row - back, 1) * dt), 0.0)
    t = np.arange(1, more + 1) * dt
    if slowing > 0.0:
        t = np.minimum(t, v / slowing)
    way = v * t - 0.5 * slowing * t**2
    yaw = float(track.yaw[row])
    return [
        Track(
            np.append(track.x[: row + 1], track.x[row] + way * np.cos(course)),
            np.append(track.y[: row + 1], track.y[row] + way * np.sin(course)),
            np.append(track.yaw[: row + 1], np.full(more, course)),
            np.append(track.present[: row + 1], np.ones(more, dtype=bool)),
            track.length, track.width,
        )
        for course in (yaw, road_heading)
    ]  # fmt: skip
