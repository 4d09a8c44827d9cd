"""Clouds of spray behind vehicles, as a lidar's beams cross them: what they take, and what they return.

A cloud begins at the rear of a vehicle and thins out with the distance by exp(-d / (v 1 s)), to 1 / 6. Along
a beam its extinction is taken in six steps. Spray is ragged: in each step of a beam and tick it is
denser or thinner than the mean by a factor of its own, exponential with mean 1 (assumption). It answers a
pulse as fog does (`lidar_returns`), with fog's share of backscatter, over half a pulse at most.
"""

from __future__ import annotations

from math import atan2, cos, exp, hypot, log, pi, sin
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
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
PULSE_SHARE = pi * BACKSCATTER
MEETS = (0.9, 10.0)  # m, from and to which receiver and beam come to overlap; `lidar_returns`
OVERLAP = 1.0 / (MEETS[1] - MEETS[0])
CLEAREST = 1.001 * OVERLAP / (4.0 * MEETS[0])  # 1/m^2, most of overlap / t^2: at twice MEETS[0]
LEAST = 1e-4  # 1/m, clouds thinner than this are left out
DENSER = -np.log1p(-(np.arange(1024) + 0.5) / 1024)  # quantiles of an exponential distribution
FIRST_BITS = np.uint64(64 - 10)  # of random bits, as many as choose one of them
STEP_BITS = np.uint64(10)
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
    stretch = 1.0 / w
    t0, t1 = (a - o) * stretch, (b - o) * stretch
    return max(low, min(t0, t1)), min(far, max(t0, t1))


@inner_kernel
def _nearest_first(clouds: Floats, eye: Floats) -> Ints:
    """Returns the rows of the clouds by the distance of their middle lines from the eye."""
    away = np.empty(len(clouds))
    for c in range(len(clouds)):
        x, y, yaw, length = clouds[c, 0], clouds[c, 1], clouds[c, 3], clouds[c, 4]
        ox, oy = eye[0] - x, eye[1] - y
        back, left = -(ox * cos(yaw) + oy * sin(yaw)), oy * cos(yaw) - ox * sin(yaw)
        away[c] = hypot(back - min(max(back, 0.0), length), left)
    return np.argsort(away)


@kernel
def spray_of(
    clouds: Floats, eye: Floats, r: Floats, azimuth: Floats, elevation: Floats, distance: Floats,
    lost: Floats, least: float, key: np.uint64, tick: int,
) -> Sprayed:  # fmt: skip
    """Returns what clouds (k, 8) do to beams from `eye` (3,), whose axes are turned by r (3, 3).

    A cloud: x, y, z of the middle of the rear at the road, yaw, length, half width, height in m,
    extinction in 1/m at its begin. azimuth (m,), elevation (c,): beam i of the n = m c beams goes to
    azimuth i // c and elevation i % c. distance (n,): m to the surface that ends each beam, or to the
    lidar's range. lost (n,): depth from which that surface is not noticed; -inf where there is none.
    Left out is what changes no return: answers below `least`, and the depth of beams whose surface is lost
    already, where a cloud is too far to answer.
    """
    n, channels = distance.size, elevation.size
    depth, power, where = np.zeros(n), np.zeros(n), np.zeros(n)
    start = scrambled((key ^ SALT) + np.uint64(tick) * GOLDEN)
    flat, rise = np.cos(elevation), np.sin(elevation)
    here = np.empty(STEPS)
    for c in _nearest_first(clouds, eye):
        x, y, z, yaw, length, half, high, first = clouds[c]
        cy, sy = cos(yaw), sin(yaw)
        ox, oy = eye[0] - x, eye[1] - y
        back, left, up = -(ox * cy + oy * sy), oy * cy - ox * sy, eye[2] - z
        off = eye_yaw(r) - yaw - atan2(-left, back - 0.5 * length)
        span, fall = _span(clouds[c], back, left), -THIN / length
        back_up, left_up = -(r[0, 2] * cy + r[1, 2] * sy), r[1, 2] * cy - r[0, 2] * sy
        for column in range(azimuth.size):
            if abs((azimuth[column] + off + pi) % (2.0 * pi) - pi) > span:
                continue
            ca, sa = cos(azimuth[column]), sin(azimuth[column])
            dx, dy = r[0, 0] * ca + r[0, 1] * sa, r[1, 0] * ca + r[1, 1] * sa
            dz = r[2, 0] * ca + r[2, 1] * sa
            back_flat, left_flat = -(dx * cy + dy * sy), dy * cy - dx * sy
            for channel in range(channels):
                i = column * channels + channel
                wz = dz * flat[channel] + r[2, 2] * rise[channel]
                gone = back_flat * flat[channel] + back_up * rise[channel]
                if _leaves(up, wz, 0.0, high) or _leaves(back, gone, 0.0, length):
                    continue
                aside = left_flat * flat[channel] + left_up * rise[channel]
                if _leaves(left, aside, -half, half):
                    continue
                is_lost = depth[i] > lost[i]
                reach = min(distance[i], ANSWER_REACH) if is_lost else distance[i]
                low, far = _cut(back, gone, 0.0, length, 0.0, reach)
                if far <= low:
                    continue
                low, far = _cut(up, wz, 0.0, high, low, far)
                if far <= low:
                    continue
                low, far = _cut(left, aside, -half, half, low, far)
                if far <= low:
                    continue
                bits = scrambled(start + np.uint64(i * 64 + c) * np.uint64(2) * GOLDEN)
                step = (far - low) * (1.0 / STEPS)
                over = PULSE_SHARE * min(ANSWERS, far - low)
                t = low + unit(bits) * step
                mean = first * exp(fall * (back + gone * t))
                thins = exp(fall * gone * step)
                bits = scrambled(bits + GOLDEN)  # ten of them for each step
                tau, densest = 0.0, 0.0
                for s in range(STEPS):
                    here[s] = DENSER[bits >> FIRST_BITS] * mean
                    bits <<= STEP_BITS
                    tau += here[s]
                    densest = max(densest, here[s])
                    mean *= thins
                depth[i] += tau * step
                # of answers, the clearest that one could be; later clouds are mostly farther
                strongest, near = max(power[i], least), max(low, NEAREST)
                bound = densest * over * min(CLEAREST, 1.0 / (near * near))
                if low >= ANSWER_REACH or far <= NEAREST or bound <= strongest:
                    continue
                tau = 0.0
                for s in range(STEPS):
                    taken = 0.5 * here[s] * step
                    tau += taken
                    if NEAREST < t < ANSWER_REACH:
                        overlap = min(max((t - MEETS[0]) * OVERLAP, 0.0), 1.0)
                        clear = here[s] * over * overlap  # without its own cloud
                        # exp(2 x) is at least 1 + 2 x + 2 x^2
                        if clear > strongest * t * t * (1.0 + 2.0 * tau * (1.0 + tau)):
                            answer = clear * exp(-2.0 * tau) / (t * t)
                            if answer > strongest:
                                strongest, where[i], power[i] = answer, t, answer
                    tau += taken
                    t += step
    return Sprayed(depth, power, where)


@inner_kernel
def eye_yaw(r: Floats) -> float:
    """Returns where the forward axis of a rotation (3, 3) points, rad."""
    return atan2(r[1, 0], r[0, 0])


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
        elevation: Floats,
        distance: Floats,
        lost: Floats,
        least: float,
        key: np.uint64,
        tick: int,
    ) -> Sprayed:
        """Returns what the clouds of this moment do to beams, as `spray_of`, seen in the eye's frame."""
        clouds = self.at(states)
        if not len(clouds):
            return no_spray()
        place, turned = np.array([eye.x, eye.y, eye.z]), np.ascontiguousarray(eye.rotation())
        return spray_of(clouds, place, turned, azimuth, elevation, distance, lost, least, key, tick)

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
