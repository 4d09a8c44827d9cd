"""Gravity: vehicles and walkers that were put into the air, pushed upwards or driven off a bridge.

In the air a body keeps its velocity in the plane and falls freely; tyres have no friction. It lands on
the highest lane of any kind below it, the verge included. Beside all lanes the ground is level, at the
height of the nearest lane, as there is no terrain. A landing is soft: nothing bounces or breaks.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.maths.constants import G
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor, ActorTable
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicles
from skidpad.simulation.world.interventions import set_grounded, set_tyres
from skidpad.simulation.world.world import World

DROP = 0.6  # m above the ground from which something falls; lower, it stands at once
VERGE = 1.0  # m beside the outermost lane that still carry (assumed)
CENTRED = 1.5  # m from a lane's middle within which every lane carries
LEVELS = 8.0  # m between the heights at which lanes are looked for
DEEPEST = 200.0  # m
LIFT_OFF = 0.1  # m/s upwards below which a push leaves a body on the ground
FALLS = (Family.VEHICLE, Family.WALKER)


def ground_below(roads: RoadMap, x: float, y: float, z: float) -> float | None:
    """Returns the height in m of the ground under a point; None without a lane within DEEPEST m below.

    The highest lane that carries the point; where none does, the nearest lane's height.
    """
    nearest: float | None = None
    depth = 0.0
    while depth <= DEEPEST:
        place = roads.project(x, y, z - depth, driving=False)
        if place is not None and place.z <= z + DROP:
            if abs(place.offset) <= place.width / 2.0 + VERGE:
                return place.z
            nearest = place.z if nearest is None else nearest
        depth += LEVELS
    return nearest


class Falling:
    """Holds the actors that are in the air and those without gravity."""

    def __init__(
        self, moving: World, roads: RoadMap, actors: ActorTable, vehicles: Vehicles
    ) -> None:
        self._moving, self._roads, self._actors, self._vehicles = moving, roads, actors, vehicles
        self._weightless: set[int] = set()

    def _floats(self, actor: Actor) -> bool:
        """Returns whether the actor has no weight or is in the air."""
        return actor.id in self._weightless or actor.id in self._actors.rising

    def _above(self, actor: Actor) -> float | None:
        """Returns the m of an actor's feet over the ground; None when there is none."""
        s, i = self._moving.states, self._moving.row(actor.body or 0)
        ground = ground_below(self._roads, float(s.x[i]), float(s.y[i]), float(s.z[i]))
        return None if ground is None else float(s.z[i]) - ground

    def start_fall(self, actor: Actor) -> None:
        """Begins a fall when the actor was placed more than DROP m above the ground; else it stands.

        Does nothing for others than vehicles and walkers, and without gravity.
        """
        if actor.family not in FALLS or actor.body is None or actor.id in self._weightless:
            return
        self._actors.rising.pop(actor.id, None)
        above = self._above(actor)
        if above is not None and above > DROP and self._is_simulated(actor):
            self._actors.rising[actor.id] = 0.0
        self._hold(actor)

    def start_fall_at_entry(self, actor: Actor, height: float) -> None:
        """Begins the fall of an actor that entered with its feet at this height, m."""
        if actor.body is not None and actor.family in FALLS:
            s, i = self._moving.states, self._moving.row(actor.body)
            s.z[i] = max(float(s.z[i]), height)
            self.start_fall(actor)

    def push(self, actor: Actor, change: float) -> None:
        """Changes an actor's speed upwards by so many m/s; from the ground only beyond LIFT_OFF."""
        if actor.family not in FALLS or actor.body is None or not self._is_simulated(actor):
            return
        speed = self._actors.rising.get(actor.id, 0.0) + change
        if actor.id in self._actors.rising or speed > LIFT_OFF:
            self._actors.rising[actor.id] = speed
            self._hold(actor)

    def weigh(self, actor: Actor, on: bool) -> None:
        """Switches gravity on or off; without it a body keeps its height, and its tyres grip nothing."""
        if actor.family not in FALLS or actor.body is None:
            return
        if on:
            self._weightless.discard(actor.id)
            self.start_fall(actor)
        else:
            self._weightless.add(actor.id)
            self._actors.rising.pop(actor.id, None)
            self._hold(actor)

    def forget(self, id: int) -> None:
        """Forgets an actor that was destroyed."""
        self._weightless.discard(id)
        self._actors.rising.pop(id, None)

    def tick(self, dt: float) -> None:
        """Moves all that are in the air by dt s, after everything else has moved, and lands them."""
        self._leave_bridges()
        for id, speed in list(self._actors.rising.items()):
            actor = self._actors.alive[id]
            s, i = self._moving.states, self._moving.row(actor.body or 0)
            above = self._above(actor)
            fallen = 0.5 * G * dt * dt - speed * dt
            s.z[i] -= fallen
            self._actors.rising[id] = speed - G * dt
            if above is not None and fallen > 0.0 and above <= fallen:
                s.z[i] += fallen - above
                del self._actors.rising[id]
                self._hold(actor)

    def _leave_bridges(self) -> None:
        """Begins the fall of vehicles that are beside their lane with another lane below them."""
        s, offset = self._moving.states, self._moving.placed["offset"][: self._moving.wheeled]
        for i in np.flatnonzero(np.abs(offset) > CENTRED).tolist():
            actor = self._actors.in_row(i)
            if self._floats(actor):
                continue
            x, y, z = float(s.x[i]), float(s.y[i]), float(s.z[i])
            here = self._roads.project(x, y, z, driving=False)
            if here is None or abs(here.offset) <= here.width / 2.0 + VERGE:
                continue
            ground = ground_below(self._roads, x, y, z)
            if ground is not None and z - ground > DROP and self._is_simulated(actor):
                self._actors.rising[actor.id] = 0.0
                self._hold(actor)

    def _is_simulated(self, actor: Actor) -> bool:
        """Returns whether the physics of the actor's body is switched on."""
        return bool(self._moving.rows.simulated[self._moving.row(actor.body or 0)])

    def _hold(self, actor: Actor) -> None:
        """Takes a floating actor off the road, or puts one that floats no more back."""
        assert actor.body is not None
        floats = self._floats(actor)
        set_grounded(self._moving, actor.body, self._is_simulated(actor) and not floats)
        if actor.id in self._vehicles:
            friction = self._vehicles.of(actor.id).physics.tire_friction.tolist()
            set_tyres(self._moving, actor.body, [0.0] * len(friction) if floats else friction)
