"""Walkers: control and bones."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.actors.bones import Skeleton, parse_bones
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.actors.walkers import WalkerControl
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.world.interventions import walk

TABLE = Table("walkers")


def parse_control(value: Any) -> WalkerControl:
    """Returns a call's checked `WalkerControl`, in ISO axes."""
    direction, speed, jump = wire.items(value, "walker control", 3)
    return WalkerControl(
        wire.iso_vector(direction, "walker control.direction"),
        wire.number(speed, "walker control.speed"),
        wire.flag(jump, "walker control.jump"),
    )


@TABLE.method("apply_control_to_walker", Shape.VOID)
def apply_control_to_walker(served: Served, id: Any, control: Any) -> None:
    """Sets a walker's control, held until the next one; jumping has no effect."""
    actor = served.episode.actors.get(id, Family.WALKER)
    new = parse_control(control)
    served.episode.walkers[actor.id] = new
    if actor.body is not None:
        walk(served.episode.moving, actor.body, *new.velocity())


def _skeleton(served: Served, id: Any) -> tuple[Actor, Skeleton]:
    """Returns the pedestrian of that id and its skeleton, made on first use."""
    actor = served.episode.actors.get(id, Family.WALKER)
    return actor, served.episode.skeletons.setdefault(actor.id, Skeleton())


def _bone_rows(served: Served, id: Any) -> list[list[Any]]:
    """Returns the bones of a walker, parents first; CallError for an actor without a skeleton."""
    if served.episode.actors.get(id).family is not Family.WALKER:
        raise CallError(f"Component could not be found in this actor: {id} has no skeleton")
    actor, skeleton = _skeleton(served, id)
    return skeleton.list_transforms(served.episode.actors.pose(actor), 2.0 * actor.half[2])


@TABLE.method("get_actor_bone_names")
def get_actor_bone_names(served: Served, id: Any) -> list[str]:
    """Returns the names of a walker's bones, in the order of their transforms."""
    return [row[0] for row in _bone_rows(served, id)]


@TABLE.method("get_actor_bone_world_transforms")
def get_actor_bone_world_transforms(served: Served, id: Any) -> list[Any]:
    """Returns where a walker's bones are in the world."""
    return [row[1] for row in _bone_rows(served, id)]


@TABLE.method("get_actor_bone_relative_transforms")
def get_actor_bone_relative_transforms(served: Served, id: Any) -> list[Any]:
    """Returns where a walker's bones are, seen from the walker (CARLA's component space)."""
    return [row[2] for row in _bone_rows(served, id)]


@TABLE.method("get_bones_transform")
def get_bones_transform(served: Served, id: Any) -> list[Any]:
    """Returns name and transforms of all bones of a walker."""
    return [_bone_rows(served, id)]


@TABLE.method("set_bones_transform", Shape.VOID)
def set_bones_transform(served: Served, id: Any, bones: Any) -> None:
    """Sets the bones of a walker's pose, which shows by the share that is blended in."""
    _skeleton(served, id)[1].set_bones(parse_bones(bones))


@TABLE.method("blend_pose", Shape.VOID)
def blend_pose(served: Served, id: Any, blend: Any) -> None:
    """Sets how much of the client's pose shows, cut to 0 to 1."""
    _skeleton(served, id)[1].blend = min(max(wire.number(blend, "blend"), 0.0), 1.0)


@TABLE.method("get_pose_from_animation", Shape.VOID)
def get_pose_from_animation(served: Served, id: Any) -> None:
    """Drops the bones that a client has set: its pose is the animation's."""
    _skeleton(served, id)[1].take()
