"""The map's own objects: which there are, which clients have hidden, and the map without those.

Boxes, lights' heads and barriers, these cut into pieces that are about straight. What is hidden is
seen by no sensor, stops no vehicle and no ray. Layers hide by kind, on maps with a layered name only.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from math import atan2, hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import Barrier, Roadside
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.world.obstacles import BARRIERS

FIRST_ID = 1 << 32  # environment ids start beyond all actor ids
LONGEST_PIECE = 50.0  # m of a barrier
BULGE = 0.3  # m by which a piece may leave its chord
THICKNESS = 0.25  # m of a barrier's box: of a wall as it is drawn
HEAD = (0.18, 0.45, 1.26)  # m: a head's depth, width and height for lamps of 0.3 m
LAYERS = {  # bits of carla.MapLayer
    SemanticClass.BUILDING: 1,
    SemanticClass.VEGETATION: 4,
    SemanticClass.CAR: 16,
    SemanticClass.STATIC: 64,
    SemanticClass.POLE: 128,
    SemanticClass.WALL: 256,
    SemanticClass.FENCE: 256,
    SemanticClass.GUARD_RAIL: 256,
}
ALL_LAYERS = 0xFFFF


@dataclass(frozen=True, slots=True)
class Source:
    """What of the roadside an object is: a box or a head by its row, or chords of a barrier."""

    kind: str  # field of Roadside
    row: int
    first: int = 0  # points of a barrier
    last: int = 0


@dataclass(frozen=True, slots=True)
class EnvironmentObject:
    """One object of the map."""

    id: int
    name: str
    label: int
    centre: Pose
    half: Vector
    source: Source

    def box(self) -> list[list[float]]:
        """Returns the `BoundingBox` in the world as CARLA's wire sends it."""
        place = wire.iso_to_wire((self.centre.x, self.centre.y, self.centre.z))
        return wire.box(place, self.half, wire.yaw_to_wire(self.centre.yaw))

    def pack(self) -> list[Any]:
        """Returns the `EnvironmentObject` as CARLA's wire sends it."""
        return [wire.transform(self.centre), self.box(), self.id, self.name, self.label]


@lru_cache(maxsize=4)
def objects(roads: RoadMap) -> tuple[EnvironmentObject, ...]:
    """Returns all objects of a map, with ids in a fixed order; cached for four maps."""
    side = roads.roadside
    found = [*_boxes(side), *_heads(side), *_barriers(side)]
    return tuple(
        EnvironmentObject(
            FIRST_ID + i, f"{label.name.title()}_{i}", int(label), centre, half, source
        )
        for i, (label, centre, half, source) in enumerate(found)
    )


Found = tuple[SemanticClass, Pose, Vector, Source]


def _boxes(side: Roadside) -> Iterator[Found]:
    """Yields (label, centre pose, half sizes in m, source) for each box beside the road."""
    for row, b in enumerate(side.boxes):
        centre = Pose(b.x, b.y, b.z + b.height / 2.0, yaw=b.yaw)
        half = (b.length / 2.0, b.width / 2.0, b.height / 2.0)
        yield SemanticClass(b.label), centre, half, Source("boxes", row)


def _heads(side: Roadside) -> Iterator[Found]:
    """Yields (label, centre pose, half sizes in m, source) for each signal head."""
    for row, h in enumerate(side.heads):
        scale = h.lamp_diameter / 0.3 / 2.0
        half = (HEAD[0] * scale, HEAD[1] * scale, HEAD[2] * scale)
        centre = Pose(h.x, h.y, h.z, yaw=h.heading)
        yield SemanticClass.TRAFFIC_LIGHT, centre, half, Source("heads", row)


def _barriers(side: Roadside) -> Iterator[Found]:
    """Yields (label, centre pose, half sizes in m, source) for each straight piece of a barrier; no kerbs."""
    for row, barrier in enumerate(side.barriers):
        if barrier.kind not in BARRIERS:
            continue  # kerbs are part of the ground
        for first, last in pieces(barrier.points):
            part = barrier.points[first : last + 1]
            (x0, y0), (x1, y1) = part[0, :2], part[-1, :2]
            low, high = float(part[:, 2].min()), float(part[:, 2].max()) + barrier.height
            centre = Pose(
                float(x0 + x1) / 2.0,
                float(y0 + y1) / 2.0,
                (low + high) / 2.0,
                yaw=atan2(y1 - y0, x1 - x0),
            )
            half = (hypot(x1 - x0, y1 - y0) / 2.0, THICKNESS / 2.0, (high - low) / 2.0)
            source = Source("barriers", row, first, last)
            yield BARRIERS[barrier.kind], centre, half, source


def pieces(points: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Yields indices of the first and last point of each nearly straight piece of a line (n, 2 or more).

    A piece keeps within BULGE m of its chord and is at most LONGEST_PIECE m long, unless it is one
    step of the line. Neighbours share a point; nothing for fewer than two points.
    """
    first = 0
    while first < len(points) - 1:
        last = first + 1
        while last + 1 < len(points) and _is_straight(points[first : last + 2, :2]):
            last += 1
        yield first, last
        first = last


def _is_straight(part: NDArray[np.float64]) -> bool:
    """Returns whether points (n, 2) lie within BULGE m of their chord, of LONGEST_PIECE m at most."""
    along = part[-1] - part[0]
    length = float(np.hypot(*along))
    if not 0.0 < length <= LONGEST_PIECE:
        return False
    away = part - part[0]
    return float(np.abs(away[:, 0] * along[1] - away[:, 1] * along[0]).max()) <= BULGE * length


class Landscape:
    """The objects of an episode's map, and what is left of them."""

    def __init__(self, roads: RoadMap, layered: bool, layers: int = ALL_LAYERS) -> None:
        """layered: layers act. layers: bits of those that are there at first."""
        self.whole, self.layered, self.layers = roads, layered, layers
        self.hidden: set[int] = set()  # by id, by clients
        self._shown: tuple[frozenset[int], RoadMap] = (frozenset(), roads)

    def toggle(self, ids: Iterable[int], on: bool) -> None:
        """Shows or hides single objects; unknown ids change nothing."""
        if on:
            self.hidden.difference_update(ids)
        else:
            self.hidden.update(ids)

    def load(self, layers: int, on: bool) -> None:
        """Brings layers (bits) back, or takes them away; without layered maps it has no effect."""
        self.layers = self.layers | layers if on else self.layers & ~layers

    def missing(self) -> frozenset[int]:
        """Returns the ids of all objects that are not there at present: hidden, or of a layer taken away."""
        away = {label for label, bit in LAYERS.items() if self.layered and not self.layers & bit}
        if not away and not self.hidden:
            return frozenset()
        return frozenset(
            o.id for o in objects(self.whole) if o.id in self.hidden or o.label in away
        )

    def present(self) -> tuple[EnvironmentObject, ...]:
        """Returns the objects of the map that are there at present."""
        missing = self.missing()
        return tuple(o for o in objects(self.whole) if o.id not in missing)

    @property
    def roads(self) -> RoadMap:
        """The map without the objects that are not there; the same object until these change."""
        missing = self.missing()
        if missing != self._shown[0]:
            self._shown = missing, without(self.whole, missing) if missing else self.whole
        return self._shown[1]


def without(roads: RoadMap, missing: frozenset[int]) -> RoadMap:
    """Returns the same map with less beside the road, and another content hash.

    missing: ids of objects.
    """
    gone = [o.source for o in objects(roads) if o.id in missing]
    rows = {(s.kind, s.row) for s in gone if s.kind != "barriers"}
    cut: dict[int, list[Source]] = {}
    for source in gone:
        if source.kind == "barriers":
            cut.setdefault(source.row, []).append(source)
    side, shown = roads.roadside, copy(roads)
    shown.roadside = replace(
        side,
        boxes=tuple(b for i, b in enumerate(side.boxes) if ("boxes", i) not in rows),
        heads=tuple(h for i, h in enumerate(side.heads) if ("heads", i) not in rows),
        barriers=tuple(
            part
            for i, b in enumerate(side.barriers)
            for part in _remaining_barriers(b, cut.get(i, []))
        ),
    )
    shown.content_hash = f"{roads.content_hash} without {sorted(missing)}"
    return shown


def _remaining_barriers(barrier: Barrier, gone: list[Source]) -> Iterator[Barrier]:
    """Yields what is left of a barrier without the pieces that are gone."""
    if not gone:
        yield barrier
        return
    chords = [not any(s.first <= k < s.last for s in gone) for k in range(len(barrier.points) - 1)]
    for stays, run in groupby(enumerate(chords), key=lambda chord: chord[1]):
        numbers = [k for k, _ in run]
        if stays:
            points = barrier.points[numbers[0] : numbers[-1] + 2]
            yield replace(barrier, points=points)
