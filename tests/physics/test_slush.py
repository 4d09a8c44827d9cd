"""Slush: grip of snow that floats away as on water, drag of its weight of water, limits."""

from dataclasses import replace
from itertools import pairwise

import pytest

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import Road, mu_at, physical_params, road_surface, stiffness_at
from skidpad.physics.slush import SPECIFIC_GRAVITY, slush_grip

ROAD = Road(Weather(road_temperature_c=0.0), GripModel.PHYSICAL, stiffness=True, drag=True)
DRY = road_surface(ROAD.weather)


def grip(mm, surface=DRY, road=ROAD, tyres="winter"):
    return slush_grip(road, surface, mm, tyres)


def test_without_depth_the_surface_below_is_left():
    wet = replace(DRY, film_mm=1.0)
    assert grip(0.0, wet) == ROAD.params("winter", wet)


def test_at_walking_pace_it_grips_like_packed_snow():
    """Of the friction of snow, 0.34, the speed of the reference road takes 2 % at 17.9 - 4 m/s."""
    snow = mu_at(ROAD.params("winter", replace(DRY, snow_mm=50.0)), 1.0)
    assert mu_at(grip(8.0), 1.0) == pytest.approx(snow, rel=0.11)
    summer = mu_at(ROAD.params("summer", replace(DRY, snow_mm=50.0)), 1.0)
    assert mu_at(grip(8.0, tyres="summer"), 1.0) == pytest.approx(summer, rel=0.11)


def test_half_of_the_grip_is_gone_at_the_speed_that_the_page_says():
    at = 60 / 3.6
    snow = ROAD.params("winter", replace(DRY, snow_mm=50.0))
    assert mu_at(grip(5.0), at) / mu_at(snow, at) == pytest.approx(0.5, abs=0.03)


def test_deeper_and_faster_is_never_better():
    for v in (5.0, 15.0, 25.0, 35.0):
        at = [mu_at(grip(mm), v) for mm in (0.0, 0.5, 1.0, 2.0, 5.0, 15.0)]
        assert all(a >= b for a, b in pairwise(at))
    for mm in (1.0, 5.0, 15.0):
        at = [mu_at(grip(mm), v) for v in (5.0, 10.0, 20.0, 30.0)]
        assert all(a > b for a, b in pairwise(at))


def test_its_drag_is_that_of_its_weight_of_water_if_asked_for():
    water = physical_params(replace(DRY, film_mm=5.0 * SPECIFIC_GRAVITY), drag=True)
    assert grip(5.0).film == water.film == pytest.approx(0.003)
    assert grip(5.0, road=replace(ROAD, drag=False)).film == 0.0


def test_it_shears_like_snow_if_asked_for_and_less_as_it_lifts():
    snow = stiffness_at(ROAD.params("winter", replace(DRY, snow_mm=50.0)), 5.0)
    assert stiffness_at(grip(8.0), 1.0) == pytest.approx(snow, rel=0.02)
    assert stiffness_at(grip(8.0), 20.0) < 0.5 * snow
    assert stiffness_at(grip(8.0, road=replace(ROAD, stiffness=False)), 20.0) == 1.0


def test_it_hides_ice_as_snow_does():
    ice = replace(DRY, ice_mm=3.0)
    assert mu_at(grip(8.0, ice), 5.0) == pytest.approx(mu_at(grip(8.0), 5.0))
    assert mu_at(grip(0.0, ice), 5.0) < 0.15
