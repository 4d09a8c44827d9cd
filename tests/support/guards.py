"""Mutants of constants, and the tests that must notice them, run in this process."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from functools import cache
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import pytest

from support.interpreted import interpret

STACK = "skidpad.stack."
TESTS = Path(__file__).parents[1]


class Guard(NamedTuple):
    """The test that notices a change of some constants of a module."""

    module: str
    test: str  # file::function
    constants: str
    values: tuple[Any, ...] = ()  # instead of 10 % less and more


def mutants(value: Any) -> Iterator[Any]:
    """`value` with one number in it 10 % smaller or larger; whole numbers stay whole."""
    if isinstance(value, tuple):
        make = getattr(value, "_make", tuple)
        for i, part in enumerate(value):
            for other in mutants(part):
                yield make((*value[:i], other, *value[i + 1 :]))
    elif is_dataclass(value):
        for f in fields(value):
            for other in mutants(getattr(value, f.name)):
                yield replace(value, **{f.name: other})  # type: ignore[type-var]
    elif isinstance(value, int):
        step = max(round(0.1 * value), 1)
        yield from (value - step, value + step)
    else:
        yield from (0.9 * value, 1.1 * value)


@cache
def module_of(file: str) -> ModuleType:
    spec = spec_from_file_location("guard_" + Path(file).stem, TESTS / file)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run(test: str) -> None:
    """Call a test function with all its parameters."""
    file, _, name = test.partition("::")
    function = getattr(module_of(file), name)
    tables = []
    for mark in getattr(function, "pytestmark", ()):
        if mark.name == "parametrize":
            names = mark.args[0]
            names = [n.strip() for n in names.split(",")] if isinstance(names, str) else names
            rows = [row if len(names) > 1 else (row,) for row in mark.args[1]]
            tables.append([dict(zip(names, row, strict=True)) for row in rows])
    for rows in product(*tables):
        function(**{name: value for row in rows for name, value in row.items()})


def survivors_of(
    guard: Guard, constant: str, monkeypatch: pytest.MonkeyPatch, house: str = "skidpad."
) -> list[Any]:
    """The mutants of a constant that the guard's test does not notice."""
    module = import_module(house + guard.module)
    value = getattr(module, constant)
    run(guard.test)
    if house == STACK:
        interpret(monkeypatch, [module_of(guard.test.partition("::")[0])])
        run(guard.test)  # without a change it passes in Python, too
    changed = list(guard.values or mutants(value))
    if constant.endswith("_GAINS"):  # limits of the output are tested with the tiers
        changed = changed[:6]
    survivors = []
    for mutant in changed:
        monkeypatch.setattr(module, constant, mutant)
        try:
            run(guard.test)
        except AssertionError:
            continue
        survivors.append(mutant)
    return survivors
