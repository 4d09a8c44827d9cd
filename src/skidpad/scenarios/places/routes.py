"""Routes: waypoints turned into the roads to take, and places along them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

from skidpad.roads.queries import LanePoint
from skidpad.roads.routing import LaneRoute, shortest_route
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.measures import between
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.places.positions import Fixed, Orientation, Position, orientation, position
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.scene import Scene

ROADS_MAX = 200  # of a way that nobody has planned


@dataclass(frozen=True, slots=True)
class ScenarioRoute:
    """A way over the map: where it begins, and the roads in their order."""

    name: str
    start: LanePoint
    roads: tuple[int, ...]

    def at(self, network: Network, s: float) -> LanePoint:
        """Returns the place `s` m along the reference lines of its roads, at most its end."""
        return network.ahead_on_roads(self.start, s, self.roads)


def compile_route(node: Node, ctx: Context) -> ScenarioRoute:
    """Compiles a <Route> or a reference to one; waypoints must not depend on what moves."""
    node = ctx.catalogs.resolve(node, "Route")
    points = []
    for waypoint in node.children("Waypoint"):
        at = position(waypoint.child("Position"), ctx)
        if not isinstance(at, Fixed):
            raise waypoint.unsupported_fault("waypoints that depend on entities are not supported")
        if at.fixed.lane is None:
            raise waypoint.error("is on no road")
        points.append(at.fixed.lane)
    if len(points) < 2:
        raise node.error("needs at least two <Waypoint>s")
    return ScenarioRoute(node.label(), points[0], roads_through(ctx.network, points))


def roads_through(network: Network, points: Sequence[LanePoint]) -> tuple[int, ...]:
    """Returns the roads from point to point; where there is no way, their own roads.

    The way is the shortest one, without changes of lanes where one leads to the point's road, as an
    entity does not change lanes for its route.
    """
    roads: list[int] = []
    for a, b in pairwise(points):
        route = shortest_route(network.map, a, b)
        if route is not None and _changes_lanes(network, route):
            route = _without_changes(network, a, b) or route
        found = [a.road, b.road] if route is None else [
            int(network.map.lanes.road[i]) for i in route.lanes
        ]  # fmt: skip
        for road in found:
            if not roads or roads[-1] != road:
                roads.append(road)
    return tuple(roads)


def _changes_lanes(network: Network, route: LaneRoute) -> bool:
    """Returns whether a way has a change of lanes."""
    return any(b not in network.map.successors(a) for a, b in pairwise(route.lanes))


def _without_changes(network: Network, start: LanePoint, goal: LanePoint) -> LaneRoute | None:
    """Returns the shortest way without changes of lanes to any lane of the goal's road, at the goal."""
    lanes = network.map.lanes
    abreast = (lanes.road == goal.road) & (lanes.section == lanes.section[goal.lane])
    goals = [network.beside(goal, int(i)) for i in lanes.lane_id[abreast]]
    ways = [shortest_route(network.map, start, g, change_cost=inf) for g in goals if g is not None]
    return min((w for w in ways if w is not None), key=lambda w: w.length, default=None)


def random_roads(
    network: Network, start: LanePoint, forward: bool, choose: Callable[[Sequence[int]], int]
) -> tuple[int, ...]:
    """Returns roads from lane to lane as `choose` has it, each once; ROADS_MAX at most.

    forward: in the sense of the traffic, else against it.
    """
    lanes, lane = network.map.lanes, start.lane
    roads = [start.road]
    while len(roads) < ROADS_MAX:
        step = network.map.successors if forward else network.map.predecessors
        further = [i for i in map(int, step(lane)) if int(lanes.road[i]) not in roads[:-1]]
        if not further:
            break
        lane = choose(sorted(further))
        if int(lanes.road[lane]) != roads[-1]:
            roads.append(int(lanes.road[lane]))
    return tuple(roads)


@dataclass(frozen=True, slots=True)
class OnRoute:
    """So far along a route, on a lane with an offset, or without one at t of the road."""

    route: ScenarioRoute
    s: float
    lane_id: int | None
    offset: float
    facing: Orientation

    def place(self, scene: Scene) -> Place:
        """Returns the place by the lanes of the route."""
        point = self.route.at(scene.network, self.s)
        network = scene.network
        if self.lane_id is None:
            there = network.on_road(point.road, network.map.s_road(point), self.offset).pose
            _, left = between(point.pose, there.x, there.y)
            there = replace(there, yaw=self.facing.to_world_heading(point.heading))
            return Place(there, replace(point, offset=left / network.lean(point)))
        point = network.beside(point, self.lane_id) or point
        left = self.offset if network.forward(point) else -self.offset
        pose = network.aside(point, left)
        pose = replace(pose, yaw=self.facing.to_world_heading(pose.yaw))
        return Place(pose, replace(point, offset=left))


@dataclass(frozen=True, slots=True)
class OfEntity:
    """Where an entity is on its own route."""

    other: str

    def place(self, scene: Scene) -> Place:
        """Returns where the entity is now."""
        return scene.actors[self.other].place(scene.network)


def route_position(node: Node, ctx: Context) -> Position:
    """Compiles a <RoutePosition>: that of an entity, or road or lane coordinates on a route."""
    inside = node.child("InRoutePosition").only()
    if inside.tag == "FromCurrentEntity":
        return OfEntity(ctx.entity(inside))
    route = compile_route(node.child("RouteRef").only(), ctx)
    if inside.tag == "FromRoadCoordinates":
        return OnRoute(route, inside.number("pathS"), None, inside.number("t"), orientation(node))
    if inside.tag == "FromLaneCoordinates":
        offset = inside.number("laneOffset", 0.0)
        return OnRoute(
            route, inside.number("pathS"), inside.whole("laneId"), offset, orientation(node)
        )
    raise inside.unsupported_fault()
