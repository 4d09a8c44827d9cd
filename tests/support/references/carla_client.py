"""A client of the CARLA server: drives among others in rain, writes down all that it is told.

Run as a program with the server's port and the file to write: the wheel can abort its process.
No radar: its rays are drawn from the frame number, and the server counted before we came.
"""

from __future__ import annotations

import os
import queue
import sys
from collections.abc import Iterator
from typing import Any

import carla
import numpy as np

TICKS = 180
PATIENCE = 60.0  # s for an answer
LATE = 20.0  # s for a reading: one that was sent before the stream stood never comes
VEHICLES = ("vehicle.tesla.model3", "vehicle.audi.tt", "vehicle.mercedes.sprinter")
IMAGE = {"image_size_x": "80", "image_size_y": "60"}
SENSORS: dict[str, dict[str, str]] = {
    "sensor.other.imu": {},
    "sensor.other.gnss": {},
    "sensor.lidar.ray_cast": {"points_per_second": "20000", "rotation_frequency": "20"},
    "sensor.camera.depth": IMAGE,
    "sensor.camera.semantic_segmentation": IMAGE,
}


def controls(k: int) -> list[carla.VehicleControl]:
    """What ego and the others press at tick k: away, a weave, a brake, then off the road."""
    if k < 110:
        ego = carla.VehicleControl(throttle=0.7, steer=(0.0, 0.03, -0.03)[(k // 25) % 3])
    elif k < 130:
        ego = carla.VehicleControl(brake=0.6)
    else:
        ego = carla.VehicleControl(throttle=0.8, steer=0.3)
    return [
        ego,
        carla.VehicleControl(throttle=0.4),
        carla.VehicleControl(throttle=0.5, steer=-0.02),
    ]


def vector(v: Any) -> list[float]:
    return [v.x, v.y, v.z]


def motion(actor: carla.Actor) -> np.ndarray:
    pose = actor.get_transform()
    turn = pose.rotation
    return np.float32(
        [
            *vector(pose.location),
            *(turn.roll, turn.pitch, turn.yaw),
            *vector(actor.get_velocity()),
            *vector(actor.get_angular_velocity()),
            *vector(actor.get_acceleration()),
        ]
    )


def numbers(kind: str, data: Any) -> Iterator[tuple[str, Any]]:
    """A reading as numbers; their type says how they are compared."""
    if kind.endswith("imu"):
        a, w = data.accelerometer, data.gyroscope
        yield kind, np.float32([*vector(a), *vector(w), data.compass])
    elif kind.endswith("gnss"):
        yield kind, np.float64([data.latitude, data.longitude, data.altitude])
    elif "camera" in kind:
        pixels = np.frombuffer(data.raw_data, np.uint8).reshape(data.height, data.width, 4)
        if kind.endswith("depth"):
            codes = pixels[..., :3].astype(np.int64) @ (65536, 256, 1)  # blue, green, red
            yield f"{kind} row means", codes.mean(axis=1).astype(np.float32)
        else:
            yield f"{kind} labels", np.bincount(pixels[..., 2].ravel(), minlength=30)
    else:
        points = np.frombuffer(data.raw_data, np.float32).reshape(-1, 4)
        yield f"{kind} points", len(points)
        yield f"{kind} mean", points.mean(axis=0, dtype=np.float64).astype(np.float32)


def main(port: int, out: str) -> None:
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(PATIENCE)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    world = client.load_world("figure8", False)  # time begins anew, now in our hands
    world.set_weather(carla.WeatherParameters.HardRainNoon)
    library = world.get_blueprint_library()
    points = world.get_map().get_spawn_points()
    cars = [world.spawn_actor(library.find(v), p) for v, p in zip(VEHICLES, points, strict=False)]
    beside = points[0].transform(carla.Location(x=40.0, y=8.0, z=1.0))
    walker = world.spawn_actor(library.find("walker.pedestrian.0001"), carla.Transform(beside))
    roof = carla.Transform(carla.Location(x=0.5, z=2.0))
    heard: dict[str, queue.Queue[Any]] = {}
    sensors = []
    for kind, attributes in SENSORS.items():
        blueprint = library.find(kind)
        for key, value in attributes.items():
            blueprint.set_attribute(key, value)
        heard[kind] = queue.Queue()
        sensors.append(world.spawn_actor(blueprint, roof, attach_to=cars[0]))
        sensors[-1].listen(heard[kind].put)
    struck: list[tuple[int, float]] = []
    bumper = world.spawn_actor(library.find("sensor.other.collision"), roof, attach_to=cars[0])
    bumper.listen(lambda event: struck.append((event.frame, event.normal_impulse.length())))
    lights = sorted(world.get_actors().filter("traffic.traffic_light"), key=lambda a: a.id)
    begin = world.get_snapshot().frame + 1
    rows: dict[str, list[Any]] = {}
    for k in range(TICKS):
        for car, control in zip(cars, controls(k), strict=True):
            car.apply_control(control)
        walker.apply_control(carla.WalkerControl(carla.Vector3D(x=0.6, y=0.8), 1.4))
        frame = world.tick(PATIENCE)
        for car in (*cars, walker):
            rows.setdefault(f"motion {car.type_id}", []).append(motion(car))
        rows.setdefault("lights", []).append([int(light.get_state()) for light in lights])
        for kind, readings in heard.items():
            reading = readings.get(timeout=LATE)
            assert reading.frame == frame, f"{kind}: a reading was lost"
            for name, value in numbers(kind, reading):
                rows.setdefault(name, []).append(value)
    columns = {f"ticks/{name}": np.array(values) for name, values in rows.items()}
    columns["events/contact.tick"] = np.array([frame - begin for frame, _ in struck])
    columns["events/contact.impulse"] = np.float32([impulse for _, impulse in struck])
    np.savez(out, **columns)
    for sensor in (*sensors, bumper):
        sensor.destroy()
    os._exit(0)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
