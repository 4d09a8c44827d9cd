"""Spaces: laws as their quantiles say, words of --vary, weather fields, files of distributions."""

from math import exp, log

import numpy as np
import pytest
from scipy import stats

from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.maths.space import Choice, Normal, Space, Uniform, Variable
from skidpad.core.run import RunSpec
from skidpad.search.files import read_space, write_choices
from skidpad.search.space import apply_values, parse_space, parse_variable
from skidpad.search.trial import Trial

GRID = np.linspace(0.01, 0.99, 33)


@pytest.mark.parametrize(
    ("text", "oracle"),
    [
        ("x=2:40", stats.uniform(2, 38)),
        ("x=normal(3,1.5)", stats.norm(3, 1.5)),
        ("x=normal(3,1,2.5:8)", stats.truncnorm(-0.5, 5.0, loc=3, scale=1)),
        ("x=lognormal(0.5,0.3)", stats.lognorm(0.3, scale=exp(0.5))),
        (
            "x=lognormal(0.5,0.3,1:2)",
            None,
        ),
    ],
)
def test_values_are_the_quantiles_of_the_distribution(text, oracle):
    variable = parse_variable(text)
    values = [variable.value(u) for u in GRID]
    if oracle is None:
        cut = stats.truncnorm((log(1) - 0.5) / 0.3, (log(2) - 0.5) / 0.3, loc=0.5, scale=0.3)
        expected = np.exp(cut.ppf(GRID))
    else:
        expected = oracle.ppf(GRID)
    assert values == pytest.approx(expected, rel=1e-6)


def test_likelihood_is_the_density_beside_the_highest_one_within_the_range():
    law = Normal(3.0, 1.0, 4.0, 8.0)
    density = stats.truncnorm(1.0, 5.0, loc=3, scale=1).pdf
    for value in (4.0, 4.5, 6.0):
        assert law.likelihood(value) == pytest.approx(density(value) / density(4.0))
    assert law.likelihood(3.9) == 0.0
    assert Uniform(0.0, 1.0).likelihood(0.3) == 1.0
    assert Choice(("a", "b"), (3.0, 1.0)).likelihood("b") == pytest.approx(1 / 3)


def test_a_choice_takes_as_much_of_the_cube_as_its_weight():
    law = Choice(("a", "b", "c"), (1.0, 2.0, 1.0))
    words = [law.value(u) for u in np.linspace(0.0, 0.999, 1000)]
    assert [words.count(w) for w in "abc"] == pytest.approx([250, 500, 250], abs=2)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("x", "takes NAME=LOW:HIGH"),
        ("x=", "takes NAME=LOW:HIGH"),
        ("x=1", "takes NAME=LOW:HIGH"),
        ("x=5:5", "the range 5:5 is empty"),
        ("x=normal(1,0)", "sigma must be above 0, got 0"),
        ("weather=3:4", "takes presets"),
        ("weather=clear-noon|mud", "mud"),
        ("weather.mud=0:1", "unknown --vary weather.FIELD 'mud'"),
        ("weather.wetness=0:101", "must lie within 0:100, got 0:101"),
        ("weather.wetness=normal(50,10)", "must lie within 0:100, got -inf:inf"),
    ],
)
def test_words_that_are_no_space_are_refused_in_one_sentence(text, complaint):
    with pytest.raises(ConfigError) as caught:
        parse_space([text])
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_space_needs_a_variable_and_each_only_once():
    with pytest.raises(ConfigError, match="nothing varies"):
        parse_space([])
    with pytest.raises(ConfigError, match="varies twice"):
        parse_space(["x=1:2", "x=2:3"])


def test_values_reach_the_scenario_and_the_weather():
    template = RunSpec(course=Scenario(file="lead_slowdown", parameters={"LeadS": 120.0}))
    space = parse_space(["Deceleration=2:6", "weather=rain-noon|icy_30", "weather.wetness=0:100"])
    spec = apply_values(template, space.values([0.25, 0.9, 0.5]))
    assert spec.course.parameters == {"LeadS": 120.0, "Deceleration": 3.0}
    assert spec.weather.name == "icy_30"
    assert spec.weather.wetness == 50.0


FILE = """<?xml version="1.0"?>
<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" description="d"
 author="a"/><ParameterValueDistribution><ScenarioFile filepath="s.xosc"/>
<Stochastic numberOfTestRuns="5">
<StochasticDistribution parameterName="gap"><NormalDistribution expectedValue="3" variance="4">
<Range lowerLimit="1" upperLimit="9"/></NormalDistribution></StochasticDistribution>
<StochasticDistribution parameterName="who"><ProbabilityDistributionSet>
<Element value="car" weight="3"/><Element value="van" weight="1"/></ProbabilityDistributionSet>
</StochasticDistribution></Stochastic></ParameterValueDistribution></OpenSCENARIO>"""


def test_a_file_of_distributions_is_a_space_and_failures_become_such_a_file(tmp_path):
    (tmp_path / "s.xosc").write_text("<OpenSCENARIO/>")
    (tmp_path / "d.xosc").write_text(FILE)
    scenario, space = read_space(tmp_path / "d.xosc")
    assert scenario == (tmp_path / "s.xosc").resolve()
    assert [v.law for v in space.variables] == [
        Normal(3.0, 2.0, 1.0, 9.0),
        Choice(("car", "van"), (3.0, 1.0)),
    ]
    assert all(v.source.endswith("d.xosc") for v in space.variables)
    values = {"gap": 1.5, "who": "van", "weather": "icy_30"}
    trial = Trial(number=0, unit=(0.1, 0.9, 0.5), values=values, margin=-1.0)
    write_choices(tmp_path / "f.xosc", "s.xosc", [trial])
    from skidpad.scenarios.reading.distributions import choices

    (found,) = choices(tmp_path / "f.xosc")
    assert dict(found.parameters) == {"gap": "1.5", "who": "van"}


def test_a_file_with_an_empty_range_names_the_element(tmp_path):
    (tmp_path / "s.xosc").write_text("<OpenSCENARIO/>")
    wrong = FILE.replace('variance="4"', 'variance="0"')
    (tmp_path / "d.xosc").write_text(wrong)
    with pytest.raises(FileError, match="variance must be above 0, got 0"):
        read_space(tmp_path / "d.xosc")


def test_values_are_written_with_nine_digits():
    assert Variable("x", Uniform(0.0, 1.0)).value(1 / 3) == 0.333333333
    assert Space((Variable("x", Uniform(0.0, 1.0)),)).values([1 / 3]) == {"x": 0.333333333}
