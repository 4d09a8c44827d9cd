"""The recorder's calls; replaying is not served."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("recorder")
NO_REPLAY = "recordings cannot be replayed yet"


@TABLE.method("start_recorder")
def start_recorder(world: World, name: Any, additional: Any = False) -> str:
    """Begin; needs --data-dir."""
    wire.flag(additional, "additional_data")
    return world.recorder.start(wire.text(name, "file name"), world)


@TABLE.method("stop_recorder", Shape.VOID)
def stop_recorder(world: World) -> None:
    """End."""
    world.recorder.stop()


@TABLE.method("show_recorder_file_info")
def show_recorder_file_info(world: World, name: Any, show_all: Any = False) -> str:
    """A summary."""
    wire.flag(show_all, "show_all")
    return world.recorder.summary(wire.text(name, "file name"))


@TABLE.method("show_recorder_collisions")
def show_recorder_collisions(world: World, name: Any, a: Any, b: Any) -> str:
    """Contacts in a recording; the type filters have no effect."""
    del a, b
    return world.recorder.collisions(wire.text(name, "file name"))


@TABLE.method("show_recorder_actors_blocked")
def show_recorder_actors_blocked(world: World, name: Any, seconds: Any, metres: Any) -> str:
    """Not evaluated."""
    wire.number(seconds, "min_time")
    wire.number(metres, "min_distance")
    return world.recorder.summary(wire.text(name, "file name"))


@TABLE.method("replay_file")
def replay_file(_: World, name: Any, *__: Any) -> str:
    """Not served."""
    raise CallError(f"{wire.text(name, 'file name', 200)}: {NO_REPLAY}")


for _name in (
    "stop_replayer",
    "set_replayer_time_factor",
    "set_replayer_ignore_hero",
    "set_replayer_ignore_spectator",
):

    @TABLE.method(_name, Shape.VOID, without_effect=NO_REPLAY)
    def no_replay(_: World, value: Any) -> None:
        """Accepted."""
        del value
