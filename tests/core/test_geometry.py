from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, footprint, wrap_angle
from skidpad.core.maths.lefthanded import pose_from_carla, pose_to_carla
from skidpad.core.maths.randomness import stream
from skidpad.core.weather import Weather

angles = floats(-1.5, 1.5)
lengths = floats(-100.0, 100.0)


@given(lengths, lengths, lengths, angles, angles, angles)
@pytest.mark.req("A-016")
def test_carla_axes_round_trip(x, y, z, roll, pitch, yaw):
    pose = Pose(x, y, z, roll, pitch, yaw)
    cx, cy, cz, croll, cpitch, cyaw = pose_to_carla(pose)
    back = pose_from_carla(cx, cy, cz, croll, cpitch, cyaw)
    assert back.rotation() == pytest.approx(pose.rotation(), abs=1e-12)
    assert (back.x, back.y, back.z) == (pose.x, pose.y, pose.z)


def test_carla_right_turn_is_negative_yaw():
    assert pose_from_carla(0, 5.0, 0, yaw=90.0).yaw == pytest.approx(-pi / 2)
    assert pose_from_carla(0, 5.0, 0).y == -5.0


@given(lengths, lengths, angles, lengths, lengths, angles, angles)
def test_composition_is_matrix_product(x, y, yaw, u, v, roll, pitch):
    a, b = Pose(x, y, 1.0, yaw=yaw), Pose(u, v, -2.0, roll, pitch, 0.3)
    c = a @ b
    assert c.rotation() == pytest.approx(a.rotation() @ b.rotation(), abs=1e-9)
    assert (c.x, c.y) == pytest.approx(
        (x + np.cos(yaw) * u - np.sin(yaw) * v, y + np.sin(yaw) * u + np.cos(yaw) * v)
    )


def test_positive_pitch_is_nose_down():
    assert (Pose(0, 0, 0, pitch=0.1).rotation() @ (1, 0, 0))[2] < 0


@given(floats(-50, 50))
def test_wrapped_angle_is_in_range_and_equal_on_the_circle(angle):
    wrapped = wrap_angle(angle)
    assert -pi < wrapped <= pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)


def test_footprint_is_turned_and_ordered():
    corners = footprint(1.0, 2.0, pi / 2, 4.0, 2.0)
    assert corners[0] == pytest.approx((0.0, 4.0))  # front left of a car that faces +y
    assert corners[2] == pytest.approx((2.0, 0.0))


def test_streams_are_independent_of_order_and_of_each_other():
    a = stream(7, "camera", "rain").random(3)
    stream(7, "radar").random(3)
    assert np.array_equal(a, stream(7, "camera", "rain").random(3))
    assert not np.array_equal(a, stream(7, "camera", "night").random(3))
    assert not np.array_equal(a, stream(8, "camera", "rain").random(3))


@pytest.mark.req("B-010")
def test_weather_out_of_range_names_field_value_and_range():
    with pytest.raises(ConfigError, match=r"weather.wetness must be between 0 and 100, got 101"):
        Weather(wetness=101)
    with pytest.raises(ConfigError, match="weather.ice_thickness"):
        Weather(ice_thickness=float("nan"))
