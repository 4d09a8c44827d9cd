"""Blueprints and actors: spawn, find, destroy, boxes, names of parts."""

from __future__ import annotations

from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.rpc import CallError, Table
from skidpad.simulation.carla_server.spawning import spawn, spawn_attached
from skidpad.simulation.carla_server.world import World

TABLE = Table("actors")


def packed(world: World, actor: Actor) -> list[Any]:
    """An actor as it travels, with its token when it is a sensor."""
    token = b"" if actor.stream is None else world.hub.token(actor.stream)
    return actor.packed(token)


@TABLE.method("get_actor_definitions")
def get_actor_definitions(world: World) -> list[Any]:
    """The whole catalogue."""
    return [b.packed(uid) for uid, b in enumerate(world.catalogue.values(), start=1)]


@TABLE.method("get_spectator")
def get_spectator(world: World) -> list[Any]:
    """The free camera."""
    return packed(world, world.spectator)


@TABLE.method("get_actors_by_id")
def get_actors_by_id(world: World, ids: Any) -> list[Any]:
    """Those that live, or are remembered, of these ids."""
    found = (world.actors.find(id) for id in wire.items(ids, "ids"))
    return [packed(world, actor) for actor in found if actor is not None]


@TABLE.method("spawn_actor")
def spawn_actor(world: World, description: Any, transform: Any) -> list[Any]:
    """A new actor."""
    return packed(world, spawn(world, description, wire.pose(transform, "transform")))


@TABLE.method("spawn_actor_with_parent")
def spawn_actor_with_parent(
    world: World, description: Any, transform: Any, parent: Any, kind: Any, socket: Any = ""
) -> list[Any]:
    """A new actor that follows another."""
    mount = wire.pose(transform, "transform")
    name = wire.text(socket, "socket")
    return packed(world, spawn_attached(world, description, mount, parent, kind, name))


@TABLE.method("destroy_actor")
def destroy_actor(world: World, id: Any) -> bool:
    """False when there is no such actor; the client wants a truth value, not an error."""
    try:
        world.destroy(wire.integer(id, "actor id"))
    except CallError:
        return False
    return True


@TABLE.method("get_actor_bounding_box")
def get_actor_bounding_box(world: World, id: Any) -> list[Any]:
    """Of the living and the dead: an error would abort a client's Traffic Manager."""
    actor = world.actors.find(id)
    return wire.box((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) if actor is None else actor.box()


@TABLE.method("get_traffic_sign_trigger_volume")
def get_traffic_sign_trigger_volume(world: World, id: Any) -> list[Any]:
    """The box in front of a light or sign."""
    return get_actor_bounding_box(world, id)


def _named_parts(what: str) -> None:
    """Bodies have one part, the root; bones and sockets there are none."""
    names = ["root"] if what == "component" else []

    @TABLE.method(f"get_actor_{what}_names")
    def part_names(world: World, id: Any) -> list[str]:
        """Names of parts."""
        world.actors.get(id)
        return names

    if what == "component":

        @TABLE.method("get_actor_component_world_transform")
        def component_world(world: World, id: Any, name: Any) -> list[Any]:
            """Where the root is."""
            wire.text(name, "component")
            return wire.transform(world.pose(world.actors.get(id)))

        @TABLE.method("get_actor_component_relative_transform")
        def component_relative(world: World, id: Any, name: Any) -> list[Any]:
            """The root, seen from itself."""
            world.actors.get(id)
            wire.text(name, "component")
            return wire.transform(Pose(0.0, 0.0))

        return

    for seen_from in ("world", "relative"):

        @TABLE.method(f"get_actor_{what}_{seen_from}_transforms")
        def part_transforms(world: World, id: Any) -> list[Any]:
            """There are none."""
            world.actors.get(id)
            return []


for _what in ("component", "bone", "socket"):
    _named_parts(_what)


@TABLE.method("get_vehicle_bone_world_transforms")
def get_vehicle_bone_world_transforms(world: World, id: Any) -> list[Any]:
    """There are none."""
    world.actors.get(id)
    return []
