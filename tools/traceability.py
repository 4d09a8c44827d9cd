"""Traceability: which requirement is proved by which test. `python tools/traceability.py` writes
docs/requirements.md from the summaries, the states, and the marks `@pytest.mark.req` in the tests."""

from __future__ import annotations

import ast
import csv
from collections import defaultdict
from functools import cache
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[1]
DOC = ROOT / "docs" / "requirements.md"
HEAD = """# Requirements

Every requirement of the three specifications, its state, and the tests that prove it. Ids: A is ADAS
in weather, B grip in weather, C channels. Written by `python tools/traceability.py`; a test checks
that this page, the marks in the tests and the states agree. A row that is simply done is proved by
behaviour: something was run and did what is asked. *Done by page* is shown by what a report or page of
the program says, *done by document* by words or names in a text of the project, and by nothing that ran.
For A-276 and A-277 done means that a verdict is computed; the shipped results may contradict the claim.

"""
WORDS = ("done", "done by page", "done by document", "differs", "not yet")
PARTS = {"A": "ADAS in weather", "B": "Grip in weather", "C": "Channels"}


PAGES = (  # tests that read what the program shows
    "report/",
    "fleet/test_fleet_pages.py",
    "cli/test_grip_command.py::test_a_small_campaign_from_command_to_page",
)
DOCUMENTS = (  # tests that read texts of the project
    "report/test_channels_architecture.py",
    "test_readme.py",
    "test_container.py",
    "scenarios/test_shipped_scenarios.py::test_the_files_are_what_their_source_writes",
    "scenarios/test_shipped_scenarios.py::test_the_asam_checkers_accept",
)


def proof(tests: list[str]) -> str:
    """How a requirement with these tests is proved, by the strongest of them; "" is behaviour."""
    kinds = {
        "by document" if t.startswith(DOCUMENTS) else "by page" if t.startswith(PAGES) else ""
        for t in tests
    }
    return min(kinds, key=("", "by page", "by document").index)


def summaries() -> dict[str, str]:
    """Requirement id to its summary."""
    with (ROOT / "docs" / "traceability" / "requirements.csv").open(encoding="utf-8") as file:
        return {row["id"]: row["summary"] for row in csv.DictReader(file)}


def states() -> dict[str, dict[str, str]]:
    """`differs` and `not_yet`: id to reason."""
    path = ROOT / "docs" / "traceability" / "states.yaml"
    raw = yaml.safe_load(path.read_text(encoding="utf-8"))
    return {kind: dict(raw[kind] or {}) for kind in ("differs", "not_yet")}


@cache
def marks() -> dict[str, list[str]]:
    """Requirement id to the tests that carry it, as `path::name`."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        where = path.relative_to(ROOT / "tests").as_posix()
        module_ids = [i for node in tree.body for i in _module_mark(node)]
        inner = (n for node in tree.body if isinstance(node, ast.ClassDef) for n in node.body)
        for node in (*tree.body, *inner):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                ids = [i for d in node.decorator_list for i in _ids(d)]
                for i in ids:
                    found[i].append(f"{where}::{node.name}")
        for i in module_ids:
            found[i].append(where)
    return found


def _module_mark(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.Assign) and any(
        isinstance(t, ast.Name) and t.id == "pytestmark" for t in node.targets
    ):
        return [i for call in ast.walk(node.value) for i in _ids(call)]
    return []


def _ids(node: ast.AST) -> list[str]:
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "req"
    ):
        return [str(a.value) for a in node.args if isinstance(a, ast.Constant)]
    return []


def render() -> str:
    """The page."""
    known, state, proved = summaries(), states(), marks()
    counts: dict[str, defaultdict[str, int]] = {part: defaultdict(int) for part in PARTS}
    tables: dict[str, list[str]] = {part: [] for part in PARTS}
    for i, summary in known.items():
        if i in state["not_yet"]:
            word, note = "not yet", state["not_yet"][i]
        elif i in state["differs"]:
            word, note = "differs", state["differs"][i]
        else:
            word, note = ("done", "") if proved.get(i) else ("not yet", "no test carries it")
        if word == "done":
            word = f"done {proof(proved[i])}".strip()
        counts[i[0]][word] += 1
        tests = "<br>".join(f"`{t}`" for t in proved.get(i, []))
        tables[i[0]].append(f"| {i} | {word} | {summary} | {tests} | {note} |")
    text = HEAD
    for part, title in PARTS.items():
        said = ", ".join(f"{counts[part][w]} {w}" for w in WORDS if counts[part][w])
        text += f"## {title}: {said}\n\n| id | state | summary | proved by | note |\n|---|---|---|---|---|\n"
        text += "\n".join(tables[part]) + "\n\n"
    return text.rstrip() + "\n"


if __name__ == "__main__":
    DOC.write_text(render(), encoding="utf-8")
