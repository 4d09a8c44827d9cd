"""The lidar on scenes with known distances."""

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.specs import LidarSpec
from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.core.weather import Weather
from skidpad.sensors.ranging.lidar import Lidar
from skidpad.sensors.suite import PixelSuite
from support.sensors.worlds import states_at, straight, table_of

SPEC = LidarSpec("l", Pose(0.0, 0.0, 2.4), channels=16, range=60.0, rotation_hz=20.0)


def turn(table, states, spec=SPEC, tick=0):
    suite = PixelSuite(straight(400), table, [], Weather())
    suite.observe(tick, states, {})
    return Lidar(spec, 0.05).measure(tick, states.pose(0), suite.scene, 0)


def test_the_road_lies_in_its_plane_all_around():
    points = turn(table_of([]), states_at([(200, -7, 0, 0.4)]))
    road = points.label == SemanticClass.ROAD
    assert road.sum() > 300
    assert np.allclose(points.xyz[road, 2], -2.4, atol=1e-4)
    azimuth = np.arctan2(points.xyz[road, 1], points.xyz[road, 0])
    assert np.histogram(azimuth, 8, (-np.pi, np.pi))[0].min() > 10
    distance = np.linalg.norm(points.xyz[road], axis=1)
    assert np.allclose(points.cosine[road], 2.4 / distance, rtol=1e-4)


def test_a_car_is_where_it_stands_with_class_and_instance():
    places = [(200, -7, 0, 0.0), (215, -3.5, 0, 0.0), (180, -7, 0, 0.0)]
    points = turn(table_of([ActorKind.CAR, ActorKind.BUS]), states_at(places))
    for instance, label, (x, y) in (
        (2, SemanticClass.CAR, (15, 3.5)),
        (3, SemanticClass.BUS, (-20, 0)),
    ):
        hit = points.instance == instance
        assert hit.sum() > 5
        assert (points.label[hit] == label).all()
        assert np.abs(points.xyz[hit, 0] - x).max() < 6.1
        assert np.abs(points.xyz[hit, 1] - y).max() < 1.3


def test_a_tick_covers_its_part_of_the_turn():
    slow = LidarSpec("l", SPEC.mount, channels=16, range=60.0, rotation_hz=5.0)
    states = states_at([(200, -7, 0, 0.0)])
    seen = [turn(table_of([]), states, slow, tick).xyz for tick in range(4)]
    for tick, xyz in enumerate(seen):
        clockwise = -np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi)
        assert (np.abs(clockwise - (tick + 0.5) * np.pi / 2) < np.pi / 4 + 1e-6).all()


def test_a_lidar_that_looks_straight_down_is_refused():
    with pytest.raises(ConfigError, match="vertical angles"):
        Lidar(LidarSpec("l", SPEC.mount, lower_fov_deg=-90.0), 0.05)
