"""Who takes part in a run, in the order of entering."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs

from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.geometry import Pose
from skidpad.core.setup import (
    RESERVE_NAME,
    VEHICLES_MAX,
    ActorSetup,
    LanePosition,
    Setup,
    TrafficSetup,
)
from skidpad.core.traffic.paints import PALETTE, draw_paint
from skidpad.core.vocabulary import ActorKind, TrafficStart
from skidpad.physics.types import VehicleType, traffic_types, vehicle_type, vehicle_types
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.simulation.world.rows import Newcomer, Shape
from skidpad.simulation.world.traffic.placement import (
    PACK_FACTOR,
    Spawn,
    fixed_spawns,
    pack_spawns,
    random_factors,
    type_of,
)

# Adult 95th-percentile stance and mass; city bicycle with rider; usual construction-site sizes.
SHAPES = {
    "pedestrian": Shape(ActorKind.PEDESTRIAN, 0.4, 0.6, 1.75, 78.0),
    "bicycle": Shape(ActorKind.BICYCLE, 1.8, 0.6, 1.75, 95.0),
    "box": Shape(ActorKind.PROP, 1.0, 1.0, 1.0, 50.0),
    "cone": Shape(ActorKind.PROP, 0.4, 0.4, 0.75, 4.0),
    "barrier": Shape(ActorKind.PROP, 0.5, 2.0, 1.0, float("inf")),
}


@dataclass(frozen=True, slots=True)
class Role:
    """An actor of a run before it enters."""

    actor: ActorSetup
    factor: float = 1.0  # desired speed over the limit, for drivers
    late: bool = False  # enters when there is room
    reserve: bool = False  # and not before it is called

    def newcomer(self, i: int, paint_seed: int | None = None) -> Newcomer:
        """Returns the actor as it enters as the i-th.

        paint_seed: its paint is drawn, else it is that of its place; its own colour comes before both.
        """
        a = self.actor
        body = SHAPES[a.type] if a.type in SHAPES else vehicle_type(a.type)
        if a.tyres and isinstance(body, VehicleType):
            body = structs.replace(body, tyres=a.tyres)
        paint = PALETTE[i % len(PALETTE)] if paint_seed is None else draw_paint(paint_seed, a.name)
        return Newcomer(body, a.name, a.type, a.rgb or paint)


def place_of(map: RoadMap, place: Pose | LanePosition) -> Pose:
    """Returns a pose on the map; a lane position becomes one along its lane, at its lateral offset.

    ConfigError for a lane position that the map has not.
    """
    if isinstance(place, Pose):
        return place
    point = map.place(place)
    return point.pose.moved(left=point.offset)


def cast_of(map: RoadMap, setup: Setup, seed: int) -> list[Role]:
    """Returns ego, scripted and background actors, checked: vehicles first, the ego before all.

    ConfigError for unknown types, equal names, an ego that is no vehicle, or traffic without room.
    """
    roles = [Role(setup.ego), *(Role(actor) for actor in setup.actors)]
    roles += _traffic(map, setup, seed)
    known = vehicle_types()
    for role in roles:
        require_choice("actor type", role.actor.type, [*known, *SHAPES])
    names = [role.actor.name for role in roles]
    if len(set(names)) != len(names):
        raise ConfigError(f"actors need different names, got {', '.join(sorted(names))}")
    if setup.ego.type not in known:
        raise ConfigError(f"the ego must be a vehicle, got type {setup.ego.type!r}")
    return sorted(roles, key=lambda role: role.actor.type in SHAPES)


def _traffic(map: RoadMap, setup: Setup, seed: int) -> list[Role]:
    """Returns the roles of the traffic's vehicles and of its reserve; empty where there is none."""
    traffic = setup.traffic
    if traffic is None or traffic.vehicles + traffic.reserve == 0:
        return []
    if traffic.vehicles <= VEHICLES_MAX < traffic.vehicles + traffic.reserve:
        raise ConfigError(
            f"traffic.reserve must be at most {VEHICLES_MAX - traffic.vehicles} beside "
            f"{traffic.vehicles} vehicles, got {traffic.reserve}"
        )
    if traffic.mode is TrafficStart.RANDOM:
        factors = random_factors(traffic.vehicles, seed)
        if traffic.variety:  # their characters bring the spread
            factors[:] = 1.0
        spawns = [Spawn(None, float(f)) for f in factors]
    else:
        around = pack_spawns if traffic.mode is TrafficStart.PACK else fixed_spawns
        spawns = around(map, _ego_point(map, setup), traffic, seed)
    assert len(spawns) <= VEHICLES_MAX
    types = traffic_types()
    roles = []
    for i, spawn in enumerate(spawns):
        pose = Pose(0.0, 0.0) if spawn.place is None else spawn.place.pose
        actor = ActorSetup(name=f"traffic_{i + 1:02d}", type=type_of(i, types), place=pose)
        roles.append(Role(actor, spawn.factor, spawn.place is None))
    return roles + _reserve(traffic, types, len(roles), seed)


def _reserve(traffic: TrafficSetup, types: Sequence[str], first: int, seed: int) -> list[Role]:
    """Returns the roles of vehicles that wait to be called; they go as fast as the traffic does.

    first: number of vehicles that are there before them.
    """
    total = traffic.vehicles + traffic.reserve
    factors = np.ones(total) if traffic.variety else random_factors(total, seed)
    pack = traffic.mode is TrafficStart.PACK
    roles = []
    for i in range(traffic.reserve):
        name, type = f"{RESERVE_NAME}{i + 1:02d}", type_of(first + i, types)
        actor = ActorSetup(name=name, type=type, place=Pose(0.0, 0.0))
        factor = PACK_FACTOR if pack else float(factors[traffic.vehicles + i])
        roles.append(Role(actor, factor, reserve=True))
    return roles


def _ego_point(map: RoadMap, setup: Setup) -> LanePoint:
    """Returns the centreline point of the ego's lane; raises ConfigError off the driving lanes."""
    pose = place_of(map, setup.ego.place)
    point = map.project(pose.x, pose.y, pose.z)
    if point is None:
        raise ConfigError(f"the ego at ({pose.x:g}, {pose.y:g}) stands on no driving lane")
    return replace(point, offset=0.0)
