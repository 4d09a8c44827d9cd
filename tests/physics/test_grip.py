from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import (
    MU_REF,
    RoadSurface,
    friction_ratio,
    grip_params,
    mu_at,
    physical_params,
    road_surface,
)

percent = floats(0.0, 100.0)
STATISTICAL, PHYSICAL = GripModel.STATISTICAL, GripModel.PHYSICAL


def rain(w: float, p: float) -> Weather:
    return Weather(wetness=w, precipitation_deposits=p)


def ice(i: float, **fields: float) -> Weather:
    return Weather(ice_thickness=i, road_temperature_c=-5.0, **fields)


@pytest.mark.req("B-030", "B-031", "B-034")
@pytest.mark.parametrize(
    ("weather", "expected"),
    [
        (rain(0, 0), 1.0),
        (ice(0), 1.0),
        (rain(100, 0), 0.4),
        (rain(100, 100), 0.3),
        (ice(100), 0.15),
    ],
)
def test_end_points_are_exact(weather, expected):
    assert friction_ratio(weather, STATISTICAL) == pytest.approx(expected, abs=1e-12)


@pytest.mark.req("B-016", "B-030")
def test_rain_ratio_by_hand():
    # w = p = 50: exp(-0.458) = 0.632548; 0.632548 / 8 * 0.6 = 0.0474411; + 0.4 - 0.05
    assert friction_ratio(rain(50, 50), STATISTICAL) == pytest.approx(0.3974411, abs=1e-6)


@pytest.mark.req("B-036")
@pytest.mark.parametrize("intensity", [1.0, 10.0, 50.0, 99.0])
def test_ice_takes_more_than_rain(intensity):
    assert friction_ratio(ice(intensity), STATISTICAL) < friction_ratio(
        rain(intensity, 0), STATISTICAL
    )


@pytest.mark.req("B-031", "B-036")
def test_ice_acts_like_a_switch():
    assert 1 - friction_ratio(ice(10), STATISTICAL) == pytest.approx(0.337, abs=5e-4)
    assert 1 - friction_ratio(ice(30), STATISTICAL) == pytest.approx(0.685, abs=5e-4)


@given(percent, percent, percent, floats(0.1, 10.0))
@pytest.mark.req("B-036")
def test_statistical_ratio_falls_with_each_input(w, p, i, step):
    # The cube's slope vanishes at the far end, so the fall is strict only within rounding.
    here = friction_ratio(rain(w, p), STATISTICAL)
    assert friction_ratio(rain(min(w + step, 100), p), STATISTICAL) <= here + 1e-15
    assert friction_ratio(rain(w, min(p + step, 100)), STATISTICAL) <= here
    assert (
        friction_ratio(ice(min(i + step, 100)), STATISTICAL)
        <= friction_ratio(ice(i), STATISTICAL) + 1e-15
    )


@pytest.mark.req("B-037")
@given(percent, percent)
def test_puddles_cost_a_tenth_whatever_the_wetness(w, p):
    dry, wet = friction_ratio(rain(w, 0), STATISTICAL), friction_ratio(rain(w, p), STATISTICAL)
    assert dry - wet == pytest.approx(0.1 * p / 100, abs=1e-12)


@pytest.mark.req("B-040", "B-018")
@pytest.mark.parametrize("i", [10.0, 30.0, 70.0, 100.0])
def test_ice_decides_alone_although_the_road_looks_wet(i):
    shiny = ice(i, wetness=i, cloudiness=90.0, wind_intensity=50.0, fog_density=30.0)
    assert friction_ratio(shiny, STATISTICAL) == friction_ratio(ice(i), STATISTICAL)
    assert friction_ratio(shiny, PHYSICAL) == friction_ratio(ice(i), PHYSICAL)


@pytest.mark.req("B-012", "B-011", "B-014", "B-015")
def test_only_wetness_and_deposits_enter_the_rain_formula():
    plain = rain(40, 20)
    busy = replace(
        plain, precipitation=90.0, cloudiness=80.0, wind_intensity=70.0, fog_density=60.0
    )
    assert friction_ratio(busy, STATISTICAL) == friction_ratio(plain, STATISTICAL)


@pytest.mark.req("B-002")
@pytest.mark.parametrize("field", ["precipitation", "precipitation_deposits"])
def test_rain_with_ice_is_refused(field):
    with pytest.raises(ConfigError, match="ice_thickness 30"):
        friction_ratio(ice(30, **{field: 10.0}), STATISTICAL)


def test_snow_needs_the_physical_model():
    with pytest.raises(ConfigError, match="physical"):
        friction_ratio(Weather(snow_depth_mm=30.0), STATISTICAL)


@pytest.mark.req("B-004")
def test_no_model_leaves_grip_alone():
    for weather in (rain(100, 100), ice(100), Weather(snow_depth_mm=50.0)):
        assert friction_ratio(weather, GripModel.NONE, v=30.0) == 1.0


@pytest.mark.req("B-017")
def test_ice_thickness_scale():
    assert road_surface(ice(100)).ice_mm == 20.0
    assert road_surface(ice(30)).ice_mm == pytest.approx(0.2 * 30)


def test_dry_weather_leaves_the_road_dry():
    surface = road_surface(Weather())
    assert (surface.film_mm, surface.ice_mm, surface.snow_mm, surface.rain_mm_h) == (0, 0, 0, 0)
    assert friction_ratio(Weather(), PHYSICAL, v=40.0) == 1.0


@given(percent, percent, percent, floats(0.0, 45.0), floats(0.01, 20.0))
def test_physical_grip_falls_with_water_and_with_speed(w, p, rain_pct, v, step):
    weather = Weather(wetness=w, precipitation_deposits=p, precipitation=rain_pct)
    more = replace(weather, wetness=min(w + step, 100), precipitation=min(rain_pct + step, 100))
    here = friction_ratio(weather, PHYSICAL, v)
    assert 0.0 < friction_ratio(more, PHYSICAL, v) <= here <= 1.0
    assert mu_at(grip_params(weather, PHYSICAL), v + step) <= mu_at(
        grip_params(weather, PHYSICAL), v
    )


@pytest.mark.parametrize("v", [5.0, 14.0, 25.0])
def test_dry_wet_snow_ice_in_this_order(v):
    dry = friction_ratio(Weather(), PHYSICAL, v)
    wet = friction_ratio(rain(60, 20), PHYSICAL, v)
    snow = friction_ratio(Weather(snow_depth_mm=30, road_temperature_c=-5), PHYSICAL, v)
    sheet = friction_ratio(ice(30), PHYSICAL, v)
    assert dry > wet > snow > sheet


def test_measured_mu_of_ice_and_snow():
    assert mu_at(grip_params(ice(100), PHYSICAL), 5.0) == pytest.approx(0.117, abs=1e-9)
    snow = Weather(snow_depth_mm=30, road_temperature_c=-5)
    assert mu_at(grip_params(snow, PHYSICAL), 10.0) == pytest.approx(0.34, abs=1e-9)


def test_colder_ice_grips_better_and_wet_ice_worse():
    cold, mild = replace(ice(50), road_temperature_c=-15.0), replace(ice(50), road_temperature_c=-1)
    wet = replace(mild, precipitation=20.0)
    ratios = [friction_ratio(w, PHYSICAL) for w in (cold, mild, wet)]
    assert ratios == sorted(ratios, reverse=True)
    assert len(set(ratios)) == 3


BOSCH = [  # water in mm, km/h, friction of new tyres: Bosch Automotive Handbook, the table fitted
    (0.0, 50, 0.85), (0.0, 90, 0.80), (0.0, 130, 0.75),
    (0.2, 50, 0.65), (0.2, 90, 0.60), (0.2, 130, 0.55),
    (1.0, 50, 0.55), (1.0, 90, 0.30), (1.0, 130, 0.20),
    (2.0, 50, 0.50), (2.0, 90, 0.05), (2.0, 130, 0.00),
]  # fmt: skip


@pytest.mark.parametrize(("film", "kmh", "measured"), BOSCH)
def test_friction_by_water_and_speed_is_the_table_s(film, kmh, measured):
    surface = RoadSurface(film, 0.0, 0.0, 0.0, 15.0)
    params = physical_params(surface, mu_ref=0.832)  # the table's dry tyre at 40 mph
    assert mu_at(params, kmh / 3.6) == pytest.approx(measured, rel=0.10, abs=0.03)


def test_dry_friction_falls_with_speed_and_is_the_reference_at_40_mph():
    params = grip_params(Weather(), PHYSICAL)
    assert mu_at(params, 40.0 * 0.44704) == pytest.approx(MU_REF)
    mus = [mu_at(params, v) for v in (0.0, 15.0, 30.0, 45.0)]
    assert mus == sorted(mus, reverse=True)
    assert len(set(mus)) == 4


def test_the_friction_ratio_is_the_share_of_dry_friction():
    params = grip_params(rain(100, 100), PHYSICAL, mu_ref=1.5)
    dry = grip_params(Weather(), PHYSICAL, mu_ref=1.5)
    share = friction_ratio(rain(100, 100), PHYSICAL, 13.0)
    assert mu_at(params, 13.0) == pytest.approx(share * mu_at(dry, 13.0))


@pytest.mark.req("B-035", "B-038")
def test_the_published_coefficients_are_logarithms_of_the_terminal_ratios() -> None:
    from math import log

    assert log(0.4) == pytest.approx(-0.916, abs=5e-4)
    assert log(0.15) == pytest.approx(-1.89711, abs=2e-5)
    assert friction_ratio(Weather(), GripModel.STATISTICAL) == 1.0  # dry is 1, not the measured 0.8
    # with the cubic factor they do not set the terminal value by themselves
    assert friction_ratio(Weather(wetness=100.0), GripModel.STATISTICAL) == pytest.approx(0.4)
