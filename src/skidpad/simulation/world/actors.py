"""Who takes part in a run: the table of actors, in the order of their rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorSetup, LanePosition, Setup
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.types import VehicleType, traffic_types, vehicle_type, vehicle_types
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.world.traffic.placement import (
    RANDOM_MAX,
    Spawn,
    fixed_spawns,
    random_factors,
    type_of,
)

TRAFFIC_MODES = ("fixed", "random")
DRIVERS = ("autopilot", "scripted")
# Paint of cars by registrations: white, black, grey, silver, blue, red, green, yellow
# (shares in the Axalta Global Automotive Color Popularity Report 2022).
PALETTE = (
    (225, 225, 225),
    (25, 25, 28),
    (95, 98, 102),
    (170, 173, 177),
    (30, 60, 130),
    (150, 25, 30),
    (35, 80, 50),
    (215, 180, 45),
)


@dataclass(frozen=True, slots=True)
class Shape:
    """A body without wheels: size in m and mass in kg; inf cannot be moved."""

    kind: ActorKind
    length: float
    width: float
    height: float
    mass: float


# Adult 95th-percentile stance and mass; city bicycle with rider; usual construction-site sizes.
SHAPES = {
    "pedestrian": Shape(ActorKind.PEDESTRIAN, 0.4, 0.6, 1.75, 78.0),
    "bicycle": Shape(ActorKind.BICYCLE, 1.8, 0.6, 1.75, 95.0),
    "box": Shape(ActorKind.PROP, 1.0, 1.0, 1.0, 50.0),
    "cone": Shape(ActorKind.PROP, 0.4, 0.4, 0.75, 4.0),
    "barrier": Shape(ActorKind.PROP, 0.5, 2.0, 1.0, float("inf")),
}


@dataclass(frozen=True, slots=True)
class Cast:
    """All actors of a run: vehicles first, the ego before all; then bodies without wheels."""

    actors: tuple[ActorSetup, ...]
    factors: tuple[float, ...]  # desired speed over the limit, for drivers
    late: tuple[bool, ...]  # enters when there is room
    vehicles: tuple[VehicleType, ...]
    shapes: tuple[Shape, ...]
    table: ActorTable


def place_of(map: RoadMap, place: Pose | LanePosition) -> Pose:
    """A pose on the map; lane positions look along the lane."""
    if isinstance(place, Pose):
        return place
    point = map.place(place)
    return point.pose.moved(left=point.offset)


def cast_of(map: RoadMap, setup: Setup, seed: int) -> Cast:
    """Ego, scripted and background actors, checked."""
    rows = [(setup.ego, 1.0, False)]
    rows += [(actor, 1.0, False) for actor in setup.actors]
    rows += _traffic(map, setup, seed)
    known = vehicle_types()
    for actor, _, _ in rows:
        require_choice("actor type", actor.type, [*known, *SHAPES])
        require_choice(f"driver of {actor.name}", actor.driver, DRIVERS)
    names = [actor.name for actor, _, _ in rows]
    if len(set(names)) != len(names):
        raise ConfigError(f"actors need different names, got {', '.join(sorted(names))}")
    if setup.ego.type not in known:
        raise ConfigError(f"the ego must be a vehicle, got type {setup.ego.type!r}")
    wheeled = [row for row in rows if row[0].type in known]
    others = [row for row in rows if row[0].type not in known]
    rows = wheeled + others
    vehicles = tuple(vehicle_type(actor.type) for actor, _, _ in wheeled)
    shapes = tuple(SHAPES[actor.type] for actor, _, _ in others)
    actors = tuple(actor for actor, _, _ in rows)
    return Cast(
        actors=actors,
        factors=tuple(factor for _, factor, _ in rows),
        late=tuple(late for _, _, late in rows),
        vehicles=vehicles,
        shapes=shapes,
        table=_table(actors, vehicles, shapes),
    )


def _table(
    actors: Sequence[ActorSetup], vehicles: Sequence[VehicleType], shapes: Sequence[Shape]
) -> ActorTable:
    kinds = [t.actor_kind for t in vehicles] + [s.kind for s in shapes]
    bodies: list[VehicleType | Shape] = [*vehicles, *shapes]
    paint = [a.rgb or PALETTE[i % len(PALETTE)] for i, a in enumerate(actors)]
    return ActorTable(
        names=tuple(a.name for a in actors),
        types=tuple(a.type for a in actors),
        kind=np.array(kinds, dtype=np.uint8),
        length=np.array([b.length for b in bodies]),
        width=np.array([b.width for b in bodies]),
        height=np.array([b.height for b in bodies]),
        rgb=np.array(paint, dtype=np.uint8),
    )


def _traffic(map: RoadMap, setup: Setup, seed: int) -> list[tuple[ActorSetup, float, bool]]:
    traffic = setup.traffic
    if traffic is None or traffic.vehicles == 0:
        return []
    require_choice("traffic mode", traffic.mode, TRAFFIC_MODES)
    if traffic.mode == "random":
        factors = random_factors(traffic.vehicles, seed)
        spawns = [Spawn(None, float(f)) for f in factors]
    else:
        spawns = fixed_spawns(map, _ego_point(map, setup), traffic, seed)
    assert len(spawns) <= RANDOM_MAX
    types = traffic_types()
    rows = []
    for i, spawn in enumerate(spawns):
        pose = Pose(0.0, 0.0) if spawn.place is None else spawn.place.pose
        actor = ActorSetup(name=f"traffic_{i + 1:02d}", type=type_of(i, types), place=pose)
        rows.append((actor, spawn.factor, spawn.place is None))
    return rows


def _ego_point(map: RoadMap, setup: Setup) -> LanePoint:
    pose = place_of(map, setup.ego.place)
    point = map.project(pose.x, pose.y, pose.z)
    if point is None:
        raise ConfigError(f"the ego at ({pose.x:g}, {pose.y:g}) stands on no driving lane")
    return replace(point, offset=0.0)
