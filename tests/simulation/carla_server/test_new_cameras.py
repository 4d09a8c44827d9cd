"""Optical flow, normals and dynamic vision, each against a second route."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.sensors.raster.view import View, world_to_camera
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.sensing.events_camera import EVENT, Retina, crossings
from skidpad.simulation.carla_server.sensing.motion import compute_flow
from skidpad.simulation.carla_server.sensing.normals import world_normals
from skidpad.simulation.carla_server.served import Served
from support.carla_streams import Kept


def view(pose: Pose) -> View:
    centre = np.array([pose.x, pose.y, pose.z])
    return View(80, 60, 40.0, 40.0, 30.0, world_to_camera(pose), centre)


def pixel(v: View, point: np.ndarray) -> tuple[float, float, float]:
    """Column, row and depth of a point of the world."""
    x, y, z = v.rotation @ (point - v.centre)
    return v.cx + v.focal * x / z, v.cy + v.focal * y / z, z


@pytest.mark.parametrize("spin", [0.0, 0.2])
def test_flow_is_where_a_point_is_less_where_it_was(spin):
    """A body that moves and turns, seen by a camera that does too: its points projected one by one."""
    now, before = view(Pose(1.0, 2.0, 1.5, 0.02, -0.03, 0.4)), view(Pose(0.4, 1.9, 1.4, yaw=0.37))
    here, there = Pose(14.0, 8.0, 0.5, yaw=0.7), Pose(13.2, 7.5, 0.4, yaw=0.7 - spin)
    turn = there.rotation() @ here.rotation().T
    shift = np.array([there.x, there.y, there.z]) - turn @ np.array([here.x, here.y, here.z])
    for row, column in ((10, 12), (30, 40), (50, 71)):
        depth = 9.0
        ray = np.array([(column + 0.5 - 40.0) / 40.0, (row + 0.5 - 30.0) / 40.0, 1.0])
        point = now.centre + now.rotation.T @ (depth * ray)
        inverse = np.full((60, 80), 1.0 / depth, dtype=np.float32)
        flow = compute_flow(now, before, turn, shift, inverse)[row, column]
        u, v, _ = pixel(before, turn @ point + shift)
        assert flow[0] * 40.0 == pytest.approx(column + 0.5 - u, abs=1e-3)
        assert -flow[1] * 30.0 == pytest.approx(row + 0.5 - v, abs=1e-3)


def test_the_sky_moves_by_turning_alone():
    straight, turned = view(Pose(0, 0)), view(Pose(5.0, 0.0, yaw=0.1))
    far = np.zeros((60, 80), dtype=np.float32)
    still = compute_flow(view(Pose(5.0, 0.0)), straight, np.eye(3), np.zeros(3), far)
    assert np.abs(still).max() < 1e-6
    to_the_left = compute_flow(turned, straight, np.eye(3), np.zeros(3), far)
    assert to_the_left[30, 40, 0] == pytest.approx(np.tan(0.1) * 40.0 / 40.0, rel=0.02)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (-0.8, 0.6, 0.0), (-0.5, -0.5, 0.7071)])
def test_normals_of_planes(normal):
    n = np.array(normal) / np.linalg.norm(normal)
    v = view(Pose(0.0, 0.0, 1.5, pitch=-0.1, yaw=0.3))
    at = v.centre + v.rotation.T @ np.array([0.0, 0.0, 10.0])  # a point of the plane
    u, w = np.meshgrid((np.arange(80) + 0.5 - 40.0) / 40.0, (np.arange(60) + 0.5 - 30.0) / 40.0)
    rays = np.stack((u, w, np.ones_like(u)), axis=-1) @ v.rotation  # planar depth 1
    inverse = np.maximum((rays @ n) / ((at - v.centre) @ n), 0.0)
    found = world_normals(v, inverse)
    facing = n if (at - v.centre) @ n < 0.0 else -n
    inside = inverse[2:-2, 2:-2] > 0.02
    assert np.abs(found[2:-2, 2:-2][inside] - facing).max() < 1e-6
    assert not found[inverse == 0.0].any()


def retina(**changes) -> Retina:
    values = {
        "positive": 0.3, "negative": 0.2, "sigma_positive": 0.0, "sigma_negative": 0.0,
        "refractory_ns": 0, "logarithmic": True, "log_eps": 1e-3,
    }  # fmt: skip
    return Retina(None, **(values | changes))


RNG = np.random.default_rng(1)


def test_each_threshold_that_is_crossed_is_an_event():
    r, light = retina(), np.zeros((2, 3))
    assert len(crossings(r, light, 0, RNG)) == 0
    brighter = light.copy()
    brighter[1, 2] = 1.0  # crosses 0.3, 0.6, 0.9
    brighter[0, 1] = -0.5  # crosses -0.2, -0.4
    events = crossings(r, brighter, 1000, RNG)
    events["t"][events["polarity"]] = (
        events["t"][events["polarity"]] + 1
    ) // 10 * 10 - 1  # rounding
    assert events.dtype.itemsize == 13
    assert [(int(e["x"]), int(e["y"]), int(e["t"]), bool(e["polarity"])) for e in events] == [
        (2, 1, 299, True), (1, 0, 400, False), (2, 1, 599, True), (1, 0, 800, False), (2, 1, 899, True),
    ]  # fmt: skip
    assert len(crossings(r, brighter, 2000, RNG)) == 0
    brighter = brighter.copy()
    brighter[1, 2] = 1.3  # the level is at 0.9: next at 1.2
    assert crossings(r, brighter, 3000, RNG)["t"].tolist() == pytest.approx([2666], abs=1)


def test_a_pixel_rests_after_an_event():
    r, light = retina(refractory_ns=500), np.zeros((1, 1))
    crossings(r, light, 0, RNG)
    assert crossings(r, light + 1.0, 1000, RNG)["t"].tolist() == pytest.approx([300, 900], abs=1)
    assert np.dtype(EVENT).names == ("x", "y", "t", "polarity")


def test_all_three_send_as_others_do(tmp_path):
    """Sizes of what travels; the first picture shows no motion and no events."""
    hub = Kept()
    served = Served(ServerOptions(map="straight"), hub)
    size = {"image_size_x": "64", "image_size_y": "48"}
    kinds = ("optical_flow", "normals", "dvs")
    episode = served.episode
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), episode.map.spawn_points[0])
    streams = []
    for kind in kinds:
        wanted = Wanted(f"sensor.camera.{kind}", size)
        pose = Pose(0.5, 0.0, 1.8)
        streams.append(episode.attach(wanted, pose, car.id, Attachment.RIGID).stream)
    served.tick()
    yaw = episode.map.spawn_points[0].yaw
    episode.vehicles.set_velocity(car.id, (8.0 * np.cos(yaw), 8.0 * np.sin(yaw), 0.0))
    for _ in range(3):
        served.tick()
    flow, shape, events = (hub.told.get(s, []) for s in streams)
    assert [len(m) for m in flow] == [48 + 12 + 64 * 48 * 8] * 4
    assert [len(m) for m in shape] == [48 + 12 + 64 * 48 * 4] * 4
    assert events
    assert all((len(m) - 60) % 13 == 0 for m in events)
    pictures = [np.frombuffer(m[60:], "<f4").reshape(48, 64, 2) for m in flow]
    assert np.abs(pictures[0]).max() == 0.0
    assert pictures[-1][30, 32, 1] < -0.005  # the road comes towards the camera: down the picture
    bgra = np.frombuffer(shape[0][60:], np.uint8).reshape(48, 64, 4)
    up = bgra[30, 32].astype(int) - (255, 128, 128, 255)  # the road's normal
    assert np.abs(up).max() <= 2
