"""`${...}` of OpenSCENARIO: a small language of numbers, text and truth values, parsed by hand.

Operators and functions are those of OpenSCENARIO XML 1.3, 9.2; nothing else can be called.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import lru_cache

Value = float | bool | str
Scope = Mapping[str, str]

TOKENS = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|\$?(?P<name>[A-Za-z_]\w*)"
    r"|\$\{(?P<inner>[A-Za-z_]\w*)\}|'(?P<text>[^']*)'|\"(?P<quoted>[^\"]*)\""
    r"|(?P<sign><=|>=|==|!=|[-+*/%(),<>]))"
)
CONSTANTS: Mapping[str, Value] = {"true": True, "false": False, "pi": math.pi, "PI": math.pi}
DEPTH_MAX = 50  # nested brackets


class ExpressionError(ValueError):
    """What is wrong in an expression."""


def _sign(x: float) -> float:
    """Returns the sign of x: -1, 0 or 1 as float."""
    return float((x > 0.0) - (x < 0.0))


FUNCTIONS: Mapping[str, tuple[int, Callable[..., float]]] = {
    "round": (1, lambda x: math.floor(x + 0.5)),
    "floor": (1, math.floor),
    "ceil": (1, math.ceil),
    "sqrt": (1, math.sqrt),
    "pow": (2, math.pow),
    "abs": (1, abs),
    "sign": (1, _sign),
    "min": (2, min),
    "max": (2, max),
    "sin": (1, math.sin),
    "cos": (1, math.cos),
    "tan": (1, math.tan),
    "asin": (1, math.asin),
    "acos": (1, math.acos),
    "atan": (1, math.atan),
    "atan2": (2, math.atan2),
}
# binding power, then what it does; `pow` is a function, as in the standard
INFIX: Mapping[str, tuple[int, Callable[[float, float], Value]]] = {
    "or": (1, lambda a, b: bool(a) or bool(b)),
    "and": (2, lambda a, b: bool(a) and bool(b)),
    "==": (3, lambda a, b: a == b),
    "!=": (3, lambda a, b: a != b),
    "<": (4, lambda a, b: a < b),
    "<=": (4, lambda a, b: a <= b),
    ">": (4, lambda a, b: a > b),
    ">=": (4, lambda a, b: a >= b),
    "+": (5, lambda a, b: a + b),
    "-": (5, lambda a, b: a - b),
    "*": (6, lambda a, b: a * b),
    "/": (6, lambda a, b: a / b),
    "%": (6, math.fmod),
}
COMPARES_ANYTHING = ("==", "!=")
BARE = re.compile(r"[A-Za-z_]\w*(?:\s+(?!and\b|or\b|not\b)\w+)*")
PIECE = re.compile(rf"\$[A-Za-z_]\w*|[\d.]+|{BARE.pattern}")


@lru_cache(maxsize=4096)
def _tokens(text: str) -> tuple[tuple[str, str], ...]:
    """Splits an expression into (kind, text) tokens; raises an error at the first unknown character."""
    found, at = [], 0
    while text[at:].strip():
        match = TOKENS.match(text, at)
        if match is None:
            raise ExpressionError(f"{text[at:].strip()[0]!r} is not understood")
        kind = match.lastgroup or ""
        found.append((kind, match[kind]))
        at = match.end()
    return tuple(found)


def literal(text: str) -> Value:
    """Returns a parameter's text as a number or truth value where it is one, else as it is."""
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


def evaluate(text: str, scope: Scope) -> str:
    """Returns the value of an expression as an attribute's text; ExpressionError says what is wrong."""
    words = [part.strip() for part in text.split("+")]
    if any(_is_text(word, scope) for word in words) and all(PIECE.fullmatch(w) for w in words):
        return "".join(_word(word, scope) for word in words)
    try:
        reader = _Reader(_tokens(text), scope)
        value = reader.value(0)
        reader.end()
    except (ArithmeticError, ValueError, TypeError) as error:
        raise ExpressionError(str(error)) from None
    return as_text(value)


def _is_text(part: str, scope: Scope) -> bool:
    """Returns whether a part is several words, or a parameter whose value is no number."""
    value = scope.get(part.removeprefix("$"), 0.0)
    return " " in part or isinstance(literal(str(value)), str)


def _word(part: str, scope: Scope) -> str:
    """Returns a piece of a text that is put together by `+`, as esmini does it."""
    if not part.startswith("$"):
        return scope.get(part, part)
    if part[1:] not in scope:
        raise ExpressionError(f"parameter {part!r} is not declared")
    return scope[part[1:]]


def as_text(value: Value) -> str:
    """Returns a value as an attribute would have it: true, false, whole numbers without a point."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    whole = math.isfinite(value) and value == int(value) and abs(value) < 1e15
    return str(int(value)) if whole else repr(value)


class _Reader:
    """Precedence climbing over the tokens of one expression."""

    def __init__(self, tokens: tuple[tuple[str, str], ...], scope: Scope) -> None:
        self.tokens, self.scope, self.at, self.depth = tokens, scope, 0, 0

    def peek(self) -> str:
        """Returns the text of the next token, "" at the end."""
        return self.tokens[self.at][1] if self.at < len(self.tokens) else ""

    def take(self, wanted: str | None = None) -> tuple[str, str]:
        """Returns the next token and goes past it; ExpressionError unless it is `wanted`, if given."""
        if self.at >= len(self.tokens):
            raise ExpressionError(f"{wanted or 'a value'} is missing at the end")
        token = self.tokens[self.at]
        if wanted is not None and token[1] != wanted:
            raise ExpressionError(f"needs {wanted!r}, got {token[1]!r}")
        self.at += 1
        return token

    def end(self) -> None:
        """Requires that nothing follows the expression."""
        if self.at < len(self.tokens):
            raise ExpressionError(f"{self.peek()!r} is too much")

    def value(self, binding: int) -> Value:
        """Returns the value of the operators that bind more strongly than `binding`."""
        self.depth += 1
        if self.depth > DEPTH_MAX:
            raise ExpressionError("too many brackets")
        left = self.operand()
        while self.peek() in INFIX and INFIX[self.peek()][0] > binding:
            sign = self.take()[1]
            power, apply = INFIX[sign]
            right = self.value(power)
            if sign in COMPARES_ANYTHING:
                left = (left == right) is (sign == "==")
            else:
                left = apply(_number(left), _number(right))
        self.depth -= 1
        return left

    def operand(self) -> Value:
        """Returns the value of a literal, parameter, call, bracket, or of one of these with a sign."""
        kind, text = self.take()
        if kind == "number":
            return float(text)
        if kind in ("text", "quoted"):
            return text
        if text == "(":
            inner = self.value(0)
            self.take(")")
            return inner
        if text in ("-", "+", "not"):
            value = self.value(6)
            if text == "not":
                return not value
            return -_number(value) if text == "-" else _number(value)
        if kind not in ("name", "inner"):
            raise ExpressionError(f"{text!r} is out of place")
        if kind == "name" and text in FUNCTIONS and self.peek() == "(":
            return self.call(text)
        if text in self.scope:
            return literal(self.scope[text])
        if text in CONSTANTS:
            return CONSTANTS[text]
        raise ExpressionError(f"parameter {text!r} is not declared")

    def call(self, name: str) -> float:
        """Returns the value of a function of the standard with its arguments in parentheses."""
        count, function = FUNCTIONS[name]
        self.take("(")
        arguments = [_number(self.value(0))]
        while self.peek() == ",":
            self.take()
            arguments.append(_number(self.value(0)))
        self.take(")")
        if len(arguments) != count:
            raise ExpressionError(f"{name} takes {count} values, got {len(arguments)}")
        return float(function(*arguments))


def _number(value: Value) -> float:
    """Returns the value as a float; raises an error where it is text."""
    if isinstance(value, str):
        raise ExpressionError(f"{value!r} is not a number")
    return float(value)
