"""Spaces from files of <ParameterValueDistribution>, and what was found as such a file."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from pathlib import Path
from xml.etree import ElementTree

from skidpad.core.maths.space import Choice, Law, Normal, Space, Uniform, Variable
from skidpad.recording.campaign.searches import Trial
from skidpad.recording.files import write_bytes
from skidpad.scenarios.reading.distributions import read_weights, scenario_of_choices
from skidpad.scenarios.reading.document import Node, parse
from skidpad.scenarios.reading.parameters import inner
from skidpad.search.space import check_space, is_parameter

TOP = "ParameterValueDistribution"


def read_space(file: Path) -> tuple[Path, Space]:
    """Return the scenario that a file of distributions names, and the space that it describes.

    Ranges are uniform, sets are choices, and stochastic distributions are as they say. What depends on
    several parameters at once, and Poisson distributions and histograms, cannot be searched.

    Raises:
        FileError: the file is damaged, its scenario is missing, or it holds what cannot be searched.
    """
    node = inner(parse(file)).child(TOP)
    drawn = node.find("Stochastic")
    if drawn is not None:
        ones = drawn.children("StochasticDistribution")
    else:
        fixed = node.child("Deterministic")
        for many in fixed.children("DeterministicMultiParameterDistribution"):
            raise many.unsupported_fault()
        ones = fixed.children("DeterministicSingleParameterDistribution")
    found = tuple(Variable(one.plain("parameterName"), _law(one.only()), str(file)) for one in ones)
    return scenario_of_choices(file, node), check_space(Space(found))


def _law(node: Node) -> Law:
    """Returns the law of a distribution node; raises an error for a kind that is not supported."""
    if node.tag == "DistributionSet":
        return Choice(tuple(e.text("value") for e in node.children("Element")))
    if node.tag == "ProbabilityDistributionSet":
        elements = list(node.children("Element"))
        return Choice(tuple(e.text("value") for e in elements), read_weights(node, elements))
    found = node.find("Range")
    low = None if found is None else found.number("lowerLimit")
    high = None if found is None else found.number("upperLimit")
    if node.tag in ("UniformDistribution", "DistributionRange"):
        if low is None or high is None or not low < high:
            raise node.error("needs a Range whose lowerLimit is below its upperLimit")
        return Uniform(low, high)
    if node.tag in ("NormalDistribution", "LogNormalDistribution"):
        variance = node.number("variance")
        if variance <= 0.0:
            raise node.error(f"variance must be above 0, got {variance:g}")
        is_log = node.tag == "LogNormalDistribution"
        return Normal(node.number("expectedValue"), sqrt(variance), low, high, is_log)
    raise node.unsupported_fault()


def write_choices(path: Path, scenario: str, trials: Sequence[Trial]) -> None:
    """Write the values of trials as a file that `skidpad play` and other tools play one by one."""
    root = ElementTree.Element("OpenSCENARIO")
    ElementTree.SubElement(
        root, "FileHeader", revMajor="1", revMinor="2", date="2026-01-01T00:00:00",
        description="failures found by a search", author="skidpad search",
    )  # fmt: skip
    top = ElementTree.SubElement(root, TOP)
    ElementTree.SubElement(top, "ScenarioFile", filepath=scenario)
    many = ElementTree.SubElement(
        ElementTree.SubElement(top, "Deterministic"), "DeterministicMultiParameterDistribution"
    )
    sets = ElementTree.SubElement(many, "ValueSetDistribution")
    for trial in trials:
        one = ElementTree.SubElement(sets, "ParameterValueSet")
        for name, value in trial.values.items():
            if is_parameter(name):
                text = value if isinstance(value, str) else repr(value)
                ElementTree.SubElement(one, "ParameterAssignment", parameterRef=name, value=text)
    ElementTree.indent(root)
    write_xml(path, root)


def write_xml(path: Path, root: ElementTree.Element) -> None:
    """Write an XML tree to a file in UTF-8 with its declaration."""
    write_bytes(path, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))
