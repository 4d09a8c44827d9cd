"""The shortest way from one place to another over lanes, lane changes included."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise

from skidpad.roads.queries import LanePoint, RoadMap

CHANGE_COST = 20.0  # m of detour that a lane change is worth


@dataclass(frozen=True, slots=True)
class LaneRoute:
    """A way over the map."""

    lanes: tuple[int, ...]  # indices; each follows or lies beside the one before
    length: float  # m along the lanes, changes not counted


@dataclass(frozen=True, slots=True, order=True)
class _Node:
    """A lane, entered at its beginning, or still abreast of the start (`first`)."""

    lane: int
    first: bool


def shortest_route(
    map: RoadMap, start: LanePoint, goal: LanePoint, *, change_cost: float = CHANGE_COST
) -> LaneRoute | None:
    """Returns the cheapest route by Dijkstra's algorithm; None when the goal cannot be reached.

    Lane changes go to neighbours of the same direction and cost as much as change_cost metres. A goal
    behind the start on the same lane is reached around, if at all.
    """
    origin = _Node(start.lane, True)
    costs, parents = {origin: 0.0}, {origin: origin}
    queue = [(0.0, origin)]
    best: tuple[float, _Node] | None = None
    while queue:
        cost, node = heappop(queue)
        if best is not None and cost >= best[0]:
            break
        if cost > costs[node]:
            continue
        done = _entered_at(map, start, node)
        if node.lane == goal.lane and goal.s >= done - 1e-6:
            total = cost + goal.s - done
            if best is None or total < best[0]:
                best = total, node
        for following, extra in _steps(map, node, done, change_cost):
            if cost + extra < costs.get(following, float("inf")):
                costs[following] = cost + extra
                parents[following] = node
                heappush(queue, (cost + extra, following))
    return None if best is None else _route(map, start, goal, best[1], parents)


def _entered_at(map: RoadMap, start: LanePoint, node: _Node) -> float:
    """Returns the m along the lane of a node at which the route comes onto it.

    On lanes beside the start's the same share of the lane as there, else 0.
    """
    if not node.first:
        return 0.0
    return start.s / float(map.lanes.length[start.lane]) * float(map.lanes.length[node.lane])


def _steps(
    map: RoadMap, node: _Node, done: float, change_cost: float
) -> Iterator[tuple[_Node, float]]:
    """Yields (next node, cost in m) for each drivable successor and each lane change from a node.

    done: m along the node's lane where the route came onto it.
    """
    rest = float(map.lanes.length[node.lane]) - done
    for lane in map.successors(node.lane):
        if map.arrays.drivable[lane]:
            yield _Node(lane, False), rest
    for lane in (int(map.lanes.left[node.lane]), int(map.lanes.right[node.lane])):
        if lane >= 0:
            yield _Node(lane, node.first), change_cost


def _route(
    map: RoadMap, start: LanePoint, goal: LanePoint, last: _Node, parents: dict[_Node, _Node]
) -> LaneRoute:
    """Returns the route that the search tree holds from start to goal, with its length in m."""
    nodes = [last]
    while parents[nodes[-1]] != nodes[-1]:
        nodes.append(parents[nodes[-1]])
    nodes.reverse()
    length = goal.s - _entered_at(map, start, last)
    for node, following in pairwise(nodes):
        if following.lane in map.successors(node.lane) and not following.first:
            length += float(map.lanes.length[node.lane]) - _entered_at(map, start, node)
    return LaneRoute(tuple(node.lane for node in nodes), length)
