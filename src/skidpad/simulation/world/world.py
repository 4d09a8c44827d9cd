"""The moving world of one run: vehicles, drivers, lights and contacts; no sensors.

The order within a step: commands, drivers, friction, vehicles, contacts, ground, lights, events.
Everything random comes from named streams of the seed.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from math import cos, isfinite, sin

import numpy as np

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.randomness import stream_key
from skidpad.core.setup import ActorCommand, Setup, TrafficSetup
from skidpad.core.states import ActorStates, ContactEvent, LaneInvasion, VehicleCommand
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.contact import CONTACT_LAW, Bodies, Contacts, bodies, resolve_contacts
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import fill_mu, friction_ratio, grip_params
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.actors import Cast, cast_of, place_of
from skidpad.simulation.world.ground import places_for, settle
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.obstacles import obstacles
from skidpad.simulation.world.patches import Patches
from skidpad.simulation.world.touch import ContactBook, MarkingWatch
from skidpad.simulation.world.traffic.manager import Traffic
from skidpad.simulation.world.traffic.network import Network, network

EGO = 0
BRAKING = 0.05  # pedal at which the brake lamps light up


@lru_cache(maxsize=8)
def network_of(map: RoadMap) -> Network:
    """The drivers' view of a map, made once per process."""
    return network(map.samples, map.lanes, map.signals)


class World:
    """Everything that changes during a run, built from a set-up and a seed."""

    def __init__(self, setup: Setup, seed: int) -> None:
        self.setup, self.dt, self.tick = setup, setup.dt, 0
        self.map = load_map(setup.map)
        self.cast = cast_of(self.map, setup, seed)
        self.table = self.cast.table
        n, wheeled = len(self.table), len(self.cast.vehicles)
        self.wheeled = wheeled
        self.states = ActorStates.empty(n)
        self.fleet = Fleet(self.cast.vehicles, self.dt, states=self.states)
        self.commands = np.zeros((n, 5))  # throttle, brake, steer, handbrake, reverse
        self.road_mu = np.zeros((wheeled, 4))
        self.mu = np.full((n, 4), np.nan)  # at the tyres; NaN where there is none
        self.grade, self.bank = np.zeros(n), np.zeros(n)
        self.placed = places_for(self.table.length, self.table.width)
        self.keys = np.array([stream_key(seed, "road noise", i) for i in range(n)], np.uint64)
        self.grip = grip_params(setup.weather, setup.grip, setup.mu_ref)
        self.patches = Patches(self.map, setup.patches, self.cast.vehicles)
        self.lights = Lights(self.map.signals, seed, self.dt, self.map.lanes)
        self.obstacles = obstacles(self.map)
        self.bodies = _bodies(self.cast)
        self.touching = Contacts.room()
        self.book = ContactBook(self.obstacles.names, self.dt)
        self.watch = MarkingWatch(self.map, self.table)
        self.index = {name: i for i, name in enumerate(self.table.names)}
        self.contacts: tuple[ContactEvent, ...] = ()
        self.invasions: tuple[LaneInvasion, ...] = ()
        self.notices: tuple[str, ...] = ()
        types = [*self.cast.vehicles, *(None for _ in self.cast.shapes)]
        traffic = setup.traffic or TrafficSetup(vehicles=0)
        ratio = friction_ratio(setup.weather, setup.grip)
        net = network_of(self.map)
        walkers = np.flatnonzero(self.table.kind == ActorKind.PEDESTRIAN)
        self.traffic = Traffic(self.map, net, types, traffic, seed, self.dt, ratio, walkers)
        self._place_all()

    def step(self, command: VehicleCommand, actor_commands: Iterable[ActorCommand]) -> None:
        """Advance by dt."""
        self.tick += 1
        self.traffic.decide(self.placed, self.lights.by_row, self.tick, self.commands)
        self._drive(EGO, command)
        moved = [self._obey(c) for c in actor_commands]
        wheeled = self.wheeled
        active = self.states.present[:wheeled]
        if moved:
            active = active.copy()
            active[[i for i in moved if 0 <= i < wheeled]] = False
        fill_mu(self.grip, self.fleet.states.vx, self.fleet.states.vy, self.road_mu)
        self.patches.apply(self.states, self.road_mu)
        grade, bank = self.grade[:wheeled], self.bank[:wheeled]
        self.fleet.step(self.commands[:wheeled], self.road_mu, grade, bank, active)
        self.mu[:wheeled] = self.fleet.mu
        self._glide(moved)
        count = resolve_contacts(
            self.states, self.bodies, self.obstacles.segments, CONTACT_LAW, self.dt, self.touching
        )
        self.contacts = self.book.update(self.tick, self.touching, count) if count else ()
        self._put_vehicles()
        self._settle()
        self.lights.update(self.tick)
        self.invasions = self.watch.update(self.tick, self.placed)

    def put(self, i: int, pose: Pose, v: float) -> None:
        """Actor i stands at `pose` and moves along it with speed v."""
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
            self.watch.forget()

    def relocate(self, pose: Pose, v: float) -> None:
        """Put the ego somewhere else between two steps."""
        self.put(EGO, pose, v)
        self._settle()
        self.watch.update(self.tick, self.placed)

    def braking(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """(n,) whose brake lamps are lit."""
        return self.commands[:, 1] > BRAKING

    def _place_all(self) -> None:
        for i, actor in enumerate(self.cast.actors):
            if self.cast.late[i]:
                self.traffic.await_room(i, self.cast.factors[i])
                continue
            self.put(i, place_of(self.map, actor.place), actor.speed)
        self._settle()
        self.watch.update(self.tick, self.placed)
        for i, actor in enumerate(self.cast.actors):
            if i == EGO or self.cast.late[i] or actor.driver != "autopilot":
                continue
            if i >= self.wheeled:
                raise ConfigError(f"{actor.name}: a {actor.type} has no autopilot")
            place = self.placed[i]
            if place["lane"] < 0:
                raise ConfigError(f"{actor.name} has an autopilot but stands on no driving lane")
            self.traffic.engage(i, int(place["lane"]), float(place["s"]), self.cast.factors[i])
        fill_mu(self.grip, self.fleet.states.vx, self.fleet.states.vy, self.road_mu)
        self.patches.apply(self.states, self.road_mu)
        self.mu[: self.wheeled] = self.road_mu

    def _drive(self, i: int, c: VehicleCommand) -> None:
        self.commands[i] = (c.throttle, c.brake, c.steer, c.handbrake, c.reverse)

    def _obey(self, word: ActorCommand) -> int:
        """Follow a player's word; returns the row that was placed, else -1."""
        i = self.index.get(word.actor)
        if i is None:
            raise ConfigError(f"there is no actor {word.actor!r} in this run")
        if word.present is not None:
            self.states.present[i] = word.present
        if word.command is not None:
            self.traffic.release(i)
            self._drive(i, word.command)
        if word.place is None:
            return -1
        speed = 0.0 if word.speed is None else word.speed
        if not isfinite(speed):
            raise ConfigError(f"actor {word.actor}: speed must be finite, got {speed!r}")
        self.traffic.release(i)
        yaw_before = float(self.states.yaw[i])
        v_before = float(np.hypot(self.states.vx[i], self.states.vy[i]))
        self.put(i, word.place, speed)
        self.states.yaw_rate[i] = wrap_angle(word.place.yaw - yaw_before) / self.dt
        self.states.ax[i] = (speed - v_before) / self.dt
        return i

    def _glide(self, placed: list[int]) -> None:
        """Bodies without wheels that nobody placed keep their velocity."""
        s = self.states
        for i in range(self.wheeled, len(self.table)):
            if s.present[i] and i not in placed:
                s.x[i] += s.vx[i] * self.dt
                s.y[i] += s.vy[i] * self.dt
                s.yaw[i] = wrap_angle(float(s.yaw[i] + s.yaw_rate[i] * self.dt))

    def _put_vehicles(self) -> None:
        """Traffic that enters, is respawned, or is put back as a wreck (decision M-7)."""
        notes = []
        for move in self.traffic.moves(self.states, self.tick):
            self.put(move.actor, move.pose, move.v)
            if move.wreck:
                notes.append(
                    f"{self.table.names[move.actor]} stood without a cause or off its lane and was "
                    f"put back at ({move.pose.x:.1f}, {move.pose.y:.1f})"
                )
        self.notices = tuple(notes)

    def _settle(self) -> None:
        settle(
            self.map.arrays,
            self.states,
            self.placed,
            self.grade,
            self.bank,
            self.keys,
            self.tick,
        )


def _bodies(cast: Cast) -> Bodies:
    """Masses and inertias; a body without wheels turns like a box of its size."""
    t, types, shapes = cast.table, cast.vehicles, cast.shapes
    return bodies(
        t.length,
        t.width,
        t.height,
        np.array([v.mass for v in types] + [s.mass for s in shapes]),
        np.array(
            [v.yaw_inertia for v in types]
            + [s.mass * (s.length**2 + s.width**2) / 12.0 for s in shapes]
        ),
        np.array([v.x_cog for v in types] + [0.0 for _ in shapes]),
    )
