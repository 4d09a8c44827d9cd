from dataclasses import replace
from math import exp, log, radians, sin
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.core.inputs import Beam
from skidpad.core.weather import Weather
from skidpad.physics.optics import (
    daylight,
    depth_range,
    extinction,
    label_range,
    radar_loss_db,
    radar_range,
    rain_attenuation_db_km,
    sight,
    sunlight,
    transmission,
)
from skidpad.physics.presets import preset
from skidpad.sensors.object_level.objects import SIGHT

percent = floats(0.0, 100.0)


def test_sight_in_named_conditions():
    assert sight(Weather()) == pytest.approx(20_000)
    assert sight(Weather(fog_density=50)) == pytest.approx(1000)
    assert sight(Weather(fog_density=100)) == pytest.approx(50)
    # Atlas: 25 mm/h leaves 1.5 km at 2 % contrast, so 1.17 km at 5 %.
    rain = Weather(precipitation=50)
    assert 1100 < sight(rain) < 1200


@given(percent, percent, floats(0.1, 20.0), floats(1.0, 300.0))
def test_more_fog_or_rain_never_clears_the_air(fog, rain, step, distance):
    w = Weather(fog_density=fog, precipitation=rain)
    for field in ("fog_density", "precipitation"):
        worse = replace(w, **{field: min(getattr(w, field) + step, 100.0)})
        assert extinction(worse) >= extinction(w)
        assert depth_range(worse) <= depth_range(w)
        assert label_range(worse) <= label_range(w)
        assert radar_range(worse, 80.0) <= radar_range(w, 80.0) <= 80.0
        assert 0.0 < transmission(worse, distance) <= transmission(w, distance) <= 1.0


@given(percent, percent, floats(0.0, 200.0))
def test_depth_range_is_where_the_contrast_is_used_up(fog, rain, start):
    w = Weather(fog_density=fog, precipitation=rain, fog_distance=start)
    assert 0.5 * transmission(w, depth_range(w)) == pytest.approx(0.05, rel=1e-9)


def test_transmission_is_exponential():
    w = Weather(fog_density=60)
    assert transmission(w, 100.0) == pytest.approx(exp(-extinction(w) * 100.0))


def test_itu_rain_attenuation_against_its_printed_table():
    # P.838-3 table 5, horizontal: 10 GHz k 0.01217 alpha 1.2571; 80 GHz k 1.1704 alpha 0.7115.
    assert rain_attenuation_db_km(1.0, 10.0) == pytest.approx(0.01217, rel=2e-3)
    assert rain_attenuation_db_km(50.0, 10.0) == pytest.approx(0.01217 * 50**1.2571, rel=3e-3)
    assert rain_attenuation_db_km(50.0, 80.0) == pytest.approx(1.1704 * 50**0.7115, rel=3e-3)


def test_heavy_rain_costs_radar_a_few_decibels():
    rain = preset("rain-noon")
    assert 2.0 < radar_loss_db(rain, 80.0) < 5.0
    assert 65.0 < radar_range(rain, 80.0) < 75.0
    assert radar_range(Weather(), 80.0) == 80.0


def test_sun_and_sky_add_up_to_daylight_and_a_low_sun_keeps_some_light():
    for altitude in (20.0, 45.0, 75.0):
        sky = Weather(sun_altitude_deg=altitude)
        sun, diffuse = sunlight(sky)
        level = sun * sin(radians(altitude)) + diffuse
        assert level == pytest.approx(daylight(sky), rel=0.02)
    assert 3_000 < sunlight(Weather(sun_altitude_deg=3.0))[0] < 10_000
    assert sunlight(Weather(sun_altitude_deg=-1.0)) == (0.0, 0.0)
    assert sunlight(Weather(sun_altitude_deg=30.0, cloudiness=100.0))[0] == 0.0


def test_daylight():
    assert 80_000 < daylight(preset("clear-noon")) < 130_000
    assert 5_000 < daylight(preset("rain-noon")) < 25_000
    assert daylight(preset("clear-night")) < 0.1
    altitudes = [75, 45, 15, 5, 1, 0, -1, -3, -6, -9, -12]
    lux = [daylight(Weather(sun_altitude_deg=h)) for h in altitudes]
    assert lux == sorted(lux, reverse=True)


@pytest.mark.req("A-218")
def test_night_sight_needs_headlights():
    night = preset("clear-night")
    assert label_range(night, Beam.OFF) == 0.0
    assert 70 < label_range(night) < 110
    assert label_range(preset("rain-night")) < label_range(night)
    assert label_range(preset("clear-noon"), Beam.OFF) > 1000


def test_the_page_tells_how_far_the_contrast_detector_sees():
    """By hand: ln(0.5 / 0.05) / ln(1 / 0.05) of the optical range; the object level looks no farther."""
    text = (Path(__file__).parents[2] / "docs" / "rendering.md").read_text(encoding="utf-8")
    shown = [{}, *({"fog_density": v} for v in (50.0, 75.0, 100.0))]
    shown += [{"precipitation": v} for v in (50.0, 100.0)]
    for fields in shown:
        weather = Weather(**fields)
        far = sight(weather) * log(10.0) / log(20.0)
        assert label_range(weather) == pytest.approx(far)
        name = " ".join(f"`{k}` {v:g}" for k, v in fields.items()) or "clear"
        numbers = (sight(weather), label_range(weather), min(label_range(weather), SIGHT))
        assert f"| {name} | " + " | ".join(f"{v:.0f}" for v in numbers) + " |" in text
    night = Weather(sun_altitude_deg=-30.0)
    at = label_range(night)
    assert f"at {at:.0f} m in clear air" in text
    assert 10_000.0 / at**2 * exp(-at * log(20.0) / sight(night)) == pytest.approx(1.0, rel=1e-6)
