"""Distributions: every combination, or as many draws as are asked for, each with its own values."""

# ruff: noqa: ISC004  elements in lists of parameters
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from skidpad.core.errors import FileError
from skidpad.scenarios.reading.distributions import choices, is_distribution
from support.scenarios.files import document, write

FILE = document(
    '<ParameterValueDistribution><ScenarioFile filepath="x.xosc"/>{}</ParameterValueDistribution>'
)
SPEEDS = """<DeterministicSingleParameterDistribution parameterName="v"><DistributionRange
stepWidth="0.1"><Range lowerLimit="1" upperLimit="1.3"/></DistributionRange>
</DeterministicSingleParameterDistribution>"""
WORDS = """<DeterministicSingleParameterDistribution parameterName="w"><DistributionSet>
<Element value="wet"/><Element value="dry"/></DistributionSet>
</DeterministicSingleParameterDistribution>"""
PAIRS = """<DeterministicMultiParameterDistribution><ValueSetDistribution>
<ParameterValueSet><ParameterAssignment parameterRef="a" value="1"/>
<ParameterAssignment parameterRef="b" value="2"/></ParameterValueSet>
<ParameterValueSet><ParameterAssignment parameterRef="a" value="3"/>
<ParameterAssignment parameterRef="b" value="4"/></ParameterValueSet>
</ValueSetDistribution></DeterministicMultiParameterDistribution>"""


def distribution(folder: Path, body: str) -> Path:
    write(folder)
    path = folder / "many.xosc"
    path.write_text(FILE.format(body), encoding="utf-8")
    return path


def test_every_combination_of_sets_ranges_and_pairs(tmp_path):
    path = distribution(tmp_path, f"<Deterministic>{SPEEDS}{WORDS}{PAIRS}</Deterministic>")
    found = [c.parameters for c in choices(path)]
    assert len(found) == 4 * 2 * 2
    assert sorted({f["v"] for f in found}) == ["1", "1.1", "1.2", "1.3"]
    assert {(f["a"], f["b"]) for f in found} == {("1", "2"), ("3", "4")}
    assert is_distribution(path)
    assert not is_distribution(tmp_path / "x.xosc")


def drawn(folder, body, runs=4000, seed=5):
    one = f'<StochasticDistribution parameterName="v">{body}</StochasticDistribution>'
    many = f'<Stochastic numberOfTestRuns="{runs}" randomSeed="{seed}">{one}</Stochastic>'
    return np.array([float(c.parameters["v"]) for c in choices(distribution(folder, many))])


@pytest.mark.parametrize(
    ("body", "mean", "low", "high"),
    [
        ('<NormalDistribution expectedValue="20" variance="9"><Range lowerLimit="14" '
         'upperLimit="26"/></NormalDistribution>', 20.0, 14.0, 26.0),
        ('<UniformDistribution><Range lowerLimit="2" upperLimit="4"/></UniformDistribution>',
         3.0, 2.0, 4.0),
        ('<PoissonDistribution expectedValue="3"/>', 3.0, 0.0, 30.0),
        ('<ProbabilityDistributionSet><Element value="1" weight="1"/><Element value="5" weight="3"/>'
         '</ProbabilityDistributionSet>', 4.0, 1.0, 5.0),
        ('<Histogram><HistogramBin weight="1"><Range lowerLimit="0" upperLimit="2"/></HistogramBin>'
         '<HistogramBin weight="1"><Range lowerLimit="2" upperLimit="6"/></HistogramBin></Histogram>',
         2.5, 0.0, 6.0),
    ],
)  # fmt: skip
def test_draws_have_the_mean_and_the_range_that_the_file_says(tmp_path, body, mean, low, high):
    values = drawn(tmp_path, body)
    assert values.mean() == pytest.approx(mean, abs=5.0 * values.std() / np.sqrt(len(values)))
    assert low <= values.min() <= values.max() <= high
    assert (drawn(tmp_path, body) == values).all()
    assert not (drawn(tmp_path, body, seed=6) == values).all()


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ('<Stochastic numberOfTestRuns="0"/>', "numberOfTestRuns"),
        (f"<Deterministic>{SPEEDS.replace('0.1', '0')}</Deterministic>", "stepWidth"),
        (f"<Deterministic>{SPEEDS.replace('0.1', '1e-9')}</Deterministic>", "stepWidth"),
    ],
)
def test_what_makes_no_sense_is_said(tmp_path, body, message):
    with pytest.raises(FileError, match=message):
        choices(distribution(tmp_path, body))
    (tmp_path / "x.xosc").unlink()
    (tmp_path / "many.xosc").write_text(FILE.format("<Deterministic/>"), encoding="utf-8")
    with pytest.raises(FileError, match="no such file"):
        choices(tmp_path / "many.xosc")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<UniformDistribution/>", "needs a Range of two numbers in order, got -inf to inf"),
        ('<UniformDistribution><Range lowerLimit="4" upperLimit="2"/></UniformDistribution>', "4 to 2"),
        ('<ProbabilityDistributionSet><Element value="1" weight="0"/></ProbabilityDistributionSet>',
         "one above 0, got 0"),
        ('<Histogram><HistogramBin weight="-1"><Range lowerLimit="0" upperLimit="2"/></HistogramBin>'
         "</Histogram>", "got -1"),
    ],
)  # fmt: skip
def test_a_distribution_without_a_range_or_a_weight_is_refused_with_its_line(
    tmp_path, body, message
):
    """NumPy's OverflowError and ValueError came through and named neither file nor line."""
    with pytest.raises(FileError, match=rf"many\.xosc.*{message}"):
        drawn(tmp_path, body)
