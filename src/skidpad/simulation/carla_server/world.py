"""The served world: everything that a tick moves, and the order in which it moves.

The bridge between clients' calls and the houses roads, physics and sensors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import GripModel
from skidpad.sensors.live_scene import scene_of
from skidpad.simulation.carla_server import moving, snapshot, wire
from skidpad.simulation.carla_server.actors import Actor, ActorTable, Attachment
from skidpad.simulation.carla_server.catalogue import (
    GRIP_BLUEPRINT,
    MU_REF,
    Blueprint,
    Family,
    grip_in_force,
    load_catalogue,
)
from skidpad.simulation.carla_server.debug import DebugShapes
from skidpad.simulation.carla_server.effects import Remarks
from skidpad.simulation.carla_server.episode import Episode
from skidpad.simulation.carla_server.ground import Ground, feel
from skidpad.simulation.carla_server.lights import LightControl
from skidpad.simulation.carla_server.maps import MapStore, ServedMap
from skidpad.simulation.carla_server.recorder import Recorder
from skidpad.simulation.carla_server.replayer import Replayer
from skidpad.simulation.carla_server.road_grip import RoadGrip
from skidpad.simulation.carla_server.rpc import CallError
from skidpad.simulation.carla_server.sensing import SensorSet
from skidpad.simulation.carla_server.snapshot import Rows
from skidpad.simulation.carla_server.spawning import place_map_actors, spectator
from skidpad.simulation.carla_server.streams import EPISODE_STREAM, StreamHub
from skidpad.simulation.carla_server.touching import Contacts
from skidpad.simulation.carla_server.vehicles import Vehicles
from skidpad.simulation.carla_server.walkers import Walkers
from skidpad.simulation.carla_server.weather import Sky


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerOptions:
    """How the server was started (decision K-3)."""

    host: str = "127.0.0.1"
    port: int = 2000  # 0: any free pair
    map: str = "figure8"
    maps: Path | None = None
    weather_grip: GripModel = GripModel.PHYSICAL
    ice: float = 0.0  # percent of 20 mm
    mu_ref: float = MU_REF
    seed: int = 0
    strict: bool = False
    record_calls: Path | None = None
    data_dir: Path | None = None
    idle_exit: float | None = None  # s without a client


@dataclass(slots=True)
class TrafficManagers:
    """Addresses at which clients' Traffic Managers said that they listen."""

    by_port: dict[int, str] = field(default_factory=dict)


class World:
    """One simulated world with its actors."""

    def __init__(self, options: ServerOptions, hub: StreamHub) -> None:
        self.options = options
        self.hub = hub
        self.maps = MapStore(options.maps)
        self.catalogue = _offered(options.weather_grip, options.mu_ref)
        self.episode = Episode()
        self.sky = Sky(options.ice)
        self.actors = ActorTable()
        self.rows = Rows()
        self.vehicles = Vehicles()
        self.walkers = Walkers()
        self.grip = RoadGrip(options.weather_grip, options.mu_ref)
        self.debug = DebugShapes()
        self.recorder = Recorder(options.data_dir)
        self.replayer = Replayer()
        self.managers = TrafficManagers()
        self.sensors = SensorSet(options.seed)
        self.contacts = Contacts()
        self.remarks = Remarks()
        self.ground = Ground.of(0)
        self.last_snapshot: bytes | None = None
        self.platform_time: Callable[[], float] = lambda: 0.0
        self.lights_changed = False
        hub.on_subscribe = self._latest
        self._begin(self.maps.load(options.map))

    def _latest(self, stream: int) -> bytes | None:
        """A second client in synchronous mode gets the newest snapshot at once."""
        return self.last_snapshot if stream == EPISODE_STREAM else None

    def load(self, name: str, reset_settings: bool) -> None:
        """Another map, or with "" the same one anew."""
        served = self.map if name == "" else self.maps.load(name)
        self.hub.hold(EPISODE_STREAM)
        self.replayer.release(self)
        scene_of(served.roads)  # triangles now, not in the first picture's tick
        for actor in list(self.actors):
            if actor.stream is not None:
                self.hub.close(actor.stream)
        self.actors.clear()
        self.rows = Rows()
        self.vehicles.clear()
        self.walkers = Walkers()
        self.sensors.clear()
        self.contacts = Contacts()
        self.debug.clear()
        self.sky = Sky(self.options.ice)
        self.episode.renew(reset_settings)
        self._begin(served)

    def _begin(self, served: ServedMap) -> None:
        self.map = served
        served.prepare()
        self.lights = LightControl(served.roads)
        self.ground = Ground.of(0)
        self.contacts.begin(served.roads)
        place_map_actors(self)
        self.spectator = spectator(self)
        self.vehicles.set_step(self.episode.settings.step)
        self._publish_snapshot()

    def pose(self, actor: Actor) -> Pose:
        """Where an actor is."""
        if actor.family is Family.VEHICLE and actor.id in self.vehicles.slots:
            return self.vehicles.pose(actor.id)
        return actor.pose

    def add(self, actor: Actor) -> None:
        """Enter an actor and give it a row of the snapshot."""
        self.actors.add(actor)
        actor.row = self.rows.add(actor.id)

    def attach(self, actor: Actor, parent: Actor, mount: Pose, kind: Attachment) -> None:
        """Let an actor follow its parent from now on."""
        if kind not in Attachment:
            raise wire.WireError(f"unknown attachment type {kind}")
        actor.parent, actor.mount = parent.id, mount
        actor.pose = self.pose(parent) @ mount

    def destroy(self, id: int) -> Actor:
        """Take an actor and what is attached to it out of the world."""
        actor = self.actors.get(id)
        if actor is self.spectator or actor.family in (Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN):
            raise CallError(f"actor {id} belongs to the map and cannot be destroyed")
        for child in list(actor.children):
            if child in self.actors.alive:
                self.destroy(child)
        actor.pose = self.pose(actor)
        if actor.family is Family.VEHICLE:
            self.vehicles.remove(id)
            self.ground = Ground.of(len(self.vehicles))
        self.walkers.forget(id)
        self.sensors.forget(id)
        if actor.stream is not None:
            self.hub.close(actor.stream)
        if actor.family is Family.GRIP:
            self.sky.set_ice(None)
        self.actors.remove(id)
        self.rows.remove(actor.row)
        order = self.rows.order()
        for other in self.actors:
            other.row = order[other.id]
        return actor

    def refresh_for_new_vehicle(self) -> None:
        """Let the road tell about a vehicle before its first tick."""
        self.ground = Ground.of(len(self.vehicles))
        self.refresh_ground()
        np.copyto(self.vehicles.fleet.states.z, self.ground.z)

    def tick(self) -> int:
        """Advance by one step; the frame that is now the newest."""
        self.episode.advance()
        step = self.episode.settings.step
        self.vehicles.set_step(step)
        self.lights_changed = self.lights.advance(step) or self.lights_changed
        self._drive()
        self.walkers.step(self, step)
        self.replayer.tick(self, step)
        moving.follow(self)
        self.debug.age(step)
        self._publish_snapshot()
        self.recorder.tick(self)
        self.sensors.produce(self)
        return self.episode.frame

    def _drive(self) -> None:
        """Vehicles: road, grip, physics, contacts."""
        vehicles = self.vehicles
        n = len(vehicles)
        if n == 0:
            self.contacts.events = []
            return
        if len(self.ground.lane) != n:
            self.ground = Ground.of(n)
            self.refresh_ground()
        mu = self.grip.per_wheel(self)
        vehicles.step(mu, self.ground.grade, self.ground.bank)
        self.contacts.resolve(self, self.episode.settings.step)
        self.refresh_ground()
        simulated = np.array([v.simulated for v in vehicles.members], dtype=np.bool_)
        np.copyto(vehicles.fleet.states.z, self.ground.z, where=simulated)

    def refresh_ground(self) -> None:
        """Ask the roads about every vehicle's place."""
        types = self.vehicles.fleet.types
        half = np.array([t.length / 2.0 for t in types])
        feel(self.map.roads, self.vehicles.fleet.states, half, self.ground)
        for i, vehicle in enumerate(self.vehicles.members):
            limit = self.ground.limit[i]
            if limit == limit:
                vehicle.speed_limit = float(limit)

    def _publish_snapshot(self) -> None:
        bits = 0
        if self.episode.map_changed:
            bits |= snapshot.MAP_CHANGED
        if self.lights_changed:
            bits |= snapshot.LIGHTS_CHANGED
        moving.fill_rows(self)
        self.last_snapshot = snapshot.message(self.episode, self.rows, self.platform_time(), bits)
        if self.hub.wanted(EPISODE_STREAM):
            self.hub.publish(EPISODE_STREAM, self.last_snapshot)
            self.episode.map_changed = False
        self.lights_changed = False

    def blueprint(self, id: str) -> Blueprint:
        """The blueprint of that id; CallError when it is not offered."""
        blueprint = self.catalogue.get(id)
        if blueprint is None:
            raise CallError(f"unknown blueprint {id!r:.80}")
        return blueprint


def _offered(grip: GripModel, mu_ref: float) -> dict[str, Blueprint]:
    """The catalogue; the blueprint `skidpad.weather` says how weather acts on grip (K-2)."""
    everything = load_catalogue()
    if grip is GripModel.NONE:
        return {id: b for id, b in everything.items() if b.family is not Family.GRIP}
    told = grip_in_force(everything[GRIP_BLUEPRINT], grip, mu_ref)
    return {**everything, GRIP_BLUEPRINT: told}
