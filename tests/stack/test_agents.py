"""Leaderboard-style agents: CARLA's axes in and out, the sensors that they ask for."""

from __future__ import annotations

from dataclasses import replace
from math import degrees

import numpy as np
import pytest

from skidpad.core.errors import ConfigError, FileError, StackError
from skidpad.core.frames import CameraImage, LidarPoints, RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.maths.geodesy import EARTH_RADIUS
from skidpad.core.states import EgoEstimate
from skidpad.roads.bundled import load_map
from skidpad.stack.agents import load_agent

CODE = """
from types import SimpleNamespace
class Agent:
    def setup(self, path): self.seen, self.gone = [], False
    def sensors(self):
        return [
            {'type': 'sensor.camera.rgb', 'id': 'left', 'x': 1.0, 'y': -0.5, 'z': 1.5, 'yaw': -30.0,
             'width': 64, 'height': 48, 'fov': 100},
            {'type': 'sensor.other.gnss', 'id': 'gps'},
            {'type': 'sensor.other.imu', 'id': 'imu'},
            {'type': 'sensor.speedometer', 'id': 'speed'},
        ]
    def set_global_plan(self, gps, world): self.gps, self.world = gps, world
    def run_step(self, data, timestamp):
        self.seen.append((data, timestamp))
        return SimpleNamespace(throttle=0.3, brake=0.0, steer=0.2, hand_brake=False, reverse=False)
    def destroy(self): self.gone = True
class Lidar(Agent):
    def sensors(self):
        return [{'type': 'sensor.lidar.ray_cast', 'id': 'l', 'x': 1.3, 'y': 0.4, 'z': 2.5, 'yaw': -90.0}]
class Sonar(Agent):
    def sensors(self): return [{'type': 'sensor.other.sonar', 'id': 's'}]
class Half:
    def run_step(self, data, timestamp): pass
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "agents.py"
    path.write_text(CODE, encoding="utf-8")
    return path


def a_frame(pose: Pose, images=None) -> SensorFrame:
    ego = EgoEstimate(pose, 12.0, 0.1, 1.0, 2.0, (12.0,) * 4, 3)
    return SensorFrame(40, ego, images or {}, {}, RadarPoints.none(), {})


HERE = Pose(100.0, -5.25, 0.0)


def drive(file, pose=HERE):
    stack = load_agent(f"{file}:Agent")((), load_map("straight"), {})
    rgb = np.zeros((48, 64, 3), np.uint8)
    rgb[..., 0] = 200  # red
    return stack, stack.tick(a_frame(pose, {"agent/left": CameraImage(rgb=rgb)}))


@pytest.mark.req("G-6", "X-4")
def test_a_lidar_is_mounted_and_read_in_carla_axes(file):
    stack = load_agent(f"{file}:Lidar")((), load_map("straight"), {})
    (spec,) = stack.sensors()
    assert (spec.channels, spec.range, spec.points_per_second) == (64, 85.0, 600_000)
    assert (spec.mount.y, degrees(spec.mount.yaw)) == (-0.4, pytest.approx(90.0))
    points = LidarPoints(
        np.array([[5.0, 2.0, -1.0], [4.0, -3.0, 0.5]], np.float32),
        np.array([0.9, 0.8], np.float32),
        np.ones(2, np.float32),
        np.zeros(2, np.uint8),
        np.zeros(2, np.uint16),
    )
    stack.tick(replace(a_frame(HERE), extra={spec.id: points}))
    _, seen = stack.agent.seen[0][0]["l"]
    assert seen.dtype == np.float32
    assert seen.tolist() == [[5.0, -2.0, -1.0, np.float32(0.9)], [4.0, 3.0, 0.5, np.float32(0.8)]]


@pytest.mark.req("B-121", "X-4", "X-5")
def test_steering_right_in_carla_is_negative_here(file):
    _, command = drive(file)
    assert (command.throttle, command.steer) == (0.3, -0.2)


def test_cameras_are_mounted_on_the_side_that_the_agent_means(file):
    stack, _ = drive(file)
    (camera,) = stack.sensors()
    assert (camera.width, camera.height, camera.fov_deg) == (64, 48, 100.0)
    assert camera.mount.y == 0.5  # left of the ego
    assert degrees(camera.mount.yaw) == pytest.approx(30.0)  # looks left


def test_readings_come_as_in_the_leaderboard(file):
    stack, _ = drive(file, Pose(100.0, -5.25, 0.0, yaw=0.5))
    data, timestamp = stack.agent.seen[0]
    assert timestamp == pytest.approx(2.0)
    frame, image = data["left"]
    assert frame == 40
    assert image.shape == (48, 64, 4)
    assert image[0, 0].tolist() == [0, 0, 200, 255]  # BGRA
    assert data["speed"][1] == {"speed": 12.0}
    lat, lon, _ = data["gps"][1]
    assert np.radians(lat) * EARTH_RADIUS == pytest.approx(-5.25, abs=1e-6)
    assert np.radians(lon) * EARTH_RADIUS == pytest.approx(100.0, abs=1e-3)
    ax, ay, _, _, _, wz, compass = data["imu"][1]
    assert (ax, ay, wz) == (1.0, -2.0, -0.1)  # right and clockwise are positive there
    assert compass == pytest.approx(np.pi / 2 - 0.5)


def test_the_plan_leads_along_the_lane_in_carla_axes(file):
    stack, _ = drive(file)
    places = [t.location for t, _ in stack.agent.world]
    assert len(places) == len(stack.agent.gps) == 100
    assert {p.y for p in places} == {5.25}  # the right lane lies at positive y there
    assert places[1].x - places[0].x == pytest.approx(5.0)
    stack.close()
    assert stack.agent.gone


def test_what_cannot_be_given_is_said(file):
    road = load_map("straight")
    with pytest.raises(StackError, match=r"sensor\.other\.sonar"):
        load_agent(f"{file}:Sonar")((), road, {})
    blind = load_agent(f"{file}:Agent")((), road, {})
    with pytest.raises(StackError, match="--sensors pixels"):
        blind.tick(a_frame(Pose(100.0, -5.25)))
    with pytest.raises(ConfigError, match="has no method setup"):
        load_agent(f"{file}:Half")
    with pytest.raises(ConfigError, match="has no class Nobody"):
        load_agent(f"{file}:Nobody")
    with pytest.raises(FileError, match="does not exist"):
        load_agent(f"{file.parent / 'nowhere.py'}:Agent")
