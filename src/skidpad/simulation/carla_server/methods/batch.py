"""Batches: many commands in one call, each with its own outcome."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from skidpad.core.errors import SkidpadError
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.methods import actors, lights, motion, vehicles, walkers
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import Shape, Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("batch")
MAX_DEPTH = 4  # of spawn commands inside `do_after`
Command = Callable[..., Any]


def _destroy(served: Served, id: Any) -> None:
    """Destroys the actor of that id; raises CallError where there is none."""
    served.episode.destroy(served.episode.actors.get(id).id)


def _nothing(_: Served, *__: Any) -> None:
    """Does nothing: the Traffic Manager lives in the client, and nothing is drawn."""


# Variant index of the command, and what it does with the command's members; 0, spawning, is apart.
COMMANDS: dict[int, Command] = {
    1: _destroy,
    2: vehicles.apply_control_to_vehicle,
    3: vehicles.apply_ackermann_control_to_vehicle,
    4: walkers.apply_control_to_walker,
    5: vehicles.apply_physics_control,
    6: motion.set_actor_transform,
    7: motion.set_walker_state,
    8: motion.set_actor_target_velocity,
    9: motion.set_actor_target_angular_velocity,
    10: motion.add_actor_impulse,
    11: motion.add_actor_force,
    12: motion.add_actor_angular_impulse,
    13: motion.add_actor_torque,
    14: motion.set_actor_simulate_physics,
    15: motion.set_actor_enable_gravity,
    16: _nothing,  # SetAutopilot
    17: _nothing,  # ShowDebugTelemetry
    18: vehicles.set_vehicle_light_state,
    19: motion.set_actor_location,
    20: _nothing,  # ConsoleCommand
    21: lights.set_traffic_light_state,
}
SPAWN = 0


@TABLE.method("apply_batch", Shape.PLAIN)
def apply_batch(served: Served, commands: Any, do_tick: Any) -> list[Any]:
    """Applies the commands in order; returns for each its actor's id or its error, as on the wire.

    do_tick: ticks once afterwards, in synchronous mode only.
    """
    outcomes = [_outcome(served, c) for c in wire.items(commands, "commands")]
    if wire.flag(do_tick, "do_tick") and served.clock.settings.synchronous:
        served.tick()
    return outcomes


def _outcome(served: Served, command: Any) -> list[Any]:
    """Carries out one command of a batch and returns its result, or its error text, as on the wire."""
    try:
        (variant,) = wire.items(command, "command", 1)
        return [[1, run(served, variant)]]
    except SkidpadError as error:
        return [[0, [str(error)]]]


def run(served: Served, variant: Any) -> int:
    """Runs one command and returns the actor id that it is about, 0 when there is none.

    WireError or CallError where it cannot be done.
    """
    _check(variant)
    return _run(served, *variant)


def _check(variant: Any, depth: int = 0) -> None:
    """Raises WireError unless this is a command, and so is each that follows a spawning one.

    depth: of spawn commands around it, up to MAX_DEPTH.
    """
    index, body = wire.items(variant, "command", 2)
    number = wire.integer(index, "command", 0, max(COMMANDS))
    members = wire.items(body, "command body")
    if number != SPAWN:
        return
    if len(members) != 6 or depth > MAX_DEPTH:
        raise wire.WireError("a spawn command has six members and is nested at most four deep")
    for command in wire.items(members[5], "do_after"):
        _check(wire.items(command, "command", 1)[0], depth + 1)


def _run(served: Served, number: int, members: list[Any]) -> int:
    """Runs one checked command and returns the id of its actor, or 0."""
    if number == SPAWN:
        return _spawn(served, members)
    try:
        COMMANDS[number](served, *members)
    except TypeError as error:
        raise wire.WireError(f"command {number} has a wrong number of members") from error
    id = members[0] if members else 0
    return id if isinstance(id, int) else 0


def _attachment(kind: Any) -> Attachment:
    """Returns the attachment, RIGID for any other value.

    The client's spawn command leaves this member unset unless told, so chance values arrive.
    """
    return Attachment(kind) if kind in tuple(Attachment) else Attachment.RIGID


def _spawn(served: Served, members: list[Any]) -> int:
    """Spawns an actor, runs the commands that follow for it, and returns its id.

    One of those that cannot be done is skipped, as CARLA's server drops what they answer.
    """
    description, transform, parent, kind, socket, after = members
    wanted, pose = actors.parse_description(description), wire.pose(transform, "transform")
    parent_id = wire.optional(parent, "parent")
    if parent_id is None:
        actor = served.episode.spawn(wanted, pose)
    else:
        wire.text(socket, "socket")
        actor = served.episode.attach(wanted, pose, parent_id, _attachment(kind))
    for ((index, own),) in after:
        if index == SPAWN:
            own = [*own[:2], wire.some(actor.id), *own[3:]]
        elif own:
            own = [actor.id, *own[1:]]
        with suppress(SkidpadError):
            _run(served, index, own)
    return actor.id
