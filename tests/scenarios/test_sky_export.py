"""Weather in exported files: what a run had is read again from the file, as near as words are."""

from __future__ import annotations

from datetime import datetime

import pytest

from skidpad.campaign.driving.outdoors import environment_of, weather_of
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.presets import preset
from skidpad.scenarios.export.tracks import Track
from skidpad.scenarios.export.version import OscVersion
from skidpad.scenarios.export.writer import Sheet, write_scenario
from skidpad.scenarios.reading.environment import Environment, Fall
from skidpad.scenarios.scenario import check


def exported(folder, environment, version):
    track = Track(
        "ego", "", True, SemanticClass.CAR, (4.2, 1.8, 0.0, 0.0), t=[0.0, 1.0], x=[0.0, 10.0],
        y=[0.0, 0.0], heading=[0.0, 0.0], v=[10.0, 10.0], z=[0.0, 0.0], height=1.5,
    )  # fmt: skip
    sheet = Sheet(
        title="x", date=datetime(1970, 1, 1), road_file="straight.xodr", t_end=1.0,  # noqa: DTZ001
        version=version, environment=environment,
    )  # fmt: skip
    file = folder / "x.xosc"
    write_scenario(file, [track], sheet)
    return check(file)


@pytest.mark.parametrize("version", list(OscVersion))
@pytest.mark.parametrize("name", ["clear-noon", "rain-night", "rain-noon"])
def test_the_weather_of_a_run_is_that_of_its_file(tmp_path, name, version):
    weather = preset(name)
    found = exported(tmp_path, environment_of(weather), version)
    assert found.findings == ()  # the schema of its version accepts it
    environment = found.scenario.start.environment
    again = weather_of(environment, preset("clear-noon"), name)
    near = {"cloudiness": 20.0 if version is OscVersion.V1_0 else 6.3, "sun_altitude_deg": 0.1,
            "precipitation": 0.1, "fog_density": 0.5}  # fmt: skip
    for field, tolerance in near.items():
        assert getattr(again, field) == pytest.approx(getattr(weather, field), abs=tolerance), field
    assert again.is_night == weather.is_night
    assert environment.friction_scale == 1.0


def test_falling_snow_is_written_as_snow(tmp_path) -> None:
    snow = Environment(fall=Fall.SNOW, fall_mm_h=2.0)
    found = exported(tmp_path, snow, OscVersion.V1_2).scenario.start.environment
    assert (found.fall, found.fall_mm_h) == (Fall.SNOW, 2.0)
