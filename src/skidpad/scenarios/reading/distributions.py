"""Files of <ParameterValueDistribution>: many choices of parameters for one scenario file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf, prod, sqrt
from pathlib import Path

import numpy as np

from skidpad.scenarios.reading.document import Node, holds, parse
from skidpad.scenarios.reading.expressions import as_text
from skidpad.scenarios.reading.parameters import assignments, inner

CHOICES_MAX = 100_000
TRIES_MAX = 10_000  # draws until one lies in its range
DIGITS = 12  # of a range's values, so that ten steps of 0.1 make 1
SLACK = 1e-9  # of a step, by which a range still reaches its end


@dataclass(frozen=True, slots=True)
class Choice:
    """A scenario file with values of its parameters."""

    file: Path
    parameters: Mapping[str, str]


def is_distribution(file: Path) -> bool:
    """Returns whether the file holds choices instead of a scenario; False for what cannot be read."""
    return holds(file, "ParameterValueDistribution")


def choices(file: Path) -> list[Choice]:
    """Returns all choices that a file makes: every combination of sets and ranges, or as many draws.

    The same file gives the same draws. A Fault where it makes more than CHOICES_MAX.
    """
    node = inner(parse(file)).child("ParameterValueDistribution")
    scenario = scenario_of_choices(file, node)
    drawn = node.find("Stochastic")
    values = _combine_parameters(node.child("Deterministic")) if drawn is None else _draws(drawn)
    return [Choice(scenario, found) for found in values]


def scenario_of_choices(file: Path, node: Node) -> Path:
    """Returns the scenario that a file of distributions names; FileError where it is not there."""
    named = node.child("ScenarioFile")
    scenario = file.parent / named.text("filepath").replace("\\", "/")
    if not scenario.is_file():
        raise named.error("there is no such file")
    return scenario.resolve()


def _combine_parameters(node: Node) -> list[dict[str, str]]:
    """Returns every combination of the deterministic distributions, each as {parameter: value text}."""
    factors: list[list[dict[str, str]]] = []
    for one in node.children("DeterministicSingleParameterDistribution"):
        name = one.plain("parameterName")
        factors.append([{name: value} for value in _values(one.only())])
    for many in node.children("DeterministicMultiParameterDistribution"):
        sets = many.child("ValueSetDistribution").children("ParameterValueSet")
        factors.append([_read_parameter_set(s) for s in sets])
    if prod(len(f) for f in factors) > CHOICES_MAX:
        raise node.error(f"makes more than {CHOICES_MAX} choices")
    return [{k: v for part in parts for k, v in part.items()} for parts in product(*factors)]


def _read_parameter_set(node: Node) -> dict[str, str]:
    """Returns the assignments of one value set as {parameter: value text}."""
    direct = {
        one.plain("parameterRef"): one.text("value") for one in node.children("ParameterAssignment")
    }
    return direct | assignments(node)


def _values(node: Node) -> list[str]:
    """Returns the value texts of a distribution set, or of a range with its step width."""
    if node.tag == "DistributionSet":
        return [e.text("value") for e in node.children("Element")]
    if node.tag != "DistributionRange":
        raise node.unsupported_fault()
    step, (low, high) = node.number("stepWidth"), _range(node)
    if step <= 0.0 or (high - low) / step > CHOICES_MAX:
        raise node.error(f"stepWidth {step:g} makes too many choices or none")
    count = int((high - low) / step + SLACK) + 1
    return [as_text(round(low + k * step, DIGITS)) for k in range(count)]


def _range(node: Node) -> tuple[float, float]:
    """Returns the lower and upper limit; -inf and inf where the node has no range."""
    found = node.find("Range")
    if found is None:
        return -inf, inf
    return found.number("lowerLimit"), found.number("upperLimit")


def _finite_range(node: Node) -> tuple[float, float]:
    """Returns the lower and upper limit; raises an error where they are missing, infinite or swapped."""
    low, high = _range(node)
    if not -inf < low <= high < inf:
        raise node.error(f"needs a Range of two numbers in order, got {low:g} to {high:g}")
    return low, high


Draw = Callable[[np.random.Generator], float | str]


def _draws(node: Node) -> Iterator[dict[str, str]]:
    """Yields `numberOfTestRuns` random parameter sets as {parameter: value text}, from the file's seed."""
    count = node.whole("numberOfTestRuns")
    if not 0 < count <= CHOICES_MAX:
        raise node.error(f"numberOfTestRuns must be 1 to {CHOICES_MAX}, got {count}")
    rng = np.random.default_rng(int(abs(node.number("randomSeed", 0.0))))
    draws = {
        one.plain("parameterName"): _draw(one.only())
        for one in node.children("StochasticDistribution")
    }
    for _ in range(count):
        drawn = {name: draw(rng) for name, draw in draws.items()}
        yield {k: v if isinstance(v, str) else as_text(float(v)) for k, v in drawn.items()}


def _draw(node: Node) -> Draw:
    """Returns the function of a random generator that draws one value of the distribution."""
    if node.tag == "ProbabilityDistributionSet":
        elements = list(node.children("Element"))
        return _draw_weighted([e.text("value") for e in elements], read_weights(node, elements))
    if node.tag == "UniformDistribution":
        low, high = _finite_range(node)
        return lambda rng: float(rng.uniform(low, high))
    low, high = _range(node)
    if node.tag in ("NormalDistribution", "LogNormalDistribution"):
        mean, sigma = node.number("expectedValue"), sqrt(max(node.number("variance"), 0.0))
        plain = node.tag == "NormalDistribution"
        return _within(
            node,
            low,
            high,
            lambda rng: rng.normal(mean, sigma) if plain else rng.lognormal(mean, sigma),
        )
    if node.tag == "PoissonDistribution":
        mean = node.number("expectedValue")
        return _within(node, low, high, lambda rng: float(rng.poisson(mean)))
    if node.tag == "Histogram":
        bins = list(node.children("HistogramBin"))
        which = _draw_weighted(list(range(len(bins))), read_weights(node, bins))
        edges = [_finite_range(b) for b in bins]
        return lambda rng: float(rng.uniform(*edges[int(which(rng))]))
    raise node.unsupported_fault()


def read_weights(node: Node, parts: Sequence[Node]) -> tuple[float, ...]:
    """Returns the weights of a distribution's parts; raises an error unless one is above 0."""
    weights = tuple(part.number("weight") for part in parts)
    if min(weights, default=0.0) < 0.0 or not 0.0 < sum(weights) < inf:
        given = ", ".join(f"{weight:g}" for weight in weights)
        raise node.error(f"weights must be 0 or more and one above 0, got {given or 'none'}")
    return weights


def _draw_weighted(values: Sequence[str] | Sequence[int], weights: Sequence[float]) -> Draw:
    """Returns the function of a random generator that draws one of the values by weight."""
    shares = np.array(weights) / sum(weights)
    return lambda rng: values[int(rng.choice(len(values), p=shares))]


def _within(
    node: Node, low: float, high: float, draw: Callable[[np.random.Generator], float]
) -> Draw:
    """Returns a draw repeated until it lies in low..high; it raises an error after `TRIES_MAX` attempts."""

    def draw_within(rng: np.random.Generator) -> float:
        for _ in range(TRIES_MAX):
            value = float(draw(rng))
            if low <= value <= high:
                return value
        raise node.error(f"hardly ever lies in its range from {low:g} to {high:g}")

    return draw_within
