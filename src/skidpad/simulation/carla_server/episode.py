"""An episode: a map and everything on it since it was loaded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.physics.grip import Road
from skidpad.roads.queries import RoadMap
from skidpad.sensors.raster.live_scene import scene_of
from skidpad.simulation.carla_server import filling
from skidpad.simulation.carla_server.actors import shapes
from skidpad.simulation.carla_server.actors.bones import Skeleton
from skidpad.simulation.carla_server.actors.catalogue import (
    Blueprint,
    Family,
    choose_attributes,
    make_catalogue,
)
from skidpad.simulation.carla_server.actors.effects import Remarks
from skidpad.simulation.carla_server.actors.map_actors import (
    light_actor,
    sign_actor,
    signs_of,
    spectator,
)
from skidpad.simulation.carla_server.actors.posts import Posts, posts_of
from skidpad.simulation.carla_server.actors.registry import SOLID, Actor, ActorTable, Attachment
from skidpad.simulation.carla_server.actors.walkers import WalkerControl
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.debug_shapes import DebugShapes
from skidpad.simulation.carla_server.maps.landscape import ALL_LAYERS, Landscape
from skidpad.simulation.carla_server.maps.maps import ServedMap
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.sensing.producers import PRODUCERS
from skidpad.simulation.carla_server.sensing.sensors import SensorSet
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings
from skidpad.simulation.carla_server.snapshot import Rows
from skidpad.simulation.carla_server.vehicles.falling import DROP, Falling, ground_below
from skidpad.simulation.carla_server.vehicles.giving_way import GivingWay
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicles
from skidpad.simulation.carla_server.weather import Sky
from skidpad.simulation.world.conditions import Conditions
from skidpad.simulation.world.ground import ground_height
from skidpad.simulation.world.interventions import (
    set_collides,
    set_grounded,
    set_simulated,
    teleport,
)
from skidpad.simulation.world.lights import Lights
from skidpad.simulation.world.obstacles import obstacles
from skidpad.simulation.world.patches import FrictionZone, Patches
from skidpad.simulation.world.surface_files import read_surface
from skidpad.simulation.world.world import World

COLLISION = "Spawn failed because of collision at spawn position"
NO_STREAM = ("sensor.other.lane_invasion",)  # computed in the client


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a client wants to spawn: a blueprint's id and the attributes that it gave."""

    blueprint: str
    attributes: Mapping[str, str]


class Stock:
    """What outlives episodes and every one of them draws on."""

    def __init__(self, options: ServerOptions, hub: StreamHub) -> None:
        self.options, self.hub = options, hub
        self.catalogue = make_catalogue(options.weather_grip, options.mu_ref)
        self.remarks = Remarks()
        self.ids: Iterator[int] = count(1)  # of actors
        self._surface = () if options.surface is None else read_surface(options.surface)
        self._first_map = ""  # its hash

    def blueprint(self, id: str) -> Blueprint:
        """The blueprint of that id; CallError when it is not offered."""
        blueprint = self.catalogue.get(id)
        if blueprint is None:
            raise CallError(f"unknown blueprint {id!r:.80}")
        return blueprint

    def sky(self) -> Sky:
        """The weather as the server was started."""
        o = self.options
        return Sky(o.ice, o.weather_grip, o.mu_ref)

    def patches_on(self, roads: RoadMap, road: Road) -> Patches | None:
        """Returns what the server's surface lays on a map: all on the first map, nothing on others.

        road: without it. ConfigError where it does not fit the first map.
        """
        self._first_map = self._first_map or roads.content_hash
        if not self._surface or roads.content_hash != self._first_map:
            return None
        try:
            return Patches(roads, self._surface, road)
        except ConfigError as error:
            raise ConfigError(f"{self.options.surface}: {error}") from None


class Episode:
    """The moving world of one map with its actors."""

    def __init__(
        self, map: ServedMap, stock: Stock, clock: Clock, layers: int = ALL_LAYERS
    ) -> None:
        """Makes everything that takes long, so that a failure leaves the old episode."""
        self.map, self.stock = map, stock
        map.prepare()
        self.landscape = Landscape(map.roads, map.has_layers, layers)
        scene_of(self.landscape.roads)  # triangles now, not in the first picture's tick
        self.sky = stock.sky()
        seed = stock.options.seed
        conditions = Conditions(
            seed=seed, dt=clock.step, grip=self.sky.grip, road_noise=0.0, all_lanes=True
        )
        self.moving = World(map.roads, Lights(map.roads, arms=True), conditions)
        self.moving.wheel_grip.lay_patches(stock.patches_on(map.roads, self.sky.road))
        self.actors = ActorTable(self.moving, stock.ids)
        self.rows = Rows()
        self.vehicles = Vehicles(self.moving)
        self.falling = Falling(self.moving, map.roads, self.actors, self.vehicles)
        self.walkers: dict[int, WalkerControl] = {}
        self.skeletons: dict[int, Skeleton] = {}  # of walkers whose bones were asked for
        self.debug = DebugShapes()
        self.posts = Posts(self.moving.lights)
        self.giving_way = GivingWay(map.roads)
        self.surroundings = Surroundings(
            map,
            self.landscape,
            self.actors,
            self.vehicles,
            self.sky,
            clock,
            stock.options.bodywork,
            stock.options.quality,
        )
        self.relandscape()
        self.sensors = SensorSet(PRODUCERS, seed)
        self._place_map_actors()
        self.spectator = spectator(self.actors.new_id(), map.spawn_points[0])
        self._enter(self.spectator)

    def _place_map_actors(self) -> None:
        """Adds an actor for each traffic light and sign of the map."""
        roads = self.map.roads
        for post in posts_of(roads, self.moving.lights):
            actor = light_actor(self.actors.new_id(), post)
            self.posts.add(actor.id, post)
            self._enter(actor)
            filling.fill_sign(self.rows, actor, str(post.light.signal), post.pole)
        for sign in signs_of(roads):
            actor = sign_actor(self.actors.new_id(), sign)
            self._enter(actor)
            filling.fill_sign(self.rows, actor, str(sign.signal), 0)

    # --- coming and going

    def spawn(self, wanted: Wanted, pose: Pose) -> Actor:
        """A new actor where a client wants it; CallError when something stands there."""
        actor = self._make_actor(wanted, pose)
        feet = self._feet(actor) if actor.family in SOLID else pose
        if actor.family in SOLID:
            if shapes.is_taken(self.moving, feet, actor.half):
                raise CallError(COLLISION)
            self._embody(actor, feet)
        self._enlist(actor)
        self.falling.start_fall_at_entry(actor, feet.z)
        return actor

    def attach(self, wanted: Wanted, mount: Pose, parent: int, kind: Attachment) -> Actor:
        """A new actor that follows its parent; all attachments are rigid (listed)."""
        del kind
        carrier = self.actors.get(parent)
        actor = self._make_actor(wanted, mount)
        if actor.family is Family.VEHICLE:
            raise CallError("a vehicle cannot be attached")
        actor.parent, actor.mount = carrier.id, mount
        actor.pose = self.actors.pose(carrier) @ mount
        self._enlist(actor)
        return actor

    def destroy(self, id: int) -> Actor:
        """Take an actor and what is attached to it out of the world."""
        actor = self.actors.get(id)
        if actor is self.spectator or actor.family in (Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN):
            raise CallError(f"actor {id} belongs to the map and cannot be destroyed")
        for child in list(actor.children):
            if child in self.actors.alive:
                self.destroy(child)
        body = actor.body
        self.actors.remove(id)
        if id in self.vehicles:
            self.vehicles.remove(id)
        if body is not None:
            self.moving.remove(body)
        self.falling.forget(id)
        self.walkers.pop(id, None)
        self.skeletons.pop(id, None)
        self._hush(actor)
        if actor.family is Family.GRIP:
            self.sky.set_ice(None)
        elif actor.family is Family.TRIGGER:
            self._mark_zones()
        self.rows.remove(actor.row)
        order = self.rows.order()
        for other in self.actors:
            other.row = order[other.id]
        return actor

    def end(self) -> None:
        """Closes the streams of all sensors: clients get no more of their messages."""
        for actor in self.actors:
            self._hush(actor)

    def _hush(self, actor: Actor) -> None:
        """Closes the streams of an actor and of its sensor textures."""
        for stream in (actor.stream, *self.sensors.forget(actor.id)):
            if stream is not None:
                self.stock.hub.close(stream)

    def _make_actor(self, wanted: Wanted, pose: Pose) -> Actor:
        """Returns a new actor of the wanted blueprint and attributes at the pose, with its box."""
        blueprint = self.stock.blueprint(wanted.blueprint)
        attributes = choose_attributes(blueprint, wanted.attributes)
        self.stock.remarks.remark(blueprint, wanted.attributes)
        actor = Actor(self.actors.new_id(), blueprint, attributes, pose)
        shapes.give_box(actor)
        return actor

    def _feet(self, actor: Actor) -> Pose:
        """Where it stands: what is a little above the ground, stands on it at once."""
        feet = replace(actor.pose, z=actor.pose.z - actor.lift)
        if actor.family is Family.PROP:
            return feet
        ground = ground_below(self.map.roads, feet.x, feet.y, feet.z)
        if ground is None:
            ground = ground_height(self.map.roads, feet.x, feet.y, feet.z)
        if feet.z - ground > DROP:
            return feet
        return replace(feet, z=ground, roll=0.0, pitch=0.0)

    def _embody(self, actor: Actor, feet: Pose) -> None:
        """Gives the actor a body in the moving world, with its feet at the pose `feet`."""
        if actor.family is Family.VEHICLE:
            vehicle = self.vehicles.add(actor.id, actor.blueprint, feet)
            vehicle.sticky = actor.attributes["sticky_control"].lower() == "true"
            actor.body = vehicle.body
            return
        (body,) = self.moving.enter([shapes.body_of(actor)])
        actor.body = body
        set_grounded(self.moving, body, actor.family is Family.WALKER)
        set_collides(self.moving, body, not shapes.is_flat(actor))
        self.moving.put(self.moving.row(body), feet, 0.0)
        teleport(self.moving, body, feet)
        self.moving.settle()

    def _enlist(self, actor: Actor) -> None:
        """Enter it in the tables of its family; a sensor that cannot work is refused first."""
        family = actor.family
        if family is Family.SENSOR:
            self.sensors.add(actor)
            if actor.blueprint.id not in NO_STREAM:
                actor.stream = self.stock.hub.create()
        self._enter(actor)
        if family is Family.WALKER:
            self.walkers[actor.id] = WalkerControl()
        elif family is Family.GRIP:
            self.sky.set_ice(float(actor.attributes["ice_thickness"]))
        elif family is Family.TRIGGER:
            self._mark_zones()

    def _enter(self, actor: Actor) -> None:
        """Adds an actor to the registry and gives it a row of the snapshot."""
        self.actors.add(actor)
        actor.row = self.rows.add(actor.id)

    def _mark_zones(self) -> None:
        """Friction triggers act on every tyre inside, where they are now."""
        self.moving.wheel_grip.zones = [
            FrictionZone(t.pose, t.half, float(t.attributes["friction"]))
            for t in self.actors.of(Family.TRIGGER)
        ]

    # --- moving

    def place(self, actor: Actor, pose: Pose) -> None:
        """Places an actor; a child is placed relative to where its parent then is."""
        if actor.parent:
            actor.mount = pose
        elif actor.body is None:
            actor.pose = pose
            if actor.family is Family.TRIGGER:
                self._mark_zones()
        else:
            teleport(self.moving, actor.body, replace(pose, z=pose.z - actor.lift))
            self.falling.start_fall(actor)

    def simulate(self, actor: Actor, on: bool) -> None:
        """Switches an actor's physics; off, it stays where clients put it."""
        if actor.body is not None and actor.family is not Family.PROP:
            set_simulated(self.moving, actor.body, on)
            set_grounded(self.moving, actor.body, on)
            self.falling.start_fall(actor)

    def relandscape(self) -> None:
        """Vehicles meet what is there at present."""
        self.moving.stand_among(obstacles(self.landscape.roads))

    def move(self, dt: float) -> None:
        """Moves all vehicles and walkers by one tick; attached actors move later, in `follow`.

        dt: s, must be the step that is set in `moving`, by which the world advances.
        """
        self._feel_weather()
        self.vehicles.command(dt)
        self.moving.step()
        self.falling.tick(dt)

    def _feel_weather(self) -> None:
        """Lets the weather act on the road, and on what the server's surface lays there."""
        grip = self.moving.wheel_grip
        if grip.patches is None:
            grip.set_for_all(self.sky.grip)
        elif grip.road is not self.sky.road:
            self.moving.lay(self.sky.road)

    def follow(self) -> None:
        """Moves each attached actor to its mount on its parent."""
        moved = False  # whether a trigger did
        for actor in self.actors:
            carrier = self.actors.carrier(actor) if actor.parent else None
            if carrier is not None:
                actor.pose = self.actors.pose(carrier) @ actor.mount
                moved |= actor.family is Family.TRIGGER
        if moved:
            self._mark_zones()

    def fill_rows(self, dt: float) -> None:
        """The snapshot's columns as of now, dt s after the last time."""
        red = self.giving_way.shown_red(self.vehicles, dt)
        filling.fill_vehicles(self.rows, self.actors, self.vehicles, self.posts, red)
        filling.fill_lights(self.rows, self.actors, self.posts)
        for actor in self.actors:
            if actor.family not in filling.BY_COLUMNS:
                filling.fill_actor(self.rows, self.actors, actor)
        for id, control in self.walkers.items():
            filling.fill_walker(self.rows, self.actors, self.actors.alive[id], control, dt)
