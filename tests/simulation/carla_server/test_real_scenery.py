"""What the unmodified client sees of cameras that tell motion and shape, and of the map's own objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from support.carla_preface import STAGE

Serve = Callable[..., Any]


def test_flow_normals_and_events(serve: Serve) -> None:
    """Each against positions that the client itself knows, by CARLA's public projection."""
    serve().client(
        STAGE
        + """
place = carla.Transform(carla.Location(x=0.5, z=1.8))
size = dict(image_size_x=400, image_size_y=300, fov=90)
flow = listen("sensor.camera.optical_flow", place, **size)
shape = listen("sensor.camera.normals", place, **size)
ids = listen("sensor.camera.instance_segmentation", place, **size)
events = listen("sensor.camera.dvs", place, use_log=True, **size)

def pixels(sensor, frame, kind, channels):
    image = at(sensor, frame)
    return np.frombuffer(image.raw_data, kind).reshape(image.height, image.width, channels)

def mine(frame, actor):
    seen = pixels(ids, frame, np.uint8, 4).astype(int)
    return seen[..., 1] + 256 * seen[..., 0] == actor.id

def on_screen(actor):
    p = seen_from(flow.get_transform(), actor)
    near = p[0] - actor.bounding_box.extent.x  # the side that it shows
    return 200.0 + 200.0 * p[1] / near, 150.0 - 200.0 * p[2] / near

frame = tick(3)
assert np.abs(pixels(flow, frame, np.float32, 2)).max() < 1e-5  # nobody moves
assert heard[events.id].empty()
seen = pixels(shape, frame, np.uint8, 4).astype(float)[..., 2::-1] / 127.5 - 1.0
ground = seen[195:205, 40:90].reshape(-1, 3).mean(axis=0)
assert np.allclose(ground, (0.0, 0.0, 1.0), atol=0.05), ground  # the road climbs
ahead = ego.get_transform().get_forward_vector()
rear = np.median(seen[mine(frame, lead)], axis=0)
assert rear @ np.array([ahead.x, ahead.y, ahead.z]) < -0.7, rear
lead.set_simulate_physics(False)
before = on_screen(lead)
point = lead.get_transform()
point.location += first.transform.get_right_vector() * 0.4
lead.set_transform(point)
frame = tick()
after = on_screen(lead)
moved = pixels(flow, frame, np.float32, 2)
body = mine(frame, lead)
mean = np.median(moved[body], axis=0) * np.array([200.0, -150.0])
assert abs(mean[0] - (after[0] - before[0])) < 0.3, (mean, before, after)
assert mean[0] > 2.0 and abs(mean[1]) < 0.3, mean
assert np.abs(moved[250:, :]).max() < 1e-5  # the road stands still
told = at(events, frame)
assert len(told) > 20 and all(0 <= e.x < 400 and 0 <= e.y < 300 for e in told)
assert {e.pol for e in told} == {True, False}
times = [e.t for e in told]
assert times == sorted(times)
columns = np.nonzero(body.any(axis=0))[0]
near = [columns.min() - 12 <= e.x <= columns.max() + 12 for e in told]
assert sum(near) > 0.95 * len(near), (sum(near), len(near))
"""
    )


def test_objects_of_the_map_can_be_hidden(serve: Serve) -> None:
    serve("--map", "town_Opt").client("""
    import numpy as np
    synchronous()
    assert world.get_map().name.endswith("town_Opt")
    assert "/Game/Carla/Maps/town_Opt" in client.get_available_maps()
    label = carla.CityObjectLabel
    buildings = world.get_environment_objects(label.Buildings)
    assert len(buildings) >= 10
    assert len(world.get_environment_objects(label.GuardRail)) > 5
    assert len(world.get_level_bbs(label.Buildings)) == len(buildings)
    one = buildings[0]
    forward = one.transform.get_right_vector()
    eye = one.transform.location - forward * (one.bounding_box.extent.y + 8.0)
    sensor = carla.Transform(eye, carla.Rotation(yaw=one.transform.rotation.yaw + 90.0))
    library = world.get_blueprint_library()
    camera = library.find("sensor.camera.depth")
    camera.set_attribute("image_size_x", "64")
    camera.set_attribute("image_size_y", "48")
    camera = world.spawn_actor(camera, sensor)
    seen = queue.Queue()
    camera.listen(seen.put)

    def near():
        frame = world.tick()
        while True:
            image = seen.get(timeout=120.0)
            if image.frame == frame:
                b, g, r, _ = np.frombuffer(image.raw_data, np.uint8).reshape(48, 64, 4)[24, 32].tolist()
                return abs((r + 256 * g + 65536 * b) / (256**3 - 1) * 1000.0 - 8.0) < 0.1

    def met():
        return label.Buildings in [h.label for h in world.cast_ray(eye, eye + forward * 9.0)]

    assert near() and met()
    world.enable_environment_objects({one.id}, False)
    assert not near() and not met()
    world.enable_environment_objects({one.id}, True)
    assert near() and met()
    world.unload_map_layer(carla.MapLayer.Buildings)
    assert not near() and not met()
    world.load_map_layer(carla.MapLayer.Buildings)
    assert near() and met()
    world = client.load_world("town_Opt", False, carla.MapLayer.Walls)
    assert not met()
    """)


def test_bones_of_a_walker(serve: Serve) -> None:
    serve("--map", "straight").client("""
    synchronous()
    library, roads = world.get_blueprint_library(), world.get_map()
    place = roads.get_spawn_points()[0]
    place.location.z += 1.0
    walker = world.spawn_actor(library.find("walker.pedestrian.0001"), place)
    world.tick()
    at = walker.get_transform()
    bones = {b.name: b for b in walker.get_bones().bone_transforms}
    assert len(bones) > 60 and {"crl_root", "crl_Head__C", "crl_hand__R"} <= set(bones)
    foot, head = bones["crl_root"].world.location, bones["crl_Head__C"].world.location
    assert abs(at.location.z - foot.z - walker.bounding_box.extent.z) < 0.01
    assert 0.8 < (head.z - foot.z) / (2 * walker.bounding_box.extent.z) < 1.0
    left, right = (bones["crl_arm__" + s].world.location for s in "LR")
    aside = at.get_right_vector()
    assert (right.x - left.x) * aside.x + (right.y - left.y) * aside.y > 0.3
    raised = carla.Transform(carla.Location(z=0.3))
    walker.set_bones(carla.WalkerBoneControlIn([("crl_hand__R", raised)]))
    walker.blend_pose(1.0)
    world.tick()
    after = {b.name: b for b in walker.get_bones().bone_transforms}
    assert abs(after["crl_hand__R"].relative.location.z - 0.3) < 1e-4
    tips = ("crl_handIndexEnd__R", "crl_handIndexEnd__L")
    moved = [after[t].world.location.z - bones[t].world.location.z for t in tips]
    assert moved[0] > 0.4 and abs(moved[1]) < 0.01, moved
    walker.blend_pose(0.0)
    world.tick()
    again = {b.name: b for b in walker.get_bones().bone_transforms}
    assert abs(again[tips[0]].world.location.z - bones[tips[0]].world.location.z) < 0.01
    """)
