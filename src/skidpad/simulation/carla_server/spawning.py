"""Making actors: from clients' descriptions, and those that every map brings along."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import SignalKind
from skidpad.simulation.carla_server import overlap, wire
from skidpad.simulation.carla_server.actors import Actor, Attachment
from skidpad.simulation.carla_server.catalogue import Blueprint, Family, chosen
from skidpad.simulation.carla_server.lights import BOX_DEPTH, BOX_HEIGHT
from skidpad.simulation.carla_server.rpc import CallError
from skidpad.simulation.carla_server.walkers import ground_height
from skidpad.simulation.carla_server.wire import Vector

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

COLLISION = "Spawn failed because of collision at spawn position"
SOLID = (Family.VEHICLE, Family.WALKER, Family.PROP)
NO_STREAM = ("sensor.other.lane_invasion",)  # computed in the client
SIGNS = {
    SignalKind.STOP: "traffic.stop",
    SignalKind.YIELD: "traffic.yield",
    SignalKind.SPEED_LIMIT: "traffic.speed_limit",
}
TOLERANCE = 0.02  # m by which boxes may overlap when spawning


def spawn(world: World, description: Any, pose: Pose) -> Actor:
    """A new actor where a client wants it; CallError when something stands there."""
    _, id, given = wire.items(description, "description", 3)
    blueprint = world.blueprint(wire.text(id, "description.id"))
    wanted = parse_attributes(given)
    attributes = chosen(blueprint, wanted)
    world.remarks.remark(blueprint, wanted)
    actor = Actor(world.actors.new_id(), blueprint, attributes, pose)
    _shape(actor)
    if blueprint.family in SOLID:
        _settle(world, actor)
        if blocked(world, actor):
            raise CallError(COLLISION)
    _enlist(world, actor)
    return actor


def spawn_attached(
    world: World, description: Any, mount: Pose, parent_id: Any, kind: Any, socket: str
) -> Actor:
    """A new actor that follows its parent; named sockets are not modelled (listed)."""
    del socket
    parent = world.actors.get(parent_id)
    _, id, given = wire.items(description, "description", 3)
    blueprint = world.blueprint(wire.text(id, "description.id"))
    wanted = parse_attributes(given)
    attributes = chosen(blueprint, wanted)
    world.remarks.remark(blueprint, wanted)
    if blueprint.family is Family.VEHICLE:
        raise CallError("a vehicle cannot be attached")
    attachment = Attachment(wire.integer(kind, "attachment type", 0, 2))
    actor = Actor(world.actors.new_id(), blueprint, attributes, mount)
    _shape(actor)
    world.attach(actor, parent, mount, attachment)
    _enlist(world, actor)
    return actor


def parse_attributes(given: Any) -> dict[str, str]:
    """Attribute values of an ActorDescription by name."""
    values = {}
    for entry in wire.items(given, "description.attributes"):
        name, _, value = wire.items(entry, "description.attribute", 3)
        values[wire.text(name, "attribute id", 256)] = wire.text(value, "attribute value")
    return values


def _shape(actor: Actor) -> None:
    """The box: vehicles and props stand on their origin, walkers have it in their middle."""
    length, width, height = actor.blueprint.size
    actor.half = (length / 2.0, width / 2.0, height / 2.0)
    if actor.family in (Family.VEHICLE, Family.PROP):
        actor.centre = (0.0, 0.0, height / 2.0)
    if actor.family is Family.TRIGGER:
        extent = [float(actor.attributes[f"extent_{axis}"]) / 100.0 for axis in "xyz"]
        actor.half = (extent[0], extent[1], extent[2])
        actor.extra = float(actor.attributes["friction"].rstrip("f"))


def _settle(world: World, actor: Actor) -> None:
    """What falls, stands on the ground at once when it was spawned close above or in it."""
    if actor.family is Family.PROP:
        return
    foot = actor.pose.z - (actor.half[2] if actor.family is Family.WALKER else 0.0)
    ground = ground_height(world, actor.pose.x, actor.pose.y, foot)
    lift = actor.half[2] if actor.family is Family.WALKER else 0.0
    actor.pose = replace(actor.pose, z=ground + lift, roll=0.0, pitch=0.0)


def world_box(world: World, actor: Actor) -> overlap.Box:
    """An actor's box in the world."""
    pose = world.pose(actor)
    x, y, z = actor.centre
    return replace(pose.moved(forward=x, left=y, up=z), yaw=pose.yaw + actor.box_yaw), actor.half


def blocked(world: World, actor: Actor) -> bool:
    """Whether a solid actor stands where this one shall."""
    x, y, z = actor.centre
    grown = max(0.0, actor.half[0] - TOLERANCE), max(0.0, actor.half[1] - TOLERANCE)
    half: Vector = (grown[0], grown[1], actor.half[2] - TOLERANCE)
    own = (actor.pose.moved(forward=x, left=y, up=z), half)
    reach = actor.half[0] + actor.half[1]
    for other in world.actors:
        if other.family not in SOLID or other is actor or other.parent:
            continue
        box = world_box(world, other)
        far = reach + box[1][0] + box[1][1]
        near = abs(box[0].x - own[0].x) < far and abs(box[0].y - own[0].y) < far
        if near and not overlap.apart(own, box):
            return True
    return False


def _enlist(world: World, actor: Actor) -> None:
    """Enter it in the tables of its family; a sensor that cannot work is refused first."""
    family = actor.family
    if family is Family.SENSOR:
        world.sensors.add(actor)
    world.add(actor)
    if family is Family.VEHICLE:
        world.vehicles.add(actor.id, actor.blueprint, actor.pose)
        world.refresh_for_new_vehicle()
    elif family is Family.WALKER:
        world.walkers.add(actor)
    elif family is Family.SENSOR:
        if actor.blueprint.id not in NO_STREAM:
            actor.stream = world.hub.create()
    elif family is Family.GRIP:
        world.sky.set_ice(float(actor.attributes["ice_thickness"]))


def spectator(world: World) -> Actor:
    """The free camera that every world has, above the first spawn point."""
    blueprint = Blueprint("spectator", Family.SPECTATOR, {})
    pose = world.map.spawn_points[0].moved(forward=-8.0, up=4.0)
    actor = Actor(world.actors.new_id(), blueprint, {"role_name": "spectator"}, pose)
    world.add(actor)
    return actor


def place_map_actors(world: World) -> None:
    """Traffic lights and signs of the map."""
    for light in world.lights.lights:
        blueprint = Blueprint(
            "traffic.traffic_light", Family.TRAFFIC_LIGHT, {}, label=SemanticClass.TRAFFIC_LIGHT
        )
        actor = Actor(world.actors.new_id(), blueprint, {"role_name": "default"}, light.pose)
        actor.half = (light.half_width, BOX_DEPTH, BOX_HEIGHT)
        actor.extra = light
        light.actor = actor.id
        world.add(actor)
        _map_row(world, actor, str(light.signal), light.pole)
    _signs(world)


def _signs(world: World) -> None:
    signals = world.map.roads.signals
    seen = set()
    for row in range(len(signals.id)):
        kind = SignalKind(int(signals.kind[row]))
        id = int(signals.id[row])
        if kind not in SIGNS or id in seen:
            continue
        seen.add(id)
        name = SIGNS[kind]
        if kind is SignalKind.SPEED_LIMIT and signals.value[row] == signals.value[row]:
            name = f"{name}.{round(float(signals.value[row]) * 3.6)}"
        blueprint = Blueprint(name, Family.TRAFFIC_SIGN, {}, label=SemanticClass.TRAFFIC_SIGN)
        x, y, z = float(signals.x[row]), float(signals.y[row]), float(signals.z[row])
        pose = Pose(x, y, z, yaw=float(signals.heading[row]))
        actor = Actor(world.actors.new_id(), blueprint, {"role_name": "default"}, pose)
        actor.half = (BOX_DEPTH, BOX_DEPTH, BOX_HEIGHT)
        world.add(actor)
        _map_row(world, actor, str(id), 0)


def _map_row(world: World, actor: Actor, sign: str, pole: int) -> None:
    row = world.rows.lights[actor.row]
    (x, y, z), (pitch, yaw, roll) = wire.transform(actor.pose)
    row["pose"] = (x, y, z, pitch, yaw, roll)
    row["sign"] = sign.encode()[:31]
    row["pole"] = pole
