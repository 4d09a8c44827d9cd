"""Tracks of a radar's detections: a Kalman filter of constant velocity over ground for each object.

State: place in the antenna's plane and velocity over ground in its axes. A detection corrects it by range,
place across and range rate, one after the other; the antenna's own motion is known. Nearest first, a
detection goes to a track where the sum of squared normalised errors is at most `GATE` (chi-square, 3
degrees of freedom, 99 %). Confirmed by 3 hits in the last 5 ticks (the form [Mc Nc] of MATLAB's
`trackHistoryLogic`, whose example is [3 5]); dropped after 5 misses in a row. Noise and the numbers of
ticks are assumptions. A confirmed track that is missed goes on by its velocity.
"""

from __future__ import annotations

from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.physical_radar.lists import (
    ALTITUDE,
    AZIMUTH,
    POWER,
    RANGE,
    RATE,
    SECTION,
    Rows,
)

MOST_TRACKS = 128
GATE = 11.34
HITS, OF_TICKS, MISSES = 3, 5, 5
NOISE_RANGE, NOISE_ACROSS, NOISE_ANGLE, NOISE_RATE = 0.5, 0.5, radians(0.35), 0.2  # m, m, rad, m/s
START_SPEED = 15.0  # m/s, standard deviation across the line of sight at first
ACCELERATION = 3.0  # m/s^2, standard deviation of what velocity does in a tick


class Tracks(NamedTuple):
    """The tracks of one radar; rows of which `number` is 0 are free."""

    number: Ints  # (MOST_TRACKS,) name of the track, from 1
    state: Floats  # (MOST_TRACKS, 4) x, y in m, vx, vy in m/s
    spread: Floats  # (MOST_TRACKS, 4, 4) its covariance
    last: Floats  # (MOST_TRACKS, 3) altitude in rad, power and section of the last detection
    history: Ints  # (MOST_TRACKS,) bits of the last ticks, newest first; 1 is a hit
    age: Ints  # (MOST_TRACKS,) ticks
    confirmed: NDArray[np.bool_]
    named: Ints  # (1,) names given so far


def make_tracks() -> Tracks:
    """Returns no track at all."""
    n = MOST_TRACKS
    return Tracks(
        np.zeros(n, np.int64), np.zeros((n, 4)), np.zeros((n, 4, 4)), np.zeros((n, 3)),
        np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.bool_), np.zeros(1, np.int64),
    )  # fmt: skip


@inner_kernel
def _turn_and_move(a: Floats, c: float, s: float, dt: float, out: Floats) -> None:
    """Write the product with a of the matrix that moves a state on by dt and turns it by (c, s)."""
    for j in range(4):
        x, y, vx, vy = a[0, j], a[1, j], a[2, j], a[3, j]
        out[0, j] = c * x + -s * y + dt * c * vx + dt * -s * vy
        out[1, j] = s * x + c * y + dt * s * vx + dt * c * vy
        out[2, j] = c * vx + -s * vy
        out[3, j] = s * vx + c * vy


@inner_kernel
def predict_tracks(tracks: Tracks, own: tuple[float, float, float], dt: float) -> None:
    """Move all tracks on by dt; own: velocity of the antenna in its axes in m/s, yaw rate in rad/s."""
    turn = -own[2] * dt
    c, s = np.cos(turn), np.sin(turn)
    half = np.empty((4, 4))
    noise = (ACCELERATION * dt) ** 2
    for t in range(MOST_TRACKS):
        if tracks.number[t] == 0:
            continue
        state = tracks.state[t]
        x, y, vx, vy = state[0], state[1], state[2], state[3]
        x, y = x + (vx - own[0]) * dt, y + (vy - own[1]) * dt
        state[0], state[1] = c * x - s * y, s * x + c * y
        state[2], state[3] = c * vx - s * vy, s * vx + c * vy
        _turn_and_move(tracks.spread[t], c, s, dt, half)
        _turn_and_move(half.T, c, s, dt, tracks.spread[t])
        for axis in range(2):
            tracks.spread[t, axis, axis] += 0.25 * noise * dt * dt
            tracks.spread[t, axis, 2 + axis] += 0.5 * noise * dt
            tracks.spread[t, 2 + axis, axis] += 0.5 * noise * dt
            tracks.spread[t, 2 + axis, 2 + axis] += noise


@inner_kernel
def _look(
    row: NDArray[np.float32], own: tuple[float, float, float], looks: Floats, values: Floats
) -> None:
    """Write how a detection measures a state, (3, 4), and its three values and variances, (3, 2)."""
    c, s = np.cos(row[AZIMUTH]), np.sin(row[AZIMUTH])
    looks[0, 0], looks[0, 1] = c, s
    looks[1, 0], looks[1, 1] = -s, c
    looks[2, 2], looks[2, 3] = c, s
    values[0, 0], values[0, 1] = row[RANGE], NOISE_RANGE**2
    values[1, 0], values[1, 1] = 0.0, NOISE_ACROSS**2 + (row[RANGE] * NOISE_ANGLE) ** 2
    values[2, 0], values[2, 1] = row[RATE] + own[0] * c + own[1] * s, NOISE_RATE**2  # over ground


@inner_kernel
def _error(state: Floats, spread: Floats, looks: Floats, values: Floats) -> float:
    """Sum of the squared normalised errors of a detection against a track."""
    total = 0.0
    for k in range(3):
        h = looks[k]
        wide = values[k, 1]
        for a in range(4):
            for b in range(4):
                wide += h[a] * spread[a, b] * h[b]
        off = values[k, 0] - (h[0] * state[0] + h[1] * state[1] + h[2] * state[2] + h[3] * state[3])
        total += off * off / wide
    return total


@inner_kernel
def _along(row: Floats, h: Floats) -> float:
    """Returns the sum of products of two rows of four."""
    return float(row[0] * h[0] + row[1] * h[1] + row[2] * h[2] + row[3] * h[3])


@inner_kernel
def _correct(state: Floats, spread: Floats, looks: Floats, values: Floats) -> None:
    """Correct a track by the three values of a detection, one after the other."""
    for k in range(3):
        h = looks[k]
        p = (
            _along(spread[0], h), _along(spread[1], h), _along(spread[2], h),
            _along(spread[3], h),
        )  # fmt: skip
        wide = values[k, 1] + h[0] * p[0] + h[1] * p[1] + h[2] * p[2] + h[3] * p[3]
        off = values[k, 0] - (h[0] * state[0] + h[1] * state[1] + h[2] * state[2] + h[3] * state[3])
        for a in range(4):
            state[a] += p[a] / wide * off
            for b in range(4):
                spread[a, b] -= p[a] * p[b] / wide


@inner_kernel
def update_tracks(
    tracks: Tracks, rows: Rows, count: int, own: tuple[float, float, float], dt: float
) -> None:
    """Carry the tracks on to this tick's detections; own: motion of the antenna."""
    predict_tracks(tracks, own, dt)
    alive, n = np.empty(MOST_TRACKS, np.int64), 0
    for t in range(MOST_TRACKS):
        if tracks.number[t] > 0:
            tracks.age[t] += 1
            tracks.history[t] = (tracks.history[t] << 1) & ((1 << OF_TICKS) - 1)
            alive[n] = t
            n += 1
    cost = np.empty((n, count))
    looks, values = np.zeros((3, 4)), np.zeros((3, 2))
    for k in range(count):
        _look(rows[k], own, looks, values)
        for m in range(n):
            cost[m, k] = _error(tracks.state[alive[m]], tracks.spread[alive[m]], looks, values)
    free = np.ones(count, np.bool_)
    while n > 0 and count > 0:
        best = np.argmin(cost)
        m, k = best // count, best % count
        if not cost[m, k] <= GATE:
            break
        cost[m, :], cost[:, k] = np.inf, np.inf
        free[k] = False
        t = alive[m]
        _look(rows[k], own, looks, values)
        _correct(tracks.state[t], tracks.spread[t], looks, values)
        _note_hit(tracks, t, rows[k])
    for t in range(MOST_TRACKS):
        if tracks.number[t] > 0 and tracks.history[t] & ((1 << MISSES) - 1) == 0:
            tracks.number[t] = 0
    for k in range(count):
        if free[k]:
            _begin(tracks, rows[k], own)


@inner_kernel
def _note_hit(tracks: Tracks, t: int, row: NDArray[np.float32]) -> None:
    """Record that a detection corrected a track in this tick."""
    tracks.history[t] |= 1
    tracks.last[t, 0], tracks.last[t, 1] = row[ALTITUDE], row[POWER]
    tracks.last[t, 2] = row[SECTION]
    hits = 0
    for bit in range(OF_TICKS):
        hits += (tracks.history[t] >> bit) & 1
    tracks.confirmed[t] = tracks.confirmed[t] or hits >= HITS


@inner_kernel
def _begin(tracks: Tracks, row: NDArray[np.float32], own: tuple[float, float, float]) -> None:
    """Begin a track where there is room; it moves as its range rate says, along the line of sight."""
    t = 0
    while t < MOST_TRACKS and tracks.number[t] > 0:
        t += 1
    if t == MOST_TRACKS:
        return
    looks, values = np.zeros((3, 4)), np.zeros((3, 2))
    _look(row, own, looks, values)
    tracks.named[0] += 1
    tracks.number[t], tracks.age[t], tracks.history[t] = tracks.named[0], 1, 0
    tracks.confirmed[t] = False
    ahead, across, rate = looks[0], looks[1], values[2, 0]
    for a in range(2):
        tracks.state[t, a] = row[RANGE] * ahead[a]
        tracks.state[t, 2 + a] = rate * ahead[a]
        for b in range(2):
            along, beside = ahead[a] * ahead[b], across[a] * across[b]
            tracks.spread[t, a, b] = values[0, 1] * along + values[1, 1] * beside
            tracks.spread[t, 2 + a, 2 + b] = values[2, 1] * along + START_SPEED**2 * beside
            tracks.spread[t, a, 2 + b] = tracks.spread[t, 2 + a, b] = 0.0
    _note_hit(tracks, t, row)


@inner_kernel
def write_tracks(tracks: Tracks, own: tuple[float, float, float], rows: Rows, more: Floats) -> int:
    """Write confirmed tracks as rows and, into `more`, number, x, y, vx, vy, age; returns how many."""
    n = 0
    for t in range(MOST_TRACKS):
        if tracks.number[t] == 0 or not tracks.confirmed[t]:
            continue
        state = tracks.state[t]
        x, y, vx, vy = state[0], state[1], state[2], state[3]
        distance = max(np.hypot(x, y), 1e-6)
        rows[n, RANGE], rows[n, AZIMUTH] = distance, np.arctan2(y, x)
        rows[n, ALTITUDE] = tracks.last[t, 0]
        rows[n, RATE] = ((vx - own[0]) * x + (vy - own[1]) * y) / distance
        rows[n, POWER], rows[n, SECTION] = tracks.last[t, 1], tracks.last[t, 2]
        more[n, 0], more[n, 5] = tracks.number[t], tracks.age[t]
        more[n, 1], more[n, 2], more[n, 3], more[n, 4] = x, y, vx, vy
        n += 1
    return n
