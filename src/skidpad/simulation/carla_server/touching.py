"""Contacts between vehicles, walkers, props and roadside, and what collision sensors hear of them.

The impulses are physics'. Vehicles come first in its arrays, then walkers and props, which nothing
can move.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import hypot, inf
from typing import TYPE_CHECKING

import numpy as np

from skidpad.core.geometry import footprint
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics import contact
from skidpad.physics.segments import Segments, static_segments
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import BarrierKind
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.wire import Vector

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

NEAR = 60.0  # m from any vehicle within which standing things are looked at
ROLLED_OVER = 0.2  # m: lower things pass under bumpers, and wheels roll over them (assumed)
BARRIERS = {
    BarrierKind.GUARDRAIL: SemanticClass.GUARD_RAIL,
    BarrierKind.WALL: SemanticClass.WALL,
    BarrierKind.FENCE: SemanticClass.FENCE,
}


@dataclass(frozen=True, slots=True)
class Touch:
    """Two actors touch in this tick."""

    actor: int
    other: int  # 0: something of the map
    label: int  # SemanticClass of the other
    impulse: Vector  # N s on `actor`, world


class Contacts:
    """Who touches whom in this tick."""

    def __init__(self) -> None:
        self.events: list[Touch] = []
        self._room = contact.Contacts.room()
        self._segments = static_segments(np.zeros((0, 4)), np.zeros(0), np.zeros(0))
        self._labels: list[int] = []

    def begin(self, roads: RoadMap) -> None:
        """Another map."""
        self.events = []
        self._segments, self._labels = roadside_segments(roads)

    def resolve(self, world: World, dt: float) -> None:
        """Find contacts, push vehicles apart, and note who was touched."""
        movers = world.vehicles
        standing = _standing(world)
        n = len(movers)
        states, bodies = self._bodies(world, standing)
        count = contact.resolve_contacts(
            states, bodies, self._segments, contact.CONTACT_LAW, dt, self._room
        )
        for column, moved in zip(movers.fleet.states, states, strict=True):
            column[:] = moved[:n]
        ids = [v.actor for v in movers.members] + [a.id for a in standing]
        self.events = []
        for k in range(count):
            self._note(world, ids, k)

    def _bodies(self, world: World, standing: list[Actor]) -> tuple[ActorStates, contact.Bodies]:
        """Vehicles and standing things as bodies; a vehicle without collisions is not present."""
        fleet, members = world.vehicles.fleet, world.vehicles.members
        n = len(members)
        states = ActorStates.empty(n + len(standing))
        for column, vehicle_column in zip(states, fleet.states, strict=True):
            column[:n] = vehicle_column
        states.present[:n] = [v.collides for v in members]
        sizes = [(t.length, t.width, t.height) for t in fleet.types]
        for i, actor in enumerate(standing, start=n):
            foot = actor.pose.z - (actor.half[2] if actor.family is Family.WALKER else 0.0)
            states.x[i], states.y[i], states.z[i] = actor.pose.x, actor.pose.y, foot
            states.yaw[i], states.present[i] = actor.pose.yaw, True
            sizes.append((2 * actor.half[0], 2 * actor.half[1], 2 * actor.half[2]))
        fixed = np.full(len(standing), inf)
        held = np.array([not v.simulated for v in members], dtype=np.bool_)
        mass = np.where(held, inf, fleet.params.mass)
        inertia = np.where(held, inf, fleet.params.yaw_inertia)
        size = np.array(sizes, dtype=np.float64).reshape(-1, 3)
        length, width, height = np.ascontiguousarray(size.T)
        return states, contact.bodies(
            length,
            width,
            height,
            np.concatenate([mass, fixed]),
            np.concatenate([inertia, fixed]),
            np.concatenate([fleet.params.x_cog, np.zeros(len(standing))]),
        )

    def _note(self, world: World, ids: list[int], k: int) -> None:
        c = self._room
        i, j = int(c.i[k]), int(c.j[k])
        push = (float(c.impulse[k] * c.nx[k]), float(c.impulse[k] * c.ny[k]), 0.0)
        if j < 0:
            self.events.append(Touch(ids[i], 0, self._labels[int(c.segment[k])], push))
            return
        for a, b, sign in ((ids[i], ids[j], 1.0), (ids[j], ids[i], -1.0)):
            label = int(world.actors.alive[b].blueprint.label)
            self.events.append(Touch(a, b, label, (sign * push[0], sign * push[1], 0.0)))


def _standing(world: World) -> list[Actor]:
    """Walkers and free props near a vehicle, except what lies flat on the road."""
    s = world.vehicles.fleet.states
    found = []
    for actor in world.actors:
        if actor.family not in (Family.WALKER, Family.PROP) or actor.parent:
            continue
        if actor.family is Family.PROP and 2 * actor.half[2] < ROLLED_OVER:
            continue
        if np.any(np.hypot(s.x - actor.pose.x, s.y - actor.pose.y) < NEAR):
            found.append(actor)
    return found


def roadside_segments(roads: RoadMap) -> tuple[Segments, list[int]]:
    """What vehicles can hit beside the road, and the class of each segment."""
    lines: list[tuple[float, float, float, float]] = []
    low: list[float] = []
    high: list[float] = []
    labels: list[int] = []

    def add(a: tuple[float, float], b: tuple[float, float], z: float, h: float, label: int) -> None:
        if hypot(b[0] - a[0], b[1] - a[1]) > 1e-3:
            lines.append((*a, *b))
            low.append(z)
            high.append(z + h)
            labels.append(label)

    for barrier in roads.roadside.barriers:
        if barrier.kind not in BARRIERS:
            continue
        points = barrier.points
        for p, q in pairwise(points):
            z = float(min(p[2], q[2]))
            add((p[0], p[1]), (q[0], q[1]), z, barrier.height, int(BARRIERS[barrier.kind]))
    for box in roads.roadside.boxes:
        if box.solid:
            corners = footprint(box.x, box.y, box.yaw, box.length, box.width).tolist()
            for p, q in zip(corners, [*corners[1:], corners[0]], strict=True):
                add((p[0], p[1]), (q[0], q[1]), box.z, box.height, int(box.label))
    return (
        static_segments(np.array(lines).reshape(-1, 4), np.array(low), np.array(high)),
        labels,
    )
