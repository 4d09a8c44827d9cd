"""Tests share helpers by `tests/support`: no test module imports another one."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
SUPPORT = "support"


def local_modules() -> set[str]:
    """Returns the names by which something of the tests outside `support` could be imported."""
    files = {p.stem for p in TESTS.rglob("*.py") if SUPPORT not in p.relative_to(TESTS).parts}
    return {"tests"} | files | {p.name for p in TESTS.iterdir() if p.is_dir()} - {SUPPORT}


def imported_modules(text: str) -> Iterator[str]:
    """Yields what a module imports, anywhere in it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


def foreign_imports(text: str, local: set[str]) -> list[str]:
    """Returns the imports of a test module that lead to another module of the tests."""
    return [m for m in imported_modules(text) if m.startswith(".") or m.split(".")[0] in local]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from test_maps import load", ["test_maps"]),
        ("def f():\n    import roads.test_maps as t", ["roads.test_maps"]),
        ("from tests.support.runs import adas_run", ["tests.support.runs"]),
        ("from .helper import a", [".helper"]),
        ("from conftest import towns", ["conftest"]),
        ("from support.runs import adas_run\nimport skidpad.roads\nimport carla", []),
    ],
)
def test_an_import_of_a_test_is_found(text, found):
    assert foreign_imports(text, local_modules()) == found


def test_no_module_imports_a_test():
    local, files = local_modules(), sorted(TESTS.rglob("*.py"))
    assert len(files) > 400
    found = {
        f"{path.relative_to(TESTS)}: {name}"
        for path in files
        for name in foreign_imports(path.read_text(encoding="utf-8"), local)
    }
    assert not found, "put what they share into tests/support"
