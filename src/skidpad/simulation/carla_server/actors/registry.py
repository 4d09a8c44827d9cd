"""Everything that is in an episode, by id; and tombstones of what was.

An error answer about an actor that has just been destroyed would abort a client's Traffic Manager,
so what the dead were is remembered for a while.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any, NamedTuple

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.catalogue import AttributeType, Blueprint, Family
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.world.world import World

TOMBSTONES = 10_000
MAX_ACTORS = 20_000
STILL: Vector = (0.0, 0.0, 0.0)
SOLID = (Family.VEHICLE, Family.WALKER, Family.PROP)


class Box(NamedTuple):
    """An upright box in the world."""

    centre: Pose
    half: Vector  # m, half extents


class Attachment(IntEnum):
    """How a child follows its parent; spring arms are rigid here (listed as a difference)."""

    RIGID = 0
    SPRING_ARM = 1
    SPRING_ARM_GHOST = 2


@dataclass(slots=True, eq=False)
class Actor:
    """One actor. Poses and vectors are ISO 8855, world frame."""

    id: int
    blueprint: Blueprint
    attributes: dict[str, str]
    pose: Pose  # where it entered or last was; while it has a body, the body's counts
    body: int | None = None  # its id in the moving world; None: no physics moves it
    parent: int = 0
    mount: Pose = Pose(0.0, 0.0)  # seen from the parent
    stream: int | None = None
    row: int = -1  # of the snapshot
    centre: Vector = STILL  # of the box from the actor's origin
    half: Vector = STILL  # half extents
    children: list[int] = field(default_factory=list)

    @property
    def family(self) -> Family:
        """The kind of actor, such as vehicle, walker or sensor."""
        return self.blueprint.family

    @property
    def lift(self) -> float:
        """Height in m of its origin above its feet: a walker's is the middle of its body, as in CARLA."""
        return self.half[2] if self.family is Family.WALKER else 0.0

    def box(self) -> list[list[float]]:
        """Returns its BoundingBox, seen from the actor, as it travels on the wire."""
        return wire.box(wire.iso_to_wire(self.centre), self.half)

    def description(self) -> list[Any]:
        """Returns the actor's `ActorDescription` as CARLA's wire sends it."""
        types = self.blueprint.attributes
        packed = [
            [name, int(types[name].type if name in types else AttributeType.STRING), value]
            for name, value in self.attributes.items()
        ]
        return [self.id, self.blueprint.id, packed]

    def pack(self, token: bytes = b"") -> list[Any]:
        """Returns the actor as CARLA's wire sends it."""
        tags = bytes([int(self.blueprint.label)])
        return [self.id, self.parent, self.description(), self.box(), tags, token]


class ActorTable:
    """Actors by id, in order of spawning."""

    def __init__(self, moving: World, ids: Iterator[int]) -> None:
        """moving: where their bodies are. ids: of those to come; no id is given twice."""
        self._moving, self._ids = moving, ids
        self.alive: dict[int, Actor] = {}
        self.dead: OrderedDict[int, Actor] = OrderedDict()
        self._by_body: dict[int, Actor] = {}
        self.rising: dict[int, float] = {}  # m/s upwards, of those in the air

    def __iter__(self) -> Iterator[Actor]:
        return iter(self.alive.values())

    def __len__(self) -> int:
        return len(self.alive)

    def new_id(self) -> int:
        """Returns the next free id; CallError when there are MAX_ACTORS already."""
        if len(self.alive) >= MAX_ACTORS:
            raise CallError(f"the world is full: at most {MAX_ACTORS} actors")
        return next(self._ids)

    def add(self, actor: Actor) -> None:
        """Adds a new actor to the table and to its parent's children; CallError for an unknown parent."""
        self.alive[actor.id] = actor
        if actor.body is not None:
            self._by_body[actor.body] = actor
        if actor.parent:
            self.get(actor.parent).children.append(actor.id)

    def remove(self, id: int) -> Actor:
        """Takes an actor out, keeps its tombstone with its last pose, and returns it.

        KeyError for one that does not live. Its children stay.
        """
        actor = self.alive[id]
        actor.pose = self.pose(actor)
        del self.alive[id]
        if actor.body is not None:
            del self._by_body[actor.body]
        self.dead[id] = actor
        if len(self.dead) > TOMBSTONES:
            self.dead.popitem(last=False)
        parent = self.alive.get(actor.parent)
        if parent is not None:
            parent.children.remove(id)
        return actor

    def get(self, id: Any, family: Family | None = None) -> Actor:
        """Returns the living actor with this id; CallError when there is none, or of another family.

        WireError for what is no integer.
        """
        wire.integer(id, "actor id")
        actor = self.alive.get(id)
        if actor is None:
            raise CallError(f"actor {id} not found")
        if family is not None and actor.family is not family:
            raise CallError(f"actor {id} is no {family.value}")
        return actor

    def find(self, id: Any) -> Actor | None:
        """Returns the actor with this id, alive or dead; None if unknown, WireError if no integer."""
        wire.integer(id, "actor id")
        return self.alive.get(id) or self.dead.get(id)

    def of(self, family: Family) -> list[Actor]:
        """Returns all living actors of a family."""
        return [a for a in self.alive.values() if a.family is family]

    def in_row(self, i: int) -> Actor:
        """Returns the actor whose body stands in row i of the moving world."""
        return self._by_body[self._moving.members[i].id]

    def pose(self, actor: Actor) -> Pose:
        """Returns the actor's pose; that of a walker is the middle of its body."""
        if actor.body is None:
            return actor.pose
        feet = self._moving.states.pose(self._moving.row(actor.body))
        return replace(feet, z=feet.z + actor.lift) if actor.lift else feet

    def velocity(self, actor: Actor) -> Vector:
        """Returns the velocity of an actor in m/s, in the world; zeros for what has no body."""
        if actor.body is None:
            return STILL
        s, i = self._moving.states, self._moving.row(actor.body)
        return float(s.vx[i]), float(s.vy[i]), self.rising.get(actor.id, 0.0)

    def box(self, actor: Actor) -> Box:
        """Returns an actor's box in the world."""
        x, y, z = actor.centre
        return Box(self.pose(actor).moved(forward=x, left=y, up=z), actor.half)

    def carrier(self, actor: Actor) -> Actor | None:
        """Returns the actor that it is attached to; None for none, or one that lives no more."""
        return self.alive.get(actor.parent)
