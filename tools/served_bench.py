"""How fast the CARLA server is with a real client: `python tools/served_bench.py [--maps FOLDER]`.

A synchronous client of the `carla` wheel, on the same machine, ticks a map with standing cars by
0.05 s and takes every reading of every tick: on figure8 with 20 cars no sensor, each of three, and all of
them; with --maps on Town10HD with 50 cars the three, and six cameras of 1600 x 900 around the first car.
With --quality full,draft both are measured, one after the other. Printed: wall time of a tick, median
and mean, how many times real time the mean is, and processor time of server and client per simulated second.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from carla_world import DT, PATIENCE_S, ServedWorld, listening, served
from processes import processor_s

WARM = 20  # ticks
IMAGE = {"image_size_x": "800", "image_size_y": "600", "fov": "90"}
WIDE = {"image_size_x": "1600", "image_size_y": "900", "fov": "70"}
LIDAR = {
    "channels": "64",
    "points_per_second": "1200000",
    "rotation_frequency": "20",
    "range": "100",
}


class Wanted(NamedTuple):
    """A sensor that is listened to."""

    kind: str
    options: dict[str, str]
    yaw_deg: float = 0.0


SENSORS = {
    "lidar, 64 channels, 1.2 million points/s": Wanted("lidar.ray_cast", LIDAR),
    "RGB, 800x600": Wanted("camera.rgb", IMAGE),
    "semantic segmentation, 800x600": Wanted("camera.semantic_segmentation", IMAGE),
}
THREE = {"these three together": tuple(SENSORS.values())}
SIX = {
    "six RGB, 1600x900, 60 deg apart": tuple(
        Wanted("camera.rgb", WIDE, yaw) for yaw in (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)
    )
}
Sets = dict[str, tuple[Wanted, ...]]
ALONE: Sets = {"nothing": (), **{name: (wanted,) for name, wanted in SENSORS.items()}}


def main() -> None:
    """Measure each set of sensors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--maps", help="a folder with Town10HD.xodr: that town alone is measured")
    parser.add_argument("--ticks", type=int, default=200)
    parser.add_argument("--quality", default="full", help="of pictures: full, draft or full,draft")
    parser.add_argument("server", nargs="*", help="options of the server, after --")
    args = parser.parse_args()
    for quality in args.quality.split(","):
        options = ["--quality", quality, *args.server]
        print(f"quality {quality}")
        if args.maps is None:
            measure("figure8", 20, ALONE | THREE, args.ticks, options)
        else:
            options = ["--maps", args.maps, *options]
            measure("Town10HD", 50, ALONE | THREE | SIX, args.ticks, options)
    sys.stdout.flush()
    os._exit(0)  # the wheel may abort while it ends


def measure(name: str, cars: int, sets: Sets, ticks: int, options: Sequence[str]) -> None:
    """Prints a table of the sets on a map with so many cars."""
    with served(name, options) as there:
        standing = _cars(there.world, cars)
        print(f"{name}, {len(standing)} cars, {ticks} ticks")
        print(
            "| listened to by a client | median, ms | mean, ms | times real time "
            "| server, s/s | client, s/s |\n|---|---|---|---|---|---|"
        )
        for title, wanted in sets.items():
            took, server, client = _ticks(there, standing[0], wanted, ticks)
            mean, middle = statistics.mean(took), statistics.median(took)
            print(
                f"| {title} | {1e3 * middle:.1f} | {1e3 * mean:.1f} | {DT / mean:.1f} "
                f"| {server:.2f} | {client:.2f} |",
                flush=True,
            )


def _cars(world: Any, number: int) -> list[Any]:
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    points = world.get_map().get_spawn_points()
    apart = max(1, len(points) // number)
    spawned = [world.try_spawn_actor(blueprint, p) for p in points[::apart][:number]]
    return [car for car in spawned if car is not None]


def _ticks(
    there: ServedWorld, car: Any, wanted: Sequence[Wanted], ticks: int
) -> tuple[list[float], float, float]:
    """Seconds of wall time per tick, until every reading of it is there.

    Also processor time of the server and of this process, s per simulated second.
    """
    heard = [listening(there.world, car, *one) for one in wanted]
    took, used = [], (0.0, 0.0)
    for k in range(WARM + ticks):
        if k == WARM:
            used = processor_s(there.server.pid), time.process_time()
        start = time.perf_counter()
        frame = there.world.tick(PATIENCE_S)
        for _, came in heard:
            while came.get(timeout=PATIENCE_S).frame < frame:
                pass
        took.append(time.perf_counter() - start)
    simulated = ticks * DT
    server = (processor_s(there.server.pid) - used[0]) / simulated
    client = (time.process_time() - used[1]) / simulated
    for sensor, _ in heard:
        sensor.stop()
        sensor.destroy()
    return took[WARM:], server, client


if __name__ == "__main__":
    main()
