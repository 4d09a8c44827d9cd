"""Lengths of the ways that entities take: along a trajectory, along lanes, else straight."""

from __future__ import annotations

from math import hypot

from skidpad.roads.queries import LanePoint
from skidpad.scenarios.movement.network import Network, Place
from skidpad.scenarios.scene import Actor, Scene


def way_to(scene: Scene, actor: Actor, goal: Place) -> float:
    """Returns how far an entity has to go to a place on the way that it takes, m.

    A trajectory that leads it comes first, then its lane and those that follow. Where neither
    leads to the place the distance is straight. As in esmini, what is led along a trajectory has made
    this step already when its other actions have their turn.
    """
    if actor.track is not None:
        return abs(actor.track.way_to(goal.pose, scene.t + scene.dt))
    here = actor.place(scene.network).lane
    if here is not None and goal.lane is not None:
        way = lane_way(scene.network, here, goal.lane)
        if way is not None:
            return abs(way)
    return hypot(goal.pose.x - actor.pose.x, goal.pose.y - actor.pose.y)


def lane_way(network: Network, here: LanePoint, there: LanePoint) -> float | None:
    """Returns the length along lanes from one place to another, m, negative against the traffic.

    Lane changes count nothing. Between lanes of opposite traffic on one road it is the difference
    of the road's s. None where no way leads from either place to the other.
    """
    lengths, sections = network.map.lanes.length, network.map.lanes.section
    abreast = here.road == there.road and sections[here.lane] == sections[there.lane]
    same = network.forward(here) == network.forward(there)
    if abreast and same:
        return there.s - here.s * float(lengths[there.lane]) / float(lengths[here.lane])
    if here.road == there.road and not same:
        way = network.map.s_road(there) - network.map.s_road(here)
        return way if network.forward(here) else -way
    ahead = network.route_length(here.lane, there.lane)
    behind = network.route_length(there.lane, here.lane)
    ways = [] if ahead is None else [ahead - here.s + there.s]
    if behind is not None:
        ways.append(-(behind - there.s + here.s))
    return min(ways, key=abs, default=None)
