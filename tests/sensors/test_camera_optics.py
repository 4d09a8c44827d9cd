"""Colour pictures show the quantities of `physics.camera`: contrast is measured in pixels."""

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.setup import CameraOptics
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import ActorKind
from skidpad.core.weather import Weather
from skidpad.physics import camera
from skidpad.physics.optics import CONTRAST_SEEN, sight
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

EYE = CameraSpec("eye", Modality.RGB, 400, 300, 20.0, Pose(0.0, 0.0, 1.5))
MAP_EYE = CameraSpec("map", Modality.INSTANCE, 400, 300, 20.0, Pose(0.0, 0.0, 1.5))
HAZE = CameraOptics(haze=True)
STEP = 0.015  # of contrast: a step of a byte and its rounding


def linear(weather, distance, optics):
    """Linear light of a lorry's rear in the middle of a picture, the rear `distance` m from the eye."""
    table = table_of([ActorKind.TRUCK])
    ahead = 50.0 + distance + 0.5 * table.length[1]
    states = states_at([(50, -7, 0, 0.0), (ahead, -7, 0, 0.0)])
    settings = PixelSettings(camera_effect=False, optics=optics)
    suite = PixelSuite(straight(400, rails=False), table, [EYE, MAP_EYE], weather, settings)
    images = suite.observe(0, states, {}).images
    assert images["map"].instances[150, 200] == 2
    return (images["eye"].rgb[150, 200] / 255.0) ** 2


def contrast(weather, distance, optics=HAZE):
    """What air leaves of the contrast against the horizon, measured in two pictures."""
    clear = weather.__class__(fog_distance=1000.0)
    horizon = lighting(weather).horizon
    through = linear(weather, distance, optics) - horizon
    return float(np.mean(through / (linear(clear, distance, optics) - horizon)))


FOG = Weather(fog_density=75.0)  # 223 m of sight
LATE = Weather(fog_density=90.0, fog_distance=40.0)
RAIN = Weather(fog_density=90.0, fog_distance=40.0, precipitation=60.0)


@pytest.mark.parametrize("weather", [FOG, LATE, RAIN], ids=["fog", "fog from 40 m", "and rain"])
@pytest.mark.parametrize("distance", [20.0, 60.0, 120.0])
def test_contrast_in_a_picture_is_that_of_camera_physics(weather, distance):
    clear = camera.contrast_at(1.0, Weather(fog_distance=1000.0), distance)
    assert clear == 1.0
    expected = camera.contrast_at(1.0, weather, distance)
    assert contrast(weather, distance) == pytest.approx(expected, abs=STEP)


def test_at_the_range_of_sight_a_picture_has_the_contrast_that_defines_it():
    """WMO-No. 8, 9.1: 5 % of a black object's contrast are left at the meteorological optical range."""
    assert contrast(FOG, sight(FOG)) == pytest.approx(CONTRAST_SEEN, abs=STEP)
    published = contrast(FOG, sight(FOG), CameraOptics())
    assert published == pytest.approx((1.0 + 3.0 / 16.0) ** -16, abs=STEP)  # 0.064


def test_the_law_for_pictures_is_the_exponential():
    depth = np.linspace(0.0, 20.0, 2001, dtype=np.float32)
    exact = camera.share_left.py_func(depth, np.float32(1.0))
    assert np.abs(exact - np.exp(-depth)).max() < 1e-4
    plain = camera.share_left.py_func(depth, np.float32(0.0))
    assert 0.016 < np.abs(plain - np.exp(-depth)).max() < 0.017


def test_the_published_pictures_keep_all_extinction_where_fog_begins():
    one, other = lighting(RAIN), lighting(RAIN, haze=True)
    assert (one.curved, other.curved) == (0.0, 1.0)
    assert one.air.rain == 0.0
    assert one.air.fog == pytest.approx(other.air.fog + other.air.rain)
