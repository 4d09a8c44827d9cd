"""What CARLA's clients call, as bytes on the wire and as calls, for tests that damage it."""

from __future__ import annotations

import json
import logging
import random
from functools import cache
from pathlib import Path
from typing import Any

import msgpack

from support.faults.more_readers import asked
from support.faults.plain_mutation import exchange
from support.faults.readers import Reader

NOBODY_SENDS = 2**64  # msgpack has no larger integers
PLACE = [[60.0, -2.0, 0.5], [0.0, 0.0, 0.0]]
CAR, WALKER, CAMERA, LIGHT = (
    "the car",
    "the walker",
    "the camera",
    "the light",
)  # ids, when they are known


def described(id: str, **attributes: str) -> list[Any]:
    """An ActorDescription."""
    return [1, id, [[name, 0, value] for name, value in attributes.items()]]


def session() -> list[list[list[Any]]]:
    """Calls as a client makes them, in groups of which one is damaged at a time."""
    force, control = [100.0, 20.0, -5.0], [0.5, 0.1, 0.0, False, False, False, 1]
    spawn = [
        0,
        [described("vehicle.audi.tt"), [[90.0, -2.0, 0.5], [0.0, 9.0, 0.0]], [False], 0, "", []],
    ]
    batch = [
        [spawn],
        [[6, [CAR, PLACE]]],
        [[2, [CAR, control]]],
        [[21, [LIGHT, 2]]],
        [[1, [WALKER]]],
    ]
    return [
        [["apply_control_to_vehicle", CAR, control], ["tick_cue"]],
        [["apply_ackermann_control_to_vehicle", CAR, [0.1, 0.0, 8.0, 1.0, 0.5]], ["tick_cue"],
         ["apply_ackermann_controller_settings", CAR, [0.15, 0.0, 0.25, 0.01, 0.0, 0.01]]],
        [["set_actor_transform", CAR, PLACE], ["set_actor_location", WALKER, PLACE[0]], ["tick_cue"]],
        [["set_actor_target_velocity", CAR, force], ["set_actor_target_angular_velocity", CAR, force]],
        [["add_actor_impulse", CAR, force], ["add_actor_force_at_location", CAR, force, PLACE[0]],
         ["add_actor_torque", CAR, force], ["add_actor_angular_impulse", CAR, force], ["tick_cue"]],
        [["enable_actor_constant_velocity", CAR, force], ["set_actor_simulate_physics", CAR, True],
         ["set_actor_enable_gravity", WALKER, False], ["set_actor_collisions", CAR, False]],
        [["apply_control_to_walker", WALKER, [[1.0, 0.0, 0.0], 1.4, False]], ["tick_cue"],
         ["set_walker_state", WALKER, PLACE, 1.2], ["blend_pose", WALKER, 0.5]],
        [["set_vehicle_light_state", CAR, [3]], ["get_telemetry_data", CAR],
         ["get_wheel_steer_angle", CAR, 1]],
        [["set_traffic_light_state", LIGHT, 1], ["set_traffic_light_green_time", LIGHT, 3.0],
         ["freeze_traffic_light", LIGHT, True], ["get_group_traffic_lights", LIGHT]],
        [["spawn_actor", described("vehicle.tesla.model3", color="1,2,3"), [[120.0, -2.0, 1.0], [0.0] * 3]],
         ["spawn_actor_with_parent", described("sensor.other.imu", sensor_tick="0.1"), PLACE, CAR, 0, ""]],
        [["apply_batch", batch, True]],
        [["cast_ray", [60.0, 0.0, 9.0], [90.0, 0.0, -9.0]], ["project_point", PLACE[0], force, 50.0]],
        [["get_actors_by_id", [CAR, WALKER, 9]], ["get_actor_bounding_box", CAR], ["destroy_actor", CAMERA]],
        [["get_actor_component_world_transform", CAR, "root"], ["get_bones_transform", WALKER]],
    ]  # fmt: skip


@cache
def own_words() -> list[list[list[Any]]]:
    """What the server says of itself, given back to it: physics, weather, settings."""
    world = renewed()
    ids = actors_of(world)
    asked_for = {"get_physics_control": (ids[CAR],)}
    asked_for |= dict.fromkeys(("get_weather_parameters", "get_episode_settings"), ())
    said = {name: _answered(call(world, name, *a)) for name, a in asked_for.items()}
    return [
        [["apply_physics_control", CAR, said["get_physics_control"]], ["tick_cue"], ["tick_cue"]],
        [["set_weather_parameters", said["get_weather_parameters"]], ["tick_cue"]],
        [["set_episode_settings", said["get_episode_settings"]], ["tick_cue"]],
    ]


def _answered(data: bytes) -> Any:
    """What the server said, out of its wrapping."""
    return msgpack.unpackb(data)[3][0][1]


@cache
def sessions() -> list[bytes]:
    """Each group of calls as msgpack, one message after the other."""
    groups = session() + own_words()
    return [
        packed([[0, k, call[0], [[False], *call[1:]]] for k, call in enumerate(g)]) for g in groups
    ]


def packed(messages: list[Any]) -> bytes:
    return b"".join(msgpack.packb(m, unicode_errors="surrogatepass", default=str) for m in messages)


def other_arguments(rng: random.Random, data: bytes) -> bytes:
    """The same calls with other values in their arguments."""
    messages = json.loads(as_text(data))
    arguments = [message[3][1:] for message in messages]
    exchange(rng, arguments)
    sent = zip(messages, arguments, strict=False)
    return packed([_sendable([*m[:3], [m[3][0], *_listed(values)]]) for m, values in sent])


@cache
def as_text(data: bytes) -> str:
    unpacker = msgpack.Unpacker()
    unpacker.feed(data)
    return json.dumps(list(unpacker))


def _listed(values: Any) -> list[Any]:
    return values if isinstance(values, list) else [values]


def _sendable(value: Any) -> Any:
    if isinstance(value, list):
        return [_sendable(v) for v in value]
    if isinstance(value, dict):
        return {k: _sendable(v) for k, v in value.items()}
    too_large = isinstance(value, int) and not -(2**63) <= value < NOBODY_SENDS
    return float(value) if too_large else value


# --- the server


def renewed() -> Any:
    """The world as it was at its beginning."""
    world = served()
    world.load("", reset_settings=True)
    return world


@cache
def served() -> Any:
    from skidpad.simulation.carla_server.options import ServerOptions
    from skidpad.simulation.carla_server.protocol.streams import StreamHub
    from skidpad.simulation.carla_server.served import Served

    logging.getLogger("skidpad.carla_server").setLevel(logging.CRITICAL)
    return Served(ServerOptions(map="figure8"), StreamHub())


def call(world: Any, name: str, *arguments: Any) -> bytes:
    from skidpad.simulation.carla_server.protocol.codec import Request

    return dispatcher(world).answer(Request(1, name, list(arguments), True))


def dispatcher(world: Any) -> Any:
    from skidpad.simulation.carla_server.methods import TABLES
    from skidpad.simulation.carla_server.protocol.rpc import Dispatcher

    return Dispatcher(world, TABLES)


def actors_of(world: Any) -> dict[str, int]:
    from skidpad.simulation.carla_server.actors.catalogue import Family
    from skidpad.simulation.carla_server.actors.registry import Attachment
    from skidpad.simulation.carla_server.episode import Wanted

    episode = world.episode
    first, second = episode.map.spawn_points[:2]
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), first)
    walker = episode.spawn(Wanted("walker.pedestrian.0001", {}), second)
    camera = episode.attach(Wanted("sensor.other.gnss", {}), first, car.id, next(iter(Attachment)))
    light = next(a.id for a in episode.actors if a.family is Family.TRAFFIC_LIGHT)
    return {CAR: car.id, WALKER: walker.id, CAMERA: camera.id, LIGHT: light}


def answer_calls(path: Path) -> object:
    """Each call is answered, none by an internal error, and the world goes on."""
    from skidpad.simulation.carla_server.protocol.codec import Decoder, Request

    world = renewed()
    ids = actors_of(world)
    answers = dispatcher(world)
    for asked_for in Decoder().feed(path.read_bytes()):
        given = _with_ids(asked_for.arguments, ids)
        said = answers.answer(Request(asked_for.msgid, asked_for.method, given, True))
        assert b"internal error" not in said, (asked_for.method, said[:300])
    for _ in range(2):
        world.tick()
    return ids


def _with_ids(value: Any, ids: dict[str, int]) -> Any:
    if isinstance(value, list):
        return [_with_ids(v, ids) for v in value]
    return ids.get(value, value) if isinstance(value, str) else value


def decode_calls(path: Path) -> object:
    from skidpad.simulation.carla_server.protocol.codec import Decoder

    return list(Decoder().feed(path.read_bytes()))


READERS = {
    "wire": Reader("calls.bin", sessions, asked(decode_calls)),
    "calls": Reader("calls.bin", sessions, asked(answer_calls), (other_arguments,)),
}
