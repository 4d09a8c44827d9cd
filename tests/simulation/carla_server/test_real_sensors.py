"""Sensors read by the unmodified client, checked against its own map and CARLA's public formulas."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from support.carla_preface import STAGE

Serve = Callable[..., Any]


def test_images_agree_with_the_public_projection(serve: Serve) -> None:
    """K-4: a flipped axis would move the mask of the walker to the other side."""
    serve().client(
        STAGE
        + """
turned = carla.Rotation(pitch=-6.0, yaw=8.0)
place = carla.Transform(carla.Location(x=0.5, z=1.8), turned)
size = dict(image_size_x=800, image_size_y=600, fov=90)
names = ("depth", "semantic_segmentation", "instance_segmentation", "rgb")
cameras = {n: listen("sensor.camera." + n, place, **size) for n in names}
time.sleep(0.5)
frame = tick(2)
assert abs(cameras["rgb"].get_transform().rotation.pitch - turned.pitch) < 0.1
assert abs(cameras["rgb"].get_transform().rotation.yaw - first.transform.rotation.yaw - 8.0) < 0.1
images = {n: at(c, frame) for n, c in cameras.items()}
pixels = {n: np.frombuffer(i.raw_data, np.uint8).reshape(600, 800, 4).astype(int)
          for n, i in images.items()}
code = pixels["depth"]
depth = (code[..., 2] + 256 * code[..., 1] + 65536 * code[..., 0]) / (256**3 - 1) * 1000.0
ids = pixels["instance_segmentation"][..., 1] + 256 * pixels["instance_segmentation"][..., 0]
tags = pixels["semantic_segmentation"][..., 2]
for actor, tag in ((lead, 14), (aside, 15), (walker, 12)):
    rows, columns = np.nonzero(ids == actor.id)
    p = seen_from(cameras["rgb"].get_transform(), actor)
    u, v = 400.0 + 400.0 * p[1] / p[0], 300.0 - 400.0 * p[2] / p[0]
    assert abs(columns.mean() - u) < 12.0, (actor.type_id, columns.mean(), u)
    assert abs(rows.mean() - v) < 8.0, (actor.type_id, rows.mean(), v)
    near = p[0] - actor.bounding_box.extent.x
    assert abs(depth[rows, columns].min() - near) < 0.6, (actor.type_id, near)
    assert set(tags[rows, columns]) >= {tag}, (actor.type_id, set(tags[rows, columns]))
sky = pixels["rgb"][:100].reshape(-1, 4).mean(axis=0)
assert sky[0] > sky[2], sky  # blue first
assert (pixels["rgb"][..., 3] == 255).all()
"""
    )


def test_radar_and_lidars_point_where_things_are(serve: Serve) -> None:
    serve().client(
        STAGE
        + """
radar = listen("sensor.other.radar", carla.Transform(carla.Location(x=2.6, z=1.0)),
               horizontal_fov=40, vertical_fov=4, points_per_second=20000)
above = carla.Transform(carla.Location(z=2.2))
lidar = listen("sensor.lidar.ray_cast", above, range=60, points_per_second=200000,
               rotation_frequency=20, dropoff_general_rate=0)
tagged = listen("sensor.lidar.ray_cast_semantic", above, range=60, points_per_second=200000,
                rotation_frequency=20)
time.sleep(0.5)
lead.set_target_velocity(first.transform.get_forward_vector() * 8.0)
frame = tick(3)
returns = at(radar, frame)
points = np.array([(d.velocity, d.azimuth, d.altitude, d.depth) for d in returns])
for actor in (lead, aside):
    p = seen_from(returns.transform, actor)
    azimuth, near = math.atan2(p[1], p[0]), p[0] - actor.bounding_box.extent.x
    mine = points[(abs(points[:, 1] - azimuth) < 0.03) & (abs(points[:, 3] - near) < 1.0)]
    assert len(mine) > 5, (actor.type_id, azimuth, near)
    v = actor.get_velocity().length()
    assert abs(mine[:, 0].mean() - v) < 0.5, (mine[:, 0].mean(), v)
assert points[:, 3].max() <= 100.0
kind = np.dtype([("p", "f4", 3), ("cosine", "f4"), ("actor", "u4"), ("tag", "u4")])
cloud = np.frombuffer(at(tagged, frame).raw_data, dtype=kind)
for actor, tag in ((lead, 14), (aside, 15), (walker, 12)):
    mine = cloud[cloud["actor"] == actor.id]
    p = seen_from(tagged.get_transform(), actor)
    assert len(mine) > 3 and set(mine["tag"]) == {tag}, (actor.type_id, len(mine))
    assert abs(mine["p"][:, 1].mean() - p[1]) < 1.2, (actor.type_id, mine["p"].mean(axis=0), p)
    assert abs(mine["p"][:, 0].min() - (p[0] - actor.bounding_box.extent.x)) < 0.8
scan = at(lidar, frame)
plain = np.frombuffer(scan.raw_data, np.float32).reshape(-1, 4)
assert scan.channels == 32
assert sum(scan.get_point_count(i) for i in range(32)) == len(plain) > 4000
assert np.linalg.norm(plain[:, :3], axis=1).max() <= 60.001
distance = np.linalg.norm(plain[:, :3], axis=1)
assert np.allclose(plain[:, 3], np.exp(-0.004 * distance), atol=1e-4)
"""
    )


def test_imu_gnss_collision_and_obstacle(serve: Serve) -> None:
    serve().client(
        STAGE
        + """
imu, gnss = listen("sensor.other.imu"), listen("sensor.other.gnss")
collision = listen("sensor.other.collision")
obstacle = listen("sensor.other.obstacle", carla.Transform(carla.Location(x=2.5, z=0.8)),
                  distance=30)
time.sleep(0.5)
frame = tick(3)
still = at(imu, frame)
assert abs(still.accelerometer.z - 9.81) < 0.02 and abs(still.accelerometer.x) < 0.05
forward = ego.get_transform().get_forward_vector()
assert abs(math.sin(still.compass) - forward.x) < 1e-3  # north is -y
assert abs(math.cos(still.compass) + forward.y) < 1e-3
fix, here = at(gnss, frame), roads.transform_to_geolocation(ego.get_location())
assert abs(fix.latitude - here.latitude) < 1e-7, (fix, here)
assert abs(fix.longitude - here.longitude) < 1e-7
met = at(obstacle, frame)
assert met.other_actor.id == lead.id and 15.0 < met.distance < 22.5, met.distance
ego.apply_control(carla.VehicleControl(throttle=1.0))
frame = tick(20)
assert at(imu, frame).accelerometer.x > 1.0
tick(80)
time.sleep(0.5)
hit = heard[collision.id].get(timeout=120.0)
assert hit.actor.id == ego.id and hit.other_actor.id == lead.id
push = hit.normal_impulse
assert push.x * forward.x + push.y * forward.y < -1000.0, push  # N s, backwards
"""
    )


def test_turning_right_in_the_clients_axes(serve: Serve) -> None:
    serve().client(
        STAGE
        + """
for other in (lead, aside, walker):
    other.destroy()
imu, lane = listen("sensor.other.imu"), listen("sensor.other.lane_invasion")
time.sleep(0.3)
ego.apply_control(carla.VehicleControl(throttle=0.6))
tick(40)
ego.apply_control(carla.VehicleControl(throttle=0.5, steer=0.1))
frame = tick(12)
turning = at(imu, frame)
assert turning.gyroscope.z > 0.02, turning.gyroscope
assert turning.accelerometer.y > 0.3, turning.accelerometer
tick(20)
crossed = heard[lane.id].get(timeout=120.0)
assert crossed.crossed_lane_markings
"""
    )


def test_sensors_work_only_when_due_and_listened_to(serve: Serve) -> None:
    serve().client(
        STAGE
        + """
slow = listen("sensor.other.gnss", sensor_tick=0.2)
time.sleep(0.3)
begin = tick()
tick(40)
time.sleep(0.5)
frames = [heard[slow.id].get().frame for _ in range(heard[slow.id].qsize())]
assert frames[0] == begin and len(frames) == 11, frames  # counted from its own first tick
assert set(np.diff(frames)) == {4}, frames
try:
    listen("sensor.camera.rgb", image_size_x=100000)
    raise SystemExit("an image of that size was accepted")
except RuntimeError as error:
    assert "image_size_x" in str(error)
"""
    )


def test_noise_is_seeded(serve: Serve) -> None:
    script = (
        STAGE
        + """
noisy = dict(noise_seed=5, noise_lat_stddev=1e-4)
a = listen("sensor.other.gnss", **noisy)
time.sleep(0.3)
frame = tick(2)
print("FIX", at(a, frame).latitude)
"""
    )
    fixes = {
        line for _ in range(2) for line in serve().client(script).splitlines() if "FIX" in line
    }
    assert len(fixes) == 1


@pytest.mark.parametrize("grip", ["none", "physical"])
def test_weather_changes_grip_once(serve: Serve, grip: str) -> None:
    """K-2: braking on ice set by the blueprint; it is offered only when weather acts."""
    out = serve("--weather-grip", grip, "--mu-ref", "0.9").client("""
    synchronous()
    library = world.get_blueprint_library()
    offered = [b.id for b in library if b.id == "skidpad.weather.grip"]
    point = world.get_map().get_spawn_points()[0]
    if offered:
        ice = library.find("skidpad.weather.grip")
        told = [ice.get_attribute(name) for name in ("weather_grip", "mu_ref")]
        print("TOLD", told[0].as_str(), round(told[1].as_float(), 6), told[1].is_modifiable)
        ice.set_attribute("ice_thickness", "100")
        world.spawn_actor(ice, carla.Transform())
    car = world.spawn_actor(library.find("vehicle.audi.tt"), point)
    world.tick()
    car.set_target_velocity(point.get_forward_vector() * 20.0)
    car.apply_control(carla.VehicleControl(brake=1.0))
    world.tick()
    start = car.get_location()
    for _ in range(60):
        world.tick()
    print("BRAKED", bool(offered), car.get_location().distance(start))
    """)
    _, offered, metres = next(x for x in out.splitlines() if "BRAKED" in x).split()
    assert offered == str(grip == "physical")
    assert ("TOLD physical 0.9 False" in out.splitlines()) == (grip == "physical")
    assert (float(metres) > 40.0) == (grip == "physical")


def test_the_first_tick_after_listen_is_heard(serve: Serve) -> None:
    """Every sensor, again and again, without a pause between listen and tick."""
    serve().client(
        STAGE
        + """
kinds = ("imu", "gnss", "radar")
for turn in range(20):
    sensors = [listen("sensor.other." + kind) for kind in kinds]
    frame = tick()
    for sensor in sensors:
        assert heard[sensor.id].get(timeout=120.0).frame == frame, (turn, sensor.type_id)
        sensor.destroy()
"""
    )
