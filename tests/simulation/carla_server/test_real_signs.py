"""K-4: every sign is checked against what the client itself computes, and each flip is caught."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.carla.mutated_server import MUTANTS
from support.carla_preface import PREFACE

pytest.importorskip("carla")
MUTATED = Path(__file__).parents[2] / "support" / "carla" / "mutated_server.py"
READY = re.compile(r"ready: CARLA \S+ on \S+:(\d+)")
LIMIT = 600.0  # s

# A car on a bend, so that no heading is a multiple of 90 deg; a truck ahead of it to the right.
CHECKS = """
import numpy as np
synchronous()
library, roads = world.get_blueprint_library(), world.get_map()
start = next(t for t in roads.get_spawn_points()
             if 20.0 < t.rotation.yaw % 90.0 < 70.0 and abs(t.location.y) > 30.0)
lane = roads.get_waypoint(start.location)
there = carla.Transform(lane.transform.transform(carla.Location(x=18.0, y=4.0)),
                        lane.transform.rotation)
ego = world.spawn_actor(library.find("vehicle.tesla.model3"), lane.transform)
truck = world.spawn_actor(library.find("vehicle.carlamotors.carlacola"), there)

def at(sensor, frame):
    while True:
        data = heard[sensor.id].get(timeout=120.0)
        if data.frame >= frame:
            return data

roof = carla.Transform(carla.Location(z=2.0), carla.Rotation(pitch=-5.0))
camera = listen("sensor.camera.instance_segmentation", roof,
                image_size_x=400, image_size_y=300, fov=90)
radar = listen("sensor.other.radar", carla.Transform(carla.Location(x=2.6, z=1.0)),
               horizontal_fov=60, vertical_fov=2, points_per_second=20000, range=40)
lidar = listen("sensor.lidar.ray_cast_semantic", carla.Transform(carla.Location(z=2.2)),
               range=60, points_per_second=100000, rotation_frequency=20)
imu = listen("sensor.other.imu", carla.Transform())
time.sleep(0.5)
world.tick()
frame = world.tick()

failed = []
def check(name, test):
    if not test:
        failed.append(name)

def apart(a, b):
    return abs((a - b + 180.0) % 360.0 - 180.0)

here = ego.get_transform()
check("place", here.location.distance(lane.transform.location) < 1.0)
check("yaw", apart(here.rotation.yaw, lane.transform.rotation.yaw) < 2.0)
check("truck", truck.get_location().distance(there.location) < 1.0)
check("pitch", abs(camera.get_transform().rotation.pitch + 5.0) < 0.5)
forward = lane.transform.get_forward_vector()
middle = truck.get_transform().transform(truck.bounding_box.location)
inverse = np.array(camera.get_transform().get_inverse_matrix())
p = inverse @ np.array([middle.x, middle.y, middle.z, 1.0])
image = np.frombuffer(at(camera, frame).raw_data, np.uint8).reshape(300, 400, 4).astype(int)
rows, columns = np.nonzero(image[..., 1] + 256 * image[..., 0] == truck.id)
check("image has the truck", len(rows) > 50)
check("image column", len(rows) and abs(columns.mean() - 200.0 - 200.0 * p[1] / p[0]) < 15.0)
check("image row", len(rows) and abs(rows.mean() - 150.0 + 200.0 * p[2] / p[0]) < 15.0)
near = [d.azimuth for d in at(radar, frame) if d.depth < 25.0]
check("radar", len(near) > 3 and abs(np.median(near) - math.atan2(p[1], p[0] - 2.6)) < 0.15)
kind = np.dtype([("p", "f4", 3), ("cosine", "f4"), ("actor", "u4"), ("tag", "u4")])
cloud = np.frombuffer(at(lidar, frame).raw_data, dtype=kind)
mine = cloud[cloud["actor"] == truck.id]["p"]
check("lidar", len(mine) > 3 and abs(mine[:, 1].mean() - p[1]) < 1.5)
still = at(imu, frame)
check("compass", abs(math.sin(still.compass) - forward.x) < 0.02
      and abs(math.cos(still.compass) + forward.y) < 0.02)
truck.destroy()
ego.set_target_velocity(forward * 8.0)
world.tick()
v, moved = ego.get_velocity(), ego.get_location() - here.location
check("velocity", abs(v.x * forward.x + v.y * forward.y - 8.0) < 0.5)
check("target velocity", moved.x * forward.x + moved.y * forward.y > 0.2)
before = ego.get_transform()
ego.apply_control(carla.VehicleControl(throttle=0.5, steer=0.15))
for _ in range(10):
    frame = world.tick()
after, turning = ego.get_transform(), at(imu, frame)
right, moved = before.get_right_vector(), after.location - before.location
check("steer", moved.x * right.x + moved.y * right.y > 0.1)
check("turned", (after.rotation.yaw - before.rotation.yaw + 180.0) % 360.0 - 180.0 > 1.0)
check("angular velocity", ego.get_angular_velocity().z > 1.0)
check("gyroscope", turning.gyroscope.z > 0.02)
check("accelerometer", turning.accelerometer.y > 0.2)
check("own steer", ego.get_control().steer > 0.1)
print("FAILED", failed, flush=True)
"""


def caught(mutant: str) -> str:
    """What the checks say to a mutated server; text of an exception when they do not end."""
    server = subprocess.Popen(
        [
            sys.executable,
            str(MUTATED),
            mutant,
            "--port",
            "0",
            "--idle-exit",
            "60",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert server.stdout is not None
    try:
        port = next(found[1] for line in server.stdout if (found := READY.search(line)))
        done = subprocess.run(
            [sys.executable, "-c", PREFACE + CHECKS + "\nfinish()\n", port],
            capture_output=True,
            text=True,
            timeout=LIMIT,
            check=False,
        )
    finally:
        server.kill()
        server.wait()
        server.stdout.close()
    said = [line for line in done.stdout.splitlines() if line.startswith("FAILED")]
    return said[0].removeprefix("FAILED ") if said else done.stderr[-2000:]


@pytest.mark.req("K-4")
def test_no_sign_is_wrong() -> None:
    assert caught("none") == "[]"


@pytest.mark.slow
@pytest.mark.req("K-4")
@pytest.mark.parametrize("mutant", list(MUTANTS))
def test_each_flipped_sign_is_caught(mutant: str) -> None:
    said = caught(mutant)
    assert said not in ("[]", "")
