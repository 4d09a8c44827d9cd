"""Rays against everything: actors, the map's objects, the road."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server.actors.boxes import Boxes
from skidpad.simulation.carla_server.actors.registry import SOLID, ActorTable, Box
from skidpad.simulation.carla_server.maps.landscape import Landscape
from skidpad.simulation.carla_server.protocol.wire import Vector

GROUND_STEP = 0.5  # m along a ray between looks at the road's height
LONGEST_RAY = 2000.0  # m


@dataclass(frozen=True, slots=True)
class Hit:
    """Where a ray meets something."""

    distance: float
    place: Vector
    label: int


def trace_ray(
    landscape: Landscape, actors: ActorTable, start: Vector, way: Vector, reach: float
) -> list[Hit]:
    """Returns everything on a ray, near to far: actors, the map's objects, the road; [] for no direction.

    way: direction, of any length; reach: m, LONGEST_RAY at most.
    """
    length = sum(v * v for v in way) ** 0.5
    if length == 0.0:
        return []
    reach = min(max(reach, 0.0), LONGEST_RAY)
    unit = (way[0] / length, way[1] / length, way[2] / length)
    targets = [(int(a.blueprint.label), actors.box(a)) for a in actors if a.family in SOLID]
    targets += [(o.label, Box(o.centre, o.half)) for o in landscape.present()]
    near, far = Boxes.of(targets).spans(start, unit)
    near = np.maximum(near, 0.0)  # a ray that begins inside meets it at once
    met = np.flatnonzero((near <= far) & (near <= reach)).tolist()
    hits = [_hit(start, unit, float(near[i]), targets[i][0]) for i in met]
    road = _onto_road(landscape.whole, start, unit, reach)
    if road is not None:
        hits.append(_hit(start, unit, road, int(SemanticClass.ROAD)))
    return sorted(hits, key=lambda h: h.distance)


def _hit(start: Vector, unit: Vector, distance: float, label: int) -> Hit:
    """Returns the hit at a distance in m from `start` along the unit vector."""
    place = tuple(s + distance * u for s, u in zip(start, unit, strict=True))
    return Hit(distance, (place[0], place[1], place[2]), label)


def _onto_road(roads: RoadMap, start: Vector, unit: Vector, reach: float) -> float | None:
    """Returns the m at which a ray goes through a road from above; None when it does not."""

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
