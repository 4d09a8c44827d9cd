"""Criteria that a file states by itself: conditions of ScenarioRunner with names of their own."""

from __future__ import annotations

from skidpad.recording.run.staging import FileCriterion
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Fault

PREFIX, SUFFIX = "criteria_", "Test"  # in 2019 without the prefix


def is_criterion(name: str) -> bool:
    """Returns whether a condition of this name is a criterion of ScenarioRunner."""
    return name.startswith(PREFIX) or name.endswith(SUFFIX)


def file_criteria(root: Node) -> tuple[FileCriterion, ...]:
    """Returns the criteria of a file: conditions on parameters that it does not declare."""
    found: dict[str, FileCriterion] = {}
    for element in root.element.iter("Condition"):
        node = Node(element, root.file, root.values)
        value = node.find("ByValueCondition", "ParameterCondition")
        name = str(element.get("name", ""))
        if value is None or not is_criterion(name):
            continue
        if value.element.get("parameterRef", "").removeprefix("$") in root.values:
            continue
        name = name.removeprefix(PREFIX)
        found.setdefault(name, FileCriterion(name=name, limit=_limit(value)))
    return tuple(found.values())


def _limit(value: Node) -> float | None:
    """Returns the number that a criterion compares with; None where it states none."""
    try:
        return value.number("value") if value.element.get("value") else None
    except Fault:
        return None
