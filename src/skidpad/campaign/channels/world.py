"""The world of one segment of a route: ego, traffic, parked cars, people; all from the seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from skidpad.campaign.driving.run_setup import setup_of
from skidpad.campaign.driving.stack_at_wheel import ego_model
from skidpad.core.courses import Route
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.maths.randomness import stream
from skidpad.core.run import ChannelCrew, RunSpec
from skidpad.core.setup import ActorSetup, Setup, TrafficSetup
from skidpad.core.vocabulary import Control, Stratum, TrafficStart
from skidpad.physics.types import EGO_TYPE, traffic_types, vehicle_type
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.crowd import Crowd
from skidpad.stack.channels.route import RoutePath, draw_route, route_path
from skidpad.stack.channels.settings import CarModel

TRAFFIC = "traffic_"  # names of background vehicles begin with this
CLEARANCE = 25.0  # m between vehicles at the start
FIRST_S = 25.0  # m from the beginning of its lane where the ego starts
PARKED_WIDTH = 1.95  # m, wider vehicles would stand on the lane
DEAD_END_LENGTH = 300.0  # m that a road without an end's successor must offer
ROUTE_SPARE = 250.0  # m for the start's offset, the warm-up and the view ahead at the end
V_STREET = 14.0  # m/s, limit of town streets
V_MEAN_MAX = 25.0  # m/s, so that no route ends before its segment


@dataclass(frozen=True, slots=True)
class Segment:
    """Everything that a segment begins with."""

    map: RoadMap
    setup: Setup
    crowd: Crowd
    route: RoutePath
    car: CarModel


def route_of(spec: RunSpec) -> Route:
    """Returns the route of a segment; ConfigError when it drives none."""
    if not isinstance(spec.course, Route):
        raise ConfigError(f"{spec.name} drives no route")
    return spec.course


def crew_of(spec: RunSpec) -> ChannelCrew:
    """Returns the channels that drive a segment; ConfigError when none do."""
    if not isinstance(spec.driver, ChannelCrew):
        raise ConfigError(f"{spec.name} is driven by no channels")
    return spec.driver


def segment_of(spec: RunSpec) -> Segment:
    """Returns the world of a route, drawn by the run's seed; the duration decides how long the way is."""
    route, seed = route_of(spec), spec.seed
    map = load_map(route.map)
    rng = stream(seed, "channels", "route")
    lane = _first_lane(map, rng)
    lanes = draw_route(map, lane, spec.duration * V_MEAN_MAX + ROUTE_SPARE, rng)
    path = route_path(map, lanes, FIRST_S)
    start = map.at(lane, FIRST_S)
    crowd = Crowd(map, route.pedestrians, route.cyclists, seed)
    places = _places(map, route.vehicles, start.pose, stream(seed, "channels", "places"))
    types = traffic_types()
    traffic = [
        ActorSetup(name=f"{TRAFFIC}{i + 1:02d}", type=types[i % len(types)], place=p)
        for i, p in enumerate(places)
    ]
    spaces = map.roadside.parking[: route.parked]
    cars = [t for t in types if vehicle_type(t).width < PARKED_WIDTH]
    parked = [
        ActorSetup(
            name=f"parked_{i + 1:02d}",
            type=cars[i % len(cars)],
            place=Pose(p.x, p.y, p.z, yaw=p.yaw),
            driver=Control.SCRIPTED,
        )
        for i, p in enumerate(spaces)
    ]
    ego = ActorSetup(name="ego", type=EGO_TYPE, place=start.pose, driver=Control.SCRIPTED)
    setup = replace(
        setup_of(spec, route.map, ego),
        specs=(),  # channels bring their own
        actors=(*traffic, *parked, *crowd.actors()),
        traffic=TrafficSetup(
            mode=TrafficStart.PACK if route.stratum is Stratum.RISKY else TrafficStart.RANDOM,
            vehicles=0,
            variety=True,
            slow_in_weather=route.drivers_mind_weather,
            stratum=route.stratum,
        ),
    )
    return Segment(map, setup, crowd, path, ego_model())


def _first_lane(map: RoadMap, rng: np.random.Generator) -> int:
    """Returns a drawn lane to start on: a long one outside junctions, of town streets if there are any.

    Raises ConfigError when the map has none.
    """
    fits = np.flatnonzero(
        (map.lanes.kind == LaneKind.DRIVING)
        & (map.lanes.junction < 0)
        & (map.lanes.length > 2.0 * FIRST_S)
        & ((np.diff(map.lanes.next_start) > 0) | (map.lanes.length > DEAD_END_LENGTH))
    )
    limit = map.samples.limit[map.lanes.first[fits]]
    streets = fits[limit < V_STREET]
    fits = streets if len(streets) else fits
    if not len(fits):
        raise ConfigError(f"map {map.name} has no driving lane of {2.0 * FIRST_S:g} m that goes on")
    return int(fits[int(rng.integers(len(fits)))])


def _places(map: RoadMap, count: int, ego: Pose, rng: np.random.Generator) -> list[Pose]:
    """Returns drawn places, CLEARANCE m from the ego and each other; fewer if the map is full."""
    first, size = map.lanes.first[map.samples.lane], map.lanes.size[map.samples.lane]
    at = np.arange(len(map.samples.x))
    fits = np.flatnonzero(
        (map.lanes.kind[map.samples.lane] == LaneKind.DRIVING)
        & (map.lanes.junction[map.samples.lane] < 0)
        & (at - first > 15)
        & (first + size - at > 15)
    )
    found: list[Pose] = []
    for sample in rng.choice(fits, size=min(40 * count, len(fits)), replace=False).tolist():
        x, y = float(map.samples.x[sample]), float(map.samples.y[sample])
        if any(hypot(p.x - x, p.y - y) < CLEARANCE for p in (ego, *found)):
            continue
        z, yaw = float(map.samples.z[sample]), float(map.samples.heading[sample])
        found.append(Pose(x, y, z, yaw=yaw))
        if len(found) == count:
            break
    return found
