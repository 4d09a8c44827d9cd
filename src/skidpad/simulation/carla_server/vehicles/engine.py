"""An engine and its gears as clients describe them, and what they come to at the wheels.

Vehicles here are driven by min(force, power / v) up to a top speed (`VehicleType`), as if gears were so
close that the engine is always at its best. CARLA's own curves and gears per blueprint are in no public
text that we found, so a fresh vehicle describes the drive that it has, and what a client changes acts.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, inf, log, pi
from typing import Any, NamedTuple

import numpy as np

from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.types import VehicleType
from skidpad.physics.wind import AIR_DENSITY
from skidpad.simulation.carla_server.protocol import wire

Curve = Sequence[tuple[float, float]]  # rpm and N m
RPM = 2.0 * pi / 60.0  # rad/s
FINAL_RATIO = 4.0
# Full power from the first to the second, rpm: petrol engines of cars, diesel engines of others; assumed.
RANGE, RANGE_HEAVY = (4000.0, 6000.0), (1400.0, 2100.0)
HEAVY = (ActorKind.TRUCK, ActorKind.BUS)
SPARE = 1.05  # speed at the limit of revolutions in the highest gear, over the one that drag allows
BEYOND = 200.0  # m/s, no drive is that fast
SHIFTS = (0.5, 0.65)  # where an automatic box shifts down and up, as the client's class has it
NUMBERS = {  # members by their places in a call
    1: "max_rpm",
    2: "moi",
    3: "damping_rate_full_throttle",
    4: "damping_rate_zero_throttle_clutch_engaged",
    5: "damping_rate_zero_throttle_clutch_disengaged",
    7: "gear_switch_time",
    8: "clutch_strength",
    9: "final_ratio",
}


@dataclass(frozen=True, slots=True)
class Engine:
    """The first eleven members of VehiclePhysicsControl; those without a comment have no effect."""

    torque_curve: tuple[tuple[float, float], ...]  # rpm and N m, ascending
    max_rpm: float
    final_ratio: float
    gears: tuple[tuple[float, float, float], ...]  # ratio, and where it shifts down and up
    moi: float = 1.0
    damping: tuple[float, float, float] = (0.15, 2.0, 0.35)
    autobox: bool = True
    switch_time: float = 0.5
    clutch: float = 10.0

    @property
    def is_told(self) -> bool:
        """Whether there are curve and gears; a client's fresh object has no gears and changes no drive."""
        return bool(self.torque_curve and self.gears)

    def pack(self) -> list[Any]:
        """Returns engine and gearbox as CARLA's wire sends them."""
        curve, gears = [list(p) for p in self.torque_curve], [list(g) for g in self.gears]
        return [
            curve, self.max_rpm, self.moi, *self.damping, self.autobox, self.switch_time, self.clutch,
            self.final_ratio, gears,
        ]  # fmt: skip


def parse_engine(value: Sequence[Any]) -> Engine:
    """Returns an engine from the first members of a call; WireError names what is not possible."""
    name = "physics control"
    curve = [wire.numbers(p, f"{name}.torque_curve", 2) for p in wire.items(value[0], "curve")]
    gears = [wire.numbers(g, f"{name}.forward_gears", 3) for g in wire.items(value[10], "gears")]
    numbers = [wire.number(value[i], f"{name}.{NUMBERS[i]}") for i in NUMBERS]
    max_rpm, moi, *damping, switch_time, clutch, final_ratio = numbers
    if any(rpm < 0.0 or torque < 0.0 for rpm, torque in curve):
        raise wire.WireError(f"{name}.torque_curve: revolutions and torques must not be negative")
    if any(b[0] < a[0] for a, b in pairwise(curve)):
        raise wire.WireError(f"{name}.torque_curve: revolutions must ascend")
    if max_rpm < 0.0 or final_ratio < 0.0 or any(g[0] < 0.0 for g in gears):
        raise wire.WireError(f"{name}: max_rpm and ratios of gears must not be negative")
    return Engine(
        tuple((rpm, torque) for rpm, torque in curve),
        max_rpm,
        final_ratio,
        tuple((ratio, down, up) for ratio, down, up in gears),
        moi,
        (damping[0], damping[1], damping[2]),
        wire.flag(value[6], f"{name}.use_gear_autobox"),
        switch_time,
        clutch,
    )


def engine_of(model: VehicleType) -> Engine:
    """Returns an engine and gears that come to the force and power of this type."""
    low, high = RANGE_HEAVY if model.actor_kind in HEAVY else RANGE
    knots = [0.0, *np.linspace(low, high, 9).tolist()]
    curve = [(rpm, model.power / (max(rpm, low) * RPM)) for rpm in knots]
    share = model.power / _power(curve, high)  # between knots a straight line is a little more
    curve = [(rpm, share * torque) for rpm, torque in curve]
    first = model.force_max * model.wheel_radius / curve[0][1]
    last = high * RPM * model.wheel_radius / (SPARE * _fastest(model))
    # no gear leaves the range of full power before the next one is in it
    steps = max(ceil(log(first / last) / log(high / low)), 0)
    ratios = [first * (last / first) ** (k / max(steps, 1)) for k in range(steps + 1)]
    gears = ((ratio / FINAL_RATIO, *SHIFTS) for ratio in ratios)
    return Engine(tuple(curve), high, FINAL_RATIO, tuple(gears))


def _fastest(model: VehicleType) -> float:
    """Returns the m/s at which all power goes into air and rolling drag on the level."""
    air, rolling = 0.5 * AIR_DENSITY * model.drag_area, model.rolling_resistance * model.mass * G
    roots = np.roots([air, 0.0, rolling, -model.power])
    return float(roots[np.isreal(roots)].real.max())


class Traction(NamedTuple):
    """What an engine comes to at the driven wheels."""

    force: float  # N in the lowest gear
    power: float  # W
    speed: float  # m/s at the limit of revolutions in the highest gear


def at_wheels(engine: Engine, radius: float) -> Traction:
    """Returns the traction at wheels of this radius in m; all 0 without a ratio or revolutions."""
    ratios = [g[0] * engine.final_ratio for g in engine.gears if g[0] > 0.0]
    if not ratios or not engine.is_told or engine.max_rpm * engine.final_ratio <= 0.0:
        return Traction(0.0, 0.0, 0.0)
    return Traction(
        max(torque for _, torque in _curve_until(engine.torque_curve, engine.max_rpm))
        * max(ratios)
        / radius,
        _power(engine.torque_curve, engine.max_rpm),
        min(engine.max_rpm * RPM * radius / min(ratios), BEYOND),
    )


def _curve_until(curve: Curve, max_rpm: float) -> list[tuple[float, float]]:
    """Returns the curve's knots below these revolutions, and its end there."""
    rpm, torque = np.array(curve).T
    end = float(np.interp(max_rpm, rpm, torque))
    return [*((r, t) for r, t in curve if r < max_rpm), (max_rpm, end)]


def _power(curve: Curve, max_rpm: float) -> float:
    """Returns the greatest power in W up to max_rpm: at a knot, or inside a falling line."""
    knots = _curve_until(curve, max_rpm)
    best = max(rpm * torque for rpm, torque in knots)
    for (r, t), (r_next, t_next) in pairwise([(0.0, knots[0][1]), *knots]):
        slope = (t_next - t) / (r_next - r) if r_next > r else 0.0
        if slope < 0.0:
            top = 0.5 * (r - t / slope)
            if r < top < r_next:
                best = max(best, top * (t + slope * (top - r)))
    return best * RPM


def shift_speeds(engine: Engine, radius: float) -> tuple[float, ...]:
    """Returns the m/s up to which an automatic box stays in each gear but the highest; inf: it stays.

    radius: of the wheels in m.
    """
    speeds, highest = [], 0.0
    for ratio, _, up in engine.gears[:-1]:
        turns = ratio * engine.final_ratio
        shifts = up < 1.0 and turns * engine.max_rpm > 0.0
        highest = max(highest, up * engine.max_rpm * RPM * radius / turns if shifts else inf)
        speeds.append(highest)
    return tuple(speeds)


def gear_at(shifts: tuple[float, ...], speed: float) -> int:
    """Returns the lowest gear, from 1, that does not shift up yet at this speed in m/s."""
    return 1 + bisect_left(shifts, abs(speed))


def revolutions(engine: Engine, gear: int, speed: float, radius: float) -> float:
    """Returns the rpm at this speed in m/s with wheels of this radius in m.

    0 out of gear, at most the limit.
    """
    if gear == 0 or not engine.gears:
        return 0.0
    ratio = engine.gears[min(abs(gear), len(engine.gears)) - 1][0] * engine.final_ratio
    return min(abs(speed) / radius * ratio / RPM, engine.max_rpm)
