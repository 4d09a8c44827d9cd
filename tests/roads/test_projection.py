"""Degrees to a map's metres, by projections whose values are known in closed form."""

from __future__ import annotations

import sys
from math import pi

import pytest

from skidpad.core.errors import ConfigError, MissingExtra
from skidpad.roads.projection import EARTH_RADIUS, map_place


def test_without_the_package_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(MissingExtra, match=r"GeoPosition on a map with a projection .*\[geo\]"):
        map_place("+proj=utm +zone=32", 0.0, 9.0)
    assert map_place("", 0.0, 180.0)[0] == pytest.approx(pi * EARTH_RADIUS)


def test_a_zone_of_utm_has_its_meridian_at_500_km():
    x, y = map_place("+proj=utm +zone=32 +datum=WGS84 +units=m", 0.0, 9.0)
    assert (x, y) == pytest.approx((500_000.0, 0.0), abs=1e-6)
    assert map_place("+proj=utm +zone=33 +south +datum=WGS84", 0.0, 15.0)[1] == pytest.approx(1e7)


def test_a_mercator_on_a_sphere_is_as_wide_as_it_is_round():
    sphere = f"+proj=merc +R={EARTH_RADIUS}"
    assert map_place(sphere, 0.0, 180.0)[0] == pytest.approx(pi * EARTH_RADIUS)


def test_heights_and_what_lies_in_files_is_the_maps_own():
    plain = "+proj=tmerc +lat_0=49 +lon_0=8 +k=0.9996 +datum=WGS84"
    more = f"{plain} +geoidgrids=egm96_15.gtx +nadgrids=/nowhere +vunits=m +no_defs"
    assert map_place(more, 49.01, 8.02) == map_place(plain, 49.01, 8.02)


def test_without_a_projection_degrees_are_about_0_and_0():
    assert map_place("", 0.0, 1.0) == pytest.approx((EARTH_RADIUS * pi / 180.0, 0.0))
    assert map_place("my own grid", 1.0, 0.0)[1] == pytest.approx(EARTH_RADIUS * pi / 180.0)


@pytest.mark.parametrize("text", ["+proj=nonsense", "+proj=tmerc +lat_0=x", "+proj=utm +zone=99"])
def test_what_proj_does_not_know_is_one_sentence(text):
    with pytest.raises(ConfigError, match="geoReference") as caught:
        map_place(text, 48.0, 9.0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("place", [(95.0, 9.0), (float("inf"), 9.0), (1e308, 1e308)])
def test_no_place_outside_the_earth_is_put_on_a_map(place):
    with pytest.raises(ConfigError, match="cannot be put"):
        map_place("+proj=tmerc +lat_0=0 +lon_0=0 +datum=WGS84", *place)
