"""How critical it became between any two actors of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.evidence.bodies import Body, body
from skidpad.evidence.channels.boxes import STEP
from skidpad.evidence.channels.conflicts import encroachment
from skidpad.evidence.drive.conflict import (
    GAP_MIN,
    deceleration_to_avoid_crash,
    least,
    time_to_collision,
)
from skidpad.recording.run.log import RunLog

EGO = 0
V_HEADWAY = 1.0  # m/s, below there is no headway
STEEPEST = 0.15  # no road climbs as much; assumption


class Pair(NamedTuple):
    """Two actors, whichever of them follows; None where it never applied."""

    one: str  # name of an actor
    other: str  # name of the other one
    min_gap_m: float | None  # m, least gap, bumper to bumper, while one is in the other's way
    min_ttc_s: float | None  # s, least time to collision
    min_thw_s: float | None  # s, least time headway
    max_drac_mps2: float | None  # m/s^2, largest deceleration to avoid a crash at constant speeds
    max_required_mps2: (
        float | None
    )  # m/s^2, largest required deceleration, with the lead's acceleration
    min_pet_s: float | None  # s, least post-encroachment time, up to 2 s


class Following(NamedTuple):
    """One behind another, arrays (T,); gap is NaN where the other is not in the way ahead."""

    gap: Floats
    v_closing: Floats
    v: Floats  # of the one behind
    a_lead: Floats  # of the one ahead, along the axis of the one behind
    left: Floats  # of the other's centre, m
    wide: Floats  # half the room that both need side by side, m


def pairs(log: RunLog) -> tuple[Pair, ...]:
    """Returns the numbers of the ego and every actor that was there together with it."""
    return tuple(_pairs(log, ((EGO, i) for i in range(1, len(log.table.names)))))


def pairs_of_others(log: RunLog) -> tuple[Pair, ...]:
    """Returns the numbers of any two other actors between whom there was anything to measure."""
    found = _pairs(log, combinations(range(1, len(log.table.names)), 2))
    return tuple(pair for pair in found if any(v is not None for v in pair[2:]))


def _pairs(log: RunLog, chosen: Iterable[tuple[int, int]]) -> Iterator[Pair]:
    """Yields how critical it became between the chosen actors, where both were there at once."""
    names = log.table.names
    bodies = [body(log, i) for i in range(len(names))]
    for i, j in chosen:
        both = together(log, i, j)
        if both.any():
            yield pair_of((names[i], names[j]), bodies[i], bodies[j], both, log.header.dt)


def together(log: RunLog, i: int, j: int) -> NDArray[np.bool_]:
    """Returns (T,) the ticks in which both are there and neither is above the other on another road.

    Another road is clear of it in height, by no road's slope. i, j: columns of the log.
    """
    a, height = log.actors, log.table.height
    dx, dy, dz = (v[:, j].astype(np.float64) - v[:, i] for v in (a.x, a.y, a.z))
    clear = np.where(dz > 0.0, height[i], height[j])
    one_road: NDArray[np.bool_] = np.abs(dz) < np.maximum(clear, STEEPEST * np.hypot(dx, dy))
    return log.present[:, i] & log.present[:, j] & one_road


def pair_of(
    names: tuple[str, str], one: Body, other: Body, both: NDArray[np.bool_], dt: float
) -> Pair:
    """Returns the numbers of two actors over the ticks of `both` (T,), where both are there.

    dt: s per tick.
    """
    ways = [following(one, other), following(other, one)]
    use = [both & ~np.isnan(w.gap) for w in ways]
    cut = [Following(*(column[u] for column in w)) for w, u in zip(ways, use, strict=True)]
    f = Following(*(np.concatenate(columns) for columns in zip(*cut, strict=True)))
    drac = deceleration_to_avoid_crash(f.gap, f.v_closing)
    headway = time_to_collision(f.gap, np.where(f.v > V_HEADWAY, f.v, 0.0))
    return Pair(
        one=names[0],
        other=names[1],
        min_gap_m=least(f.gap),
        min_ttc_s=least(time_to_collision(f.gap, f.v_closing)),
        min_thw_s=least(headway),
        max_drac_mps2=_most(drac),
        max_required_mps2=_most(required_deceleration(f.gap, f.v_closing, f.a_lead)),
        min_pet_s=post_encroachment(one, other, both, dt),
    )


def following(behind: Body, ahead: Body) -> Following:
    """Returns what the one behind has in its way, as boxes; both keep their directions."""
    c, s = np.cos(behind.yaw), np.sin(behind.yaw)
    forward, left = behind.project(ahead.x, ahead.y)
    turn = ahead.yaw - behind.yaw
    tc, ts = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    long = 0.5 * (behind.length + ahead.length * tc + ahead.width * ts)
    wide = 0.5 * (behind.width + ahead.length * ts + ahead.width * tc)
    in_the_way = (forward > 0.0) & (np.abs(left) < wide)
    v = behind.vx * c + behind.vy * s
    closing = v - (ahead.vx * c + ahead.vy * s)
    a_lead = ahead.ax * np.cos(turn) - ahead.ay * np.sin(turn)
    gap = np.where(in_the_way, np.maximum(forward - long, 0.0), np.nan)
    return Following(gap, closing, v, a_lead, left, wide)


def required_deceleration(gap: Floats, v_closing: Floats, a_lead: Floats) -> Floats:
    """Returns the constant m/s^2 behind a lead that keeps its own, without contact; >= 0.

    a_lead: m/s^2 along the axis of the one behind, negative when it brakes.
    Source: a_long,req for constant accelerations, Jansson (2005), as in
    criticality-metrics.readthedocs.io, "Required Longitudinal Acceleration".
    """
    needed = np.maximum(v_closing, 0.0) ** 2 / (2.0 * np.maximum(gap, GAP_MIN)) - a_lead
    out: Floats = np.maximum(needed, 0.0)
    return out


def post_encroachment(a: Body, b: Body, both: NDArray[np.bool_], dt: float) -> float | None:
    """Returns the least s between one leaving a place and the other coming there; None above 2 s."""
    stride = max(1, round(STEP / dt))
    rows = np.flatnonzero(both)
    breaks = np.flatnonzero(np.diff(rows) > 1) + 1
    best = np.inf
    for stretch in np.split(rows, breaks):
        chosen = stretch[::stride]
        if len(chosen) > 1:
            time, _ = encroachment(_motion(a, chosen), _half(a), _motion(b, chosen), _half(b))
            best = min(best, time)
    return float(best) if np.isfinite(best) else None


def _motion(one: Body, rows: NDArray[np.int64]) -> Floats:
    """Returns (n, 4) x, y in m and cosine, sine of yaw of a body at the rows."""
    columns = (one.x, one.y, np.cos(one.yaw), np.sin(one.yaw))
    return np.ascontiguousarray(np.column_stack([c[rows] for c in columns]))


def _half(one: Body) -> Floats:
    """Returns (2,) half the length and half the width in m."""
    return np.array([0.5 * one.length, 0.5 * one.width])


def _most(values: Floats) -> float | None:
    """Returns the largest value; None without values."""
    return float(values.max()) if len(values) else None
