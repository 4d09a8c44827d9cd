"""One leg of tools/soak_server.py: a process of its own, since the wheel can abort its process."""

from __future__ import annotations

import os
import sys
import time

import carla

from carla_world import PATIENCE_S, loaded

BEAT = 200  # ticks between signs of life


def main(port: int, tm_port: int, seed: int, ticks: int, cars: int, name: str, only: str) -> None:
    """Load the map, let the Traffic Manager drive, say how it goes."""
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(PATIENCE_S)
    world = loaded(client, name)
    manager = client.get_trafficmanager(tm_port)
    manager.set_synchronous_mode(True)
    manager.set_random_device_seed(seed)
    spawned = _spawn(client, world, tm_port, seed, cars, only)
    slowest = 0.0
    for k in range(1, ticks + 1):
        before = time.monotonic()
        world.tick(PATIENCE_S)
        slowest = max(slowest, time.monotonic() - before)
        if k % BEAT == 0 or k == ticks:
            print("TICKS", k, spawned, round(slowest, 3), flush=True)
    left = world.get_actors().filter("vehicle.*")
    print("LEFT", len(left), sum(v.get_velocity().length() > 0.1 for v in left), flush=True)
    manager.shut_down()  # before the next map is loaded: else the wheel can crash
    os._exit(0)


def _spawn(
    client: carla.Client, world: carla.World, tm_port: int, seed: int, cars: int, only: str
) -> int:
    """Cars of the Traffic Manager, as many as there is room for; how many came."""
    library = sorted(world.get_blueprint_library().filter("vehicle.*"), key=lambda b: b.id)
    library = [b for b in library if int(b.get_attribute("number_of_wheels")) == 4]
    if only:
        library = [b for b in library if b.get_attribute("base_type").as_str() == only]
    points = world.get_map().get_spawn_points()
    apart = max(1, len(points) // cars)
    batch = []
    for i in range(min(cars, len(points))):
        blueprint = library[(seed + i) % len(library)]
        blueprint.set_attribute("role_name", "autopilot")
        point = points[(7 * seed + i * apart) % len(points)]
        drive = carla.command.SetAutopilot(carla.command.FutureActor, True, tm_port)
        batch.append(carla.command.SpawnActor(blueprint, point).then(drive))
    return sum(not r.error for r in client.apply_batch_sync(batch, True))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:6]), *sys.argv[6:8])  # type: ignore[arg-type]
