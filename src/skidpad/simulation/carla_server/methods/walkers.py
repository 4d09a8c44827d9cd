"""Walkers: control and bones."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.rpc import Shape, Table
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.walkers import WalkerControl

TABLE = Table("walkers")
NO_BONES = "walkers are boxes without bones"


def parse_control(value: Any) -> WalkerControl:
    """WalkerControl."""
    direction, speed, jump = wire.items(value, "walker control", 3)
    return WalkerControl(
        wire.iso_vector(direction, "walker control.direction"),
        wire.number(speed, "walker control.speed"),
        wire.flag(jump, "walker control.jump"),
    )


@TABLE.method("apply_control_to_walker", Shape.VOID)
def apply_control_to_walker(served: Served, id: Any, control: Any) -> None:
    """Held until the next one; jumping has no effect."""
    actor = served.episode.actors.get(id, Family.WALKER)
    new = parse_control(control)
    served.episode.walkers[actor.id] = new
    if actor.body is not None:
        served.episode.moving.walk(actor.body, *new.velocity())


@TABLE.method("get_bones_transform", without_effect=NO_BONES)
def get_bones_transform(served: Served, id: Any) -> list[Any]:
    """None."""
    served.episode.actors.get(id, Family.WALKER)
    return [[]]


@TABLE.method("set_bones_transform", Shape.VOID, without_effect=NO_BONES)
def set_bones_transform(served: Served, id: Any, bones: Any) -> None:
    """Accepted."""
    served.episode.actors.get(id, Family.WALKER)
    wire.items(bones, "bones")


@TABLE.method("blend_pose", Shape.VOID, without_effect=NO_BONES)
def blend_pose(served: Served, id: Any, blend: Any) -> None:
    """Accepted."""
    served.episode.actors.get(id, Family.WALKER)
    wire.number(blend, "blend")


@TABLE.method("get_pose_from_animation", Shape.VOID, without_effect=NO_BONES)
def get_pose_from_animation(served: Served, id: Any) -> None:
    """Accepted."""
    served.episode.actors.get(id, Family.WALKER)
