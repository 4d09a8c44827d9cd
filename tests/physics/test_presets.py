import pytest

from skidpad.core.errors import ConfigError, FileError
from skidpad.core.vocabulary import GripModel
from skidpad.physics.grip import friction_ratio
from skidpad.physics.presets import (
    WeatherManager,
    all_presets,
    find_weather,
    load_weather,
    preset,
    preset_groups,
)

# The printed ratios of the friction study, tables 2 and 3.
PRINTED = {
    "rain_0": 1.0, "rain_20": 0.63, "rain_40": 0.45, "rain_60": 0.36, "rain_80": 0.32,
    "rain_100": 0.30, "icy_0": 1.0, "icy_10": 0.66, "icy_30": 0.31, "icy_70": 0.16, "icy_100": 0.15,
}  # fmt: skip


@pytest.mark.req("B-039", "B-050", "B-053")
@pytest.mark.parametrize("name", PRINTED)
def test_ratios_are_within_a_hundredth_of_the_printed_ones(name):
    assert abs(friction_ratio(preset(name), GripModel.STATISTICAL) - PRINTED[name]) < 0.01


@pytest.mark.req("B-051", "B-054")
def test_rain_presets():
    for percent, clouds, fog, wind in [
        (0, 20, 0, 10), (20, 20, 5, 20), (40, 40, 10, 30), (60, 60, 15, 40), (80, 80, 20, 50),
        (100, 100, 30, 70),
    ]:  # fmt: skip
        w = preset(f"rain_{percent}")
        assert w.precipitation == w.precipitation_deposits == w.wetness == percent
        assert (w.cloudiness, w.fog_density, w.wind_intensity) == (clouds, fog, wind)
        assert w.ice_thickness == 0


@pytest.mark.req("B-052", "B-054")
@pytest.mark.parametrize("percent", [0, 10, 30, 70, 100])
def test_ice_presets(percent):
    w = preset(f"icy_{percent}")
    assert w.ice_thickness == w.wetness == percent
    assert (w.cloudiness, w.wind_intensity, w.fog_density) == (20, 10, 0)
    assert (w.precipitation, w.precipitation_deposits) == (0, 0)
    assert w.road_temperature_c == (-5 if percent else 15)


@pytest.mark.req("B-055")
def test_both_baselines_are_the_same_weather():
    assert preset("rain_0").values() == preset("icy_0").values()


@pytest.mark.req("A-213", "A-214", "A-215", "A-216")
def test_matrix_presets():
    matrix = preset_groups()["matrix"]
    assert list(matrix) == [
        "clear-sunrise", "clear-noon", "clear-night", "rain-sunrise", "rain-noon", "rain-night",
    ]  # fmt: skip
    assert [w.sun_altitude_deg for w in matrix.values()] == [15, 75, -30, 15, 45, -30]
    assert [w.is_night for w in matrix.values()] == [False, False, True] * 2
    assert matrix["rain-noon"].title == "Heavy Rain - Noon"
    for name, w in matrix.items():
        assert w.sun_azimuth_deg == 0
        assert w.rayleigh_scattering_scale == 0.0331
        rain = name.startswith("rain")
        assert w.cloudiness == (100 if rain else 10)
        assert w.wind_intensity == (80 if rain else 5)
        assert w.precipitation == w.precipitation_deposits == w.wetness == (100 if rain else 0)
        assert (w.fog_density, w.fog_distance, w.fog_falloff) == (
            (10, 20, 2) if rain else (0, 0, 0)
        )
        assert w.scattering_intensity == (1 if rain else 0)
        assert w.mie_scattering_scale == (0.03 if rain else 0)


def test_names_take_dash_and_underscore():
    assert preset("rain-20") is preset("rain_20")
    assert preset("Rain_Noon").name == "rain-noon"
    assert len(all_presets()) == 18
    with pytest.raises(ConfigError, match="rain_30.*choose one of.*icy_70"):
        preset("rain_30")


def test_weather_from_a_file(tmp_path):
    path = tmp_path / "wet.yaml"
    path.write_text("wetness: 40\nprecipitation_deposits: 40\n")
    assert find_weather(str(path)).wetness == 40.0
    assert load_weather(path).name == "wet"
    for text, match in [
        ("wetnes: 4", "wetnes"),
        ("wetness: 140", "between 0 and 100, got 140"),
        ("wetness: much", "float"),
        ("- 3", "mapping"),
    ]:
        path.write_text(text)
        with pytest.raises(ConfigError, match=match):
            load_weather(path)
    path.write_text("wetness: [")
    with pytest.raises(FileError, match="not YAML"):
        load_weather(path)
    with pytest.raises(FileError, match="nowhere"):
        find_weather("nowhere.yaml")


@pytest.mark.req("A-217")
def test_manager_applies_cycles_and_ignores_unknown_names():
    manager = WeatherManager()
    assert manager.current.name == "clear-sunrise"
    assert manager.apply("Heavy Rain - Night")
    assert manager.current.values()["sun_altitude_deg"] == -30
    assert not manager.apply("hail")
    assert manager.current.name == "rain-night"
    assert manager.cycle().name == "clear-sunrise"
    assert manager.apply("rain_noon")
    with pytest.raises(ConfigError):
        WeatherManager(())
