"""CPU time of a vehicle and tick: for `skidpad bench physics`."""

from __future__ import annotations

from statistics import median
from time import process_time_ns

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.physics.fleet import Fleet
from skidpad.physics.types import traffic_types, vehicle_type

TICKS = 400
FLEETS = (1, 21, 200)
SPEED = 25.0  # m/s
MU = 0.9
DT = 0.05  # s
US = 1.0e-3  # per ns


def run(ticks: int = TICKS) -> dict[str, float]:
    """Returns the median CPU time in us per vehicle and tick, by number of vehicles, kernels warm."""
    return {f"fleet of {n}": _cost(n, ticks) for n in FLEETS}


def _cost(n: int, ticks: int) -> float:
    """Returns the median processor time in us of one step of one of n vehicles."""
    kinds = traffic_types()
    fleet = Fleet(tuple(vehicle_type(kinds[i % len(kinds)]) for i in range(n)), DT)
    for i in range(n):
        fleet.place(i, Pose(0.0, 8.0 * i), SPEED)
    commands = np.tile([0.4, 0.0, 0.02, 0.0, 0.0], (n, 1))
    mu, level, active = np.full((n, 4), MU), np.zeros(n), np.ones(n, dtype=np.bool_)
    times = []
    for k in range(-2, ticks):
        begin = process_time_ns()
        fleet.step(commands, mu, level, level, active)
        if k >= 0:
            times.append(process_time_ns() - begin)
    return median(times) * US / n
