"""How fast the CARLA server is with a real client: `python tools/served_bench.py`.

A synchronous client of the `carla` wheel, on the same machine, ticks figure8 with standing cars by
0.05 s and takes every reading of every tick: with no sensor, with each of three, and with all of
them. Printed: wall time of a tick, median and mean, and how many times real time the mean is.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from typing import Any

from carla_world import DT, PATIENCE_S, listening, served

TICKS, WARM = 200, 20
CARS = 20
IMAGE = {"image_size_x": "800", "image_size_y": "600", "fov": "90"}
LIDAR = {
    "channels": "64",
    "points_per_second": "1200000",
    "rotation_frequency": "20",
    "range": "100",
}
SENSORS: dict[str, tuple[str, dict[str, str]]] = {
    "lidar, 64 channels, 1.2 million points/s": ("lidar.ray_cast", LIDAR),
    "RGB, 800x600": ("camera.rgb", IMAGE),
    "semantic segmentation, 800x600": ("camera.semantic_segmentation", IMAGE),
}


def main() -> None:
    """Measure each set of sensors."""
    sets: dict[str, tuple[str, ...]] = {"nothing": ()}
    sets |= {name: (name,) for name in SENSORS} | {"these three together": tuple(SENSORS)}
    with served("figure8") as world:
        cars = _cars(world)
        print("| listened to by a client | median, ms | mean, ms | times real time |")
        print("|---|---|---|---|")
        for title, names in sets.items():
            took = _ticks(world, cars[0], names)
            mean, middle = statistics.mean(took), statistics.median(took)
            print(f"| {title} | {1e3 * middle:.1f} | {1e3 * mean:.1f} | {DT / mean:.1f} |")
        sys.stdout.flush()
    os._exit(0)  # the wheel may abort while it ends


def _cars(world: Any) -> list[Any]:
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    points = world.get_map().get_spawn_points()
    apart = max(1, len(points) // CARS)
    spawned = [world.try_spawn_actor(blueprint, p) for p in points[::apart][:CARS]]
    return [car for car in spawned if car is not None]


def _ticks(world: Any, car: Any, names: tuple[str, ...]) -> list[float]:
    """Seconds of wall time per tick, until every reading of it is there."""
    heard = [listening(world, car, *SENSORS[name]) for name in names]
    took = []
    for _ in range(WARM + TICKS):
        start = time.perf_counter()
        frame = world.tick(PATIENCE_S)
        for _, came in heard:
            while came.get(timeout=PATIENCE_S).frame < frame:
                pass
        took.append(time.perf_counter() - start)
    for sensor, _ in heard:
        sensor.stop()
        sensor.destroy()
    return took[WARM:]


if __name__ == "__main__":
    main()
