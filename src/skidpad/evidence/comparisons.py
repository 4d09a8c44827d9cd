"""`COLUMN > NUMBER`: a name, a comparison and a number, read before anything heavy loads; words of a gate."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from enum import Enum
from typing import Any

from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.text.told import describe_value

OPERATORS: dict[str, Callable[[Any, Any], Any]] = {  # of numbers, or arrays of them
    ">": operator.gt,
    ">=": operator.ge,
    "<": operator.lt,
    "<=": operator.le,
}
LIST_COLUMNS = "skidpad compare --columns"  # the command that lists what a rule can be about
RULE = re.compile(r"^\s*(\w+)\s*(>=|<=|>|<)\s*([-+]?[0-9.]+(?:e[-+]?\d+)?)\s*$")


def parse_comparison(
    option: str, text: str, known: list[str] | tuple[str, ...], list_command: str = ""
) -> tuple[str, Callable[[float, float], bool], float]:
    """Returns a name among `known`, a comparison and a number; ConfigError says what `option` takes.

    list_command: the command that lists `known`, as in `require_choice`.
    """
    match = RULE.match(text)
    if not match:
        raise ConfigError(
            f"{option} takes COLUMN > NUMBER (or >=, <, <=), got {describe_value(text, 200)}"
        )
    column, sign, number = match.groups()
    require_choice("column", column, known, list_command)
    try:
        limit = float(number)
    except ValueError:
        raise ConfigError(
            f"{option}: {describe_value(number, 100)} is no number, in {describe_value(text, 200)}"
        ) from None
    return column, OPERATORS[sign], limit


class Flaw(str, Enum):
    """Why a gate cannot be trusted; each fails it unless it is allowed by name."""

    MISSING = "missing"  # a run of one campaign is not in the other
    CRASHED = "crashed"  # a run crashed, timed out, or its stack failed
    EMPTY = "empty"  # what a rule judges has no values in both
