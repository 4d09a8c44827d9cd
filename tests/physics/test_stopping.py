import numpy as np
import pytest

from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import GripParams, grip_params
from skidpad.physics.presets import all_presets, preset
from skidpad.physics.stopping import grip_rows, mean_deceleration, stops

PHYSICAL, STATISTICAL = GripModel.PHYSICAL, GripModel.STATISTICAL


def physical_stop(name, v0):
    weather = Weather() if name == "dry" else preset(name)
    return stops([grip_params(weather, PHYSICAL)], [v0])[0]


@pytest.mark.parametrize(
    ("surface", "v0", "measured"),
    [
        ("dry", 99.8 / 3.6, 43.7),  # What Car? n11594, winter tyres, 62 mph
        ("rain_40", 80 / 3.6, 37.6),  # ADAC 2018, wet asphalt; its water depth is not told
        ("snow", 50 / 3.6, 29.1),  # ADAC 2018, packed snow
        ("icy_30", 12 * 0.44704, 12.5),  # What Car? n11592, sheet ice, 12 mph
    ],
)
def test_stops_like_the_measured_ones(surface, v0, measured):
    assert physical_stop(surface, v0).distance == pytest.approx(measured, rel=0.10)


@pytest.mark.req("B-001")
@pytest.mark.parametrize("kmh", [50, 80, 100])
def test_dry_wet_snow_ice(kmh):
    distances = [
        physical_stop(name, kmh / 3.6).distance for name in ("dry", "rain_40", "snow", "icy_30")
    ]
    assert distances == sorted(distances)
    assert len(set(distances)) == 4


def test_mean_deceleration_of_an_even_stop_is_its_deceleration():
    t = np.linspace(0.0, 4.0, 4001)
    assert mean_deceleration(28.0 - 7.0 * t, 28.0 * t - 3.5 * t * t) == pytest.approx(7.0)


def test_mean_deceleration_counts_only_the_middle():
    # A late bite above 80 % and a slow end below 10 % leave it alone.
    v = np.array([20.0, 18.0, 16.0, 2.0, 0.0])
    s = np.array([0.0, 50.0, 60.0, 60.0 + (256 - 4) / 12, 400.0])
    assert mean_deceleration(v, s) == pytest.approx(6.0)


@pytest.mark.parametrize("mu", [0.9, 0.3, 0.12])
def test_a_stop_means_the_friction_it_was_made_on(mu):
    stop = stops([GripParams(mu, 1.0, 0.0, 0.0)], [15.0])[0]
    assert stop.v0**2 / (2.0 * 9.80665 * stop.distance) == pytest.approx(mu, rel=0.05)
    assert stop.mfdd == pytest.approx(mu * 9.80665, rel=0.06)


def test_type_zero_stop_of_the_ego():
    # UN R13-H: MFDD at least 6.43 m/s^2 from 100 km/h on a dry road.
    assert physical_stop("dry", 100 / 3.6).mfdd > 6.43


def test_a_standing_car_has_stopped_already():
    standing, moving = stops([GripParams(0.9, 1.0, 0.0, 0.0)] * 2, [0.0, 10.0])
    assert (standing.distance, standing.mfdd) == (0.0, 0.0)
    assert moving.distance > 1.0


def test_no_grip_at_all_is_said():
    with pytest.raises(ConfigError, match="too little grip"):
        stops([GripParams(0.0, 1.0, 0.0, 0.0)], [10.0])


@pytest.mark.req("B-032")
def test_table_of_all_presets():
    rows = grip_rows(list(all_presets().values()), [STATISTICAL, PHYSICAL])
    assert len(rows) == 2 * 18 - 1  # no statistical snow
    for row in rows:
        assert [stop.distance for stop in row.stops] == sorted(s.distance for s in row.stops)
        assert row.mu == pytest.approx(0.9 * row.ratio)
        alone = stops([grip_params(preset(row.weather), row.model)], [80 / 3.6])[0]
        assert alone.distance == row.stops[1].distance
        if row.weather == "rain_100" and row.model is STATISTICAL:
            assert row.mu == pytest.approx(0.27)
