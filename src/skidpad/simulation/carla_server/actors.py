"""Everything that is in the world, by id; and tombstones of what was.

An error answer about an actor that has just been destroyed would abort a client's Traffic Manager,
so what the dead were is remembered for a while.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.catalogue import AttributeType, Blueprint, Family
from skidpad.simulation.carla_server.rpc import CallError
from skidpad.simulation.carla_server.wire import Vector

TOMBSTONES = 10_000
MAX_ACTORS = 20_000
STILL: Vector = (0.0, 0.0, 0.0)


class Attachment(IntEnum):
    """How a child follows its parent; spring arms are rigid here (listed as a difference)."""

    RIGID = 0
    SPRING_ARM = 1
    SPRING_ARM_GHOST = 2


@dataclass(slots=True, eq=False)
class Actor:
    """One actor. Poses and vectors are ISO 8855, world frame; a vehicle's motion is the fleet's."""

    id: int
    blueprint: Blueprint
    attributes: dict[str, str]
    pose: Pose
    parent: int = 0
    mount: Pose = Pose(0.0, 0.0)  # seen from the parent
    stream: int | None = None
    velocity: Vector = STILL
    turn: Vector = STILL  # rad/s
    acceleration: Vector = STILL
    row: int = -1  # of the snapshot
    centre: Vector = STILL  # of the box from the actor's origin
    half: Vector = STILL  # half extents
    box_yaw: float = 0.0  # rad
    children: list[int] = field(default_factory=list)
    extra: Any = None  # what the topic that owns this family keeps about it

    @property
    def family(self) -> Family:
        """What it is."""
        return self.blueprint.family

    def box(self) -> list[list[float]]:
        """Its BoundingBox as it travels."""
        x, y, z = wire.iso_to_wire(self.centre)
        return wire.box((x, y, z), self.half, wire.yaw_to_wire(self.box_yaw))

    def description(self) -> list[Any]:
        """ActorDescription."""
        types = self.blueprint.attributes
        packed = [
            [name, int(types[name].type if name in types else AttributeType.STRING), value]
            for name, value in self.attributes.items()
        ]
        return [self.id, self.blueprint.id, packed]

    def packed(self, token: bytes = b"") -> list[Any]:
        """Actor as it travels."""
        tags = bytes([int(self.blueprint.label)])
        return [self.id, self.parent, self.description(), self.box(), tags, token]


class ActorTable:
    """Actors by id, in order of spawning."""

    def __init__(self) -> None:
        self._next = 1
        self.alive: dict[int, Actor] = {}
        self.dead: OrderedDict[int, Actor] = OrderedDict()

    def __iter__(self) -> Iterator[Actor]:
        return iter(self.alive.values())

    def __len__(self) -> int:
        return len(self.alive)

    def new_id(self) -> int:
        """The next free id; CallError when the world is full."""
        if len(self.alive) >= MAX_ACTORS:
            raise CallError(f"the world is full: at most {MAX_ACTORS} actors")
        id = self._next
        self._next += 1
        return id

    def add(self, actor: Actor) -> None:
        """Enter a new actor."""
        self.alive[actor.id] = actor
        if actor.parent:
            self.get(actor.parent).children.append(actor.id)

    def remove(self, id: int) -> Actor:
        """Take it out and keep its tombstone."""
        actor = self.alive.pop(id)
        self.dead[id] = actor
        if len(self.dead) > TOMBSTONES:
            self.dead.popitem(last=False)
        parent = self.alive.get(actor.parent)
        if parent is not None:
            parent.children.remove(id)
        return actor

    def get(self, id: Any, family: Family | None = None) -> Actor:
        """The living actor with this id; CallError when there is none of that family."""
        wire.integer(id, "actor id")
        actor = self.alive.get(id)
        if actor is None:
            raise CallError(f"actor {id} not found")
        if family is not None and actor.family is not family:
            raise CallError(f"actor {id} is no {family.value}")
        return actor

    def find(self, id: Any) -> Actor | None:
        """The actor with this id, alive or dead; None when it is not remembered."""
        wire.integer(id, "actor id")
        return self.alive.get(id) or self.dead.get(id)

    def of(self, family: Family) -> list[Actor]:
        """All living actors of a family."""
        return [a for a in self.alive.values() if a.family is family]

    def clear(self) -> None:
        """Another episode: ids go on, nothing else does."""
        self.alive.clear()
        self.dead.clear()
