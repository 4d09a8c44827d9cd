"""Version, episode, settings, ticking, streams."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.clock import parse_settings
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.sensing.gbuffers import (
    ColourCamera,
    Texture,
    stream_of,
)
from skidpad.simulation.carla_server.sensing.sensor import Sensor
from skidpad.simulation.carla_server.sensing.v2x import Station
from skidpad.simulation.carla_server.served import Served

VERSION = "0.9.16"
TABLE = Table("episode")


@TABLE.method("version")
def version(_: Served) -> str:
    """Returns the version whose protocol is spoken."""
    return VERSION


@TABLE.method("get_episode_info")
def get_episode_info(served: Served) -> list[Any]:
    """Returns the episode's id and a token of the snapshots."""
    return [served.clock.episode, [served.hub.episode_token()]]


@TABLE.method("get_sensor_token")
def get_sensor_token(served: Served, stream: Any) -> list[bytes]:
    """Returns the token of a stream, asked for before every subscription; ticks wait for that.

    CallError for an unknown stream.
    """
    number = wire.integer(stream, "stream id", 0, 2**32 - 1)
    if not served.hub.exists(number):
        raise CallError(f"stream {number} not found")
    served.announce(number)
    return [served.hub.token(number)]


def _colour_camera(served: Served, id: Any) -> Sensor:
    """Returns the RGB camera of that id; raises CallError for any other actor."""
    actor = served.episode.actors.get(id, Family.SENSOR)
    sensor = served.episode.sensors.of(actor.id)
    if sensor is None or not isinstance(sensor.equipment, ColourCamera):
        raise CallError(f"actor {actor.id} has no G-buffers: it is no sensor.camera.rgb")
    return sensor


@TABLE.method("get_gbuffer_token")
def get_gbuffer_token(served: Served, id: Any, texture: Any) -> bytes:
    """Returns the token of a texture's stream, asked for before each subscription and each end of one."""
    sensor = _colour_camera(served, id)
    number = wire.integer(texture, "G-buffer", 0, max(Texture))
    stream = stream_of(sensor, number, served.hub)
    if not served.hub.has_listeners(stream):
        served.announce(stream)
    return served.hub.token(stream)


@TABLE.method("enable_gbuffers", Shape.VOID)
def enable_gbuffers(served: Served, id: Any, enabled: Any) -> None:
    """Sets whether a colour camera sends G-buffers to its listeners."""
    _colour_camera(served, id).equipment.gbuffers = wire.flag(enabled, "enabled")


@TABLE.method("are_gbuffers_enabled")
def are_gbuffers_enabled(served: Served, id: Any) -> bool:
    """Tells whether a colour camera sends G-buffers."""
    return bool(_colour_camera(served, id).equipment.gbuffers)


@TABLE.method("console_command", without_effect="there is no console")
def console_command(_: Served, *__: Any) -> bool:
    """Returns True for any command and does nothing, as there is no console."""
    return True


@TABLE.method("get_episode_settings")
def get_episode_settings(served: Served) -> list[Any]:
    """Returns the episode settings as last set."""
    return served.clock.settings.pack()


@TABLE.method("set_episode_settings")
def set_episode_settings(served: Served, settings: Any) -> int:
    """Sets what holds from the next tick on; returns the number of the current frame.

    WireError for settings out of range.
    """
    served.apply(parse_settings(settings))
    return served.clock.frame


@TABLE.method("tick_cue")
def tick_cue(served: Served) -> int:
    """Ticks once in synchronous mode, and returns the new frame; in asynchronous mode the pacer ticks.

    Right after a batch that destroyed sensors which were stopped just before, it returns the frame
    before the tick. The 0.9.16 client holds Python's lock in `apply_batch_sync(commands, True)` while
    it waits for the snapshot of the returned frame, and its threads that could read the snapshot wait
    for that lock to release the callbacks of the stopped sensors. With the older frame it waits for
    nothing.
    """
    before = served.clock.frame
    if not served.clock.settings.synchronous:
        return before
    frame = served.tick()
    return before if served.follows_batch and served.hub.is_client_cleaning_up() else frame


@TABLE.method("enable_sensor_for_ros")
def enable_sensor_for_ros(served: Served, stream: Any) -> None:
    """Publishes a sensor's readings on ROS 2 topics, where the server was started with --ros-domain."""
    number, actors = wire.integer(stream, "stream"), served.episode.actors
    found = next((a for a in actors.of(Family.SENSOR) if a.stream == number), None)
    if served.ros is not None and found is not None:
        served.ros.enable(found, actors.carrier(found))


@TABLE.method("disable_sensor_for_ros")
def disable_sensor_for_ros(served: Served, stream: Any) -> None:
    """Ends what a sensor publishes on ROS 2 topics, if it does."""
    number = wire.integer(stream, "stream")
    if served.ros is not None:
        served.ros.disable(number)


@TABLE.method("is_sensor_enabled_for_ros")
def is_sensor_enabled_for_ros(served: Served, stream: Any) -> bool:
    """Returns whether a sensor publishes on ROS 2 topics."""
    number = wire.integer(stream, "stream")
    return served.ros is not None and served.ros.is_enabled(number)


@TABLE.method("send", Shape.VOID)
def send(served: Served, id: Any, message: Any) -> None:
    """Queues a text that a sensor of clients' own messages radios in the next tick.

    CallError for any other actor.
    """
    actor = served.episode.actors.get(id, Family.SENSOR)
    sensor = served.episode.sensors.of(actor.id)
    if sensor is None or not isinstance(sensor.equipment, Station):
        raise CallError(f"actor {actor.id} has no radio")
    sensor.equipment.queue.append(wire.text(message, "message").encode())
