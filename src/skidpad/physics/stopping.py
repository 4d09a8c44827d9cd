"""Full stops through the whole vehicle model: distances, mean decelerations, and the friction they mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from skidpad.core.environment.tyres import REFERENCE, find_tyres
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, mps_from_kmh
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import MU_REF, GripParams, Road, dry_friction, mu_at
from skidpad.physics.types import EGO_TYPE, VehicleType, vehicle_type

SPEEDS_KMH = (50.0, 80.0, 100.0)
TICK = 0.01  # s
STOP_TIME_MAX = 300.0  # s


@dataclass(frozen=True, slots=True)
class Stop:
    """One full braking from v0 to rest with the pedal to the floor at once."""

    v0: float  # m/s
    distance: float  # m
    mfdd: float  # m/s^2, mean fully developed deceleration


def mean_deceleration(v: NDArray[np.float64], s: NDArray[np.float64]) -> float:
    """Returns the mean fully developed deceleration in m/s^2 between 0.8 and 0.1 of the first speed.

    v, s (k,): falling speed in m/s and distance in m. (v_b^2 - v_e^2) / (2 (s_e - s_b)), which is
    UN R13-H annex 3's (v_b^2 - v_e^2) / (25.92 (s_e - s_b)) with speeds in km/h. 0 from standstill.
    """
    if v[0] == 0.0:
        return 0.0
    v_b, v_e = 0.8 * v[0], 0.1 * v[0]
    s_b, s_e = np.interp([-v_b, -v_e], -v, s)
    return float((v_b**2 - v_e**2) / (2.0 * (s_e - s_b)))


def stops(
    params: Sequence[GripParams],
    v0: Sequence[float],
    vehicle: VehicleType | None = None,
    *,
    anti_lock: bool = True,
) -> list[Stop]:
    """Returns stops of one vehicle type (the ego's by default), each on its own surface from its own speed.

    params, v0: as many, v0 >= 0 in m/s. ConfigError where one takes longer than STOP_TIME_MAX.
    """
    n = len(params)
    fleet = Fleet([vehicle or vehicle_type(EGO_TYPE)] * n, TICK, anti_lock=anti_lock)
    for i in range(n):
        fleet.place(i, Pose(0.0, 0.0), v0[i])
    commands = np.zeros((n, 5))
    commands[:, 1] = 1.0
    mu = np.empty((n, 4))
    speeds, places = [fleet.states.vx.copy()], [np.zeros(n)]
    while fleet.states.vx.any():
        if len(speeds) * TICK > STOP_TIME_MAX:
            raise ConfigError(f"a vehicle did not stop within {STOP_TIME_MAX:g} s: too little grip")
        for i in range(n):
            mu[i] = mu_at(params[i], abs(fleet.states.vx[i]))
        fleet.step(commands, mu)
        speeds.append(fleet.states.vx.copy())
        places.append(fleet.states.x.copy())
    v, s = np.array(speeds), np.array(places)
    return [Stop(v0[i], float(s[-1, i]), mean_deceleration(v[:, i], s[:, i])) for i in range(n)]


@dataclass(frozen=True, slots=True)
class GripRow:
    """What one model makes of one weather."""

    weather: str
    model: GripModel
    ratio: float  # at standstill, over the dry friction of the same tyres
    mu: float  # at standstill
    mu_80: float  # at 80 km/h
    stops: tuple[Stop, ...]  # from SPEEDS_KMH


def grip_rows(
    weathers: Sequence[Weather],
    models: Sequence[GripModel],
    mu_ref: float = MU_REF,
    tyres: str = REFERENCE,
) -> list[GripRow]:
    """Returns rows for all weathers and models, weather by weather, from one batch of stops.

    A model that cannot say (ConfigError) leaves its row out.
    """
    cases: list[tuple[Weather, GripModel, GripParams]] = []
    for weather in weathers:
        for model in models:
            try:
                cases.append((weather, model, Road(weather, model, mu_ref, tyres).params()))
            except ConfigError:
                continue
    v0 = [mps_from_kmh(kmh) for kmh in SPEEDS_KMH]
    each = stops([p for *_, p in cases for _ in v0], v0 * len(cases))
    dry = mu_ref * (dry_friction(find_tyres(tyres)) / MU_REF)
    rows = []
    for k, (weather, model, params) in enumerate(cases):
        mine = tuple(each[k * len(v0) : (k + 1) * len(v0)])
        mu = float(mu_at(params, 0.0))
        mu_80 = float(mu_at(params, mps_from_kmh(80.0)))
        rows.append(GripRow(weather.name, model, mu / dry, mu, mu_80, mine))
    return rows
