"""Fog in pictures: the visual range of a file, density that falls with height, a sky without rings."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.campaign.driving.outdoors import weather_of
from skidpad.core.geometry import Pose
from skidpad.core.setup import CameraOptics
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.optics import air_depth, air_of, fog_extinction, fog_share
from skidpad.physics.presets import preset
from skidpad.roads.roadside import Box
from skidpad.scenarios.reading.environment import Environment
from skidpad.sensors.finish.extras import ALL_EXTRAS, Extra
from skidpad.sensors.finish.tone import CURVE, set_tone
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

EYE = CameraSpec("eye", Modality.RGB, 400, 300, 20.0, Pose(0.0, 0.0, 1.5))
ABOVE_HORIZON = 148  # the row of pixels that shows the lowest sky
PEOPLE = PixelSettings(camera_effect=False, extras=frozenset({Extra.FOG}))
HAZE = PixelSettings(camera_effect=False, optics=CameraOptics(haze=True))
STEP = 0.015  # of contrast: a step of a byte and its rounding


def seen(weather, boxes, settings=PEOPLE, camera=EYE):
    """Linear light of a picture of boxes along a straight road, and what stands in each pixel."""
    labels = replace(camera, id="map", modality=Modality.SEMANTIC)
    world = straight(900, rails=False, boxes=boxes)
    suite = PixelSuite(world, table_of([]), [camera, labels], weather, settings)
    images = suite.observe(0, states_at([(50, -7, 0, 0.0)]), {}).images
    return (images["eye"].rgb / 255.0) ** 2, images["map"].labels.copy()


def black(distance, height=6.0):
    """A black wall of 6 m across the line of sight, `distance` m from the eye."""
    middle = 51.0 + distance, -7.0, 0.0, 0.0
    return Box(SemanticClass.BUILDING, *middle, 2.0, 6.0, height, rgb=(0, 0, 0))


@pytest.mark.osc("EnvironmentAction")
@pytest.mark.parametrize("settings", [PEOPLE, HAZE], ids=["for people", "camera_haze"])
@pytest.mark.parametrize("base", ["clear-noon", "rain-noon"])
@pytest.mark.parametrize("visual", [150.0, 400.0])
def test_contrast_of_black_targets_is_that_of_the_visual_range(visual, base, settings):
    """WMO-No. 8, 9.1: 5 % of a black target's contrast are left at the range, so 0.05^(d / range) at d."""
    dry = Environment(visual_range=visual, clouds=0.0)  # which ends the rain of the weather before
    weather = weather_of(dry, preset(base), "x")
    for distance in (visual / 4.0, visual / 2.0, visual):
        light, labels = seen(weather, [black(distance)], settings)
        row = ABOVE_HORIZON
        assert labels[row, 200] == SemanticClass.BUILDING
        assert labels[row, 0] == SemanticClass.SKY
        contrast = float(np.mean((light[row, 0] - light[row, 200]) / light[row, 0]))
        assert contrast == pytest.approx(0.05 ** (distance / visual), abs=STEP)


HIGH = [
    Weather(fog_density=80.0, fog_falloff=falloff, fog_distance=start)
    for falloff, start in ((0.2, 0.0), (1.0, 0.0), (5.0, 30.0))
]


def by_steps(weather, distance, height, climb):
    """The optical depth of fog on a way, summed over its parts: density is halved each 10 m / falloff."""
    foggy = max(distance - weather.fog_distance, 0.0)
    way = weather.fog_distance + (np.arange(20_000) + 0.5) / 20_000 * foggy
    z = height + climb * way / distance
    density = 2.0 ** (-0.1 * weather.fog_falloff * np.maximum(z, 0.0))
    return fog_extinction(weather) * float(density.mean()) * foggy


@given(
    weather=st.sampled_from(HIGH),
    height=st.floats(-20.0, 120.0),
    climb=st.floats(-120.0, 120.0),
    distance=st.floats(121.0, 400.0),
)
def test_fog_on_a_sloping_way_is_the_sum_over_its_parts(weather, height, climb, distance):
    found = air_depth(air_of(weather, 0.0), distance, height, climb)
    assert found == pytest.approx(by_steps(weather, distance, height, climb), rel=2e-3, abs=1e-4)


def test_fog_is_alike_at_all_heights_without_falloff_or_ground():
    even = Weather(fog_density=80.0)
    assert air_of(even, 3.0) == air_of(even)
    assert fog_share(air_of(even, 0.0), 50.0, -50.0) == 1.0
    assert air_of(HIGH[1]).thinning == 0.0
    for name in ("rain-noon", "rain-night"):  # fog_falloff 2, with a fog that leaves 11 km of sight
        assert air_of(preset(name), 0.0) == air_of(preset(name))


@pytest.mark.parametrize("weather", HIGH, ids=lambda w: f"falloff {w.fog_falloff:g}")
@pytest.mark.parametrize("height", [1.5, 40.0])
def test_contrast_in_a_picture_follows_the_density_by_height(weather, height):
    """A black tower of 60 m, 100 m away, from its foot to its top."""
    camera = CameraSpec("eye", Modality.RGB, 400, 300, 70.0, Pose(0.0, 0.0, height))
    light, labels = seen(weather, [black(100.0, 60.0)], camera=camera)
    horizon = lighting(weather).horizon
    rows = np.flatnonzero(labels[:, 200] == SemanticClass.BUILDING)[2:-2]
    assert len(rows) > 40
    for row in rows[::10]:
        slope = (149.5 - row) / camera.focal
        expected = exp(-by_steps(weather, 100.0 * np.hypot(1.0, slope), height, 100.0 * slope))
        contrast = float(np.mean((horizon - light[row, 200]) / horizon))
        assert contrast == pytest.approx(expected, abs=STEP)


def test_a_shallow_fog_leaves_the_sky_and_a_deep_one_hides_it():
    """At the same density: 3 nepers per 106 m, in 3 m of fog and in 72 m."""
    high = CameraSpec("eye", Modality.RGB, 400, 300, 70.0, Pose(0.0, 0.0, 1.5, 0.0, -0.6, 0.0))
    shallow, deep = (Weather(fog_density=90.0, fog_falloff=f) for f in (5.0, 0.2))
    clear, _ = seen(Weather(), [], camera=high)
    changed = [np.abs(seen(w, [], camera=high)[0] - clear)[20].max() for w in (shallow, deep)]
    assert changed[0] < 0.08 < 0.2 < changed[1]


def test_the_sky_in_fog_has_no_rings():
    """Means of 8 x 8 pixels differ from a smooth surface by far less than a step of a byte."""
    fog = Weather(fog_density=100.0, cloudiness=100.0, sun_altitude_deg=30.0)
    settings = replace(PEOPLE, extras=ALL_EXTRAS)
    camera = CameraSpec("eye", Modality.RGB, 400, 304, 70.0, Pose(0.0, 0.0, 1.5, 0.0, -0.6, 0.0))
    light, labels = seen(fog, [], settings, camera)
    assert (labels[:200] == SemanticClass.SKY).all()
    green = 255.0 * np.sqrt(light[:200, :, 1])
    means = green.reshape(25, 8, 50, 8).mean(axis=(1, 3))
    y, x = np.mgrid[-1:1:25j, -1:1:50j]
    terms = np.stack([x**i * y**j for i in range(7) for j in range(7 - i)], axis=-1)
    flat = terms.reshape(-1, terms.shape[-1])
    smooth = flat @ np.linalg.lstsq(flat, means.ravel(), rcond=None)[0]
    assert np.abs(means.ravel() - smooth).max() < 0.2


def test_tone_keeps_the_mean_of_an_even_grey():
    camera = CameraSpec("a", Modality.RGB, 256, 64, 1.0, Pose(0.0, 0.0))
    means = []
    for grey in range(60, 70):
        word = np.uint32(grey | grey << 8 | grey << 16 | 0xFF000000)
        out = np.full((64, 256), word)
        set_tone(camera_view(camera, Pose(0.0, 0.0)), CURVE, out)
        means.append((out & 255).mean())
    assert np.ptp(np.diff(means)) < 0.1, "as even as the curve, not in steps"
