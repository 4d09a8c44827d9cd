"""Where background vehicles begin: the published positions, or drawn around the ego."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.maths.lefthanded import lanes_left_from_carla
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import VEHICLES_MAX, TrafficSetup
from skidpad.roads.queries import LanePoint, RoadMap

VARIANTS = ("listing", "table")
MAX_AHEAD, MAX_BEHIND = 15, 5
SHARE_AHEAD = 0.75
FACTOR_AHEAD, FACTOR_BEHIND = 0.90, 1.05  # of the limit: Traffic Manager's +10 % and -5 % (A-207)
GAP_SPREAD = 3.0  # m, uniform (decision M-2)
SPEED_SPREAD = 0.03  # standard deviation of desired speeds (decision M-2)
PACK_AHEAD, PACK_BEHIND = 240.0 / 900.0, 240.0 / 400.0  # of the published distances: within 250 m
PACK_FACTOR = 0.75  # of the limit: chosen by speed and by ticks with a target (docs/traffic.md)
RANDOM_SPEED_SPREAD = 0.10  # random mode; the size is not published


@dataclass(frozen=True, slots=True)
class Spawn:
    """One background vehicle at the start; place None: it enters later."""

    place: LanePoint | None
    factor: float  # desired speed over the limit


@dataclass(frozen=True, slots=True)
class Position:
    """A row of the published table: metres ahead of the ego, and lanes to its left."""

    group: str
    index: int
    distance: float
    lanes_left: int


def published_positions(variant: str) -> tuple[Position, ...]:
    """Returns the twenty positions as in the "listing" or in the "table"s (D-085, D-086).

    ConfigError for another variant.
    """
    require_choice("traffic variant", variant, VARIANTS)
    text = resources.files(__package__).joinpath("positions.csv").read_text()
    return tuple(
        Position(
            row["group"],
            int(row["index"]),
            float(row[f"{variant}_distance_m"]),
            lanes_left_from_carla(int(row[f"{variant}_lane_offset"])),
        )
        for row in csv.DictReader(text.splitlines())
    )


def chosen_positions(vehicles: int, variant: str) -> list[Position]:
    """Returns the first of each group: floor(0.75 n) ahead up to 15, the rest behind up to 5 (A-203)."""
    rows = published_positions(variant)
    ahead = min(int(SHARE_AHEAD * vehicles), MAX_AHEAD)
    behind = min(vehicles - ahead, MAX_BEHIND)
    return [r for r in rows if r.group == "ahead"][:ahead] + [
        r for r in rows if r.group == "behind"
    ][:behind]


def fixed_spawns(map: RoadMap, ego: LanePoint, setup: TrafficSetup, seed: int) -> list[Spawn]:
    """Returns vehicles at the published distances from the ego, gaps and speeds varied (A-202 to A-205).

    ConfigError where a place has no lane and fewer are not allowed.
    """
    spawns, missing = [], []
    for position in chosen_positions(setup.vehicles, setup.variant):
        mean = FACTOR_AHEAD if position.group == "ahead" else FACTOR_BEHIND
        spawn = _spawn(map, ego, position, mean, seed)
        if spawn is None:
            missing.append(f"{position.group} {position.index} ({position.distance:g} m)")
        else:
            spawns.append(spawn)
    if len(spawns) < setup.vehicles and not setup.allow_fewer:
        raise ConfigError(
            f"traffic: map {map.name} holds {len(spawns)} of {setup.vehicles} vehicles around the "
            f"ego (no lane for: {', '.join(missing) or 'more than twenty'}); "
            "choose fewer vehicles or allow fewer"
        )
    return spawns


def pack_spawns(map: RoadMap, ego: LanePoint, setup: TrafficSetup, seed: int) -> list[Spawn]:
    """Returns vehicles at the published places drawn together around the ego.

    Those that find no lane there enter later: their place is None.
    """
    spawns = []
    for position in chosen_positions(setup.vehicles, setup.variant):
        share = PACK_AHEAD if position.group == "ahead" else PACK_BEHIND
        near = replace(position, distance=share * position.distance)
        spawn = _spawn(map, ego, near, PACK_FACTOR, seed)
        spawns.append(Spawn(None, PACK_FACTOR) if spawn is None else spawn)
    return spawns + [Spawn(None, PACK_FACTOR)] * (setup.vehicles - len(spawns))


def _spawn(
    map: RoadMap, ego: LanePoint, position: Position, mean: float, seed: int
) -> Spawn | None:
    """Returns a vehicle at a position, its gap and its speed varied by the seed; None: no lane is there.

    mean: of its desired speed over the limit.
    """
    name = f"{position.group} {position.index}"
    gap = stream(seed, "traffic", "gap", name).uniform(-GAP_SPREAD, GAP_SPREAD)
    place = _place(map, ego, position.distance + gap, position.lanes_left)
    if place is None:
        return None
    spread = stream(seed, "traffic", "speed", name).normal(0.0, SPEED_SPREAD)
    return Spawn(place, mean * (1.0 + spread))


def _place(map: RoadMap, ego: LanePoint, distance: float, lanes_left: int) -> LanePoint | None:
    """Returns the place `distance` m along the road from the ego, then so many lanes left; None: no lane."""
    place = map.ahead(ego, distance) if distance >= 0.0 else map.behind(ego, -distance)
    step = map.left if lanes_left > 0 else map.right
    for _ in range(abs(lanes_left)):
        place = None if place is None else step(place)
    return place


def random_factors(vehicles: int, seed: int) -> NDArray[np.float64]:
    """Returns (vehicles,) desired speeds over the limit, Gaussian, one stream per vehicle (A-209).

    ConfigError beyond VEHICLES_MAX.
    """
    if not 0 <= vehicles <= VEHICLES_MAX:
        raise ConfigError(f"traffic.vehicles must be between 0 and {VEHICLES_MAX}, got {vehicles}")
    draws = [stream(seed, "traffic", "speed", i).normal(0.0, 1.0) for i in range(vehicles)]
    return np.clip(1.0 + RANDOM_SPEED_SPREAD * np.array(draws), 0.6, 1.3)


def type_of(index: int, types: Sequence[str]) -> str:
    """Returns the type of the vehicle of this index: types take turns (A-205)."""
    return types[index % len(types)]
