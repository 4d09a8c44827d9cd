"""A world of a CARLA server, for the programs here that are clients of the `carla` wheel."""

from __future__ import annotations

import queue
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import carla

from skidpad.simulation.carla_server.process import ServerProcess

DT = 0.05  # s of a tick
PATIENCE_S = 120.0  # with a call
HIGH = 2.0  # m above the middle of the car at which sensors are put


class ServedWorld(NamedTuple):
    """A world, and the process that serves it."""

    world: Any
    server: ServerProcess


@contextmanager
def served(name: str, options: Sequence[str] = ()) -> Iterator[ServedWorld]:
    """The world of a map, loaded and synchronous, on a server of its own; options: of the server."""
    with ServerProcess(["--idle-exit", "600", *options]) as server:
        client = carla.Client("127.0.0.1", server.port)
        client.set_timeout(PATIENCE_S)
        yield ServedWorld(loaded(client, name), server)


def loaded(client: Any, name: str) -> Any:
    """The world of a map after a client has loaded it, synchronous by ticks of DT."""
    world = client.load_world(name)
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, DT
    world.apply_settings(settings)
    return world


def listening(
    world: Any, car: Any, kind: str, options: Mapping[str, str], yaw_deg: float = 0.0
) -> tuple[Any, queue.Queue[Any]]:
    """A fresh sensor on a car, and where its readings come. yaw_deg: of CARLA, to the right."""
    blueprint = world.get_blueprint_library().find(f"sensor.{kind}")
    for name, value in options.items():
        blueprint.set_attribute(name, value)
    place = carla.Transform(carla.Location(z=HIGH), carla.Rotation(yaw=yaw_deg))
    sensor = world.spawn_actor(blueprint, place, attach_to=car)
    came: queue.Queue[Any] = queue.Queue()
    sensor.listen(came.put)
    return sensor, came


def spread(client: Any, world: Any, pattern: str, seed: int, number: int) -> list[Any]:
    """Vehicles at spawn points that are spread over the map, of the blueprints of a pattern in turns."""
    blueprints = sorted(world.get_blueprint_library().filter(pattern), key=lambda b: b.id)
    points = world.get_map().get_spawn_points()
    apart = max(1, len(points) // number)
    commands = [
        carla.command.SpawnActor(
            blueprints[(seed + i) % len(blueprints)], points[(7 * seed + i * apart) % len(points)]
        )
        for i in range(number)
    ]
    answers = client.apply_batch_sync(commands, True)
    return list(world.get_actors([a.actor_id for a in answers if not a.error]))


def hear_collisions(world: Any, cars: list[Any], heard: Any) -> list[Any]:
    """A collision sensor on each car, whose events go to `heard`."""
    blueprint = world.get_blueprint_library().find("sensor.other.collision")
    sensors = [world.spawn_actor(blueprint, carla.Transform(), attach_to=car) for car in cars]
    for sensor in sensors:
        sensor.listen(heard)
    return sensors
