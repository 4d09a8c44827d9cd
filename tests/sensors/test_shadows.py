"""Shadows for people: where they fall, and that nothing else changes."""

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.optics import fog_extinction
from skidpad.physics.presets import preset
from skidpad.roads.roadside import Box, Shape
from skidpad.sensors.finish.casters import Bodies, standing
from skidpad.sensors.finish.extras import NO_EXTRAS, Extra
from skidpad.sensors.finish.fog import fog_of
from skidpad.sensors.finish.shadows import GROUND_MASK, cast_shadows, shade_of
from skidpad.sensors.pictures.lighting import lighting
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of

# from straight above, 20 m over the road: 400 px show 2 * 20 m, so 10 px are a metre
ABOVE = Pose(0.0, 0.0, 20.0, 0.0, np.pi / 2, 0.0)
PX = 10


def seen(weather, shadows, view=ABOVE):
    """Colour, inverse depth and classes of a bus ahead; the ego is far behind."""
    cameras = [
        CameraSpec(m.value, m, 400, 400, 90.0, view, True)
        for m in (Modality.RGB, Modality.DEPTH, Modality.SEMANTIC)
    ]
    settings = PixelSettings(
        camera_effect=False, extras=frozenset({Extra.SHADOWS}) if shadows else NO_EXTRAS
    )
    world = straight(300, rails=False)
    suite = PixelSuite(world, table_of([ActorKind.CAR]), cameras, weather, settings)
    states = states_at([(100.0, -8.75, 0.0, 0.0), (108.0, -8.75, 0.0, 0.0)])
    images = suite.observe(0, states, {}).images
    return (
        images["rgb"].rgb.astype(float).mean(axis=2),
        images["depth"].inverse_depth.copy(),
        images["semantic"].labels.copy(),
        suite,
    )


def shade_in(weather):
    light = lighting(weather, haze=True, ground=0.0)
    return shade_of(weather, light, fog_of(weather, light))


def test_only_the_ground_about_a_body_is_darker():
    plain, depth, labels, _ = seen(preset("clear-noon"), False)
    shaded, same_depth, same_labels, suite = seen(preset("clear-noon"), True)
    assert np.array_equal(depth, same_depth)
    assert np.array_equal(labels, same_labels)
    darker = shaded < plain - 1.0
    assert (shaded <= plain + 1e-9).all()
    length = suite._table.length[1]
    rows, columns = np.nonzero(darker)
    # forward is up in the picture: the car ahead is 8 m above the middle
    ahead = (200 - rows) / PX
    assert darker.sum() > 200
    near_ahead = np.abs(ahead - 8.0) < 0.5 * length + 1.5
    near_ego = np.abs(ahead) < 0.5 * suite._table.length[0] + 1.5
    assert (near_ahead | near_ego).all()
    assert (np.abs(columns - 200) / PX < 3.0).all()


@pytest.mark.parametrize(("azimuth", "side"), [(90.0, 1.0), (270.0, -1.0)])
def test_a_low_sun_throws_long_shadows_away_from_it(azimuth, side):
    low = Weather(sun_altitude_deg=20.0, sun_azimuth_deg=azimuth)
    plain, *_ = seen(low, False)
    shaded, *_, suite = seen(low, True)
    _, columns = np.nonzero(shaded < plain - 3.0)
    left = (200 - columns) / PX
    # azimuth is CARLA-handed: at 90 deg the sun stands to the right, so shadows fall to the left
    half = 0.5 * suite._table.width.max()
    assert (side * left).max() > half + 2.0
    assert (-side * left).max() < half + 1.0


def test_without_sun_there_is_no_edge_but_still_contact():
    plain, *_ = seen(preset("clear-night"), False)
    shaded, *_ = seen(preset("clear-night"), True)
    assert (shaded <= plain).all()
    overcast = Weather(cloudiness=100.0, sun_altitude_deg=20.0, sun_azimuth_deg=90.0)
    dull = seen(overcast, False)[0] - seen(overcast, True)[0]
    sharp = Weather(sun_altitude_deg=20.0, sun_azimuth_deg=90.0)
    bright = seen(sharp, False)[0] - seen(sharp, True)[0]
    assert (dull > 3.0).sum() < 0.7 * (bright > 3.0).sum()


def test_fog_before_a_shadow_veils_it():
    """20 m of dense fog leave (1 + 1.2 / 16)^-16 = 0.31 of the ground's light; what the air adds stays."""
    fog, left = Weather(fog_density=100.0), 0.314
    assert fog_extinction(fog) == pytest.approx(0.06, rel=0.01)
    light = lighting(fog)
    view = camera_view(CameraSpec("rgb", Modality.RGB, 400, 400, 90.0, ABOVE), Pose(10.0, 0.0, 0.0))
    keys = np.full((400, 400), Material.GRASS, dtype=np.int32)
    inverse = np.full((400, 400), 1.0 / 20.0, dtype=np.float32)
    shade = shade_in(fog)

    def darkest(ground, veil, air):
        value = round(255.0 * np.sqrt(ground + veil))
        picture = np.full((400, 400), 0xFF000000 + value * 0x010101, dtype=np.uint32)
        bodies, inside = standing([post(10.0, 4.0)]), shade._replace(air=air)
        cast_shadows(view, bodies, inside, GROUND_MASK, inverse, keys, picture)
        return (picture.view(np.uint8).reshape(400, 400, 4)[200, 200:, 1].min() / 255.0) ** 2

    share = darkest(0.3, 0.0, shade.air._replace(fog=0.0)) / 0.3
    assert share < 0.6
    veil = (1.0 - left) * float(light.horizon[1])
    assert darkest(left * 0.1, veil, shade.air) == pytest.approx(
        left * 0.1 * share + veil, abs=0.01
    )
    assert veil > 0.3, "and not by 0.31 of the dark, as if the air were as dark as the ground"


def test_the_sun_casts_no_shadow_through_deep_fog():
    """150 m of fog of 60 m of sight keep its beam away; its light comes from all sides then."""
    shares = [float(shade_in(Weather(fog_density=d)).sun.mean()) for d in (0.0, 10.0, 30.0, 100.0)]
    assert shares[0] > 0.5
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > shares[2] + 0.02
    assert shares[-1] < 0.001


def test_a_crown_throws_a_round_shadow_beside_its_stem_and_a_beam_over_the_road_none():
    def box(x, z, height, width, shape):
        return Box(SemanticClass.VEGETATION, x, 0.0, z, 0.0, width, width, height, shape=shape)

    crown = box(10.0, 2.0, 4.0, 3.0, Shape.CROWN)
    stem = box(10.0, 0.0, 2.3, 0.3, Shape.POST)
    bodies = standing([stem, crown, box(40.0, 6.0, 1.0, 2.0, Shape.BOX)])
    assert bodies.lift.tolist() == [0.0, 2.0, 0.0]
    assert bodies.round.tolist() == [False, True, False]
    weather = Weather(sun_altitude_deg=45.0, sun_azimuth_deg=0.0)
    view = camera_view(CameraSpec("rgb", Modality.RGB, 400, 400, 90.0, ABOVE), Pose(10.0, 0.0, 0.0))
    ground = np.full((400, 400), Material.GRASS, dtype=np.int32)
    inverse = np.full((400, 400), 1.0 / 20.0, dtype=np.float32)

    def dark(only):
        picture = np.full((400, 400), 0xFF808080, dtype=np.uint32)
        one = Bodies._make(field[only] for field in bodies)
        shade = shade_in(weather)
        cast_shadows(view, one, shade, GROUND_MASK, inverse, ground, picture)
        return (200 - np.nonzero(picture != 0xFF808080)[0]) / PX

    way = dark([1])  # m behind the stem: the sun stands ahead of it, 1 m of shadow per m of height
    assert way.max() == pytest.approx(-2.0 + 0.85 * 1.5, abs=0.25)
    assert way.min() == pytest.approx(-6.0 - 0.85 * 1.5, abs=0.25)
    assert dark([0]).size > 0
    assert dark([2]).size == 0


def shadows_of(boxes, weather, ground_at=0.0):
    """Returns the light that shadows leave, by row, along the middle column from 40 m above the place 20, 0.

    The view shows 2 * 40 m, 5 px a metre, ahead is up. ground_at: m of the ground above the boxes' feet.
    """
    view = camera_view(
        CameraSpec("rgb", Modality.RGB, 400, 400, 90.0, Pose(0.0, 0.0, 40.0, 0.0, np.pi / 2, 0.0)),
        Pose(20.0, 0.0, 0.0),
    )
    keys = np.full((400, 400), Material.GRASS, dtype=np.int32)
    inverse = np.full((400, 400), 1.0 / (40.0 - ground_at), dtype=np.float32)
    picture = np.full((400, 400), 0xFFFFFFFF, dtype=np.uint32)
    shade = shade_in(weather)
    cast_shadows(view, standing(boxes), shade, GROUND_MASK, inverse, keys, picture)
    return picture.view(np.uint8).reshape(400, 400, 4)[:, 200, 1] / 255.0


def post(x, height):
    return Box(SemanticClass.POLE, x, 0.0, 0.0, 0.0, 1.0, 1.0, height)


def test_a_low_sun_throws_shadows_of_tens_of_metres_that_fade():
    low = Weather(sun_altitude_deg=8.0, sun_azimuth_deg=180.0)
    left = shadows_of([post(10.0, 5.0)], low)  # 5 m / tan 8 deg = 36 m ahead of it
    at = {m: left[round(200 - 5 * (m - 20.0))] for m in (8.0, 14.0, 20.0, 44.0, 50.0)}
    assert at[8.0] == at[50.0] == 1.0
    assert at[14.0] < 0.65
    assert at[14.0] < at[44.0] < 1.0
    cloudy = Weather(sun_altitude_deg=8.0, sun_azimuth_deg=180.0, cloudiness=80.0)
    assert shadows_of([post(10.0, 5.0)], cloudy)[230] > at[14.0] + 0.1


def test_where_two_shadows_meet_it_is_no_darker():
    low = Weather(sun_altitude_deg=15.0, sun_azimuth_deg=180.0)
    one = shadows_of([post(10.0, 8.0)], low)
    two = shadows_of([post(10.0, 8.0), post(14.0, 8.0)], low)
    assert two[200] == pytest.approx(one[200], abs=0.02)


def test_a_shadow_falls_farther_on_lower_ground():
    sun = Weather(sun_altitude_deg=20.0, sun_azimuth_deg=180.0)
    level, low = (shadows_of([post(10.0, 3.0)], sun, z) for z in (0.0, -0.5))
    ends = [20.0 + (200 - np.flatnonzero(left < 0.99).min()) / 5.0 for left in (level, low)]
    farther = 0.5 / np.tan(np.radians(20.0))
    assert ends[1] - ends[0] == pytest.approx(farther, abs=0.5)
