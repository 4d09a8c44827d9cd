"""What all conditions are, and rules by which they compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.parameters import RULES
from skidpad.scenarios.scene import Scene

Probe = Callable[[Scene], bool]
SAME = 1e-9  # differences below this come from adding up steps


class Condition(Protocol):
    """Something that holds now or not; `probe` makes what is asked once per step."""

    def probe(self) -> Probe:
        """Returns a fresh observer: a function of the scene, for one run, to be called once per step."""
        ...


class EntityCondition(Protocol):
    """Something that holds for an entity or not."""

    def holds(self, scene: Scene, actor: str) -> bool:
        """Returns whether it holds for an entity now; called at most once per step and entity."""
        ...


@dataclass(frozen=True, slots=True)
class Rule:
    """Compares a quantity with a number, as OpenSCENARIO rules do."""

    rule: str
    value: float

    def is_met(self, quantity: float) -> bool:
        """Returns whether the quantity stands so to the value; infinity is beyond every number.

        They are equal where they differ by less than SAME.
        """
        difference = quantity - self.value
        if abs(difference) < SAME:
            return self.rule in ("equalTo", "greaterOrEqual", "lessOrEqual")
        return RULES[self.rule](quantity, self.value)


def rule(node: Node, value: str = "value") -> Rule:
    """Returns the comparison in the attributes `rule` and `value` of a condition."""
    return Rule(rule_name(node), node.number(value))


def rule_name(node: Node) -> str:
    """Returns the attribute `rule` of a node; raises an error for one that is not supported."""
    name = node.text("rule")
    if name not in RULES:
        raise node.unsupported_fault(f"rule={name!r} is not supported, only {', '.join(RULES)}")
    return name
