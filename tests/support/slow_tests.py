"""Which tests `make test` leaves to `make test-all`: those that were measured to take long.

`tests/slow_tests.txt` holds a line per test function, written by `make test-times`.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
LIST = TESTS / "slow_tests.txt"
SLOW_S = 2.0  # a test function whose cases together take longer is slow


@cache
def slow_functions() -> frozenset[str]:
    """Returns the ids of slow test functions, without their parameters."""
    if not LIST.exists():
        return frozenset()
    lines = LIST.read_text(encoding="utf-8").splitlines()
    return frozenset(line.split()[1] for line in lines if line and not line.startswith("#"))


def is_slow(nodeid: str) -> bool:
    """Returns whether the test function of this id is in the list."""
    return function_of(nodeid) in slow_functions()


def quick_tests() -> set[str]:
    """Returns the ids of the test functions that `make test` runs, and of files that have some."""
    quick = set()
    for path in sorted(TESTS.rglob("test_*.py")):
        file = path.relative_to(TESTS).as_posix()
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
                continue
            marks = {ast.unparse(decorator) for decorator in node.decorator_list}
            if "pytest.mark.slow" not in marks and not is_slow(f"{file}::{node.name}"):
                quick |= {file, f"{file}::{node.name}"}
    return quick


def function_of(nodeid: str) -> str:
    """Returns a test's id without its parameters."""
    return nodeid.split("[")[0].removeprefix("tests/")


class SlowTests:
    """Adds up what each test function takes, and writes the slow ones at the end."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.seconds[function_of(report.nodeid)] += report.duration

    def pytest_sessionfinish(self) -> None:
        slow = sorted((s, name) for name, s in self.seconds.items() if s > SLOW_S)
        head = "# Written by `make test-times`: seconds of each test function above 2 s, on two cores.\n"
        rows = "".join(f"{s:.1f} {name}\n" for s, name in reversed(slow))
        LIST.write_text(head + rows, encoding="utf-8")
