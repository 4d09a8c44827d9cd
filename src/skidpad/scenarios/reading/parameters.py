"""Parameters and variables: declarations, values from outside, constraints, nested scopes."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping

from skidpad.core.errors import FileError
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.expressions import as_text
from skidpad.scenarios.reading.moments import moment

NUMBERS = ("double", "integer", "int", "unsignedInt", "unsignedShort")
RULES: Mapping[str, Callable[[float | str, float | str], bool]] = {
    "equalTo": operator.eq,
    "notEqualTo": operator.ne,
    "greaterThan": operator.gt,
    "lessThan": operator.lt,
    "greaterOrEqual": operator.ge,
    "lessOrEqual": operator.le,
}


def holds_between(rule: str, left: str, right: str) -> bool:
    """Returns whether texts compare by a rule: as numbers or moments where both are, else by letters."""
    for read in (float, moment):
        try:
            return RULES[rule](read(left), read(right))
        except ValueError:
            continue
    return RULES[rule](left, right)


def root_values(root: Node, given: Mapping[str, float | str]) -> dict[str, str]:
    """Returns the parameters of a file, some of them overridden from outside.

    FileError for a given one that the file does not declare.
    """
    values = read_declarations(root, {}, given)
    for name in given:
        if name not in values:
            known = ", ".join(values) or "none"
            raise FileError(f"{root.file.name} declares no parameter {name!r}; it has {known}")
    return values


def read_declarations(
    node: Node, outer: Mapping[str, str], given: Mapping[str, float | str]
) -> dict[str, str]:
    """Returns the parameters in scope inside an element that may declare some; given: assigned values.

    A Fault where a value does not fit its type or constraints.
    """
    values = dict(outer)
    declarations = node.find("ParameterDeclarations")
    if declarations is None:
        return values
    for one in declarations.children("ParameterDeclaration"):
        name = one.plain("name")
        value = given.get(name)
        text = one.with_parameters(values).text("value") if value is None else _text(value)
        _require_type(one, text)
        values[name] = text
    for one in declarations.children("ParameterDeclaration"):  # which may name each other
        name = one.plain("name")
        _require_constraints(one.with_parameters(values), name, values[name])
    return values


def inner(node: Node) -> Node:
    """Returns an element with its own declarations in scope."""
    if node.find("ParameterDeclarations") is None:
        return node
    return node.with_parameters(read_declarations(node, node.values, {}))


def assignments(node: Node) -> dict[str, str]:
    """Returns the values that a catalog reference or a distribution assigns, by parameter."""
    found = node.find("ParameterAssignments")
    if found is None:
        return {}
    return {
        one.plain("parameterRef"): one.text("value")
        for one in found.children("ParameterAssignment")
    }


def variables(root: Node) -> dict[str, str]:
    """Returns the variables of a file with their first values."""
    declarations = root.find("VariableDeclarations")
    if declarations is None:
        return {}
    found = {}
    for one in declarations.children("VariableDeclaration"):
        name = one.plain("name")
        found[name] = one.text("value")
        _require_type(one, found[name])
    return found


def _text(value: float | str) -> str:
    """Returns the value as the text that a file would hold."""
    return value if isinstance(value, str) else as_text(float(value))


def _require_type(node: Node, text: str) -> None:
    """Raises an error where the text is no value of the declared number or boolean type."""
    kind = node.text("parameterType" if node.has("parameterType") else "variableType", "string")
    if kind in NUMBERS:
        try:
            float(text)
        except ValueError:
            raise node.error(f"value must be a number of type {kind}, got {text!r}") from None
    elif kind == "boolean" and text not in ("true", "false", "1", "0"):
        raise node.error(f"value must be true or false, got {text!r}")


def _require_constraints(node: Node, name: str, text: str) -> None:
    """Raises an error where the value meets none of the parameter's constraint groups."""
    groups = [list(g.children("ValueConstraint")) for g in node.children("ConstraintGroup")]
    if not groups:
        return
    for group in groups:
        for one in group:
            if one.text("rule") not in RULES:
                raise one.unsupported_fault(f"rule={one.text('rule')!r} is not supported")
    if not any(
        all(holds_between(c.text("rule"), text, c.text("value")) for c in g) for g in groups
    ):
        raise node.error(f"{name} = {text} meets none of its constraint groups")
