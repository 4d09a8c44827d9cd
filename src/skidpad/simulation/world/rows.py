"""The arrays of a world: one row per actor, kept when others come and go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.maths.randomness import stream_key
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.contact import Bodies, bodies
from skidpad.physics.types import VehicleType
from skidpad.simulation.world.placed import Places, places_for


@dataclass(frozen=True, slots=True)
class Shape:
    """A body without wheels: size in m and mass in kg; inf cannot be moved."""

    kind: ActorKind
    length: float
    width: float
    height: float
    mass: float


@dataclass(frozen=True, slots=True)
class Newcomer:
    """An actor as it enters."""

    body: VehicleType | Shape
    name: str = ""
    type: str = ""  # id of the vehicle type or shape
    rgb: tuple[int, int, int] = (225, 225, 225)


@dataclass(frozen=True, slots=True)
class Member:
    """An actor of the world under the id that it keeps."""

    id: int
    actor: Newcomer

    @property
    def kind(self) -> ActorKind:
        """Returns the kind of actor that the member's body is."""
        body = self.actor.body
        return body.actor_kind if isinstance(body, VehicleType) else body.kind

    @property
    def is_wheeled(self) -> bool:
        """Whether the physics of vehicles moves it."""
        return isinstance(self.actor.body, VehicleType)


class Rows(NamedTuple):
    """Everything about n actors that a step changes or reads; arrays (n,) unless noted."""

    states: ActorStates
    commands: Floats  # (n, 5) throttle, brake, steer, handbrake, reverse
    mu: Floats  # (n, 4) at the tyres; NaN where there is none
    grade: Floats  # rad along the body, uphill positive
    bank: Floats  # rad, left side up positive
    placed: Places
    keys: NDArray[np.uint64]  # of the actor's own draws
    simulated: Flags  # physics moves it
    collides: Flags
    grounded: Flags  # its height follows from the road
    held: Floats  # (n, 2) forward and left speed kept against all forces; NaN: none

    @classmethod
    def of(cls, members: Sequence[Member], seed: int) -> Rows:
        """Returns the rows of the members: at the origin and not present."""
        n = len(members)
        sizes = [m.actor.body for m in members]
        return cls(
            states=ActorStates.empty(n),
            commands=np.zeros((n, 5)),
            mu=np.full((n, 4), np.nan),
            grade=np.zeros(n),
            bank=np.zeros(n),
            placed=places_for(
                np.array([b.length for b in sizes]), np.array([b.width for b in sizes])
            ),
            keys=np.array([stream_key(seed, "road noise", m.id) for m in members], np.uint64),
            simulated=np.ones(n, dtype=np.bool_),
            collides=np.ones(n, dtype=np.bool_),
            grounded=np.ones(n, dtype=np.bool_),
            held=np.full((n, 2), np.nan),
        )

    def carry(self, old: Rows, to: NDArray[np.intp], source: NDArray[np.intp]) -> None:
        """Rows `to` go on from rows `source` of `old`."""
        for column, was in zip((*self.states, *self[1:]), (*old.states, *old[1:]), strict=True):
            column[to] = was[source]


def table_of(members: Sequence[Member]) -> ActorTable:
    """What does not change about these actors."""
    actors = [m.actor for m in members]
    return ActorTable(
        names=tuple(a.name for a in actors),
        types=tuple(a.type for a in actors),
        kind=np.array([m.kind for m in members], dtype=np.uint8),
        length=np.array([a.body.length for a in actors]),
        width=np.array([a.body.width for a in actors]),
        height=np.array([a.body.height for a in actors]),
        rgb=np.array([a.rgb for a in actors], dtype=np.uint8).reshape(-1, 3),
    )


def bodies_of(members: Sequence[Member]) -> Bodies:
    """Masses and inertias; a body without wheels turns like a box of its size."""
    found = [m.actor.body for m in members]
    return bodies(
        np.array([b.length for b in found]),
        np.array([b.width for b in found]),
        np.array([b.height for b in found]),
        np.array([b.mass for b in found]),
        np.array([_yaw_inertia(b) for b in found]),
        np.array([b.x_cog if isinstance(b, VehicleType) else 0.0 for b in found]),
    )


def _yaw_inertia(body: VehicleType | Shape) -> float:
    """Returns the yaw inertia in kg m^2; that of a uniform cuboid where the body has no vehicle type."""
    if isinstance(body, VehicleType):
        return body.yaw_inertia
    return body.mass * (body.length**2 + body.width**2) / 12.0
