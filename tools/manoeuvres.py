"""Test manoeuvres of standards, driven with the whole vehicle model: one function each.

A row of arguments is one car, so that many cars or drivers go through a manoeuvre together. What the
manoeuvres say of the model, beside measurements, stands in docs/physics.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from skidpad.core.geometry import Pose, mps_from_kmh
from skidpad.core.maths.constants import G
from skidpad.physics.car import BRAKE, STEER, THROTTLE
from skidpad.physics.fleet import Fleet
from skidpad.physics.types import VehicleType
from skidpad.physics.vehicle import steer_share

Floats = NDArray[np.float64]
TICK = 0.01  # s
MU = 0.9
RADIUS = 100.0  # m, of the circle; ISO 4138's recommended one
SETTLE = 8.0  # s to find the circle
SPUN = 0.35  # rad of side slip beyond which nobody calls it driving
AFTER = 4.0  # s of watching after a pedal moved

# Sine with dwell: 49 CFR 571.126 (FMVSS 126) S5 to S7, the same in UN Regulation 140, paragraph 9. Its
# waveform was looked up; shares and displacement below were not read in its text (docs/physics.md).
DWELL_SPEED = mps_from_kmh(80.0)
DWELL_FREQUENCY = 0.7  # Hz
DWELL = 0.5  # s
SLOW_STEER = radians(13.5)  # 1/s at the steering wheel
STEERING_RATIO = 14.5  # as the rate limit of `types.VehicleType` has it
A_REFERENCE = 0.3 * G  # at which the amplitude's unit is taken
T_SHIFT, SHIFT_LEAST = 1.07, 1.83  # s, m: lateral displacement asked for from 5 units on
RATIOS = ((1.0, 0.35), (1.75, 0.20))  # s after the steer, largest share of the peak yaw rate


@dataclass(frozen=True, slots=True)
class Trace:
    """n cars over k ticks, arrays (k, n); SI, angles unwrapped."""

    t: Floats  # (k,)
    x: Floats
    y: Floats
    yaw: Floats
    v: Floats
    yaw_rate: Floats
    slip: Floats  # side slip at the centre of gravity
    steer: Floats  # road wheel


@dataclass(frozen=True, slots=True)
class Dwell:
    """One sine with dwell."""

    amplitude: float  # in units of the steering angle that gives 0.3 g
    ratios: tuple[float, float]  # yaw rate over its peak 1.0 and 1.75 s after the steer
    shift: float  # m sideways 1.07 s after its beginning

    @property
    def stable(self) -> bool:
        """Both yaw-rate criteria are met."""
        return all(r <= most for r, (_, most) in zip(self.ratios, RATIOS, strict=True))

    @property
    def responsive(self) -> bool:
        """The displacement is met, where it is asked for."""
        return self.amplitude < 5.0 or self.shift >= SHIFT_LEAST


@dataclass(frozen=True, slots=True)
class Pedalled:
    """A car on a circle whose pedals are moved, steering wheel held."""

    a_y: float  # m/s^2 before
    brake: float  # pedal; 0: the throttle alone is released
    ratio: float  # yaw rate after 1 s over that before
    slip: float  # rad, largest side slip
    turned: float  # rad within AFTER


class Bench:
    """Cars side by side on one surface, and what they did."""

    def __init__(
        self, kinds: Sequence[VehicleType], v: ArrayLike, mu: ArrayLike = MU, *,
        stability: bool = True, cycling: bool = False, sensed: bool = False,
    ) -> None:  # fmt: skip
        """v (n,): m/s. mu: one value, or (n, 4) by wheel."""
        self.n = len(kinds)
        self.fleet = Fleet(kinds, TICK, stability=stability, cycling=cycling, sensed=sensed)
        self.mu = np.array(np.broadcast_to(np.asarray(mu, dtype=np.float64), (self.n, 4)))
        for i, speed in enumerate(np.broadcast_to(np.asarray(v, dtype=np.float64), self.n)):
            self.fleet.place(i, Pose(0.0, 0.0), float(speed))
        self.commands = np.zeros((self.n, 5))
        self.full = np.array([kind.steer_max for kind in kinds])
        self._rows: list[tuple[Floats, ...]] = []

    @property
    def v(self) -> Floats:
        """(n,) speeds along the bodies."""
        s = self.fleet.states
        return np.asarray(s.vx * np.cos(s.yaw) + s.vy * np.sin(s.yaw))

    def hold(self, v: ArrayLike) -> Floats:
        """(n,) throttle that keeps these speeds."""
        return np.clip(np.asarray(v) - self.v + 0.1, 0.0, 1.0)

    def step(self, steer: ArrayLike, throttle: ArrayLike = 0.0, brake: ArrayLike = 0.0) -> None:
        """One tick with these road-wheel angles and pedals, each (n,) or one for all."""
        s = self.fleet.states
        share = self.full * np.array([steer_share(float(x)) for x in np.hypot(s.vx, s.vy)])
        self.commands[:, THROTTLE], self.commands[:, BRAKE] = throttle, brake
        self.commands[:, STEER] = np.asarray(steer) / share
        self.fleet.step(self.commands, self.mu)
        self._rows.append(
            (
                s.x.copy(), s.y.copy(), s.yaw.copy(), self.v, s.yaw_rate.copy(),
                self.slip_angles(), self.fleet.wheels.steer.copy(),
            )
        )  # fmt: skip

    def slip_angles(self) -> Floats:
        """(n,) side slip of the centres of gravity in rad, left positive; 0 below 1 m/s."""
        s, x_cog = self.fleet.states, self.fleet.params.x_cog
        u = self.v
        v = s.vy * np.cos(s.yaw) - s.vx * np.sin(s.yaw) + s.yaw_rate * x_cog
        return np.where(np.hypot(u, v) > 1.0, np.arctan2(v, u), 0.0)

    @property
    def ticks(self) -> int:
        """Steps so far."""
        return len(self._rows)

    def trace(self) -> Trace:
        """All steps so far."""
        x, y, yaw, v, rate, slip, steer = (np.array(c) for c in zip(*self._rows, strict=True))
        t = TICK * np.arange(1.0, len(x) + 1.0)
        return Trace(t, x, y, np.unwrap(yaw, axis=0), v, rate, slip, steer)


def circle(
    kind: VehicleType,
    a_y: ArrayLike,
    mu: float = MU,
    *,
    stability: bool = False,
    sensed: bool = False,
) -> tuple[Bench, Floats]:
    """Cars that drive the circle of ISO 4138 steadily, left, and their road-wheel angles.

    a_y: m/s^2 that the speeds mean; a car that cannot do it runs wide.
    """
    v = np.sqrt(np.asarray(a_y, dtype=np.float64) * RADIUS)
    bench = Bench([kind] * len(v), v, mu, stability=stability, sensed=sensed)
    trim = np.zeros(len(v))
    steer = trim
    for k in range(round(SETTLE / TICK)):
        wanted = bench.v / RADIUS * min(1.0, k * TICK / (0.4 * SETTLE))
        error = wanted - bench.fleet.states.yaw_rate
        trim = trim + 0.3 * TICK * error
        steer = kind.wheelbase * wanted / np.maximum(bench.v, 1.0) + 0.1 * error + trim
        steer = np.clip(steer + kind.understeer * wanted * bench.v, -0.35, 0.35)
        bench.step(steer, bench.hold(v))
    return bench, steer


def understeer(kind: VehicleType, a_low: float = 1.0, a_high: float = 4.0) -> float:
    """Understeer gradient in rad s^2/m between two lateral accelerations, by ISO 4138."""
    bench, _ = circle(kind, (a_low, a_high))
    s = bench.fleet.states
    beyond = bench.fleet.wheels.steer - kind.wheelbase * s.yaw_rate / bench.v
    a_y = s.yaw_rate * bench.v
    return float((beyond[1] - beyond[0]) / (a_y[1] - a_y[0]))


def lateral_limit(kind: VehicleType, mu: float = MU) -> float:
    """Largest steady lateral acceleration on the circle in m/s^2."""
    bench, _ = circle(kind, np.linspace(0.6, 1.0, 9) * mu * G, mu)
    rate, v = bench.fleet.states.yaw_rate, bench.v
    held = (np.abs(bench.slip_angles()) < SPUN) & (rate * RADIUS < 1.05 * v)
    return float((rate * v)[held].max())


def pedals_in_turn(
    kind: VehicleType,
    a_y: float,
    brakes: Sequence[float],
    mu: float = MU,
    *,
    stability: bool,
    sensed: bool = False,
) -> list[Pedalled]:
    """Throttle released (ISO 9816) and brakes applied (ISO 7975) on the circle, steer held."""
    bench, steer = circle(kind, [a_y] * len(brakes), mu, stability=stability, sensed=sensed)
    begin = bench.ticks - 1
    for _ in range(round(AFTER / TICK)):
        bench.step(steer, 0.0, np.asarray(brakes))
    t = bench.trace()
    rate = t.yaw_rate[begin + round(1.0 / TICK)] / t.yaw_rate[begin]
    slip, turned = np.abs(t.slip[begin:]).max(axis=0), t.yaw[-1] - t.yaw[begin]
    return [
        Pedalled(a_y, float(b), float(rate[i]), float(slip[i]), float(turned[i]))
        for i, b in enumerate(brakes)
    ]


def dwell_unit(kind: VehicleType, mu: float = MU) -> float:
    """Road-wheel angle in rad at 0.3 g and 80 km/h, steered slowly."""
    bench = Bench([kind], DWELL_SPEED, mu, stability=False)
    steer = 0.0
    while bench.fleet.states.yaw_rate[0] * bench.v[0] < A_REFERENCE:
        steer += SLOW_STEER / STEERING_RATIO * TICK
        bench.step(steer, bench.hold(DWELL_SPEED))
    return steer


def dwell_steer(t: float) -> float:
    """Steering angle over its amplitude: a sine that rests 0.5 s at its second peak."""
    period = 1.0 / DWELL_FREQUENCY
    if t < 0.75 * period:
        return float(np.sin(2.0 * pi * DWELL_FREQUENCY * t))
    if t < 0.75 * period + DWELL:
        return -1.0
    if t < period + DWELL:
        return float(np.sin(2.0 * pi * DWELL_FREQUENCY * (t - DWELL)))
    return 0.0


def sine_with_dwell(
    kind: VehicleType,
    amplitudes: Sequence[float],
    mu: float = MU,
    *,
    stability: bool,
    sensed: bool = False,
) -> list[Dwell]:
    """The cars coast through it, one per amplitude."""
    steer = dwell_unit(kind, mu) * np.asarray(amplitudes)
    bench = Bench([kind] * len(steer), DWELL_SPEED, mu, stability=stability, sensed=sensed)
    end = 1.0 / DWELL_FREQUENCY + DWELL
    while bench.ticks * TICK < end + RATIOS[-1][0] + TICK:
        bench.step(steer * dwell_steer(bench.ticks * TICK))
    t = bench.trace()
    reversed_, done = round(0.5 / DWELL_FREQUENCY / TICK), round(end / TICK)
    peak = t.yaw_rate[reversed_:done].min(axis=0)  # steered left first, then right
    found = []
    for i, amplitude in enumerate(amplitudes):
        first, second = (
            float(t.yaw_rate[done + round(s / TICK), i] / peak[i]) for s, _ in RATIOS
        )  # fmt: skip
        shift = float(t.y[round(T_SHIFT / TICK), i])
        found.append(Dwell(float(amplitude), (first, second), shift))
    return found


def until(bench: Bench, done: Callable[[Bench], bool], limit: float = 60.0) -> Bench:
    """Whatever the commands are, until something is so or `limit` seconds are over."""
    while not done(bench) and bench.ticks * TICK < limit:
        bench.step(0.0, bench.commands[:, THROTTLE], bench.commands[:, BRAKE])
    return bench


def time_to_speed(kind: VehicleType, v: float, mu: float = MU) -> float:
    """Seconds from rest to v m/s at full throttle."""
    bench = Bench([kind], 0.0, mu, stability=True)
    bench.commands[:, THROTTLE] = 1.0
    return until(bench, lambda b: bool(b.v[0] >= v)).ticks * TICK
