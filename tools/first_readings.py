"""Whether a sensor's first reading is that of the first tick: `python tools/first_readings.py`.

A client of the `carla` wheel listens to a fresh sensor and ticks at once, 200 times for every kind
that reads each tick (dynamic vision says nothing while nothing moves). 1 when a reading was of another
tick or did not come.
"""

from __future__ import annotations

import os
import queue
import sys
from collections import Counter
from typing import Any

from carla_world import listening, served

TRIES = 200
PATIENCE_S = 60.0
SMALL = {"image_size_x": "64", "image_size_y": "48"}
FEW = {"channels": "8", "points_per_second": "20000"}
KINDS = {
    "camera.rgb": SMALL,
    "camera.depth": SMALL,
    "camera.semantic_segmentation": SMALL,
    "camera.instance_segmentation": SMALL,
    "camera.normals": SMALL,
    "camera.optical_flow": SMALL,
    "lidar.ray_cast": FEW,
    "lidar.ray_cast_semantic": FEW,
    "other.radar": {},
    "other.gnss": {},
    "other.imu": {},
}
TEXTURE = 3  # carla.GBufferTextureID.GBufferA


def main() -> None:
    """Every kind, again and again."""
    with served("straight") as (world, _):
        point = world.get_map().get_spawn_points()[0]
        car = world.spawn_actor(world.get_blueprint_library().find("vehicle.tesla.model3"), point)
        right: Counter[str] = Counter()
        for kind, options in KINDS.items():
            right[kind] = sum(_first(world, car, kind, options) for _ in range(TRIES))
            print(f"{kind}: {right[kind]} of {TRIES}", flush=True)
        right["G-buffer"] = sum(_first_texture(world, car) for _ in range(TRIES))
        print(f"G-buffer: {right['G-buffer']} of {TRIES}", flush=True)
        least = min(right.values())
        kinds = f"{len(right)} kinds of readings, {TRIES} tries each"
        print(f"{kinds}: at least {least} first readings were of the first tick")
    sys.stdout.flush()
    os._exit(0 if least == TRIES else 1)  # the wheel may abort while it ends


def _first(world: Any, car: Any, kind: str, options: dict[str, str]) -> bool:
    sensor, came = listening(world, car, kind, options)
    try:
        return _came(world, came)
    finally:
        sensor.destroy()


def _first_texture(world: Any, car: Any) -> bool:
    camera, _ = listening(world, car, "camera.rgb", SMALL)
    camera.enable_gbuffers(True)
    came: queue.Queue[Any] = queue.Queue()
    camera.listen_to_gbuffer(TEXTURE, came.put)
    try:
        return _came(world, came)
    finally:
        camera.destroy()


def _came(world: Any, came: queue.Queue[Any]) -> bool:
    frame = world.tick(PATIENCE_S)
    try:
        return bool(came.get(timeout=PATIENCE_S).frame == frame)
    except queue.Empty:
        return False


if __name__ == "__main__":
    main()
