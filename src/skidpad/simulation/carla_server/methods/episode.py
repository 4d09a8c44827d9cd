"""Version, episode, settings, ticking, streams."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.episode import parse_settings
from skidpad.simulation.carla_server.rpc import CallError, Table
from skidpad.simulation.carla_server.world import World

VERSION = "0.9.16"
TABLE = Table("episode")


@TABLE.method("version")
def version(_: World) -> str:
    """The version whose protocol is spoken."""
    return VERSION


@TABLE.method("get_episode_info")
def get_episode_info(world: World) -> list[Any]:
    """Episode id and the token of the snapshots."""
    return [world.episode.id, [world.hub.episode_token()]]


@TABLE.method("get_sensor_token")
def get_sensor_token(world: World, stream: Any) -> list[bytes]:
    """The token of a stream, asked for before every subscription."""
    number = wire.integer(stream, "stream id", 0, 2**32 - 1)
    if not world.hub.exists(number):
        raise CallError(f"stream {number} not found")
    return [world.hub.token(number)]


@TABLE.method("get_episode_settings")
def get_episode_settings(world: World) -> list[Any]:
    """As last set."""
    return world.episode.settings.packed()


@TABLE.method("set_episode_settings")
def set_episode_settings(world: World, settings: Any) -> int:
    """From the next tick on; the current frame."""
    world.episode.settings = parse_settings(settings)
    world.vehicles.set_step(world.episode.settings.step)
    return world.episode.frame


@TABLE.method("tick_cue")
def tick_cue(world: World) -> int:
    """One tick in synchronous mode; in asynchronous mode the pacer ticks."""
    return world.tick() if world.episode.settings.synchronous else world.episode.frame


for _name in ("enable_sensor_for_ros", "disable_sensor_for_ros", "send"):

    @TABLE.method(_name, without_effect="there is no ROS publisher and no radio")
    def no_publisher(_: World, *__: Any) -> None:
        """Accepted."""


@TABLE.method("is_sensor_enabled_for_ros")
def is_sensor_enabled_for_ros(_: World, __: Any) -> bool:
    """Never."""
    return False
