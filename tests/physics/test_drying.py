"""Roads that dry: both rates by hand, wheel paths first, and what a surface's file asks for."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.drying import dried_film, evaporation_mm_h, wear_mm_h
from skidpad.physics.grip import Road
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.patches import Patches
from skidpad.simulation.world.surface_files import read_surface

MILD = Weather()


def test_evaporation_by_hand():
    """15 C, 70 %, calm: 0.51 kPa too little in the air, 30 s/m, so 316 W/m^2 and 0.46 mm/h."""
    e = 0.61078 * exp(17.269 * 15.0 / 252.3)
    flux = 1.2090 * 1005.43 * 0.3 * e / (0.065650 * 30.0)
    assert evaporation_mm_h(MILD) == pytest.approx(flux / (2.452e6 * 999.87) * 3.6e6, rel=1e-3)
    assert evaporation_mm_h(MILD) == pytest.approx(0.464, rel=0.01)


def test_evaporation_grows_with_warmth_and_wind_and_ends_in_frost():
    rates = [
        evaporation_mm_h(replace(MILD, **changes))
        for changes in (
            {"road_temperature_c": 0.0, "air_temperature_c": 0.0},
            {"road_temperature_c": 5.0, "air_temperature_c": 5.0},
            {},
            {"road_temperature_c": 30.0},
            {"road_temperature_c": 30.0, "wind_intensity": 60.0},
        )
    ]
    assert rates[0] == 0.0
    assert np.all(np.diff(rates) > 0.0)
    assert evaporation_mm_h(replace(MILD, road_temperature_c=5.0)) == 0.0  # dew would fall


def test_traffic_takes_more_of_much_water_and_nothing_of_a_damp_road():
    assert wear_mm_h(2.0) == pytest.approx(2.9)
    assert wear_mm_h(0.8) == pytest.approx(0.5 * 1.16)
    assert wear_mm_h(0.2) == pytest.approx(0.3)
    assert wear_mm_h(0.05) == 0.0


def test_a_deep_film_in_wheel_paths_falls_off_as_an_exponential():
    """From 2 to 1 mm by W' = -1.45 W - E alone: ln((2 + E / 1.45) / (1 + E / 1.45)) / 1.45 h."""
    share = evaporation_mm_h(MILD) / 1.45
    minutes = 60.0 * log((2.0 + share) / (1.0 + share)) / 1.45
    assert dried_film(2.0, minutes, MILD, traffic=True) == pytest.approx(1.0, abs=0.01)


def test_wheel_paths_dry_first_and_rain_dries_nothing():
    left = {t: dried_film(0.5, 50.0, MILD, traffic=t) for t in (False, True)}
    assert left[True] == 0.0
    assert left[False] == pytest.approx(0.5 - evaporation_mm_h(MILD) * 50.0 / 60.0)
    wet = replace(MILD, precipitation=1.0)
    assert dried_film(0.5, 40.0, wet, traffic=True) == 0.5
    assert dried_film(0.5, 0.0, MILD, traffic=True) == 0.5


def test_a_surface_has_dried_in_its_wheel_paths_and_holds_less_beside_them(tmp_path):
    road = load_map("straight")
    x, y, z, heading = (
        float(v[500])
        for v in (road.samples.x, road.samples.y, road.samples.z, road.samples.heading)
    )
    place = road.project(x, y, z)
    file = tmp_path / "dried.yaml"
    sides = ("wheel_paths", "beside_wheel_paths")
    shares = {}
    for minutes in (0, 30):
        lines = [
            f"  - {{water_mm: 0.5, road: {place.road}, side: {side}, dried_min: {minutes}}}"
            for side in sides
        ]
        file.write_text("patches:\n" + "\n".join(lines))
        found = Patches(road, read_surface(file), Road(MILD, GripModel.PHYSICAL))
        for name, left in (("path", 0.75), ("beside", 0.0)):
            at = x - left * np.sin(heading), y + left * np.cos(heading), z
            shares[name, minutes] = found.ratio_at(*at, 20.0)
    assert shares["path", 0] == shares["beside", 0] < 0.8
    assert shares["beside", 0] < shares["beside", 30] < shares["path", 30]


@pytest.mark.parametrize(
    ("patch", "said"),
    [
        ({"water_mm": 1.0, "dried_min": -1.0}, "dried_min must be between 0 and 1440, got -1"),
        ({"ice_mm": 1.0, "dried_min": 5.0}, "dried_min goes with water_mm"),
    ],
)
def test_bad_values_are_refused_in_a_sentence(patch, said):
    with pytest.raises(ConfigError, match=said):
        SurfacePatch(road=1, **patch)
