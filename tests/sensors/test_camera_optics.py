"""Colour pictures show the quantities of `physics.camera`: contrast is measured in pixels."""

import csv
from pathlib import Path

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.inputs import Beam
from skidpad.core.setup import CameraOptics
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.vocabulary import ActorKind
from skidpad.core.weather import Weather
from skidpad.physics import camera
from skidpad.physics.droplets import rain_drops
from skidpad.physics.grip import road_surface
from skidpad.physics.optics import CONTRAST_SEEN, sight
from skidpad.physics.presets import preset
from skidpad.physics.spray import spray_density
from skidpad.sensors.pictures.exposure import DARKEST, LUMA, expose, exposure_of
from skidpad.sensors.pictures.lens import cover_glass, glass_of
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
    law = np.vectorize(camera.share_left.py_func)
    exact = law(depth, np.float32(1.0))
    assert np.abs(exact - np.exp(-depth)).max() < 1e-4
    plain = law(depth, np.float32(0.0))
    assert 0.016 < np.abs(plain - np.exp(-depth)).max() < 0.017


def test_the_published_pictures_keep_all_extinction_where_fog_begins():
    one, other = lighting(RAIN), lighting(RAIN, haze=True)
    assert (one.curved, other.curved) == (0.0, 1.0)
    assert one.air.rain == 0.0
    assert one.air.fog == pytest.approx(other.air.fog + other.air.rain)


def drops_on(swept, rain=25.0, focal=200.0, stroke=0, seed=1):
    """Share of a picture that drops cover after a way in m, by pixels."""
    camera_spec = CameraSpec("eye", Modality.RGB, 400, 300, 90.0, Pose(0.0, 0.0, 1.5))
    glass = glass_of(camera_spec, focal, rain_drops(rain))
    work = np.zeros((3, 300, 400), dtype=np.float32)
    work[0] = 1.0
    cover_glass(glass, np.uint64(seed), stroke, swept, 0, 300, work)
    assert work.sum(axis=0) == pytest.approx(1.0, abs=1e-4)
    return 1.0 - work[0]


@pytest.mark.parametrize(("speed", "rain"), [(10.0, 25.0), (25.0, 25.0), (25.0, 5.0)])
def test_drops_cover_of_a_picture_what_they_cover_of_the_glass(speed, rain):
    """The mean over many strokes is `wetted_share`, less the hundredth of the smallest drops."""
    shares = [drops_on(speed * 1.5, rain, stroke=k).mean() for k in range(40)]
    expected = camera.wetted_share(rain, speed, 1.5)
    spread = np.std(shares) / np.sqrt(len(shares))
    assert np.mean(shares) == pytest.approx(expected, abs=3.0 * spread + 0.02 * expected)


def test_drops_stay_until_the_wiper_passes():
    few, more = drops_on(5.0), drops_on(15.0)
    assert (more >= few - 1e-6).all()
    assert more.mean() > 2.0 * few.mean()
    assert not np.array_equal(few, drops_on(5.0, stroke=1))


def test_a_small_drop_out_of_focus_covers_its_own_area():
    """One drop in the middle: radius 1 px or 20 px, blurred over 4 px."""
    glass = glass_of(EYE, 200.0, rain_drops(25.0))
    assert glass.blur == pytest.approx(0.5 * 200.0 * 0.002 / 0.05)
    for radius in (1.0, 20.0):
        inner, outer = abs(radius - glass.blur), radius + glass.blur
        full = 3.0 * radius**2 / (inner**2 + inner * outer + outer**2)
        r = np.linspace(0.0, outer, 20_001)
        profile = full * np.clip((outer - r) / (outer - inner), 0.0, 1.0)
        assert np.trapezoid(2.0 * np.pi * r * profile, r) == pytest.approx(
            np.pi * radius**2, rel=1e-4
        )
        assert full <= 1.0


WET = Weather(precipitation=60.0, wetness=100.0)


def drive(optics, ticks, speed=20.0, rows=None):
    """The picture after some ticks of driving at a speed."""
    table = table_of([])
    states = states_at([(50, -7, 0, 0.0)])
    states.vx[:] = speed
    settings = PixelSettings(camera_effect=False, optics=optics, seed=3)
    suite = PixelSuite(straight(400), table, [EYE], WET, settings)
    for tick in range(ticks):
        suite.observe(tick, states, {})
    return suite.render("eye", rows).rgb.copy()


def test_pictures_have_drops_while_driving_in_rain_and_none_just_after_a_stroke():
    plain, drops = CameraOptics(), CameraOptics(drops=True)
    assert np.array_equal(drive(drops, 1), drive(plain, 1))
    assert np.array_equal(drive(drops, 41), drive(plain, 41))  # a stroke every 2 s
    assert np.array_equal(drive(drops, 30, speed=0.0), drive(plain, 30, speed=0.0))
    changed = (drive(drops, 30) != drive(plain, 30)).any(axis=2).mean()
    share = camera.wetted_share(30.0, 20.0, 29 * 0.05)
    assert 0.5 * share < changed
    assert np.array_equal(drive(drops, 30), drive(drops, 30))


def test_rows_drawn_alone_have_the_drops_of_the_whole():
    drops = CameraOptics(drops=True)
    assert np.array_equal(
        drive(drops, 30, rows=range(100, 160))[100:160], drive(drops, 30)[100:160]
    )


TABLE = Path(__file__).parents[2] / "docs" / "camera-exposure.csv"
SCENES = list(csv.DictReader(TABLE.open(encoding="utf-8")))


@pytest.mark.parametrize("row", SCENES, ids=lambda r: r["scene"][:20])
def test_exposure_is_that_of_tabulated_scenes(row):
    """Exposure values of daylight scenes as printed for ISO 100; daylight and scale know none of them."""
    weather = Weather(
        sun_altitude_deg=float(row["sun_altitude_deg"]), cloudiness=float(row["cloudiness_pct"])
    )
    assert exposure_of(weather) == pytest.approx(float(row["ev100_published"]), abs=0.7)


def test_white_ground_is_white_by_day_and_dark_where_the_camera_ends():
    for weather, expected in ((preset("clear-noon"), 1.0), (preset("rain-noon"), 1.0)):
        light = expose(lighting(weather), weather)
        assert LUMA @ (light.sun_direction[2] * light.sun + light.sky) == pytest.approx(expected)
    night = preset("clear-night")
    assert exposure_of(night) == DARKEST
    dark = expose(lighting(night), night)
    by_hand = 0.05 / np.pi / (1.2 * 100.0 * 4.0 * 30.0 / 1600.0)  # lux, cd/m^2 of white
    assert LUMA @ dark.sky == pytest.approx(by_hand, rel=0.01)


def test_headlights_are_worth_their_candela_at_night_and_little_by_day():
    night, noon = preset("clear-night"), preset("clear-noon")
    values = [expose(lighting(weather, Beam.LOW), weather).headlights for weather in (night, noon)]
    white = 10_000.0 / 400.0 / np.pi / (1.2 * 7.5)  # of a white surface 20 m ahead
    shape = 2.6 / (1.0 + 400.0 / 380.0) ** 2
    assert values[0] * shape == pytest.approx(white, rel=1e-3)
    assert values[1] < 1e-3 * values[0]
    assert expose(lighting(noon), noon).headlights == 0.0


def brightness(weather, optics):
    """Mean grey of a picture of an empty road."""
    states = states_at([(50, -7, 0, 0.0)])
    settings = PixelSettings(camera_effect=False, optics=optics)
    suite = PixelSuite(straight(400, rails=False), table_of([]), [EYE], weather, settings)
    return float(suite.observe(0, states, {}).images["eye"].rgb.mean())


def test_a_picture_at_dusk_is_darker_only_where_the_camera_ends():
    exposed = CameraOptics(exposure=True)
    grey = [brightness(Weather(sun_altitude_deg=h), exposed) for h in (60.0, 5.0, -4.0, -14.0)]
    assert grey[1] == pytest.approx(grey[0], rel=0.25)
    assert grey[3] < 0.7 * min(grey[:3])


SPRAY = CameraOptics(spray=True)
FLOOD = Weather(precipitation=100.0, wetness=100.0, precipitation_deposits=60.0)


def behind_a_lorry(weather, speed, optics=SPRAY, rows=None, gap=20.0):
    """Linear light of a picture in whose middle is a lorry's rear, and the table of its vehicles."""
    table = table_of([ActorKind.TRUCK])
    ahead = 50.0 + gap + 0.5 * table.length[1]
    states = states_at([(50, -7, 0, 0.0), (ahead, -7, 0, 0.0)])
    states.vx[:] = speed
    settings = PixelSettings(camera_effect=False, optics=optics)
    suite = PixelSuite(straight(400, rails=False), table, [EYE], weather, settings)
    suite.observe(0, states, {})
    return (suite.render("eye", rows).rgb.copy() / 255.0) ** 2, table


@pytest.mark.parametrize("speed", [20.0, 30.0])
def test_spray_leaves_of_contrast_what_steps_through_it_leave(speed):
    """Along the axis, in the lane's middle, through 20 m of a cloud that thins out with the distance."""
    plain, table = behind_a_lorry(FLOOD, speed, CameraOptics())
    veiled, _ = behind_a_lorry(FLOOD, speed)
    film = road_surface(FLOOD).film_mm / 1000.0
    first = spray_density(film, speed, float(table.width[1]), float(table.height[1]))
    steps = (np.arange(2000) + 0.5) / 2000 * 20.0
    left = np.prod(camera.spray_transmission(1.0, 0.01) ** (first * np.exp(-steps / speed)))
    horizon = lighting(FLOOD).horizon
    row, column = 150, 200
    through = (veiled[row, column] - horizon) / (plain[row, column] - horizon)
    assert through == pytest.approx(left, abs=STEP)
    assert left < 0.9


def test_spray_is_drawn_behind_fast_vehicles_on_wet_road_alone():
    for weather, speed in ((FLOOD, 10.0), (Weather(), 30.0)):
        assert np.array_equal(
            *(behind_a_lorry(weather, speed, o)[0] for o in (SPRAY, CameraOptics()))
        )
    # from 70 m the eye is behind the cloud, which reaches 54 m
    veiled, plain = (behind_a_lorry(FLOOD, 30.0, o, gap=70.0)[0] for o in (SPRAY, CameraOptics()))
    changed = (veiled != plain).any(axis=2)
    assert changed[120:180, 190:210].any()
    assert not changed[:60].any()
    assert not changed[:, :40].any()
    rows = range(140, 170)
    part = behind_a_lorry(FLOOD, 30.0, rows=rows)[0]
    assert np.array_equal(part[140:170], behind_a_lorry(FLOOD, 30.0)[0][140:170])
