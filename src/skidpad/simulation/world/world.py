"""The moving world: every actor's motion, the road under it, contacts, lights and drivers.

The order within a step: drivers, commands, friction, vehicles, contacts, ground, lights, events.
Everything random comes from named streams of the seed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, isfinite, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.kernels.jit import hold
from skidpad.core.setup import ActorCommand
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import AntiLock, StabilityControl
from skidpad.physics.contact import CONTACT_LAW, Contacts
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import Road
from skidpad.physics.types import TIRE_FRICTION_REFERENCE, VehicleType
from skidpad.physics.wind import Gusts
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.conditions import Conditions
from skidpad.simulation.world.events import StepEvents
from skidpad.simulation.world.ground import RoadSigns, read_signs
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.obstacles import Obstacles, obstacles
from skidpad.simulation.world.rows import Member, Newcomer, Rows, bodies_of, table_of
from skidpad.simulation.world.step import (
    DECIDE,
    MOVE,
    SETTLE,
    Arena,
    Rules,
    advance,
    advance_undriven,
    feel_grip,
)
from skidpad.simulation.world.touch import EGO, ContactBook, Touches, forget, invasions, markings_of
from skidpad.simulation.world.traffic.care import careless
from skidpad.simulation.world.traffic.manager import CHECK_PERIOD, Reason, Traffic
from skidpad.simulation.world.traffic.occupancy import occupancy
from skidpad.simulation.world.traffic.state import drivers
from skidpad.simulation.world.traffic.streets import no_streets
from skidpad.simulation.world.wheel_grip import WheelGrip

CARELESS = careless()
BRAKING = 0.05  # pedal at which the brake lamps light up


class World:
    """Everything that changes during a run. Actors keep their id; rows are in order of entering,
    vehicles before bodies without wheels."""

    def __init__(self, map: RoadMap, lights: Lights, conditions: Conditions) -> None:
        self.map, self.lights, self.conditions = map, lights, conditions
        self.dt, self.tick = conditions.dt, 0
        self.wheel_grip = WheelGrip(conditions.grip)
        self.obstacles = obstacles(map)
        self.touching = Contacts.room()
        self.touches = 0  # contacts of this tick: rows of `touching`
        self.traffic: Traffic | None = None
        self.book: ContactBook | None = None
        self.markings = markings_of(map)
        self.events = StepEvents()
        self.gusts = None if conditions.wind is None else Gusts(conditions.wind, conditions.seed)
        self.air = (0.0, 0.0)  # m/s of the air in world axes
        self._next_id = 0
        self._begin([])
        self._outfit()

    # --- who is there

    def enter(self, newcomers: Sequence[Newcomer]) -> list[int]:
        """Lets actors enter, not yet present, and returns their ids; rows of others may move."""
        ids = range(self._next_id, self._next_id + len(newcomers))
        self._next_id += len(newcomers)
        self._arrange([*self.members, *map(Member, ids, newcomers)])
        return list(ids)

    def add(self, newcomer: Newcomer, pose: Pose, v: float = 0.0) -> int:
        """Lets one more actor enter at `pose` with speed v along it, present, and returns its id."""
        (id,) = self.enter([newcomer])
        self.put(self.row(id), pose, v)
        self.settle()
        return id

    def remove(self, id: int) -> None:
        """Takes an actor out; all others go on as they were, in other rows."""
        gone = self.row(id)
        self._arrange([m for i, m in enumerate(self.members) if i != gone])

    def row(self, id: int) -> int:
        """Returns the row of an actor's values at present; KeyError for an unknown id."""
        return self._rows_by_id[id]

    def reshape(self, id: int, body: VehicleType) -> None:
        """Replaces a vehicle's physics, mass, brakes and wheels; it goes on moving."""
        i = self.row(id)
        old = self.members[i].actor
        new = Newcomer(body, old.name, old.type, old.rgb)
        self._arrange([*self.members[:i], Member(id, new), *self.members[i + 1 :]])

    def _begin(self, members: list[Member]) -> None:
        """Builds the tables, arrays, fleet and bodies of these members anew."""
        self.members = members
        self._rows_by_id = {m.id: i for i, m in enumerate(members)}
        self.index = {m.actor.name: i for i, m in enumerate(members)}
        types = [b for m in members if isinstance(b := m.actor.body, VehicleType)]
        self.wheeled = len(types)
        self.table = table_of(members)
        self.rows = Rows.of(members, self.conditions.seed)
        self.states, self.commands, self.mu = self.rows.states, self.rows.commands, self.rows.mu
        self.grade, self.bank, self.placed = self.rows.grade, self.rows.bank, self.rows.placed
        self.fleet = Fleet(
            types,
            self.dt,
            states=self.states,
            stability=self.conditions.stability,
            cycling=self.conditions.anti_lock is AntiLock.WHEEL_SPEEDS,
            sensed=self.conditions.stability_control is StabilityControl.WHEEL_SPEEDS,
            roll_over=self.conditions.roll_over,
        )
        self.wheel_grip.begin(self.fleet)
        self.bodies = bodies_of(members)

    def _arrange(self, members: Sequence[Member]) -> None:
        """Makes new rows for these actors; those that were there go on from their old rows."""
        old, fleet, tyres = self.rows, self.fleet, self.wheel_grip.tyres
        was = self._rows_by_id
        self._begin(sorted(members, key=lambda m: not m.is_wheeled))
        kept = [(i, was[m.id]) for i, m in enumerate(self.members) if m.id in was]
        to, source = np.array(kept, dtype=np.intp).reshape(-1, 2).T
        self.rows.carry(old, to, source)
        to, source = to[to < self.wheeled], source[to < self.wheeled]
        for column, before in zip(self.fleet.wheels, fleet.wheels, strict=True):
            column[to] = before[source]
        self.fleet.mu[to] = fleet.mu[source]
        self.wheel_grip.carry(tyres, to, source)
        self.weigh()
        if self.traffic is not None:
            self.traffic.arrange(self.members, dict(kept))
        if self.book is not None:
            self.book.arrange({before: now for now, before in kept})
        self._outfit()

    def _outfit(self) -> None:
        """Makes the arrays of a step for the present actors."""
        n, traffic = len(self.members), self.traffic
        self.moved = np.zeros(n, dtype=np.bool_)
        self.on_wheels = self.wheel_grip.make_arrays(self.conditions.wakes)
        arena = Arena(
            self.rows,
            self.moved,
            self.on_wheels,
            self.bodies,
            np.zeros(n, dtype=np.bool_),
            self.obstacles.segments,
            self.touching,
            self.map.arrays,
            no_streets() if traffic is None else traffic.streets,
            drivers(n) if traffic is None else traffic.drivers,
            occupancy(0, n) if traffic is None else traffic.occupancy,
            self.markings,
            Rules(
                self.lights.by_row,
                CONTACT_LAW,
                traffic is not None and traffic.free_choice,
                CARELESS if traffic is None else traffic.care,
                self.conditions.road_noise,
                not self.conditions.all_lanes,
            ),
        )
        self.arena = hold(arena)

    def let_drive(self, traffic: Traffic) -> None:
        """Gives the actors drivers of this traffic from now on."""
        self.traffic = traffic
        if self.members:  # else the first ones to enter come to it
            self._arrange(self.members)

    # --- control from outside

    def change_streams(self, seed: int) -> None:
        """Draws what drivers choose from the streams of another seed from now on."""
        if self.traffic is not None:
            self.traffic.change_streams(seed)

    def lay(self, road: Road) -> None:
        """Sets what the weather does to the road from now on, in patches too."""
        self.wheel_grip.lay(road)
        if self.traffic is not None and self.traffic.sees_patches:
            n, patches = len(self.map.samples.x), self.wheel_grip.patches
            self.traffic.see_patches(np.ones(n) if patches is None else patches.lane_shares())

    def blow(self, speed: float, towards: float) -> None:
        """Sets the mean wind, in m/s and rad, from now on; nothing changes where wind pushes no vehicles."""
        if self.gusts is not None:
            self.gusts.wind = replace(self.gusts.wind, speed=speed, towards=towards)

    def stand_among(self, found: Obstacles) -> None:
        """Sets what stands beside the road from now on."""
        self.obstacles = found
        self._outfit()

    def command(self, id: int, c: VehicleCommand) -> None:
        """Sets pedals and steer of a vehicle from now on."""
        self._drive(self.row(id), c)

    def put(self, i: int, pose: Pose, v: float) -> None:
        """Puts the actor of row i at `pose`, present, moving along it with speed v."""
        s = self.states
        if i < self.wheeled:
            self.fleet.place(i, pose, v)
        else:
            s.x[i], s.y[i], s.z[i] = pose.x, pose.y, pose.z
            s.yaw[i] = wrap_angle(pose.yaw)
            s.vx[i], s.vy[i] = v * cos(pose.yaw), v * sin(pose.yaw)
            s.yaw_rate[i] = s.ax[i] = s.ay[i] = 0.0
            s.present[i] = True
        if i == EGO:
            forget(self.markings)

    def weigh(self) -> None:
        """Sets the inverse masses of the bodies; what is not simulated cannot be pushed."""
        for column, original in zip(self.bodies, bodies_of(self.members), strict=True):
            column[:] = original
        self.bodies.inverse_mass[~self.rows.simulated] = 0.0
        self.bodies.inverse_inertia[~self.rows.simulated] = 0.0

    def set_step(self, dt: float) -> None:
        """Sets the s by which one step advances from now on."""
        self.dt = dt
        self.fleet.set_step(dt)

    # --- time

    def step(self, words: Sequence[ActorCommand] = ()) -> None:
        """Advances the world by dt.

        words: what a scenario tells actors for this step; ConfigError for an unknown actor or a speed that
        is not finite.
        """
        self.tick += 1
        stages = MOVE | SETTLE
        if self.traffic is not None:
            stages |= DECIDE
        if words:
            if self.has_drivers:
                self._advance(DECIDE)
            stages &= ~DECIDE
            for word in words:
                self._obey(word)
        grip = self.wheel_grip
        if grip.patches is not None or grip.zones or grip.was_zoned:
            grip.feel(self.states, self.placed)
        if self.gusts is not None:
            self.air = self.gusts.advance(self.dt)
        self.events = StepEvents()
        lay = self.fleet.on_side() if self.conditions.roll_over else None
        if self.traffic is not None and self.tick % CHECK_PERIOD == 0:
            self._advance(stages & ~SETTLE)
            self._put_vehicles(self.traffic)
            stages = SETTLE
        self._advance(stages)
        if lay is not None:
            self.events.rolled = tuple(np.flatnonzero(self.fleet.on_side() & ~lay).tolist())
        if words:
            self.moved[:] = False
        self._end_step()

    def _end_step(self) -> None:
        """Notes which contacts of a step are new, and lets the lights go on."""
        if self.book is not None:
            book, touching, count = self.book, self.touching, self.touches
            found = book.update(self.tick, touching, count) if count else Touches()
            self.events.contacts, self.events.background = found
        self.lights.advance(self.dt)

    def pass_ticks(self, ticks: int) -> None:
        """Takes in that a kernel has made so many whole steps, lights included, in which nothing happened."""
        self.tick += ticks
        self.events = StepEvents()
        self.touches = 0

    def finish_step(self, touches: int, crossed: int, settled: bool) -> None:
        """Finishes a step that a kernel has begun, after its contacts and markings were found.

        settled: no actor waits for its place or is to be put elsewhere in this step.
        """
        self.pass_ticks(1)
        self._note_events(MOVE | SETTLE if settled else MOVE, touches, crossed)
        if not settled:
            if self.traffic is not None:
                self._put_vehicles(self.traffic)
            self._advance(SETTLE)
        self._end_step()

    @property
    def has_drivers(self) -> bool:
        """Whether any vehicle of the traffic drives itself."""
        return self.traffic is not None and bool(self.traffic.drivers.state["active"].any())

    def _advance(self, stages: int) -> None:
        """Runs the given stages of a step and stores their contacts and lane invasions."""
        step = advance_undriven if self.traffic is None else advance
        found = step(self.arena, stages, self.tick, self.dt, self.fleet.steps, *self.air)
        self._note_events(stages, *found)

    def _note_events(self, stages: int, touches: int, crossed: int) -> None:
        """Stores what the given stages of a step have found."""
        if stages & MOVE:
            self.touches = touches
        if stages & SETTLE:
            where = self.markings, self.map, self.placed
            self.events.invasions = invasions(*where, self.tick, crossed) if crossed else ()

    def feel_grip(self) -> None:
        """Writes the road's friction where all actors stand into `mu`, before the first step."""
        self.wheel_grip.feel(self.states, self.placed)
        feel_grip(self.rows, self.on_wheels)
        w = self.on_wheels
        self.mu[: self.wheeled] = w.road_mu * (w.tire_friction / TIRE_FRICTION_REFERENCE)

    def settle(self) -> None:
        """Finds the road under every actor, after some were moved between steps; that is no lane invasion."""
        self._advance(SETTLE)
        self.events.invasions = ()

    # --- questions

    def braking(self) -> NDArray[np.bool_]:
        """Returns the mask (n,) of the actors whose brake lamps are lit."""
        return self.commands[:, 1] > BRAKING

    def signs(self) -> RoadSigns:
        """Returns speed limit and governing traffic light of every actor."""
        return read_signs(self.map, self.placed)

    def _drive(self, i: int, c: VehicleCommand) -> None:
        """Writes the command of a vehicle into its row."""
        self.commands[i] = (c.throttle, c.brake, c.steer, c.handbrake, c.reverse)

    def _obey(self, word: ActorCommand) -> None:
        """Carries out the command of an actor: presence, pedals, then place.

        One that is kept back only begins to wait for room. ConfigError for an actor that the run lacks or a
        speed that is not finite.
        """
        i = self.index.get(word.actor)
        if i is None:
            raise ConfigError(f"there is no actor {word.actor!r} in this run")
        traffic, was_there = self.traffic, bool(self.states.present[i])
        if word.present and traffic is not None and traffic.call(self.members[i].id):
            return
        if word.present is not None:
            self.states.present[i] = word.present
        if word.command is not None:
            self._release(i)
            self._drive(i, word.command)
        if word.place is None:
            return
        speed = 0.0 if word.speed is None else word.speed
        if not isfinite(speed):
            raise ConfigError(f"actor {word.actor}: speed must be finite, got {speed!r}")
        self._release(i)
        yaw_before = float(self.states.yaw[i])
        v_before = float(np.hypot(self.states.vx[i], self.states.vy[i]))
        self.put(i, word.place, speed)
        self.moved[i] = True
        if not was_there:  # who appears has not turned or braked
            return
        self.states.yaw_rate[i] = wrap_angle(word.place.yaw - yaw_before) / self.dt
        self.states.ax[i] = (speed - v_before) / self.dt

    def _release(self, i: int) -> None:
        """Takes a vehicle out of the traffic's hands, where there is traffic."""
        if self.traffic is not None:
            self.traffic.release(i)

    def _put_vehicles(self, traffic: Traffic) -> None:
        """Puts traffic that enters, is respawned, or is put back as a wreck (decision M-7), and notes it."""
        events = self.events
        for move in traffic.moves(self.states, self.placed, self.tick):
            self.put(move.actor, move.pose, move.v)
            if move.reason is Reason.FAR:
                events.moved_on += (move.actor,)
            elif move.reason is Reason.WRECK:
                events.put_back += (move.actor,)
                where = f"({move.pose.x:.1f}, {move.pose.y:.1f})"
                what = "stood without a cause or off its lane and was put back at"
                events.notices += (f"{self.table.names[move.actor]} {what} {where}",)
