"""What becomes of vehicles under the Traffic Manager of the `carla` wheel, on a server of its own.

    PYTHONPATH=src python tools/carla_traffic.py --maps FOLDER --map Town10HD --seeds 1 2 3

60 vehicles of all blueprints are driven for 6000 ticks of 0.05 s per seed. Printed: each pair that touched,
each thing of the map that a vehicle touched, each vehicle that vanished, each that moved less than a metre
for a minute with those near it, and their sums. Of each it says how it steers and how far its middle is from
its lane's.
"""

from __future__ import annotations

import argparse
import os
from math import cos, hypot, inf, radians, sin
from typing import Any

import carla

from carla_world import DT, PATIENCE_S, hear_collisions, loaded, spread
from skidpad.simulation.carla_server.process import ServerProcess
from soak_server import free_port

NEAR = 20.0  # m


class Watch:
    """What became of vehicles: places, contacts, and the tick in which each last moved by a metre."""

    def __init__(self, world: Any, cars: list[Any]) -> None:
        self.roads, self.k = world.get_map(), 0
        self.cars = {car.id: car for car in cars}
        self.names = {car.id: car.type_id.removeprefix("vehicle.") for car in cars}
        self.touched, self.told = set[frozenset[int]](), set[frozenset[int]]()
        self.struck, self.struck_told = set[tuple[int, str]](), set[tuple[int, str]]()
        self.vanished, self.now = set[int](), dict[int, Any]()
        self.moved: dict[int, tuple[int, float, float]] = {}

    def note_contact(self, event: Any) -> None:
        """Notes the pair of a collision event, or the thing of the map that a vehicle touched."""
        if event.other_actor.id in self.names:
            self.touched.add(frozenset((event.actor.id, event.other_actor.id)))
        else:
            self.struck.add((event.actor.id, event.other_actor.type_id))

    def note_tick(self, snapshot: Any) -> None:
        """Notes where each vehicle is, and prints new contacts and losses."""
        self.k += 1
        for pair in set(self.touched) - self.told:
            self.told.add(pair)
            self.tell("touched", pair)
        for id, thing in set(self.struck) - self.struck_told:
            self.struck_told.add((id, thing))
            self.tell(f"touched {thing}", {id})
        for id in self.names.keys() - self.vanished:
            if (state := snapshot.find(id)) is None:
                self.vanished.add(id)
                self.tell("vanished", {id})
                continue
            self.now[id], at = state, state.get_transform().location
            _, x, y = self.moved.get(id, (0, inf, inf))
            if hypot(at.x - x, at.y - y) > 1.0:
                self.moved[id] = (self.k, at.x, at.y)
            if self.k - self.moved[id][0] == round(60.0 / DT):
                car = self.cars[id]
                light = (
                    f" at a light, {car.get_traffic_light_state()}"
                    if car.is_at_traffic_light()
                    else ""
                )
                self.tell(f"stands{light}, and within {NEAR:.0f} m", {id, *self.near(id)})

    def near(self, id: int) -> list[int]:
        """Returns the vehicles within NEAR m of one."""
        here = self.now[id].get_transform().location
        there = self.now.keys() - self.vanished
        return [i for i in there if self.now[i].get_transform().location.distance(here) < NEAR]

    def standing(self) -> list[int]:
        """Returns the vehicles that are there and moved less than a metre in the last minute."""
        since = {id: self.moved[id][0] for id in self.names.keys() - self.vanished}
        return [id for id, k in since.items() if self.k - k >= 60.0 / DT]

    def tell(self, what: str, ids: Any) -> None:
        """Prints an event, with the state of its vehicles in the tick before."""
        words = [f"{self.k * DT:.1f} s {what}"]
        for id in ids & self.now.keys():
            place, speed = self.now[id].get_transform(), self.now[id].get_velocity().length()
            lane, at = self.roads.get_waypoint(place.location), place.location
            middle, along = lane.transform.location, radians(lane.transform.rotation.yaw)
            aside = (at.y - middle.y) * cos(along) - (at.x - middle.x) * sin(along)
            astray = (place.rotation.yaw - lane.transform.rotation.yaw + 180.0) % 360.0 - 180.0
            steered = None if id in self.vanished else self.cars[id].get_control()
            words.append(
                f"{self.names[id]} ({at.x:.1f}, {at.y:.1f}) {place.rotation.yaw:.0f} deg {speed:.1f} m/s, "
                f"still for {(self.k - self.moved[id][0]) * DT:.0f} s, road {lane.road_id} lane "
                f"{lane.lane_id}{' in a junction' * lane.is_junction}, {aside:+.1f} m and {astray:+.0f} deg "
                f"off the lane's middle"
                + (
                    ""
                    if steered is None
                    else f", steers {steered.steer:+.2f}, throttle {steered.throttle:.2f}"
                )
            )
        print("; ".join(words), flush=True)


def drive(client: Any, args: argparse.Namespace) -> None:
    """Drives a leg per seed and prints its events and a line of sums."""
    port = free_port()
    for seed in args.seeds:
        world = loaded(client, args.map)
        manager = client.get_trafficmanager(port)
        manager.set_synchronous_mode(True)
        manager.set_random_device_seed(seed)
        cars = spread(client, world, args.only, seed, args.cars)
        for car in cars:
            car.set_autopilot(True, port)
        watch = Watch(world, cars)
        sensors = hear_collisions(world, cars, watch.note_contact)
        for _ in range(args.ticks):
            world.tick(PATIENCE_S)
            watch.note_tick(world.get_snapshot())
        for id in (standing := watch.standing()):
            watch.tell("stands", {id})
        struck = {id for pair in watch.touched for id in pair}
        print(
            f"seed {seed}: {len(cars)} vehicles, {args.ticks} ticks: {len(watch.vanished)} vanished, "
            f"{len(struck)} touched in {len(watch.touched)} pairs, {len(standing)} stand",
            flush=True,
        )
        for sensor in sensors:
            sensor.stop()
        manager.shut_down()  # before the next map is loaded: else the wheel can crash


def main() -> None:
    """Drives all seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", help="a folder with .xodr files")
    parser.add_argument("--map", default="town")
    parser.add_argument("--only", default="vehicle.*", help="pattern of the blueprints that drive")
    parser.add_argument("--cars", type=int, default=60)
    parser.add_argument("--ticks", type=int, default=6000)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    args = parser.parse_args()
    with ServerProcess(["--maps", args.maps] if args.maps else []) as server:
        client = carla.Client("127.0.0.1", server.port)
        client.set_timeout(PATIENCE_S)
        drive(client, args)
    os._exit(0)  # the wheel may abort while it ends


if __name__ == "__main__":
    main()
