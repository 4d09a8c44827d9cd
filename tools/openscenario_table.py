"""Writes the coverage table of docs/openscenario.md from the code and the marks of the tests.

python -m tools.openscenario_table [--check]
"""

from __future__ import annotations

import ast
from pathlib import Path

from openscenario_coverage import Support, coverage

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "openscenario.md"
BEGIN, END = "<!-- coverage: begin -->", "<!-- coverage: end -->"


def marked_tests(mark_name: str = "osc") -> dict[str, str]:
    """A test for each element that one is marked with.

    mark_name: `osc` for tests of what an element does, `osc_noted` for those of a note alone.
    """
    found: dict[str, str] = {}
    for file in sorted((ROOT / "tests" / "scenarios").glob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef):
                continue
            for mark in node.decorator_list:
                if (
                    isinstance(mark, ast.Call)
                    and ast.unparse(mark.func) == f"pytest.mark.{mark_name}"
                ):
                    for name in mark.args:
                        found.setdefault(ast.literal_eval(name), f"{file.stem}::{node.name}")
    return found


def table() -> str:
    """The table in Markdown, with its counts."""
    rows, tests = coverage(), marked_tests()
    counts = {s: sum(row.support is s for row in rows) for s in Support}
    lines = [
        BEGIN,
        f"{len(rows)} elements of 1.3: " + ", ".join(f"{n} {s.value}" for s, n in counts.items())
        + f"; {sum(row.element in tests for row in rows)} have a test of their own.",
        "",
        "| element | support | test |",
        "|---|---|---|",
    ]  # fmt: skip
    for row in rows:
        remark = f": {row.remark}" if row.remark else ""
        test = f"`{tests[row.element]}`" if row.element in tests else ""
        lines.append(f"| {row.element} | {row.support.value}{remark} | {test} |")
    return "\n".join([*lines, END])


def page(text: str) -> str:
    """The page with the table of today."""
    before, _, rest = text.partition(BEGIN)
    return before + table() + rest.partition(END)[2]


def main() -> None:
    """Write it."""
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
