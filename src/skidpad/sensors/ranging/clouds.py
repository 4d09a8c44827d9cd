"""Clouds of spray behind vehicles, as a lidar's beams cross them: what they take, and what they return.

A cloud begins at the rear of a vehicle and thins out with the distance by exp(-d / (v 1 s)), to 1 / 6. Along
a beam its extinction is taken in six steps. Spray is ragged: in each step of a beam and tick it is
denser or thinner than the mean by a factor of its own, exponential with mean 1 (assumption). It answers a
pulse as fog does (`lidar_returns`), with fog's share of backscatter, over half a pulse at most.
"""

from __future__ import annotations

from math import atan2, cos, exp, log, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.kernels.splitmix import GOLDEN, scrambled, unit
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.droplets import FOG_BACKSCATTER
from skidpad.physics.spray import ASIDE, HANGS, HIGHEST, spray_density, spray_extinction

THIN = log(6.0)  # depths of thinning at which a cloud ends
STEPS = 6
ROOM = 0.05  # rad, of a column that is not upright as its lidar rolls and pitches
NEAREST, ANSWER_REACH = 1.5, 30.0  # m, of spray that is noticed, as of drops in `lidar_returns`
BACKSCATTER = -FOG_BACKSCATTER / log(0.05)  # 1/sr, of the extinction
ANSWERS = 3.0  # m, half a pulse of 20 ns
MEETS = (0.9, 10.0)  # m, from and to which receiver and beam come to overlap; `lidar_returns`
LEAST = 1e-4  # 1/m, clouds thinner than this are left out
DENSER = -np.log1p(-(np.arange(1024) + 0.5) / 1024)  # quantiles of an exponential distribution
FIRST_BITS = np.uint64(64 - 10)  # of random bits, as many as choose one of them
CERTAIN = 1.0 - 1e-12  # of a bound, so that rounding leaves no answer out
SALT = np.uint64(0x5BF0_3635_D1F9_B3A7)


class Sprayed(NamedTuple):
    """What spray does to n beams; empty arrays: there is none."""

    depth: Floats  # one way, up to the surface
    power: Floats  # of its strongest answer, 0: none
    distance: Floats  # m of that


def no_spray() -> Sprayed:
    """Returns the value for beams without any spray: empty arrays."""
    none = np.empty(0)
    return Sprayed(none, none, none)


@inner_kernel
def _span(cloud: Floats, back: float, left: float) -> float:
    """Returns half the angle in rad over which an eye sees a cloud; pi from inside.

    The eye is `back` m behind the rear and `left` m of its middle. cloud: (8,) as in `spray_of`.
    """
    length, half = cloud[4], cloud[5]
    if 0.0 <= back <= length and abs(left) <= half:
        return pi
    middle, most = atan2(-left, back - 0.5 * length), 0.0
    for k in range(4):
        x, y = (length if k < 2 else 0.0), (half if k % 2 == 0 else -half)
        off = atan2(y - left, back - x) - middle
        most = max(most, abs((off + pi) % (2.0 * pi) - pi))
    return most + ROOM


@inner_kernel
def _leaves(o: float, w: float, a: float, b: float) -> bool:
    """Returns whether a beam that begins at o goes away from what lies between a and b."""
    return bool((o > b and w >= 0.0) or (o < a and w <= 0.0))


@inner_kernel
def _cut(o: float, w: float, a: float, b: float, low: float, far: float) -> tuple[float, float]:
    """Returns the part of a stretch from low to far that lies between a and b; far -1: none does.

    o, w: where a beam begins on this axis, and how far it goes per metre.
    """
    if abs(w) < 1e-9:
        return low, (-1.0 if o < a or o > b else far)
    t0, t1 = (a - o) / w, (b - o) / w
    return max(low, min(t0, t1)), min(far, max(t0, t1))


@kernel
def spray_of(
    clouds: Floats, eye: Floats, azimuth: Floats, ways: Floats, distance: Floats,
    met: NDArray[np.bool_], least: float, key: np.uint64, tick: int,
) -> Sprayed:  # fmt: skip
    """Returns what clouds (k, 8) do to beams from `eye` (3,) with unit vectors ways (n, 3), of the world.

    A cloud: x, y, z of the middle of the rear at the road, yaw, length, half width, height in m,
    extinction in 1/m at its begin. azimuth (m,): of the columns of n / m beams each, roughly.
    distance (n,): m to the surface that ends each beam, where it has `met` one, else to the lidar's range.
    Left out is what changes no return: answers below `least`, and the depth of beams that meet nothing, or
    whose surface is lost already, where a cloud is too far to answer.
    """
    n = distance.size
    channels = n // azimuth.size
    depth, power, where = np.zeros(n), np.zeros(n), np.zeros(n)
    lost = np.empty(n)  # depth at which not even a white surface is noticed
    for i in range(n):
        lost[i] = -0.5 * log(least * distance[i] * distance[i]) + 1e-6
    start = scrambled((key ^ SALT) + np.uint64(tick) * GOLDEN)
    for c in range(len(clouds)):
        x, y, z, yaw, length, half, high, first = clouds[c]
        cy, sy = cos(yaw), sin(yaw)
        ox, oy = eye[0] - x, eye[1] - y
        back, left, up = -(ox * cy + oy * sy), oy * cy - ox * sy, eye[2] - z
        toward = yaw + atan2(-left, back - 0.5 * length)
        span = _span(clouds[c], back, left)
        for column in range(azimuth.size):
            if abs((azimuth[column] - toward + pi) % (2.0 * pi) - pi) > span:
                continue
            for i in range(column * channels, (column + 1) * channels):
                wx, wy, wz = ways[i, 0], ways[i, 1], ways[i, 2]
                gone, aside = -(wx * cy + wy * sy), wy * cy - wx * sy
                if _leaves(up, wz, 0.0, high) or _leaves(back, gone, 0.0, length):
                    continue
                if _leaves(left, aside, -half, half):
                    continue
                low, far = _cut(back, gone, 0.0, length, 0.0, distance[i])
                if far <= low or not (met[i] or low < ANSWER_REACH):
                    continue
                low, far = _cut(up, wz, 0.0, high, low, far)
                if far <= low:
                    continue
                low, far = _cut(left, aside, -half, half, low, far)
                if far <= low:
                    continue
                is_lost = not met[i] or depth[i] > lost[i]
                if is_lost and low >= ANSWER_REACH:
                    continue
                bits = scrambled(start + np.uint64(i * 64 + c) * np.uint64(16) * GOLDEN)
                step, jitter = (far - low) / STEPS, unit(bits)
                tau, over, strongest = 0.0, min(ANSWERS, far - low), power[i]
                mean = first * exp(-THIN * (back + gone * (low + jitter * step)) / length)
                thins = exp(-THIN * gone * step / length)
                for s in range(STEPS):
                    t = low + (s + jitter) * step
                    if is_lost and t >= ANSWER_REACH:
                        break
                    bits += GOLDEN
                    here = DENSER[scrambled(bits) >> FIRST_BITS] * mean
                    tau += 0.5 * here * step
                    if NEAREST < t < ANSWER_REACH:
                        overlap = min(max((t - MEETS[0]) / (MEETS[1] - MEETS[0]), 0.0), 1.0)
                        clear = (
                            pi * BACKSCATTER * here * over
                        )  # without its own cloud, full overlap
                        noticed = CERTAIN * max(strongest, least) * t * t
                        # exp(2 x) is at least 1 + 2 x + 2 x^2
                        if clear * overlap > noticed * (1.0 + 2.0 * tau * (1.0 + tau)):
                            answer = clear * overlap * exp(-2.0 * tau) / (t * t)
                            if answer > strongest:
                                strongest, where[i] = answer, t
                    tau += 0.5 * here * step
                    mean *= thins
                depth[i] += tau
                power[i] = strongest
    return Sprayed(depth, power, where)


class SprayClouds:
    """The clouds behind the vehicles of a run, by the film on the road."""

    def __init__(self, table: ActorTable, film: float) -> None:
        """film: m of water on the road."""
        self.table, self.film = table, film

    def of_beams(
        self,
        states: ActorStates,
        eye: Pose,
        azimuth: Floats,
        ways: Floats,
        distance: Floats,
        met: NDArray[np.bool_],
        least: float,
        key: np.uint64,
        tick: int,
    ) -> Sprayed:
        """Returns what the clouds of this moment do to beams, as `spray_of`, seen in the eye's frame."""
        clouds = self.at(states)
        if not len(clouds):
            return no_spray()
        place = np.array([eye.x, eye.y, eye.z])
        turned = ways @ eye.rotation().T
        return spray_of(clouds, place, azimuth + eye.yaw, turned, distance, met, least, key, tick)

    def at(self, states: ActorStates) -> Floats:
        """Returns the clouds (k, 8) of this moment, as in `spray_of`, but those thinner than LEAST."""
        table, rows = self.table, []
        for i in np.flatnonzero(states.present & (table.kind <= ActorKind.MOTORCYCLE)).tolist():
            speed = float(np.hypot(states.vx[i], states.vy[i]))
            width, height = float(table.width[i]), float(table.height[i])
            first = spray_extinction(spray_density(self.film, speed, width, height))
            if first < LEAST:
                continue
            yaw, rear = float(states.yaw[i]), 0.5 * float(table.length[i])
            place = (states.x[i] - rear * cos(yaw), states.y[i] - rear * sin(yaw), states.z[i])
            size = (THIN * HANGS * speed, 0.5 * width + ASIDE, min(height, HIGHEST))
            rows.append((*map(float, place), yaw, *size, first))
        return np.array(rows, dtype=np.float64).reshape(-1, 8)
