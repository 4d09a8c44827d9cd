"""Blueprints and actors: spawn, find, destroy, boxes, names of parts."""

from __future__ import annotations

from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.registry import Actor, Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("actors")


def pack_actor(served: Served, actor: Actor) -> list[Any]:
    """Returns an actor as CARLA's wire sends it, with its token when it is a sensor."""
    token = b"" if actor.stream is None else served.hub.token(actor.stream)
    return actor.pack(token)


def parse_description(value: Any) -> Wanted:
    """Returns blueprint id and attributes of a call's ActorDescription; WireError for another shape."""
    _, id, given = wire.items(value, "description", 3)
    values = {}
    for entry in wire.items(given, "description.attributes"):
        name, _, text = wire.items(entry, "description.attribute", 3)
        values[wire.text(name, "attribute id", 256)] = wire.text(text, "attribute value")
    return Wanted(wire.text(id, "description.id"), values)


@TABLE.method("get_actor_definitions")
def get_actor_definitions(served: Served) -> list[Any]:
    """Returns the definitions of all blueprints."""
    return [b.pack() for b in served.stock.catalogue.values()]


@TABLE.method("get_spectator")
def get_spectator(served: Served) -> list[Any]:
    """Returns the spectator, CARLA's free camera."""
    return pack_actor(served, served.episode.spectator)


@TABLE.method("get_actors_by_id")
def get_actors_by_id(served: Served, ids: Any) -> list[Any]:
    """Returns those of these ids that live or are remembered; unknown ids are left out."""
    found = (served.episode.actors.find(id) for id in wire.items(ids, "ids"))
    return [pack_actor(served, actor) for actor in found if actor is not None]


@TABLE.method("spawn_actor")
def spawn_actor(served: Served, description: Any, transform: Any) -> list[Any]:
    """Spawns an actor and returns it as the wire sends it; CallError when something stands there."""
    pose = wire.pose(transform, "transform")
    return pack_actor(served, served.episode.spawn(parse_description(description), pose))


@TABLE.method("spawn_actor_with_parent")
def spawn_actor_with_parent(
    served: Served, description: Any, transform: Any, parent: Any, kind: Any, socket: Any = ""
) -> list[Any]:
    """Spawns an actor that follows another and returns it; the socket has no effect."""
    wire.text(socket, "socket")  # not modelled (listed)
    mount = wire.pose(transform, "transform")
    attachment = Attachment(wire.integer(kind, "attachment type", 0, max(Attachment)))
    wanted = parse_description(description)
    return pack_actor(served, served.episode.attach(wanted, mount, parent, attachment))


@TABLE.method("destroy_actor")
def destroy_actor(served: Served, id: Any) -> bool:
    """Destroys an actor; returns False when there is none or it cannot be destroyed.

    The client wants a truth value, not an error.
    """
    try:
        served.episode.destroy(wire.integer(id, "actor id"))
    except CallError:
        return False
    return True


@TABLE.method("get_actor_bounding_box")
def get_actor_bounding_box(served: Served, id: Any) -> list[Any]:
    """Returns the box of a living or dead actor; one of no size for an unknown id.

    An error would abort a client's Traffic Manager.
    """
    actor = served.episode.actors.find(id)
    return wire.box((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) if actor is None else actor.box()


@TABLE.method("get_traffic_sign_trigger_volume")
def get_traffic_sign_trigger_volume(served: Served, id: Any) -> list[Any]:
    """Returns the box in front of a light or sign, as of any actor."""
    return get_actor_bounding_box(served, id)


COMPONENT = "root"  # the one component of every actor


@TABLE.method("get_actor_component_names")
def get_actor_component_names(served: Served, id: Any) -> list[str]:
    """Returns the names of an actor's components: the root alone."""
    served.episode.actors.get(id)
    return [COMPONENT]


def _require_component(name: Any) -> None:
    """Raises CallError where the name is not that of the one component of an actor."""
    if wire.text(name, "component") != COMPONENT:
        raise CallError(
            f"Component could not be found in this actor: {name!r}; there is {COMPONENT!r}"
        )


@TABLE.method("get_actor_component_world_transform")
def get_actor_component_world_transform(served: Served, id: Any, name: Any) -> list[Any]:
    """Returns where the root is; CallError for a component that there is not."""
    actor = served.episode.actors.get(id)
    _require_component(name)
    return wire.transform(served.episode.actors.pose(actor))


@TABLE.method("get_actor_component_relative_transform")
def get_actor_component_relative_transform(served: Served, id: Any, name: Any) -> list[Any]:
    """Returns the root seen from itself; CallError for a component that there is not."""
    served.episode.actors.get(id)
    _require_component(name)
    return wire.transform(Pose(0.0, 0.0))


for _seen_from in ("names", "world_transforms", "relative_transforms"):

    @TABLE.method(f"get_actor_socket_{_seen_from}")
    def sockets(served: Served, id: Any) -> list[Any]:
        """Returns nothing: no actor has sockets."""
        served.episode.actors.get(id)
        return []


@TABLE.method("get_vehicle_bone_world_transforms")
def get_vehicle_bone_world_transforms(served: Served, id: Any) -> list[Any]:
    """Returns an empty list, as vehicles have no bones here."""
    served.episode.actors.get(id)
    return []
