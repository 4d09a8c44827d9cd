"""Seeded mutations of the values inside JSON, lines of JSON and YAML: what is read stays well formed."""

from __future__ import annotations

import json
import random
import re
from copy import deepcopy
from functools import cache
from typing import Any

import yaml

from support.faults import mutation

VALUES = (
    None, True, False, 0, 1, -1, 2, 7, 0.5, -0.0, 10**30, 2**63, 2**31, -(2**63), 1.7e308, -1.7e308, 5e-324,
    float("nan"), float("inf"), -float("inf"), "", "a", "1", "-1.5", "nan", "null", [], {}, [[]], [None],
    [1, 2], {"a": 1}, "x" * 5000, "two\nlines", "\ud800", "\x00", "../../x", "$x", "2001-99-99", "2026-01-01",
    "\N{SUPERSCRIPT TWO}", "\N{RIGHT-TO-LEFT OVERRIDE}a", "<b>&", [0] * 300,
)  # fmt: skip
KEYS = ("", "zz", "x" * 300, "\ud800", "1", "a\nb", "__class__")
FACTORS = (-1, 0, 2, 0.5, 1000, 1e-3, 1e6)
NAMED = re.compile(r"\b(NaN|Infinity)\b")  # as YAML calls them: .nan and .inf
YAML_NAMES = {"NaN": ".nan", "Infinity": ".inf"}
Slot = tuple[Any, Any]  # a list or dict, and the index or key of one of its values


def mutated_json(rng: random.Random, data: bytes) -> bytes:
    """A file of one JSON value, or of one per line, with other values in it."""
    texts = as_json(data)
    values = [json.loads(text) for text in texts]
    exchange(rng, values)
    return b"\n".join(json.dumps(value).encode() for value in values) + b"\n" * (len(texts) > 1)


def mutated_yaml(rng: random.Random, data: bytes) -> bytes:
    """A YAML file with other values in it, in flow style."""
    values = [json.loads(yaml_as_json(data))]
    exchange(rng, values)
    text = json.dumps(values[0] if values else None)
    return NAMED.sub(lambda found: YAML_NAMES[found[0]], text).encode()


@cache
def as_json(data: bytes) -> tuple[bytes, ...]:
    """The lines of a file, or all of it where it is one value over many lines."""
    lines = tuple(line for line in data.splitlines() if line.strip())
    return lines if len(lines) > 1 and lines[0].endswith(b"}") else (data,)


@cache
def yaml_as_json(data: bytes) -> str:
    """A YAML file as JSON."""
    return json.dumps(yaml.safe_load(data), default=str)


def exchange(rng: random.Random, values: list[Any]) -> None:
    """One to three changes of values at any depth; whole lines are values too."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        slots = list(_slots(values))
        if slots:
            _change(rng, rng.choice(slots), slots)


def _slots(value: Any) -> Any:
    keys = range(len(value)) if isinstance(value, list) else value
    for key in keys:
        yield value, key
        if isinstance(value[key], (list, dict)):
            yield from _slots(value[key])


def _change(rng: random.Random, slot: Slot, slots: list[Slot]) -> None:
    inside, key = slot
    old = inside[key]
    what = rng.randrange(10)
    if what < 3 and isinstance(old, (int, float)):
        inside[key] = _near(rng, old)
    elif what < 3 and isinstance(old, str):
        inside[key] = rng.choice((old.upper(), old + " ", old[:-1], *mutation.TEXTS))
    elif what < 6:
        inside[key] = deepcopy(rng.choice(VALUES))
    elif what == 6:
        del inside[key]
    elif what == 7:
        other, place = rng.choice(slots)
        inside[key] = deepcopy(other[place]) if place in _places(other) else None
    elif what == 8 and isinstance(old, list):
        inside[key] = old * rng.choice((2, 2, 100)) if rng.random() < 0.7 else old[::-1]
    elif what == 8:
        inside[key] = rng.choice(([old], {"a": old}, [old, old], str(old)))
    elif isinstance(inside, dict):
        inside[rng.choice((*inside, *KEYS))] = inside.pop(key)
    else:
        inside.insert(rng.randrange(len(inside) + 1), old)


def _places(value: Any) -> Any:
    return range(len(value)) if isinstance(value, list) else value


def _near(rng: random.Random, old: float) -> float:
    if rng.random() < 0.5:
        return old + rng.choice((-1, 1, -0.5, 0.001))
    return old * rng.choice(FACTORS)
