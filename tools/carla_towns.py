"""How towns load on a server of its own, and whether pedestrians cross the roads of each.

    PYTHONPATH=src python tools/carla_towns.py --maps FOLDER --towns Town01 Town10HD

Each town is loaded twice, with the bundled map `straight` between, and then walked on for 60 s by 30
pedestrians of the client's own navigation, all of which may cross. Printed per town: seconds of each load to
the answer of its first tick, with those of the server's processor, pedestrians, and how many stood on a lane.
"""

from __future__ import annotations

import argparse
import os
import time
from typing import Any

import carla

from carla_world import DT, PATIENCE_S, loaded
from processes import processor_s
from skidpad.simulation.carla_server.process import ServerProcess

WALKERS, SECONDS = 30, 60.0


def crossed(client: Any, world: Any) -> tuple[int, int]:
    """Returns how many pedestrians came, and how many of them stood on a driving lane."""
    world.set_pedestrians_seed(3)
    world.set_pedestrians_cross_factor(1.0)
    roads, library = world.get_map(), world.get_blueprint_library()
    kinds, spawn = library.filter("walker.pedestrian.*"), carla.command.SpawnActor
    places = [world.get_random_location_from_navigation() for _ in range(WALKERS)]
    walkers = [
        walker
        for i, place in enumerate(places)
        if place
        and (walker := world.try_spawn_actor(kinds[i % len(kinds)], carla.Transform(place)))
    ]
    leader = library.find("controller.ai.walker")
    commands = [spawn(leader, carla.Transform(), walker.id) for walker in walkers]
    answers = client.apply_batch_sync(commands, True)
    world.tick(PATIENCE_S)
    for controller in world.get_actors([answer.actor_id for answer in answers]):
        controller.start()
        controller.go_to_location(world.get_random_location_from_navigation())
        controller.set_max_speed(1.4)
    on_road = set[int]()
    for k in range(round(SECONDS / DT)):
        world.tick(PATIENCE_S)
        for walker in walkers if k % 10 == 0 else ():
            lane = roads.get_waypoint(
                walker.get_location(), project_to_road=False, lane_type=carla.LaneType.Driving
            )
            if lane is not None:
                on_road.add(walker.id)
    return len(walkers), len(on_road)


def main() -> None:
    """Loads and walks all towns."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", required=True, help="a folder with .xodr files")
    parser.add_argument("--towns", nargs="+", required=True)
    args = parser.parse_args()
    with ServerProcess(["--maps", args.maps, "--map", "straight"]) as server:
        client = carla.Client("127.0.0.1", server.port)
        client.set_timeout(PATIENCE_S)
        for town in args.towns:
            took = []
            for name in (town, "straight", town):
                began, before = time.monotonic(), processor_s(server.pid)
                world = loaded(client, name)
                world.tick(PATIENCE_S)
                seconds, busy = time.monotonic() - began, processor_s(server.pid) - before
                took.append(f"{seconds:.1f} s ({busy:.1f} s)")
            came, crossing = crossed(client, world)
            print(
                f"{town}: first load {took[0]}, second {took[2]}; {came} pedestrians, {crossing} crossed",
                flush=True,
            )
    os._exit(0)  # the wheel may abort while it ends


if __name__ == "__main__":
    main()
