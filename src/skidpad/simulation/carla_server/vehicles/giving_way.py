"""Stop and yield signs: a vehicle that waits at one is shown red, without a light, while the way is taken.

CARLA's signs do so (public source: `StopSignComponent`, `YieldSignComponent`), and its Traffic Manager
lets only those take turns at a junction without lights to whom they have shown red.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicles
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.traffic.priority import STOP, YIELD
from skidpad.simulation.world.traffic.streets import priority_of

BOX = 0.9  # of a lane's width: how long the box before the line is
STOPPED = 2.0  # s for which a stop sign shows red in any case
ALONG = 0.5  # cosine of the angle to the lane up to which one drives along it

Span = tuple[float, float]  # m along a lane: a vehicle with a part of its body in it is there


@dataclass(frozen=True, slots=True)
class Line:
    """Where one waits at the end of a lane, and for whom."""

    begins: float  # m along the lane, of the box
    least: float  # s of red for every vehicle that comes
    watched: dict[int, Span]  # by lane

    def is_taken(self, lane: int, rear: float, front: float) -> bool:
        """Returns whether a vehicle with its body from `rear` to `front` m on a lane is to be waited for."""
        begins, ends = self.watched.get(lane, (inf, -inf))
        return front > begins and rear < ends


class GivingWay:
    """Holds the stop and yield lines of a map, and how long which vehicle has waited there."""

    def __init__(self, roads: RoadMap) -> None:
        self._lines = dict(_lines(roads))
        self._signed = np.zeros(len(roads.lanes.first) + 1, dtype=np.bool_)  # the last: on no lane
        self._signed[list(self._lines)] = True
        self._since: dict[int, float] = {}  # s by actor

    def shown_red(self, vehicles: Vehicles, dt: float) -> NDArray[np.bool_]:
        """Returns (n,) whether a sign shows each vehicle red, dt s after the last time.

        Call it once a tick: it counts how long each has been before its sign. A stop sign shows red for
        at least STOPPED s, and both kinds as long as the way is taken.
        """
        n = len(vehicles)
        placed, red = vehicles.moving.placed[:n], np.zeros(n, dtype=np.bool_)
        along = np.cos(placed["yaw"] - placed["heading"]) > ALONG
        before = self._since
        self._since = {}
        if not (candidates := np.flatnonzero(self._signed[placed["lane"]] & along).tolist()):
            return red
        actors = [vehicle.actor for vehicle in vehicles]
        others = _bodies(placed)
        for i in candidates:
            lane, _, front = others[i]
            line = self._lines[lane]
            if front < line.begins:
                continue
            waited = self._since[actors[i]] = before.get(actors[i], 0.0) + dt
            red[i] = waited <= line.least or any(line.is_taken(*other) for other in others)
        return red


def _bodies(placed: Places) -> list[tuple[int, float, float]]:
    """Returns (lane, s of the rear, s of the front) in m of every actor."""
    s, half = placed["s"], placed["half_length"]
    return list(zip(placed["lane"].tolist(), (s - half).tolist(), (s + half).tolist(), strict=True))


def _lines(roads: RoadMap) -> Iterator[tuple[int, Line]]:
    """Yields lines by the lane on which one waits."""
    entry = priority_of(roads)[0]
    for lane in np.flatnonzero(np.isin(entry["control"], (STOP, YIELD))).tolist():
        least = STOPPED if entry["control"][lane] == STOP else 0.0
        begins = float(entry["line"][lane]) - BOX * _width(roads, lane)
        yield lane, Line(begins, least, _watched_lanes(roads, lane))


def _watched_lanes(roads: RoadMap, lane: int) -> dict[int, Span]:
    """Returns the stretches to be watched, by lane, from a stop or yield line at the end of a lane.

    Lanes of the junction that cross or join the ways on from it, the ends of those before and
    the beginnings of those behind; what comes from the same road is not watched.
    """
    entry, conflict, _, _ = priority_of(roads)
    lanes = roads.lanes
    crossing: set[int] = set()
    for way in roads.successors(lane):
        first = int(entry["first"][way])
        crossing |= set(conflict["other"][first : first + int(entry["size"][way])].tolist())
    watched: dict[int, Span] = {}
    inside = {
        c for c in crossing if lanes.road[lane] not in lanes.road[list(_before(roads, c))].tolist()
    }
    for other in inside:
        for p in _before(roads, other):
            length = float(lanes.length[p])
            watched[p] = (length - BOX * _width(roads, p), inf)
        for q in roads.successors(other):
            watched[int(q)] = (-inf, 0.0)
    return watched | dict.fromkeys(inside, (-inf, inf))


def _before(roads: RoadMap, lane: int) -> list[int]:
    """Returns the indices of the lanes that lead into a lane."""
    first, after = roads.lanes.prev_start[lane], roads.lanes.prev_start[lane + 1]
    return [int(p) for p in roads.lanes.prev_lane[first:after]]


def _width(roads: RoadMap, lane: int) -> float:
    """Returns the width in m of a lane at its end."""
    return float(roads.at(lane, float(roads.lanes.length[lane])).width)
