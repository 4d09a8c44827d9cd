"""Obstacle avoidance (ISO 3888-2, the "moose test"): who gets through the cones, and how fast.

Lengths add up to the standard's 61 m, widths depend on the vehicle's, as its text says; the single
widths and the offset were not found in a public text and are assumptions. Many drivers, alike but for
when and how far ahead they steer, try at once: a speed is passed when one of them gets through.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from manoeuvres import MU, TICK, Bench, Trace
from skidpad.core.geometry import mps_from_kmh
from skidpad.physics.types import VehicleType

Floats = NDArray[np.float64]

ENDS = (0.0, 12.0, 25.5, 36.5, 49.0, 61.0)  # m: lane, gap, lane beside it, gap, lane
OFFSET = 1.0  # m between the first lane and the one beside it; assumption
RUN_UP = 15.0  # m before the first cones
LIFT = 2.0  # m into the first lane, where the throttle is released
MARGIN = 12.0  # m beyond the last cones, within which all have arrived

# What drivers differ in: preview s, begin of both steers in m before the lane's end, aim in the lane
# beside (share of its spare room), gain of the steer.
PREVIEW = (0.25, 0.35, 0.45, 0.6)
BEGIN = (0.0, 4.0, 8.0)
BACK = (-2.0, 3.0, 8.0)
AIM = (0.2, 0.5)
GAIN = (1.0, 1.6, 2.4)


@dataclass(frozen=True, slots=True)
class Lanes:
    """Where cones stand beside the first, second and third lane: right and left, m."""

    right: tuple[float, float, float]
    left: tuple[float, float, float]

    @classmethod
    def of(cls, width: float) -> Lanes:
        """For a vehicle of this width; assumptions, see above."""
        first, beside, last = 1.1 * width + 0.25, width + 1.0, max(1.3 * width + 0.25, 3.0)
        edge = 0.5 * first + OFFSET
        return cls((-0.5 * first, edge, -0.5 * last), (0.5 * first, edge + beside, 0.5 * last))


def attempts(kind: VehicleType, v_kmh: float, mu: float = MU, *, stability: bool) -> Trace:
    """All drivers at this entry speed, one column each."""
    preview, begin, back, aim, gain = np.array(
        list(product(PREVIEW, BEGIN, BACK, AIM, GAIN)), dtype=np.float64
    ).T
    lanes = Lanes.of(kind.width)
    spare = lanes.left[1] - lanes.right[1] - kind.width
    y_beside = lanes.right[1] + 0.5 * kind.width + aim * spare
    v = mps_from_kmh(v_kmh)
    bench = Bench([kind] * len(preview), v, mu, stability=stability)
    s = bench.fleet.states
    s.x[:] = -RUN_UP
    out = (ENDS[1] - begin, ENDS[2] + 1.0)
    home = (ENDS[3] - back, ENDS[4] + 1.0)
    for _ in range(round(1.6 * (RUN_UP + ENDS[-1] + MARGIN) / v / TICK)):
        speed = np.maximum(bench.v, 1.0)
        ahead = s.x + preview * speed
        wanted = y_beside * (_ramp(ahead, *out) - _ramp(ahead, *home))
        angle = np.arctan2(wanted - s.y, preview * speed) - s.yaw
        steer = gain * angle * 2.0 * kind.wheelbase / (preview * speed)
        steer += kind.understeer * speed * s.yaw_rate
        bench.step(np.clip(steer, -0.5, 0.5), np.where(s.x < LIFT, bench.hold(v), 0.0))
    return bench.trace()


def _ramp(x: Floats, begin: Floats, end: float) -> Floats:
    """0 before, 1 after, smooth between."""
    share = np.clip((x - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def through(kind: VehicleType, t: Trace) -> NDArray[np.bool_]:
    """(n,) who touched no cone."""
    lanes = Lanes.of(kind.width)
    passed = t.x[-1] > ENDS[-1]
    for along, across in product((0.5, -0.5), (0.5, -0.5)):
        dx, dy = along * kind.length, across * kind.width
        x = t.x + dx * np.cos(t.yaw) - dy * np.sin(t.yaw)
        y = t.y + dx * np.sin(t.yaw) + dy * np.cos(t.yaw)
        for lane in range(3):
            inside = (x >= ENDS[2 * lane]) & (x <= ENDS[2 * lane + 1])
            wide = (y < lanes.right[lane]) | (y > lanes.left[lane])
            passed &= ~(inside & wide).any(axis=0)
    return np.asarray(passed)


def highest(
    kind: VehicleType, mu: float = MU, *, stability: bool, speeds: range = range(56, 92, 2)
) -> int:
    """The highest entry speed in km/h, of those tried one after the other, that is passed; 0: none."""
    best = 0
    for v in speeds:
        if not through(kind, attempts(kind, v, mu, stability=stability)).any():
            break
        best = v
    return best
