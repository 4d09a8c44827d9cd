"""The property `tyres` of a vehicle names its tyres, and a wrong name is one sentence."""

import pytest

from skidpad.scenarios.playing.player import setups
from skidpad.scenarios.reading.findings import ScenarioError
from support.scenarios.files import at, compiled, vehicle


def shod(name, tyres):
    said = f'<Properties><Property name="tyres" value="{tyres}"/></Properties>'
    return vehicle(name).replace("<Properties/>", said)


def test_a_vehicle_of_a_file_has_the_tyres_that_its_property_names(tmp_path):
    scenario = compiled(
        tmp_path, entities=vehicle("ego") + shod("other", "summer_1.6mm"),
        init=at("ego", -3, 100) + at("other", -1, 120),
    )  # fmt: skip
    ego, (other,) = setups(scenario)
    assert (ego.tyres, other.tyres) == ("", "summer_1.6mm")


def test_an_unknown_name_says_what_is_allowed(tmp_path):
    with pytest.raises(ScenarioError, match="property tyres must be one of all_season, .*'slick'"):
        compiled(tmp_path, entities=shod("ego", "slick"), init=at("ego", -3, 100))
