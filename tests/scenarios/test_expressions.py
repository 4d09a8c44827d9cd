"""Expressions: operators and functions of the standard by hand arithmetic; nothing else is called."""

from __future__ import annotations

import pytest

from skidpad.scenarios.reading.expressions import ExpressionError, evaluate
from skidpad.scenarios.reading.findings import ScenarioError
from support.scenarios.files import at, compiled

SCOPE = {"a": "7", "b": "2.5", "word": "wet", "yes": "true"}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", "7"),
        ("(1 + 2) * 3", "9"),
        ("-$a + 10", "3"),
        ("10 - 4 - 3", "3"),
        ("$a / 2", "3.5"),
        ("$a % 4", "3"),
        ("round(2.5)", "3"),
        ("round(-2.5)", "-2"),
        ("floor(-0.5)", "-1"),
        ("ceil(0.2)", "1"),
        ("sqrt(16)", "4"),
        ("pow(2, 10)", "1024"),
        ("max(3, $b) - min(3, $b)", "0.5"),
        ("abs(-3)", "3"),
        ("sign(-3)", "-1"),
        ("cos(0) + sin(0)", "1"),
        ("1e3", "1000"),
        ("70 / 3.6 > 19 and not false", "true"),
        ("$yes or false", "true"),
        ("$word == 'wet'", "true"),
        ("2 < 1", "false"),
        ("a * 2", "14"),
    ],
)
def test_values(text, value):
    assert evaluate(text, SCOPE) == value


@pytest.mark.parametrize(
    "text",
    ["", "1 +", "1 2", "$nothing", "sqrt(-1)", "1 / 0", "exit(1)", "__import__('os')", "a.b", "1 ; 2",
     "sqrt(1, 2)", "'wet' + 1", "(" * 60 + "1" + ")" * 60, "10 ^ 2"],
)  # fmt: skip
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(ExpressionError):
        evaluate(text, SCOPE)


KMH = '<ParameterDeclaration name="kmh" parameterType="double" value="72">{}</ParameterDeclaration>'
LIMITS = """<ConstraintGroup><ValueConstraint rule="greaterThan" value="{}"/>
<ValueConstraint rule="lessThan" value="${{$kmh + 1}}"/></ConstraintGroup>"""


def test_an_attribute_may_be_an_expression(tmp_path):
    begin = at("ego", -3, 100, "${$kmh / 3.6}") + at("other", -1, 120)
    start = compiled(tmp_path, parameters=KMH.format(""), init=begin).start
    assert start.entities["ego"].speed == pytest.approx(20.0)


def test_a_parameter_is_held_to_its_constraints(tmp_path):
    assert compiled(tmp_path, parameters=KMH.format(LIMITS.format(50)))
    either = LIMITS.format(90) + LIMITS.format(60)
    assert compiled(tmp_path, parameters=KMH.format(either))
    with pytest.raises(ScenarioError, match="kmh = 72 meets none of its constraint groups"):
        compiled(tmp_path, parameters=KMH.format(LIMITS.format(90)))
