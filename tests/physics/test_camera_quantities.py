"""What weather does to a camera, by values derived by hand and by second routes."""

from math import exp, log, log2, pi

import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.weather import Weather
from skidpad.physics import camera
from skidpad.physics.optics import CONTRAST_CAR, CONTRAST_SEEN, depth_range, sight
from skidpad.physics.radio import radome_film


def test_exposure_of_a_sunlit_scene():
    # reference of Filament's camera model: f/16, 1/125 s, ISO 100 for a sunlit exterior
    ev = camera.exposure_value(16.0, 1.0 / 125.0, 100.0)
    assert ev == pytest.approx(log2(256.0 * 125.0))  # 14.97
    assert camera.saturation_luminance(ev) == pytest.approx(1.2 * 32_000.0)
    white = 100_000.0 / pi  # cd/m^2 of white paper in 100 000 lux; not used: it must not be clipped
    assert 0.7 < camera.exposed_share(white, ev) < 1.0
    assert camera.exposure_value(16.0, 1.0 / 125.0, 200.0) == pytest.approx(ev - 1.0)
    assert camera.exposed_share(1e6, ev) == 1.0


def test_a_lamp_veils_by_the_square_of_its_angle():
    # a low beam of 10 000 cd at 50 m gives 4 lux; at 2 degrees 10 cd/m^2
    assert camera.veiling_luminance(10_000.0 / 50.0**2, 2.0) == pytest.approx(10.0)
    assert camera.veiling_luminance(4.0, 4.0) == pytest.approx(2.5)
    for angle in (0.5, 31.0):
        with pytest.raises(ConfigError, match="angle_deg"):
            camera.veiling_luminance(4.0, angle)
    # a sign of 0.5 on a road of 1 cd/m^2 keeps a 1/11 of its contrast under 10 cd/m^2
    assert camera.veiled_contrast(0.5, 1.0, 10.0) == pytest.approx(0.5 / 11.0)


def test_contrast_falls_to_the_least_seen_at_the_range_of_sight():
    fog = Weather(fog_density=50.0)
    assert camera.contrast_at(1.0, fog, sight(fog)) == pytest.approx(CONTRAST_SEEN)
    rain = Weather(precipitation=50.0, fog_density=20.0, fog_distance=30.0)
    at = depth_range(rain)
    assert camera.contrast_at(CONTRAST_CAR, rain, at) == pytest.approx(CONTRAST_SEEN)


def test_drops_cover_glass_as_random_circles_do():
    rate, speed = 25.0, 20.0
    slope = 4.1 * rate**-0.21  # 1/mm, Marshall and Palmer
    size = np.linspace(0.0, 12.0, 20_001)  # mm
    circles = pi / 4.0 * (2.0 ** (1.0 / 3.0) * size * 1e-3) ** 2
    area = np.trapezoid(8000.0 * np.exp(-slope * size) * circles, size) * speed * 0.5
    assert camera.wetted_share(rate, speed, 0.5) == pytest.approx(1.0 - exp(-area), rel=1e-3)
    assert camera.wetted_share(0.0, speed, 5.0) == 0.0
    assert camera.wetted_share(rate, 0.0, 5.0) == 0.0


def test_circles_thrown_at_random_cover_what_the_law_says():
    rng = np.random.default_rng(1)
    radius, n = 0.02, 400
    centres, points = rng.uniform(-0.1, 1.1, (int(n * 1.44), 2)), rng.uniform(0.0, 1.0, (4000, 2))
    apart = np.linalg.norm(points[:, None] - centres[None], axis=2).min(axis=1)
    assert np.mean(apart < radius) == pytest.approx(1.0 - exp(-n * pi * radius**2), abs=0.04)


def test_a_lower_glass_has_a_thinner_film():
    # flow grows with the height above, depth with its third root
    high, low = radome_film(25.0, 25.0), camera.lens_film(25.0, 25.0)
    assert low / high == pytest.approx((0.03 / 0.1) ** (1.0 / 3.0))


def test_spray_takes_light_by_its_water():
    # 1 g/m^3 in drops of 0.2 mm: 3 m / (rho D) = 0.015 per m; 20 m leave exp(-0.3)
    assert camera.spray_transmission(1e-3, 20.0) == pytest.approx(exp(-0.3))
    assert -log(camera.spray_transmission(2e-3, 20.0)) == pytest.approx(0.6)


def test_motion_blur_is_the_way_that_the_image_moves():
    # a sign 3 m aside and 20 m ahead, 20 m/s, 10 ms, 400 px: f x v / z^2 t
    hand = 400.0 * 3.0 * 20.0 / 400.0 * 0.01
    assert camera.motion_blur(400.0, 0.01, (3.0, 0.0, 20.0), (0.0, 0.0, -20.0)) == pytest.approx(
        hand
    )
    # by differences of the projection
    p, v, dt = np.array([2.0, -1.0, 15.0]), np.array([1.0, 0.5, -12.0]), 1e-6
    q = p + v * dt
    way = 500.0 * np.hypot(q[0] / q[2] - p[0] / p[2], q[1] / q[2] - p[1] / p[2]) / dt * 0.02
    assert camera.motion_blur(500.0, 0.02, tuple(p), tuple(v)) == pytest.approx(way, rel=1e-4)
