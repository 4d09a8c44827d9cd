"""A stop on split friction: one side of the car on ice, the other on dry road, and a driver who steers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manoeuvres import STEERING_RATIO, TICK, Bench
from skidpad.core.maths.constants import G
from skidpad.physics.types import VehicleType

HIGH, LOW = 0.8, 0.2  # friction left and right
STOPPED = 0.5  # m/s
REACTION = 0.2  # s by which the driver's eyes and hands lag
# rad per m aside and per rad of heading, s: gains of a driver who wants to stay in lane; ours
ASIDE, HEADING, RATE = 0.04, 1.0, 0.25
WHEEL_RATE = 10.0  # rad/s of the steering wheel at most; ours


@dataclass(frozen=True, slots=True)
class SplitStop:
    """What came of it."""

    distance: float  # m
    aside: float  # m from the line at most
    heading: float  # rad off the line at most
    wheel: float  # rad of the steering wheel at most
    utilisation: float  # mean deceleration over that of both sides' friction together


def split_stop(
    kind: VehicleType, v: float, *, steers: bool, stability: bool = True, cycling: bool = False,
    sensed: bool = False,
) -> SplitStop:  # fmt: skip
    """Full braking from v m/s straight on, left wheels on HIGH, right ones on LOW.

    cycling: anti-lock brakes work from wheel speeds, sensed: stability control does; else they are ideal.
    """
    bench = Bench(
        [kind], v, [[HIGH, LOW, HIGH, LOW]], stability=stability, cycling=cycling, sensed=sensed
    )
    lag = round(REACTION / TICK)
    seen = [0.0] * lag  # steer that the driver has decided upon
    steer = 0.0
    while bench.v[0] > STOPPED and bench.ticks * TICK < 60.0:
        s = bench.fleet.states
        wanted = -(ASIDE * s.y[0] + HEADING * s.yaw[0] + RATE * s.yaw_rate[0])
        seen.append(float(np.clip(wanted, -0.3, 0.3)))
        most = WHEEL_RATE / STEERING_RATIO * TICK
        steer += float(np.clip(seen.pop(0) - steer, -most, most)) if steers else 0.0
        bench.step(steer, 0.0, 1.0)
    t = bench.trace()
    distance = float(t.x[-1, 0])
    return SplitStop(
        distance,
        float(np.abs(t.y).max()),
        float(np.abs(t.yaw).max()),
        STEERING_RATIO * float(np.abs(t.steer).max()),
        v * v / (2.0 * distance) / (0.5 * (HIGH + LOW) * G),
    )
