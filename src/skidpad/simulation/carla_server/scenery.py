"""What belongs to the map: its objects with ids and boxes, and rays against everything."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, sin
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import SOLID, ActorTable, Box
from skidpad.simulation.carla_server.wire import Vector

GROUND_STEP = 0.5  # m along a ray between looks at the road's height
LONGEST_RAY = 2000.0  # m
FIRST_ID = 1 << 32  # environment ids start beyond all actor ids


@dataclass(frozen=True, slots=True)
class EnvironmentObject:
    """One object of the map."""

    id: int
    name: str
    label: int
    centre: Pose
    half: Vector

    def box(self) -> list[list[float]]:
        """BoundingBox in the world."""
        place = wire.iso_to_wire((self.centre.x, self.centre.y, self.centre.z))
        return wire.box(place, self.half, wire.yaw_to_wire(self.centre.yaw))

    def packed(self) -> list[Any]:
        """EnvironmentObject as it travels."""
        return [wire.transform(self.centre), self.box(), self.id, self.name, self.label]


@dataclass(frozen=True, slots=True)
class Hit:
    """Where a ray meets something."""

    distance: float
    place: Vector
    label: int


@lru_cache(maxsize=4)
def objects(roads: RoadMap) -> tuple[EnvironmentObject, ...]:
    """All objects of a map."""
    found = []
    for i, b in enumerate(roads.roadside.boxes):
        name = f"{SemanticClass(b.label).name.title()}_{i}"
        centre = Pose(b.x, b.y, b.z + b.height / 2.0, yaw=b.yaw)
        half = (b.length / 2.0, b.width / 2.0, b.height / 2.0)
        found.append(EnvironmentObject(FIRST_ID + i, name, int(b.label), centre, half))
    return tuple(found)


def cast(roads: RoadMap, actors: ActorTable, start: Vector, way: Vector, reach: float) -> list[Hit]:
    """Everything on a ray, near to far: actors, the map's objects, the road."""
    length = sum(v * v for v in way) ** 0.5
    if length == 0.0:
        return []
    reach = min(max(reach, 0.0), LONGEST_RAY)
    unit = (way[0] / length, way[1] / length, way[2] / length)
    targets = [(actors.box(a), int(a.blueprint.label)) for a in actors if a.family in SOLID]
    targets += [(Box(o.centre, o.half), o.label) for o in objects(roads)]
    hits = []
    for box, label in targets:
        distance = _into_box(start, unit, box)
        if distance is not None and distance <= reach:
            hits.append(_hit(start, unit, distance, label))
    road = _onto_road(roads, start, unit, reach)
    if road is not None:
        hits.append(_hit(start, unit, road, int(SemanticClass.ROAD)))
    return sorted(hits, key=lambda h: h.distance)


def _hit(start: Vector, unit: Vector, distance: float, label: int) -> Hit:
    place = tuple(s + distance * u for s, u in zip(start, unit, strict=True))
    return Hit(distance, (place[0], place[1], place[2]), label)


def _into_box(start: Vector, unit: Vector, box: Box) -> float | None:
    """Distance at which a ray enters an upright box (slab test); None when it misses."""
    pose, half = box
    c, s = cos(pose.yaw), sin(pose.yaw)
    dx, dy, dz = start[0] - pose.x, start[1] - pose.y, start[2] - pose.z
    origin = (dx * c + dy * s, dy * c - dx * s, dz)
    ray = (unit[0] * c + unit[1] * s, unit[1] * c - unit[0] * s, unit[2])
    near, far = 0.0, LONGEST_RAY
    for o, r, h in zip(origin, ray, half, strict=True):
        if abs(r) < 1e-12:
            if abs(o) > h:
                return None
            continue
        a, b = sorted(((-h - o) / r, (h - o) / r))
        near, far = max(near, a), min(far, b)
        if near > far:
            return None
    return near


def _onto_road(roads: RoadMap, start: Vector, unit: Vector, reach: float) -> float | None:
    """Distance at which a ray goes through a road from above; None when it does not."""

    def above(distance: float) -> float | None:
        x, y, z = (s + distance * u for s, u in zip(start, unit, strict=True))
        place = roads.project(x, y, z, driving=False)
        if place is None or abs(place.offset) > place.width:
            return None
        return z - place.z

    before = above(0.0)
    distance = 0.0
    while distance < reach:
        beyond = min(distance + GROUND_STEP, reach)
        after = above(beyond)
        if before is not None and after is not None and before >= 0.0 > after:
            share = before / (before - after)
            return distance + share * (beyond - distance)
        before, distance = after, beyond
    return None
