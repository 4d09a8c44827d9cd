"""Entry points on the page of the Python API are described in full, in Google style."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "python.md"
NAMES = re.findall(r"^::: (\S+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
SECTION = re.compile(
    r"^(Args|Attributes|Returns|Raises|Example):\n((?:[ \t].*\n?|\n)+)", re.MULTILINE
)


def find(name: str) -> Any:
    """Returns the module, class or function of a dotted name."""
    try:
        return import_module(name)
    except ImportError:
        module, _, last = name.rpartition(".")
        return getattr(import_module(module), last)


def sections(symbol: Any) -> dict[str, str]:
    """Returns the sections of a docstring by title."""
    return dict(SECTION.findall(inspect.getdoc(symbol) + "\n"))


def described(text: str) -> set[str]:
    """Returns the names that a section describes."""
    return set(re.findall(r"^    (\w+): \S", text, re.MULTILINE))


def check_function(function: Any) -> None:
    """All parts are there, and every parameter is described."""
    found = sections(function)
    assert set(found) == {"Args", "Returns", "Raises", "Example"}
    assert described(found["Args"]) == set(inspect.signature(function).parameters) - {"self"}
    assert ">>> " in found["Example"]


def test_the_page_lists_the_entry_points() -> None:
    assert len(NAMES) == len(set(NAMES)) >= 24


@pytest.mark.parametrize("name", NAMES)
def test_an_entry_point_is_described_in_full(name: str) -> None:
    symbol = find(name)
    assert inspect.getdoc(symbol)
    if inspect.isfunction(symbol):
        check_function(symbol)
    elif inspect.isclass(symbol):
        fields = {n for n in inspect.get_annotations(symbol) if not n.startswith("_")}
        if not fields and name.endswith("DrivingFunction"):
            check_function(symbol.update)
            return
        fields |= (
            {n for n, v in vars(symbol).items() if isinstance(v, property)} if not fields else set()
        )
        assert fields
        assert fields <= described(sections(symbol)["Attributes"])
    else:
        own = [f for f in vars(symbol).values() if getattr(f, "__module__", "") == name]
        public = [f for f in own if not f.__name__.startswith("_")]
        assert public
        assert all(inspect.getdoc(f) for f in public)
